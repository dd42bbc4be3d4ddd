//! One way to render: a point of a sweep, as plain data.

use std::fmt::{self, Display};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// How long to build the hierarchy for faster rays; spelled as on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bvh {
    /// Quickest to build.
    Fast,
    /// Good trees quickly.
    #[default]
    Balanced,
    /// The best trees.
    Best,
}

/// Which shading model; spelled as on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// glTF 2.0 appendix B.
    #[default]
    Pbr,
    /// Foley et al., eq. 14.32.
    Whitted,
}

/// All that a sweep can vary.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Levels of the ray tree below the camera ray, 0 to 1024.
    pub depth: u32,
    /// Throughput below which a branch is dropped, 0 to 1.
    pub min_weight: f64,
    /// Samples a pixel, 1 to 8192.
    pub spp: u32,
    /// The error that is asked for, linear radiance: it decides what samples, depths and weights are taken, whatever is said above. `None`:
    /// none is, and every pixel has all its samples.
    pub tolerance: Option<f64>,
    /// How the hierarchy is built.
    pub bvh: Bvh,
    /// Which equation is solved. Settings of one model alone have the same truth.
    pub shading: Model,
}

impl Default for Setting {
    /// Those of `raytree render`.
    fn default() -> Self {
        Self {
            depth: 8,
            min_weight: 1.0 / 256.0,
            spp: 1,
            tolerance: None,
            bvh: Bvh::default(),
            shading: Model::default(),
        }
    }
}

/// What a sweep can vary, by the name of its flag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Knob {
    /// [`Setting::spp`].
    Spp,
    /// [`Setting::tolerance`].
    Tolerance,
    /// [`Setting::depth`].
    Depth,
    /// [`Setting::min_weight`].
    MinWeight,
    /// [`Setting::bvh`].
    Bvh,
    /// [`Setting::shading`].
    Shading,
}

impl Knob {
    /// All of them, in the order in which they are told.
    pub const ALL: [Self; 6] = [
        Self::Spp,
        Self::Tolerance,
        Self::Depth,
        Self::MinWeight,
        Self::Bvh,
        Self::Shading,
    ];

    /// The key of `--sweep`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Spp => "spp",
            Self::Tolerance => "tolerance",
            Self::Depth => "depth",
            Self::MinWeight => "min-weight",
            Self::Bvh => "bvh",
            Self::Shading => "shading",
        }
    }

    /// What a diagram calls it.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Spp => "samples a pixel",
            Self::Tolerance => "tolerance",
            Self::Depth => "depth",
            Self::MinWeight => "least weight",
            Self::Bvh => "hierarchy",
            Self::Shading => "shading",
        }
    }

    /// Its value in a setting, as [`Setting::set`] takes it.
    #[must_use]
    pub fn value_of(self, setting: &Setting) -> String {
        match self {
            Self::Spp => setting.spp.to_string(),
            Self::Tolerance => setting
                .tolerance
                .map_or_else(|| "none".to_owned(), |tolerance| tolerance.to_string()),
            Self::Depth => setting.depth.to_string(),
            Self::MinWeight => setting.min_weight.to_string(),
            Self::Bvh => setting.bvh.to_string(),
            Self::Shading => setting.shading.to_string(),
        }
    }

    /// Its value as a number from which an order can be told: finer is more. `None`: it is no number.
    #[must_use]
    pub fn fineness(self, setting: &Setting) -> Option<f64> {
        let inverse = |value: f64| (value > 0.0).then(|| value.recip());
        match self {
            Self::Spp => Some(f64::from(setting.spp)),
            Self::Tolerance => setting.tolerance.and_then(inverse),
            Self::Depth => Some(f64::from(setting.depth)),
            Self::MinWeight => inverse(setting.min_weight),
            Self::Bvh | Self::Shading => None,
        }
    }
}

/// Why a setting can't be swept so.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingError {
    /// No such knob.
    #[error("'{key}' can't be swept; what can: {}", names())]
    Key {
        /// As it was given.
        key: String,
    },
    /// A value that the knob does not have.
    #[error("{key}: '{value}' is not {wanted}")]
    Value {
        /// The knob.
        key: &'static str,
        /// As it was given.
        value: String,
        /// What is.
        wanted: &'static str,
    },
}

fn names() -> String {
    Knob::ALL.map(Knob::name).join(", ")
}

impl FromStr for Knob {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, SettingError> {
        let plain = text.trim().replace('_', "-");
        Self::ALL
            .into_iter()
            .find(|knob| knob.name() == plain)
            .ok_or_else(|| SettingError::Key {
                key: text.to_owned(),
            })
    }
}

