//! The shaders' own functions at a boundary, called alone with given vectors: all pairs of indices, all angles.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};
use raytree_gpu::{Piece, PieceCall, PieceResult, RenderSettings};
use raytree_scene::{default_view::frame_scene, model::Scene};

use super::{
    INDICES,
    twin::{Encounter, Outcome, angle, outcome},
};
use crate::{
    judge::worse,
    random::Random,
    report::Limit,
    stage::{Stage, StressError},
};

/// Boundaries of each pair of indices and each kind of angle.
const ENCOUNTERS: usize = 2_000;

/// How close to a special angle rays come, radians: from the first to the second, evenly in the logarithm.
const NEARNESS: [f64; 2] = [1e-6, 1e-1];

/// A squared cosine this small says either "grazing" or "total": the two differ by less than 1e-6 rad.
const UNDECIDED: f64 = 1e-12;

/// Which angles are tried.
#[derive(Clone, Copy, Debug)]
enum Angles {
    /// Evenly from normal incidence to grazing.
    All,
    /// Near to 90 degrees.
    Grazing,
    /// Near to the critical angle, on both sides; where there is one.
    Critical,
}

pub(super) fn measure(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for (angles, name) in [
        (Angles::All, "all angles"),
        (Angles::Grazing, "1e-6 to 0.1 rad from grazing"),
        (Angles::Critical, "1e-6 to 0.1 rad from critical"),
    ] {
        let encounters = encounters(angles);
        let calls: Vec<PieceCall> = encounters.iter().map(call).collect();
        let camera = frame_scene(DVec3::NEG_ONE, DVec3::ONE, 1.0);
        let settings = RenderSettings::new(1, 1, camera);
        let results = stage.evaluate(Piece::Interface, &Scene::default(), &settings, &calls)?;
        let mut worst = Errors::default();
        for (encounter, result) in encounters.iter().zip(&results) {
            worst.add(&outcome(encounter), &Answer::of(result));
        }
        worst.record(stage, name);
    }
    Ok(())
}

fn encounters(angles: Angles) -> Vec<Encounter> {
    let mut random = Random::new(6);
    let mut encounters = Vec::new();
    for eta_i in INDICES {
        for eta_t in INDICES {
            for _ in 0..ENCOUNTERS {
                let Some(theta) = incidence(angles, eta_i, eta_t, &mut random) else {
                    continue;
                };
                let normal = random.direction().as_dvec3().normalize();
                let along = normal.cross(random.direction().as_dvec3()).normalize();
                let (sin, cos) = theta.sin_cos();
                encounters.push(Encounter {
                    wo: (cos * normal + sin * along).as_vec3(),
                    normal: normal.as_vec3(),
                    eta_i,
                    eta_t,
                });
            }
        }
    }
    encounters
}

fn incidence(angles: Angles, eta_i: f32, eta_t: f32, random: &mut Random) -> Option<f64> {
    let [nearest, farthest] = NEARNESS;
    let near = nearest * (farthest / nearest).powf(random.unit());
    match angles {
        Angles::All => Some(random.unit() * (FRAC_PI_2 - nearest)),
        Angles::Grazing => Some(FRAC_PI_2 - near),
        Angles::Critical if eta_i > eta_t => {
            let critical = (f64::from(eta_t) / f64::from(eta_i)).asin();
            let theta = if random.unit() < 0.5 {
                critical - near
            } else {
                critical + near
            };
            (theta > 0.0 && theta < FRAC_PI_2 - nearest).then_some(theta)
        }
        Angles::Critical => None,
    }
}

fn call(encounter: &Encounter) -> PieceCall {
    let mut call = PieceCall::default();
    let Encounter {
        wo,
        normal,
        eta_i,
        eta_t,
    } = *encounter;
    let vectors = [wo, normal, normal].map(|vector| vector.to_array());
    let numbers = vectors.into_iter().flatten().chain([eta_i, eta_t]);
    for (word, number) in call.iter_mut().zip(numbers) {
        *word = number.to_bits();
    }
    call
}

/// What the shaders say.
#[derive(Clone, Copy, Debug)]
struct Answer {
    total: bool,
    /// Weight of the reflected ray of a clear white dielectric.
    reflected_weight: f64,
    /// .. and of the refracted one.
    refracted_weight: f64,
    reflected: DVec3,
    refracted: DVec3,
}

impl Answer {
    fn of(result: &PieceResult) -> Self {
        let number = |k: usize| f64::from(f32::from_bits(result[k]));
        let vector =
            |k: usize| Vec3::from_array([k, k + 1, k + 2].map(|k| f32::from_bits(result[k])));
        Self {
            total: result[2] != 0,
            reflected_weight: number(4),
            refracted_weight: number(5),
            reflected: vector(6).as_dvec3(),
            refracted: vector(9).as_dvec3(),
        }
    }
}

/// The largest of each kind; NaN stays.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    balance: f64,
    reflectance: f64,
    reflected: f64,
    refracted: f64,
    misjudged: u32,
}

impl Errors {
    fn add(&mut self, right: &Outcome, answer: &Answer) {
        let raise = |worst: &mut f64, error: f64| *worst = worse(*worst, error);
        let sum = answer.reflected_weight + answer.refracted_weight;
        raise(&mut self.balance, (sum - 1.0).abs());
        let off = (answer.reflected_weight - right.reflectance).abs();
        raise(&mut self.reflectance, off);
        raise(
            &mut self.reflected,
            angle(answer.reflected, right.reflected),
        );
        match right.refracted {
            Some(direction) if !answer.total => {
                raise(&mut self.refracted, angle(answer.refracted, direction));
            }
            None if answer.total => {}
            _ => self.misjudged += u32::from(right.cos_t_squared.abs() > UNDECIDED),
        }
    }

    fn record(&self, stage: &mut Stage<'_>, angles: &str) {
        stage.record(
            format!("{angles}: R + T - 1"),
            self.balance,
            Limit::AtMost(1e-6),
        );
        stage.record(
            format!("{angles}: R against f64"),
            self.reflectance,
            Limit::AtMost(1e-6),
        );
        stage.record(
            format!("{angles}: reflected direction, rad"),
            self.reflected,
            Limit::AtMost(1e-5),
        );
        stage.record(
            format!("{angles}: refracted direction, rad"),
            self.refracted,
            Limit::AtMost(1e-5),
        );
        stage.record(
            format!("{angles}: total reflection misjudged"),
            f64::from(self.misjudged),
            Limit::AtMost(0.0),
        );
    }
}
