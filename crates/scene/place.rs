//! Points of world space in double-double: each coordinate is the sum of two f64, 106 bits in all.
//!
//! A scene may lie far from the world's origin: at 10^9 times its extent an f64 coordinate resolves 10^-7 of the extent, no more
//! than f32 does. A file that moves a whole scene by one node still holds every digit of its shape. So positions of nodes are
//! added up without loss, and rounded only once the scene's own origin has been subtracted. Linear parts of transforms, and what
//! they do to a mesh's own coordinates, do not grow with the distance and stay f64.
//!
//! Error-free sums and products: Knuth (The Art of Computer Programming 2, 4.2.2), Dekker (1971); the product by the fused
//! multiply-add (Ogita, Rump and Oishi 2005), which is exact on every processor, in software where it has none.

use glam::{BVec3, DMat3, DVec3};

/// A point of world space, metres: the unevaluated sum `high + low`, `high` the f64 nearest to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    high: DVec3,
    low: DVec3,
}

impl Place {
    /// The world's origin.
    pub const ORIGIN: Self = Self {
        high: DVec3::ZERO,
        low: DVec3::ZERO,
    };

    /// The nearest point of f64 coordinates.
    #[must_use]
    pub fn rounded(self) -> DVec3 {
        self.high
    }

    /// This point moved by `offset`.
    #[must_use]
    pub fn moved(self, offset: DVec3) -> Self {
        let (high, low) = two_sum(self.high, offset);
        Self::of_sum(high, low + self.low)
    }

    /// This point moved by `linear * vector`, the product as exact as the sum.
    #[must_use]
    pub fn moved_by_product(self, linear: &DMat3, vector: DVec3) -> Self {
        let columns = [
            (linear.x_axis, vector.x),
            (linear.y_axis, vector.y),
            (linear.z_axis, vector.z),
        ];
        columns.into_iter().fold(self, |place, (column, factor)| {
            let (high, low) = two_product(column, DVec3::splat(factor));
            place.moved(high).moved(low)
        })
    }

    /// The way from `from` to here, rounded once.
    #[must_use]
    pub fn since(self, from: Self) -> DVec3 {
        let (high, low) = two_sum(self.high, -from.high);
        high + (low + (self.low - from.low))
    }

    /// The coordinates of `self` where `mask` is true, those of `other` elsewhere.
    #[must_use]
    pub fn select(mask: BVec3, this: Self, other: Self) -> Self {
        Self {
            high: DVec3::select(mask, this.high, other.high),
            low: DVec3::select(mask, this.low, other.low),
        }
    }

    /// `low` is small against `high`, though it may overlap it.
    fn of_sum(high: DVec3, low: DVec3) -> Self {
        let sum = high + low;
        Self {
            high: sum,
            low: low - (sum - high),
        }
    }
}

impl From<DVec3> for Place {
    fn from(point: DVec3) -> Self {
        Self {
            high: point,
            low: DVec3::ZERO,
        }
    }
}

/// The rounded sum and what rounding took away: together exactly `a + b` (Knuth's TwoSum).
fn two_sum(a: DVec3, b: DVec3) -> (DVec3, DVec3) {
    let sum = a + b;
    let b_share = sum - a;
    let a_share = sum - b_share;
    (sum, (a - a_share) + (b - b_share))
}

/// The rounded product and what rounding took away: together exactly `a * b`.
fn two_product(a: DVec3, b: DVec3) -> (DVec3, DVec3) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_lost_far_away() {
        let far = DVec3::new(1e18, -3e17, 7e9);
        let near = DVec3::new(0.1, 1.0 / 3.0, -2e-7);
        let place = Place::ORIGIN.moved(far).moved(near);
        // In f64 the first two are gone.
        assert_eq!((far + near).x - far.x, 0.0);
        assert!((place.since(far.into()) - near).abs().max_element() < 1e-14);
        assert_eq!(place.rounded(), far + near);
        assert_eq!(Place::from(far).moved(near).moved(-far), near.into());
    }

    #[test]
    fn products_are_exact_too() {
        let tenth = 0.1_f64;
        let linear = DMat3::from_cols(DVec3::X * tenth, DVec3::Y * tenth, DVec3::Z * tenth);
        let far = 1.0 + f64::EPSILON;
        let place = Place::ORIGIN.moved_by_product(&linear, DVec3::splat(far));
        // 0.1 (1 + eps) is not a f64: what is beyond 0.1 is 0.1 eps.
        assert_eq!(
            place.since(DVec3::splat(tenth).into()),
            DVec3::splat(tenth * f64::EPSILON)
        );
        assert_eq!(place.rounded(), DVec3::splat(tenth * far));
    }

    #[test]
    fn a_move_there_and_back_changes_no_way() {
        let (a, b) = (DVec3::new(0.3, 0.7, -0.2), DVec3::new(-1.1, 0.01, 5.0));
        for far in [1.0, 1e3, 123_456_789.123, 1e9, 1e13] {
            let [a, b] = [a, b].map(|point| Place::from(DVec3::splat(far)).moved(point));
            let expected = DVec3::new(0.3, 0.7, -0.2) - DVec3::new(-1.1, 0.01, 5.0);
            assert_eq!(a.since(b), expected, "{far}");
        }
    }

    #[test]
    fn select_keeps_both_halves() {
        let one = Place::from(DVec3::splat(1e20)).moved(DVec3::ONE);
        let other = Place::from(DVec3::splat(5.0));
        let mixed = Place::select(BVec3::new(true, false, true), one, other);
        assert_eq!(
            mixed.since(DVec3::new(1e20, 5.0, 1e20).into()),
            DVec3::new(1.0, 0.0, 1.0)
        );
    }
}