impl Setting {
    /// Turns a knob.
    ///
    /// # Errors
    /// [`SettingError::Value`].
    pub fn set(mut self, knob: Knob, value: &str) -> Result<Self, SettingError> {
        let value = value.trim();
        let refuse = |wanted| SettingError::Value {
            key: knob.name(),
            value: value.to_owned(),
            wanted,
        };
        match knob {
            Knob::Spp => {
                self.spp =
                    whole(value, 1, 8192).ok_or_else(|| refuse("a whole number from 1 to 8192"))?;
            }
            Knob::Depth => {
                self.depth =
                    whole(value, 0, 1024).ok_or_else(|| refuse("a whole number from 0 to 1024"))?;
            }
            Knob::MinWeight => {
                let weight = number(value).filter(|weight| (0.0..=1.0).contains(weight));
                self.min_weight = weight.ok_or_else(|| refuse("a number from 0 to 1"))?;
            }
            Knob::Tolerance => {
                let tolerance = number(value).filter(|tolerance| *tolerance > 0.0);
                self.tolerance = match value {
                    "none" => None,
                    _ => Some(tolerance.ok_or_else(|| refuse("a number above 0, or none"))?),
                };
            }
            Knob::Bvh => {
                self.bvh = match value {
                    "fast" => Bvh::Fast,
                    "balanced" => Bvh::Balanced,
                    "best" => Bvh::Best,
                    _ => return Err(refuse("fast, balanced or best")),
                };
            }
            Knob::Shading => {
                self.shading = match value {
                    "pbr" => Model::Pbr,
                    "whitted" => Model::Whitted,
                    _ => return Err(refuse("pbr or whitted")),
                };
            }
        }
        Ok(self)
    }

    /// What tells it from every other.
    #[must_use]
    pub fn key(&self) -> String {
        Knob::ALL
            .map(|knob| format!("{}={}", knob.name(), knob.value_of(self)))
            .join(" ")
    }
}

fn whole(text: &str, least: u32, most: u32) -> Option<u32> {
    let value = text.parse().ok()?;
    (least..=most).contains(&value).then_some(value)
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

impl Display for Bvh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Best => "best",
        })
    }
}

impl Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pbr => "pbr",
            Self::Whitted => "whitted",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_knob_can_be_turned_to_its_own_value() {
        let setting = Setting {
            depth: 3,
            min_weight: 0.03,
            spp: 16,
            tolerance: Some(1e-3),
            bvh: Bvh::Best,
            shading: Model::Whitted,
        };
        for knob in Knob::ALL {
            let turned = Setting::default().set(knob, &knob.value_of(&setting));
            assert_eq!(
                knob.value_of(&turned.unwrap()),
                knob.value_of(&setting),
                "{knob:?}"
            );
        }
        let text = "spp=16 tolerance=0.001 depth=3 min-weight=0.03 bvh=best shading=whitted";
        assert_eq!(setting.key(), text);
    }

    #[test]
    fn nonsense_is_refused_with_what_is_wanted() {
        for (knob, value) in [
            (Knob::Spp, "0"),
            (Knob::Spp, "8193"),
            (Knob::Spp, "2.5"),
            (Knob::Depth, "-1"),
            (Knob::MinWeight, "NaN"),
            (Knob::MinWeight, "1.5"),
            (Knob::Tolerance, "0"),
            (Knob::Tolerance, "inf"),
            (Knob::Bvh, "slow"),
            (Knob::Shading, ""),
        ] {
            let error = Setting::default().set(knob, value).unwrap_err().to_string();
            assert!(
                error.contains(knob.name()) && error.contains("is not"),
                "{error}"
            );
        }
        let error = "samples".parse::<Knob>().unwrap_err().to_string();
        assert!(
            error.contains("'samples'") && error.contains("min-weight"),
            "{error}"
        );
    }

    #[test]
    fn finer_is_more() {
        let coarse = Setting::default();
        for (knob, value) in [
            (Knob::Spp, "2"),
            (Knob::Depth, "9"),
            (Knob::MinWeight, "1e-4"),
        ] {
            let fine = coarse.set(knob, value).unwrap();
            assert!(knob.fineness(&fine) > knob.fineness(&coarse), "{knob:?}");
        }
        assert_eq!(Knob::Tolerance.fineness(&coarse), None);
        assert_eq!(Knob::Bvh.fineness(&coarse), None);
    }
}
