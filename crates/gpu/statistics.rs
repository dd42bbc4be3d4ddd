//! What a render took, in rays and in work.

use crate::types::Slot;

/// Words of the device's counters (shaders/counters.wgsl).
pub(crate) const COUNTERS: usize = 11;

/// Rays and work of a render. The same for the same scene and settings, whatever the machine does besides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Rays by kind.
    pub rays: RayCounts,
    /// BVH nodes whose children were tested.
    pub node_visits: u64,
    /// Triangles that were tested.
    pub triangle_tests: u64,
    /// Why branches ended.
    pub ended: EndCounts,
}

/// Rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub primary: u64,
    /// To lights.
    pub shadow: u64,
    /// Reflected.
    pub reflection: u64,
    /// Transmitted, bent or straight on.
    pub refraction: u64,
}

impl RayCounts {
    /// Of all kinds.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.primary + self.shadow + self.reflection + self.refraction
    }
}

/// Why branches of ray trees ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EndCounts {
    /// Hit nothing.
    pub miss: u64,
    /// At the maximum depth.
    pub depth: u64,
    /// Below the least weight.
    pub weight: u64,
    /// Could not add enough to matter to the tolerance; lights that were not looked for included.
    pub tolerance: u64,
    /// No room in the ray stack or the medium stack.
    pub storage: u64,
    /// No ray left of those that the sample's tree may have ([`RenderSettings::max_rays`](crate::RenderSettings::max_rays)).
    pub budget: u64,
}

/// Branches of ray trees that ended for want of room. Counted in every render: the picture lacks their light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// No room in the ray stack or the medium stack.
    pub storage: u64,
    /// No ray left of those that the sample's tree may have.
    pub budget: u64,
}

impl Dropped {
    /// Adds what a slot has dropped.
    pub(crate) fn add(&mut self, slot: &Slot) {
        self.storage += u64::from(slot.dropped_storage);
        self.budget += u64::from(slot.dropped_budget);
    }

    /// For either reason.
    #[must_use]
    pub fn total(self) -> u64 {
        self.storage + self.budget
    }
}

impl Counters {
    /// What slots have dropped, not the device's counters, says what ended for want of room.
    pub(crate) fn set_dropped(&mut self, dropped: Dropped) {
        self.ended.storage = dropped.storage;
        self.ended.budget = dropped.budget;
    }

    /// Adds the counters of some dispatches; how many iterations they were.
    pub(crate) fn add(&mut self, words: &[u32]) -> u32 {
        let totals = [
            &mut self.rays.primary,
            &mut self.rays.shadow,
            &mut self.rays.reflection,
            &mut self.rays.refraction,
            &mut self.node_visits,
            &mut self.triangle_tests,
            &mut self.ended.miss,
            &mut self.ended.depth,
            &mut self.ended.weight,
            &mut self.ended.tolerance,
        ];
        for (total, &count) in totals.into_iter().zip(&words[1..]) {
            *total += u64::from(count);
        }
        words[0]
    }
}
