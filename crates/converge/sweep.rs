//! Which settings are measured, and which of them belong together: a sweep is a list of ladders, each of which turns one knob.

use crate::setting::{Knob, Setting, SettingError};

/// Settings that differ by one knob, from the coarsest to the finest as they were given.
#[derive(Clone, Debug, PartialEq)]
pub struct Ladder {
    /// What is turned.
    pub knob: Knob,
    /// What is not, as far as it is worth telling: "depth 8", or nothing.
    pub fixed: String,
    /// At least one.
    pub settings: Vec<Setting>,
}

/// What is measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sweep {
    /// Settings may be in more than one.
    pub ladders: Vec<Ladder>,
}

/// Values for a knob, `spp=1,4,16`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Values {
    /// What is turned.
    pub knob: Knob,
    /// To each of these.
    pub values: Vec<String>,
}

/// Why a sweep can't be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// No `=`, or nothing on its right.
    #[error("'{0}': write what to sweep and its values, as in spp=1,4,16")]
    Form(String),
    /// A knob or a value.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A tolerance decides these by itself.
    #[error("with a tolerance nothing is left of {0} to be swept; sweep one or the other")]
    Decided(&'static str),
    /// Two lists of values for one knob.
    #[error("'{0}' is swept twice; give all its values at once")]
    Twice(&'static str),
    /// The product of all lists.
    #[error("the sweep has {0} settings; at most {MOST_SETTINGS} can be measured at once")]
    TooMany(usize),
}

/// More settings would take hours, and no diagram shows them.
pub const MOST_SETTINGS: usize = 1000;

/// Samples that ladders of other knobs than samples have: enough that the steps of other knobs are not lost in what sampling leaves.
const OTHER_LADDERS_SPP: u32 = 4;

impl Values {
    /// Reads `key=a,b,c`.
    ///
    /// # Errors
    /// [`SweepError`].
    pub fn parse(text: &str) -> Result<Self, SweepError> {
        let form = || SweepError::Form(text.to_owned());
        let (key, values) = text.split_once('=').ok_or_else(form)?;
        let knob: Knob = key.parse()?;
        let values: Vec<String> = values
            .split(',')
            .map(|value| value.trim().to_owned())
            .collect();
        if values.iter().any(String::is_empty) {
            return Err(form());
        }
        for value in &values {
            Setting::default().set(knob, value)?;
        }
        Ok(Self { knob, values })
    }
}

impl Sweep {
    /// Ladders about `base`: samples, tolerances, depths, least weights, hierarchies.
    ///
    /// Steps and lengths are chosen so that a small picture takes about a minute on two cores, its reference included.
    #[must_use]
    pub fn standard(base: Setting) -> Self {
        let few = Setting {
            spp: OTHER_LADDERS_SPP,
            ..base
        };
        let fixed = format!("{OTHER_LADDERS_SPP} samples");
        let mut ladders = vec![ladder(
            Knob::Spp,
            "",
            [1, 2, 4, 8, 16, 32].map(|spp| Setting { spp, ..base }),
        )];
        let tolerances = [0.1, 0.05, 0.02, 0.01].map(|error| Setting {
            tolerance: Some(error),
            ..base
        });
        ladders.push(ladder(Knob::Tolerance, "", tolerances));
        ladders.push(ladder(
            Knob::Depth,
            &fixed,
            [1, 2, 4, 8, 16].map(|depth| Setting { depth, ..few }),
        ));
        ladders.push(ladder(
            Knob::MinWeight,
            &fixed,
            [0.1, 0.03, 0.01, Setting::default().min_weight, 0.001]
                .map(|min_weight| Setting { min_weight, ..few }),
        ));
        use crate::setting::Bvh::{Balanced, Best, Fast};
        ladders.push(ladder(
            Knob::Bvh,
            &fixed,
            [Fast, Balanced, Best].map(|bvh| Setting { bvh, ..few }),
        ));
        Self { ladders }
    }

    /// Every combination of the values given, as ladders of the first knob.
    ///
    /// # Errors
    /// [`SweepError`].
    pub fn product(base: Setting, lists: &[Values]) -> Result<Self, SweepError> {
        let Some((first, others)) = lists.split_first() else {
            return Ok(Self::default());
        };
        for (index, list) in lists.iter().enumerate() {
            if lists[..index].iter().any(|before| before.knob == list.knob) {
                return Err(SweepError::Twice(list.knob.name()));
            }
        }
        if lists.iter().any(|list| list.knob == Knob::Tolerance) {
            let decided = [Knob::Spp, Knob::Depth, Knob::MinWeight];
            let other = lists.iter().find(|list| decided.contains(&list.knob));
            if let Some(other) = other {
                return Err(SweepError::Decided(other.knob.name()));
            }
        }
        let count = lists.iter().fold(1, |count: usize, list| {
            count.saturating_mul(list.values.len())
        });
        if count > MOST_SETTINGS {
            return Err(SweepError::TooMany(count));
        }
        let mut starts = vec![(base, String::new())];
        for list in others {
            starts = each_with_each(&starts, list)?;
        }
        let ladders = starts.into_iter().map(|(start, fixed)| {
            let settings = first
                .values
                .iter()
                .map(|value| start.set(first.knob, value));
            Ok(Ladder {
                knob: first.knob,
                fixed,
                settings: settings.collect::<Result<_, SettingError>>()?,
            })
        });
        Ok(Self {
            ladders: ladders.collect::<Result<_, SettingError>>()?,
        })
    }

    /// Every setting once, in the order of the ladders.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        let mut settings: Vec<Setting> = Vec::new();
        for setting in self.ladders.iter().flat_map(|ladder| &ladder.settings) {
            if !settings.contains(setting) {
                settings.push(*setting);
            }
        }
        settings
    }
}

