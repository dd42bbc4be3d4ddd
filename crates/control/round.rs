//! Samples that are taken together, before anything new is decided.

use crate::groups::Brought;
use crate::negligible::Negligible;
use crate::pixel::{Sampled, samples_at};

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

/// The place of orders that no refinement is behind.
const SINGLE: u32 = u32::MAX;

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

/// What a round takes, ordered one after the other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Round {
    refinements: Vec<Refinement>,
    /// Instead of these: pixels that get their only sample, of which nothing has to be kept until all have theirs.
    singles: Vec<u32>,
    /// Instead of either: all pixels get their only sample.
    is_of_all: bool,
    negligible: Negligible,
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

    /// A sample of each of these pixels, which is then their only one.
    pub(crate) fn of_singles(singles: Vec<u32>, negligible: Negligible) -> Self {
        Self {
            singles,
            negligible,
            ..Self::default()
        }
    }

    /// A sample of each of `pixels` pixels, which is then its only one.
    pub(crate) fn of_all(pixels: usize, negligible: Negligible) -> Self {
        Self {
            is_of_all: true,
            negligible,
            open: pixels as u64,
            ..Self::default()
        }
    }

    /// What is negligible where all pixels get their first sample.
    pub(crate) fn of_all_with(&self) -> Option<Negligible> {
        (self.is_of_all && self.open > 0).then_some(self.negligible)
    }

    /// All pixels have got their first sample in it.
    pub(crate) fn has_taken_all(&self) -> bool {
        self.is_of_all && self.open == 0
    }

    /// Samples that have not come: who takes those of which nothing has to be kept here counts them down.
    pub(crate) fn left(&mut self) -> &mut u64 {
        &mut self.open
    }

    fn len(&self) -> usize {
        self.refinements.len() + self.singles.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All was ordered and has come back.
    pub(crate) fn is_over(&self) -> bool {
        self.place >= self.len() && self.open == 0
    }

    /// Pixels in it, and how many of them were ordered.
    pub(crate) fn progress(&self) -> (usize, usize) {
        (self.len(), self.place)
    }

    fn next_singles(&mut self, most: usize) -> Vec<Order> {
        let left = &self.singles[self.place..];
        let taken = &left[..most.min(left.len())];
        let orders = taken.iter().map(|&pixel| Order {
            pixel,
            sample: 0,
            negligible: self.negligible,
            place: SINGLE,
        });
        let orders: Vec<Order> = orders.collect();
        self.place += orders.len();
        orders
    }

    pub(crate) fn next_orders(&mut self, most: usize) -> Vec<Order> {
        if !self.singles.is_empty() {
            let orders = self.next_singles(most);
            self.open += orders.len() as u64;
            return orders;
        }
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

    /// Keeps what has come of an order until the round ends; gives back what need not be kept.
    #[must_use]
    pub(crate) fn take(&mut self, order: &Order, sampled: Sampled) -> Option<Sampled> {
        if order.place == SINGLE {
            self.open -= 1;
            return Some(sampled);
        }
        let refinement = &mut self.refinements[order.place as usize];
        refinement
            .brought
            .take(refinement.level, order.sample, sampled);
        self.open -= 1;
        None
    }

    pub(crate) fn into_refinements(self) -> Vec<Refinement> {
        self.refinements
    }
}
