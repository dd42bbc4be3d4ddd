//! `compare`: numbers, limits, the difference picture.

use serde_json::{Value, json};

use crate::harness::{Folder, keys};

#[test]
fn compare_measures_and_holds_limits() {
    let folder = Folder::new();
    folder.write_plain("a.exr", (40, 30), [0.5; 3]);
    folder.write_plain("b.exr", (40, 30), [0.5, 0.5, 0.8]);
    folder.write_plain("small.exr", (20, 30), [0.5; 3]);

    let report =
        folder.json("compare a.exr a.exr --json --max-rmse 0 --max-flip 0 --max-outliers 0:0");
    let all = [
        "pixels",
        "rmse",
        "relative_mse",
        "mean_abs",
        "max_abs",
        "p99_abs",
        "flip_mean",
        "outliers",
        "max_alpha",
        "non_finite",
    ];
    assert_eq!(keys(&report), all);
    assert_eq!(
        (&report["pixels"], &report["rmse"], &report["max_abs"]),
        (&json!(1200), &json!(0.0), &json!(0.0))
    );

    let report =
        folder.json("compare a.exr b.exr --json --no-flip --threshold 0.1 --threshold 0.5");
    let close = |key: &str, value: f64| {
        assert!(
            (report[key].as_f64().unwrap() - value).abs() < 1e-6,
            "{key}: {report}"
        )
    };
    close("mean_abs", 0.1);
    close("max_abs", 0.3);
    close("p99_abs", 0.3);
    close("rmse", (0.09_f64 / 3.0).sqrt());
    close("relative_mse", 0.09 / 3.0 / (0.25 + 0.01));
    assert_eq!(report["flip_mean"], Value::Null);
    assert_eq!(
        report["outliers"],
        json!([{ "threshold": 0.1, "share": 1.0 }, { "threshold": 0.5, "share": 0.0 }])
    );

    let text = folder.run("compare a.exr b.exr").succeeded().stdout;
    for word in ["mean ", "rmse ", "FLIP ", "above 0.02 "] {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
    folder.run("compare a.exr b.exr --max-mean 0.11 --max-abs 0.31 --max-p99 0.31 --max-outliers 0.31:0").succeeded();
    for (limit, words) in [
        (
            "--max-mean 0.09",
            ["mean absolute difference is 0.1", "0.09"],
        ),
        (
            "--max-rmse 0.17",
            ["root mean square difference is 0.173", "0.17"],
        ),
        ("--max-abs 0.29", ["largest difference is 0.3", "0.29"]),
        ("--max-p99 0.29", ["99th percentile", "0.29"]),
        ("--max-flip 0.01", ["mean FLIP", "0.01"]),
        (
            "--max-outliers 0.1:0.999",
            ["more than 0.1 is 1.0", "0.999"],
        ),
    ] {
        let run = folder.run(&format!("compare a.exr b.exr {limit}"));
        assert_eq!(run.code, Some(1), "{limit}");
        assert!(
            run.stdout.contains("rmse"),
            "the numbers are printed all the same"
        );
        run.mentions(&words);
    }
    folder
        .run("compare a.exr small.exr")
        .failed(1, &["40x30", "20x30"]);
}

#[test]
fn compare_clips_if_asked_and_never_lets_nan_pass_a_limit() {
    let folder = Folder::new();
    folder.write_plain("white.exr", (40, 30), [1.0; 3]);
    folder.write_plain("bright.exr", (40, 30), [7.0; 3]);
    assert_eq!(
        folder.json("compare white.exr bright.exr --json")["max_abs"],
        6.0
    );
    assert_eq!(
        folder.json("compare white.exr bright.exr --json --clip --max-abs 0")["max_abs"],
        0.0
    );

    folder.write_plain("nan.exr", (40, 30), [f32::NAN, 1.0, 1.0]);
    assert_eq!(
        folder.json("compare white.exr nan.exr --json")["non_finite"],
        1200
    );
    let run = folder.run("compare white.exr nan.exr --max-abs 1e9");
    assert_eq!(run.code, Some(1));
    run.mentions(&["NaN"]);
}

#[test]
fn compare_draws_the_difference() {
    let folder = Folder::new();
    folder.write_plain("a.exr", (40, 30), [0.5; 3]);
    folder.write_plain("b.png", (40, 30), [0.2; 3]);
    folder.run("compare a.exr b.png --diff d.png").succeeded();
    let picture = folder.picture("d.png");
    assert_eq!((picture.width, picture.height), (120, 30));
    folder
        .run("compare a.exr b.png --diff d.exr")
        .failed(2, &["d.exr", ".png"]);
}
