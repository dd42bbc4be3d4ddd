//! A summary to tell in tests, of numbers made up: six numbers of samples whose error falls as N^-0.75, and three depths.

use crate::measurement::{Build, Errors, Journal, MadeBy, Picture, Rays, Record, Reference, Run};
use crate::setting::{Bvh, Model, Setting};
use crate::summary::{Clock, Subject, Summary};
use crate::sweep::{Sweep, Values};

pub fn reference() -> Reference {
    Reference {
        shading: Model::Pbr,
        made_by: MadeBy::Ourselves,
        samples: vec![121, 144],
        depth: 32,
        min_weight: 1e-4,
        agreement: Some(Errors {
            rmse: 0.002,
            ..Errors::default()
        }),
        truncation: None,
        oracle: None,
    }
}

pub fn sweep() -> Sweep {
    let base = Setting::default();
    let spp = Values::parse("spp=1,2,4,8,16,32").unwrap();
    let depth = Values::parse("depth=1,4,8").unwrap();
    let mut sweep = Sweep::product(base, &[spp]).unwrap();
    let few = Setting { spp: 4, ..base };
    sweep
        .ladders
        .extend(Sweep::product(few, &[depth]).unwrap().ladders);
    sweep
}

pub fn journal() -> Journal {
    let mut journal = Journal::default();
    for setting in sweep().settings() {
        let spp = f64::from(setting.spp);
        let depth = f64::from(setting.depth);
        let rmse = 0.05 * spp.powf(-0.75) + 0.1 * (-depth).exp();
        journal.add(Record::Picture(Picture {
            setting,
            errors: Errors {
                rmse,
                relative_mse: rmse * rmse,
                mean_abs: 0.1 * rmse,
                p99_abs: 2.0 * rmse,
                max_abs: 10.0 * rmse,
                flip_mean: 0.5 * rmse,
            },
            rays: Rays {
                primary: 1000 * u64::from(setting.spp),
                ..Rays::default()
            },
            dropped: 0,
            fingerprint: 0,
            estimated_rmse: None,
        }));
        for round in 0..3 {
            let seconds = [0.1, 0.11, 0.13][round as usize] * spp * (0.2 + depth / 10.0);
            journal.add(Record::Run(Run {
                setting,
                round,
                session: 0,
                wall_s: 0.6 * seconds,
                cpu_s: Some(seconds),
                prepare_s: 0.01,
                compile_s: 0.02,
            }));
        }
    }
    for round in 0..3 {
        journal.add(Record::Build(Build {
            bvh: Bvh::Balanced,
            round,
            wall_s: 0.03,
        }));
    }
    journal
}

pub fn summary() -> Summary {
    let subject = Subject {
        scene: "made-up".to_owned(),
        size: (160, 120),
        device: "no device".to_owned(),
        driver: "none".to_owned(),
        command: "raytree converge made-up.glb".to_owned(),
    };
    Summary::new(subject, &sweep(), &journal(), &[reference()], Clock::Cpu)
}
