//! Samples that are taken together, before anything new is decided.

use crate::negligible::Negligible;
use crate::pixel::{Brought, Sampled, samples_at};

/// A sample to be taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// Index into the picture, row after row.
    pub pixel: u32,
    /// Which of the [`raytree_film::progressive_pattern`].
    pub sample: u32,
    /// What may be left out of it.
    pub negligible: Negligible,
    /// Which of the round's pixels it is.
    place: u32,
}

/// A pixel that goes from one level to the next.
#[derive(Clone, Debug)]
pub(crate) struct Refinement {
    pub(crate) pixel: u32,
    pub(crate) level: u32,
    /// Samples that it keeps: those it has, or none where its only one is taken again.
    pub(crate) kept: u32,
    pub(crate) negligible: Negligible,
    pub(crate) brought: Brought,
}

impl Refinement {
    /// A pixel's only sample.
    pub(crate) fn first(pixel: u32, negligible: Negligible) -> Self {
        Self {
            pixel,
            level: 0,
            kept: 0,
            negligible,
            brought: Brought::default(),
        }
    }

    /// It has all of its samples.
    pub(crate) fn is_complete(&self) -> bool {
        self.brought.is_complete(self.kept, self.level)
    }
}

/// The refinements of a round, ordered one after the other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Round {
    refinements: Vec<Refinement>,
    /// The one that is ordered next, and its next sample.
    place: usize,
    sample: u32,
    /// Orders that have not come back.
    open: u64,
}

impl Round {
    pub(crate) fn new(refinements: Vec<Refinement>) -> Self {
        let sample = refinements.first().map_or(0, |first| first.kept);
        Self {
            refinements,
            sample,
            ..Self::default()
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.refinements.is_empty()
    }

    /// All was ordered and has come back.
    pub(crate) fn is_over(&self) -> bool {
        self.place >= self.refinements.len() && self.open == 0
    }

    /// Refinements in it, and how many of them were ordered.
    pub(crate) fn progress(&self) -> (usize, usize) {
        (self.refinements.len(), self.place)
    }

    pub(crate) fn next_orders(&mut self, most: usize) -> Vec<Order> {
        let mut orders = Vec::new();
        while orders.len() < most {
            let Some(refinement) = self.refinements.get(self.place) else {
                break;
            };
            orders.push(Order {
                pixel: refinement.pixel,
                sample: self.sample,
                negligible: refinement.negligible,
                place: self.place as u32,
            });
            self.sample += 1;
            if self.sample == samples_at(refinement.level) {
                self.place += 1;
                self.sample = self.refinements.get(self.place).map_or(0, |next| next.kept);
            }
        }
        self.open += orders.len() as u64;
        orders
    }

    pub(crate) fn take(&mut self, order: &Order, sampled: Sampled) {
        let refinement = &mut self.refinements[order.place as usize];
        refinement
            .brought
            .take(refinement.level, order.sample, sampled);
        self.open -= 1;
    }

    pub(crate) fn into_refinements(self) -> Vec<Refinement> {
        self.refinements
    }
}
