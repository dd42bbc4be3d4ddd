//! The picture depends on what is asked for, and on nothing else.

use raytree::Picture;

use crate::harness::{Folder, Run};

#[test]
fn the_same_command_gives_the_same_bytes() {
    need_device!();
    let folder = Folder::new();
    let arguments = "@critical-prism.glb --size 61x47 --spp 2 -o a.png -o a.exr";
    let render = |more: &str, threads: Option<&str>| {
        let mut command = folder.command(&format!("{arguments} {more}"));
        command.envs(threads.map(|count| ("LP_NUM_THREADS", count)));
        Run::of(command.output().unwrap()).succeeded();
        [folder.read("a.png"), folder.read("a.exr")]
    };
    let first = render("", None);
    for _ in 0..4 {
        assert!(render("", None) == first, "another time");
    }
    for batch in ["1", "640", "2000"] {
        assert!(
            render(&format!("--batch {batch}"), None) == first,
            "batches of {batch}"
        );
    }
    assert!(render("", Some("1")) == first, "on one thread");
    assert!(render("--counters", None) == first, "with counters");
}

#[test]
fn a_region_is_that_part_of_the_picture() {
    need_device!();
    let folder = Folder::new();
    folder
        .run("@critical-prism.glb --size 61x47 -o all.exr")
        .succeeded();
    folder
        .run("@critical-prism.glb --size 61x47 -o part.exr -o part.png --region 13,5,30,21")
        .succeeded();
    let (all, part) = (folder.picture("all.exr"), folder.picture("part.exr"));
    assert_eq!(
        (part.width, part.height),
        (61, 47),
        "the display window is the whole picture"
    );
    assert_eq!(
        (part.data.x, part.data.y, part.data.width, part.data.height),
        (13, 5, 30, 21)
    );
    let bits = |picture: &Picture| -> Vec<u32> {
        let cropped = picture.crop(part.data).unwrap();
        cropped.rgb.iter().flatten().map(|c| c.to_bits()).collect()
    };
    assert_eq!(bits(&all), bits(&part));
    assert!(bits(&all).iter().any(|&bits| bits != 0));
    let png = folder.picture("part.png");
    assert_eq!((png.width, png.height), (30, 21));
}

#[test]
fn every_depth_works() {
    need_device!();
    let folder = Folder::new();
    let mut before = 0;
    for depth in [0, 1, 2, 3, 8, 21, 32, 63, 64] {
        let report = folder.json(&format!(
            "@facing-mirrors.glb --size 32x24 --json --counters --depth {depth} -o a.png"
        ));
        let counters = &report["counters"];
        let reflected = counters["rays"]["reflection"].as_u64().unwrap();
        assert_eq!(reflected == 0, depth == 0);
        assert!(reflected >= before, "fewer reflections at depth {depth}");
        assert_eq!(counters["ended"]["storage"], 0, "depth {depth}");
        before = reflected;
    }
}
