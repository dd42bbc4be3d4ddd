//! Numbers that host and shaders have to agree on and that only this crate can see. The others: `tests/shaders.rs`.

use std::mem::offset_of;

use naga::{Expression, Literal, Module};

use crate::{
    adaptive::{BUDGET_MOST, COMMON_RAYS, STORAGE_SHIFT},
    batch::TILE_PIXELS,
    branch_bound::LEAST_HIGHLIGHT_ALPHA,
    instances::{INSTANCE_NORMAL, INSTANCE_WORDS, MOST_INSTANCES},
    plan::{
        CAMERA_LEVEL, CONTACT_WORDS, HIT_WORDS, ITEM_WORDS, ITEMS_OF_LIGHTS, ITEMS_TO_TRACE,
        MOST_LEVELS, MOST_SLOTS, SLOT_WORDS, STACK_VARIABLES, TRAVERSAL_WORDS,
    },
    source::{self, Limits},
    statistics::{COUNTERS, Counters},
    types::{LIST_PARTS, PartLength, WorkList},
    upload,
    wavefront::recorded_rays::{ENTRY_SUSPENDED, ITEM_KIND, LIGHTS, SHADOW, T_MAX},
};

fn shaders() -> Module {
    source::parse(Limits::for_depth(32)).unwrap()
}

fn literal(module: &Module, name: &str) -> Literal {
    let mut constants = module.constants.iter();
    let (_, constant) = constants
        .find(|(_, constant)| constant.name.as_deref() == Some(name))
        .unwrap();
    match module.global_expressions[constant.init] {
        Expression::Literal(literal) => literal,
        ref other => panic!("{name}: {other:?}"),
    }
}

fn constant(module: &Module, name: &str) -> u32 {
    match literal(module, name) {
        Literal::U32(value) => value,
        other => panic!("{name}: {other:?}"),
    }
}

fn float(module: &Module, name: &str) -> f32 {
    match literal(module, name) {
        Literal::F32(value) => value,
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn an_instance_is_read_as_it_is_written() {
    let module = shaders();
    assert_eq!(constant(&module, "INSTANCE_WORDS") as usize, INSTANCE_WORDS);
    assert_eq!(float(&module, "INSTANCE_NORMAL"), INSTANCE_NORMAL);
    // An item's depth gives way to it, counted from 1; in a hit it has two bits more.
    let bits = 32 - constant(&module, "ITEM_DEPTH_SHIFT");
    assert_eq!(MOST_INSTANCES, (1 << bits) - 1);
    assert!(constant(&module, "MET_SHIFT") <= constant(&module, "ITEM_DEPTH_SHIFT"));
}

#[test]
fn the_largest_radiance_is_the_same() {
    assert_eq!(
        float(&shaders(), "LARGEST_RADIANCE"),
        upload::LARGEST_RADIANCE
    );
}

#[test]
fn a_slot_has_room_for_what_a_dispatch_leaves() {
    assert_eq!(constant(&shaders(), "ITEMS_TO_TRACE"), ITEMS_TO_TRACE);
    assert_eq!(constant(&shaders(), "ITEMS_OF_LIGHTS"), ITEMS_OF_LIGHTS);
    assert_eq!(constant(&shaders(), "CONTACT_WORDS"), CONTACT_WORDS);
    assert_eq!(constant(&shaders(), "TRAVERSAL_WORDS"), TRAVERSAL_WORDS);
    assert_eq!(constant(&shaders(), "STACK_VARIABLES"), STACK_VARIABLES);
    assert_eq!(constant(&shaders(), "SLOT_WORDS"), SLOT_WORDS);
    assert_eq!(constant(&shaders(), "HIT_WORDS"), HIT_WORDS);
    assert_eq!(constant(&shaders(), "ITEM_WORDS"), ITEM_WORDS);
}

#[test]
fn an_entry_of_a_list_has_room_for_slot_and_level() {
    let constant = |name| constant(&shaders(), name);
    assert_eq!(constant("ENTRY_SLOT") + 1, MOST_SLOTS);
    assert_eq!(1 << constant("ENTRY_LEVEL_SHIFT"), MOST_SLOTS);
    assert_eq!(constant("ENTRY_LEVEL"), CAMERA_LEVEL);
    assert_eq!(constant("CAMERA_LEVEL"), CAMERA_LEVEL);
    assert_eq!(MOST_LEVELS, CAMERA_LEVEL, "levels are below");
    assert_eq!(constant("LIST_WORKGROUP"), TILE_PIXELS);
    assert_eq!(constant("LIST_PARTS"), LIST_PARTS);
    assert_eq!(
        constant("LENGTHS_WORD") as usize * 16,
        offset_of!(WorkList, lengths)
    );
    assert_eq!(
        constant("PART_WORDS") as usize * 16,
        size_of::<PartLength>()
    );
}

#[test]
fn what_a_sample_counts_is_read_as_it_is_written() {
    let module = shaders();
    assert_eq!(constant(&module, "STORAGE_SHIFT"), STORAGE_SHIFT);
    assert_eq!(constant(&module, "COMMON_RAYS"), COMMON_RAYS);
    assert_eq!(COMMON_RAYS + 1, 1 << STORAGE_SHIFT);
    assert_eq!(constant(&module, "BUDGET_MOST"), BUDGET_MOST);
    assert_eq!(BUDGET_MOST + 1, 1 << constant(&module, "CODE_SHIFT"));
}

#[test]
fn a_highlight_is_left_out_of_the_same_surfaces() {
    let least = float(&shaders(), "LEAST_HIGHLIGHT_ALPHA");
    assert_eq!(f64::from(least) as f32, LEAST_HIGHLIGHT_ALPHA as f32);
}

#[test]
fn recorded_rays_are_read_as_they_are_written() {
    let module = shaders();
    for (name, value) in [
        ("ENTRY_SUSPENDED", ENTRY_SUSPENDED),
        ("ITEM_KIND", ITEM_KIND),
        ("SHADOW", SHADOW),
        ("LIGHTS", LIGHTS),
    ] {
        assert_eq!(constant(&module, name), value, "{name}");
    }
    assert_eq!(float(&module, "T_MAX"), T_MAX);
}

#[test]
fn a_workgroup_is_a_tile() {
    for entry in shaders().entry_points {
        assert_eq!(entry.workgroup_size, [TILE_PIXELS, 1, 1], "{}", entry.name);
    }
}

#[test]
fn counters_come_in_the_same_order() {
    let module = shaders();
    assert_eq!(constant(&module, "COUNTERS") as usize, COUNTERS);
    let words: Vec<u32> = (0..COUNTERS as u32).collect();
    let mut counted = Counters::default();
    assert_eq!(counted.add(&words), constant(&module, "ITERATIONS"));
    let Counters {
        rays,
        node_visits,
        triangle_tests,
        ended,
    } = counted;
    for (total, name) in [
        (rays.primary, "PRIMARY_RAYS"),
        (rays.shadow, "SHADOW_RAYS"),
        (rays.reflection, "REFLECTION_RAYS"),
        (rays.refraction, "REFRACTION_RAYS"),
        (node_visits, "NODE_VISITS"),
        (triangle_tests, "TRIANGLE_TESTS"),
        (ended.miss, "ENDED_MISS"),
        (ended.depth, "ENDED_DEPTH"),
        (ended.weight, "ENDED_WEIGHT"),
        (ended.tolerance, "ENDED_TOLERANCE"),
    ] {
        assert_eq!(total, u64::from(constant(&module, name)), "{name}");
    }
}
