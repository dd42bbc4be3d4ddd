//! What a ray travels through: "Media" in `shaders/README.md`.

use crate::vec::Rgb;

/// What fills a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Medium {
    /// Index of refraction.
    pub index: f64,
    /// Absorption coefficient, per unit of length.
    pub sigma: Rgb,
    /// Where solids overlap the highest counts.
    pub priority: i32,
}

/// The solids that a ray is in: those of higher priority further back, among equals the one entered last.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Media(Vec<Medium>);

/// No room for another medium.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Full;

impl Media {
    const CAPACITY: usize = 8;

    /// The medium that counts; `None` outside of all solids.
    pub fn top(&self) -> Option<&Medium> {
        self.0.last()
    }

    /// Index of the medium on top, 1 outside of all solids.
    pub fn index(&self) -> f64 {
        self.0.last().map_or(1.0, |medium| medium.index)
    }

    /// What remains of radiance over a length of `distance`, which may be infinite.
    pub fn transmittance(&self, distance: f64) -> Rgb {
        let remaining = |sigma: f64| {
            if sigma == 0.0 {
                1.0
            } else {
                (-sigma * distance).exp()
            }
        };
        self.0
            .last()
            .map_or(Rgb::ONE, |medium| medium.sigma.map(remaining))
    }

    /// The media on the other side of a surface of `medium`, met from its front.
    pub fn entered(&self, medium: Medium) -> Result<Self, Full> {
        if self.0.len() == Self::CAPACITY {
            return Err(Full);
        }
        let mut media = self.clone();
        let place = self.0.iter().rposition(|m| m.priority <= medium.priority);
        media.0.insert(place.map_or(0, |below| below + 1), medium);
        Ok(media)
    }

    /// The media on the other side of a surface of `medium`, met from its back.
    pub fn left(&self, medium: Medium) -> Self {
        let mut media = self.clone();
        if let Some(place) = media.0.iter().rposition(|&inside| inside == medium) {
            media.0.remove(place);
        }
        media
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WATER: Medium = Medium {
        index: 1.33,
        sigma: Rgb::new(0.5, 0.0, 0.0),
        priority: 0,
    };
    const GLASS: Medium = Medium {
        index: 1.5,
        sigma: Rgb::ZERO,
        priority: 0,
    };

    #[test]
    fn the_topmost_equal_entry_is_left() {
        let media = Media::default()
            .entered(WATER)
            .unwrap()
            .entered(GLASS)
            .unwrap();
        assert_eq!(media.index(), 1.5);
        assert_eq!(media.left(GLASS).index(), 1.33);
        assert_eq!(media.left(WATER).index(), 1.5);
        assert_eq!(media.left(WATER).left(WATER).index(), 1.5);
        assert_eq!(Media::default().left(GLASS).index(), 1.0);
        let sandwich = media.entered(WATER).unwrap();
        assert_eq!(sandwich.left(WATER).index(), 1.5);
    }

    #[test]
    fn higher_priorities_stay_on_top() {
        let steel = Medium {
            index: 2.5,
            priority: 1,
            ..GLASS
        };
        let media = Media::default()
            .entered(steel)
            .unwrap()
            .entered(WATER)
            .unwrap();
        assert_eq!(media.top(), Some(&steel));
        let media = media.entered(GLASS).unwrap();
        assert_eq!(media.top(), Some(&steel));
        assert_eq!(media.left(steel).top(), Some(&GLASS));
        assert_eq!(media.left(GLASS).left(steel).top(), Some(&WATER));
    }

    #[test]
    fn absorption_is_beer_lamberts_also_over_infinity() {
        let media = Media::default().entered(WATER).unwrap();
        let remaining = media.transmittance(2.0);
        assert!((remaining.x - (-1.0_f64).exp()).abs() < 1e-15);
        assert_eq!(remaining.y, 1.0);
        assert_eq!(media.transmittance(f64::INFINITY), Rgb::new(0.0, 1.0, 1.0));
    }

    #[test]
    fn the_ninth_is_too_many() {
        let mut media = Media::default();
        for _ in 0..8 {
            media = media.entered(GLASS).unwrap();
        }
        assert!(media.entered(GLASS).is_err());
    }
}