fn ladder<const N: usize>(knob: Knob, fixed: &str, settings: [Setting; N]) -> Ladder {
    Ladder {
        knob,
        fixed: fixed.to_owned(),
        settings: settings.to_vec(),
    }
}

fn each_with_each(
    starts: &[(Setting, String)],
    list: &Values,
) -> Result<Vec<(Setting, String)>, SettingError> {
    let mut all = Vec::new();
    for (start, fixed) in starts {
        for value in &list.values {
            let label = format!("{} {value}", list.knob.title());
            let fixed = match fixed.as_str() {
                "" => label,
                before => format!("{before}, {label}"),
            };
            all.push((start.set(list.knob, value)?, fixed));
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setting::Bvh;

    #[test]
    fn the_standard_sweep_turns_one_knob_a_ladder() {
        let sweep = Sweep::standard(Setting::default());
        for ladder in &sweep.ladders {
            for other in Knob::ALL.into_iter().filter(|knob| *knob != ladder.knob) {
                let first = other.value_of(&ladder.settings[0]);
                assert!(
                    ladder
                        .settings
                        .iter()
                        .all(|setting| other.value_of(setting) == first)
                );
            }
        }
        // 4 samples at depth 8 are in four ladders, and measured once.
        assert_eq!(sweep.settings().len(), 6 + 4 + 4 + 4 + 2);
    }

    #[test]
    fn lists_are_multiplied() {
        let lists =
            ["spp=1, 4,16", "depth=2,8", "bvh=fast"].map(|text| Values::parse(text).unwrap());
        let sweep = Sweep::product(Setting::default(), &lists).unwrap();
        assert_eq!(sweep.ladders.len(), 2);
        assert_eq!(sweep.settings().len(), 6);
        assert_eq!(sweep.ladders[1].fixed, "depth 8, hierarchy fast");
        assert!(sweep.settings().iter().all(|s| s.bvh == Bvh::Fast));
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["spp", "spp=", "spp=1,,2", "=1", "colour=red", "spp=1,many"] {
            assert!(Values::parse(text).is_err(), "{text}");
        }
        let twice = ["spp=1", "spp=2"].map(|text| Values::parse(text).unwrap());
        assert_eq!(
            Sweep::product(Setting::default(), &twice),
            Err(SweepError::Twice("spp"))
        );
        let decided = ["tolerance=0.1", "depth=2"].map(|text| Values::parse(text).unwrap());
        assert_eq!(
            Sweep::product(Setting::default(), &decided),
            Err(SweepError::Decided("depth"))
        );
        let many: Vec<String> = (1..=101).map(|n| n.to_string()).collect();
        let many = ["spp", "depth"]
            .map(|key| Values::parse(&format!("{key}={}", many.join(","))).unwrap());
        assert_eq!(
            Sweep::product(Setting::default(), &many),
            Err(SweepError::TooMany(101 * 101))
        );
    }
}
