//! Drawing arguments, calling the device once for all of them, and shrinking what fails.

use std::fmt::Debug;

use glam::{DVec3, Vec3};
use proptest::{
    prelude::*,
    strategy::ValueTree,
    test_runner::{Config, RngAlgorithm, TestRng, TestRunner},
};
use raytree::{RenderSettings, Scene};
use raytree_gpu::{Piece, PieceCall, PieceResult, evaluate};

use super::support;

/// Calls of a property.
pub const CALLS: usize = 20_000;

/// Steps of making a failing call simpler.
const SHRINKS: usize = 200;

/// One rounding of f32, relative.
pub const EPSILON: f64 = f32::EPSILON as f64 / 2.0;

/// How many roundings a builtin may be off by: as few as on a CPU's drivers, or what WGSL grants elsewhere.
pub fn roundings(on_cpus: f64, granted: f64) -> f64 {
    match support::device() {
        Some(device) if !device.info().cpu => granted,
        _ => on_cpus,
    }
}

/// A function with what it is called within.
pub struct Trial {
    pub piece: Piece,
    pub scene: Scene,
    pub settings: RenderSettings,
}

impl Trial {
    /// Within nothing at all.
    pub fn alone(piece: Piece) -> Self {
        Self::within(piece, Scene::default())
    }

    pub fn within(piece: Piece, scene: Scene) -> Self {
        let camera = raytree::default_camera(&Scene::default());
        Self {
            piece,
            scene,
            settings: RenderSettings::new(1, 1, camera),
        }
    }

    /// What `call` makes of each of 20,000 drawn arguments is what `judge` expects.
    #[track_caller]
    pub fn holds<S: Strategy>(
        &self,
        arguments: S,
        call: impl Fn(&S::Value) -> PieceCall,
        judge: impl Fn(&S::Value, Answer) -> Result<(), String>,
    ) where
        S::Value: Debug,
    {
        let Some(device) = support::device() else {
            return;
        };
        let run = |calls: &[PieceCall]| {
            evaluate(device, self.piece, &self.scene, &self.settings, calls)
                .unwrap_or_else(|error| panic!("{error}"))
        };
        let mut trees = draw(&arguments, CALLS);
        let calls: Vec<PieceCall> = trees.iter().map(|tree| call(&tree.current())).collect();
        let results = run(&calls);
        let failing = trees
            .iter_mut()
            .zip(&results)
            .find(|(tree, result)| judge(&tree.current(), Answer(result)).is_err());
        if let Some((tree, _)) = failing {
            let fails = |value: &S::Value| judge(value, Answer(&run(&[call(value)])[0])).err();
            let (value, why) = shrunk(tree, fails);
            panic!("{:?} of {value:?}: {why}", self.piece);
        }
    }
}

fn draw<S: Strategy>(arguments: &S, count: usize) -> Vec<S::Tree> {
    let config = Config {
        failure_persistence: None,
        ..Config::default()
    };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut runner = TestRunner::new_with_rng(config, rng);
    let tree = |_| {
        let tree = arguments.new_tree(&mut runner);
        tree.unwrap_or_else(|reason| panic!("nothing can be drawn: {reason}"))
    };
    (0..count).map(tree).collect()
}

/// The simplest value found that still fails, and how.
fn shrunk<T: ValueTree>(
    tree: &mut T,
    fails: impl Fn(&T::Value) -> Option<String>,
) -> (T::Value, String) {
    let first = tree.current();
    let why = fails(&first).unwrap_or_else(|| "it does not fail when called alone".to_owned());
    let mut simplest = (first, why);
    for _ in 0..SHRINKS {
        let value = tree.current();
        let goes_on = match fails(&value) {
            Some(why) => {
                simplest = (value, why);
                tree.simplify()
            }
            None => tree.complicate(),
        };
        if !goes_on {
            break;
        }
    }
    simplest
}

/// A call's results.
#[derive(Clone, Copy)]
pub struct Answer<'a>(&'a PieceResult);

impl Answer<'_> {
    pub fn word(self, k: usize) -> u32 {
        self.0[k]
    }

    pub fn number(self, k: usize) -> f64 {
        f64::from(f32::from_bits(self.0[k]))
    }

    pub fn vector(self, k: usize) -> DVec3 {
        DVec3::new(self.number(k), self.number(k + 1), self.number(k + 2))
    }
}

/// A call's arguments, in order.
#[derive(Default)]
pub struct Arguments {
    call: PieceCall,
    filled: usize,
}

impl Arguments {
    pub fn word(mut self, word: u32) -> Self {
        self.call[self.filled] = word;
        self.filled += 1;
        self
    }

    pub fn number(self, number: f32) -> Self {
        self.word(number.to_bits())
    }

    pub fn vector(self, vector: Vec3) -> Self {
        self.number(vector.x).number(vector.y).number(vector.z)
    }

    pub fn done(self) -> PieceCall {
        self.call
    }
}

/// `found` is within `bound` of `expected`; never NaN.
pub fn near(what: &str, found: f64, expected: f64, bound: f64) -> Result<(), String> {
    if (found - expected).abs() <= bound {
        return Ok(());
    }
    Err(format!(
        "{what} is {found:e}, in f64 {expected:e}, by more than {bound:e}"
    ))
}

pub fn near_vector(what: &str, found: DVec3, expected: DVec3, bound: f64) -> Result<(), String> {
    if (found - expected).length() <= bound {
        return Ok(());
    }
    Err(format!(
        "{what} is {found}, in f64 {expected}, by more than {bound:e}"
    ))
}

pub fn ensure(holds: bool, why: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(why()) }
}

/// Any point of the box from -1 to 1.
pub fn point() -> impl Strategy<Value = Vec3> {
    [-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0].prop_map(Vec3::from)
}

/// Unit vectors, as good as f32 has them; along axes too.
pub fn direction() -> impl Strategy<Value = Vec3> {
    prop_oneof![
        9 => point()
            .prop_filter("it has a direction", |v| v.length() > 0.1)
            .prop_map(|v| v.as_dvec3().normalize().as_vec3()),
        1 => (0_usize..6).prop_map(|k| {
            [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z][k]
        }),
    ]
}

/// Evenly in the logarithm, from 10^low to 10^high.
pub fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low..high).prop_map(|exponent| 10_f64.powf(exponent))
}

/// The comparison has to be able to fail, and shrinking has to find what is simplest.
#[test]
fn what_fails_is_noticed_and_shrunk() {
    assert!(near("x", 1.0, 1.1, 0.2).is_ok());
    assert!(near("x", 1.0, 1.1, 0.05).is_err());
    assert!(near("x", f64::NAN, 1.1, 0.2).is_err());
    assert!(near_vector("x", DVec3::NAN, DVec3::ZERO, 9.0).is_err());
    let mut tree = draw(&(0_u32..1000), 50)
        .into_iter()
        .find(|tree| tree.current() > 500)
        .expect("half of them are");
    let (value, _) = shrunk(&mut tree, |&x| (x > 37).then(|| "too large".to_owned()));
    assert_eq!(value, 38);
}

/// A wrong expectation of a real function fails.
#[test]
#[should_panic(expected = "ln(1 - s) is")]
fn a_wrong_twin_is_noticed() {
    if support::device().is_none() {
        panic!("ln(1 - s) is not asked for: there is no device");
    }
    Trial::alone(Piece::Functions).holds(
        0.0_f32..0.9,
        |s| Arguments::default().number(*s).done(),
        |s, answer| {
            near(
                "ln(1 - s)",
                answer.number(0),
                (-f64::from(*s)).ln_1p() * 1.001,
                1e-6,
            )
        },
    );
}
