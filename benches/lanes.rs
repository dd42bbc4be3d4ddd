//! What the eight lanes of a vector do in step, counted: how often they test a node or a triangle together, where each ray has fewer to
//! test; and how often they would if loops were ordered otherwise, or a lane took another ray when it has finished one. A simulation on
//! the CPU, over the rays of frames in the order of the device's lists: what can be known before a shader is written.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use raytree_bvh::CpuTraversal;
use raytree_gpu::{RecordedRays, types::ProbeRay};
use support::{Effort, frames::Subject, rays};

/// Lanes of a vector of lavapipe's (256 bits).
const LANES: usize = 8;
/// Pixels on a picture's side.
const SIDE: u32 = 512;
/// Rays that may hit something else here: two tests in f32 differ at edges.
const OTHER_HITS: f64 = 1e-3;

/// Of a ray: for each node that it visits, how many triangles it tests there.
type Visits = Vec<u8>;

/// What all rays visit.
///
/// # Panics
/// If too many hit something else than they did in the frame.
fn walk_all(subject: &Subject, recorded: &RecordedRays) -> Vec<Visits> {
    let cpu = CpuTraversal::new(&subject.bvh, &rays::triangles(&subject.scene));
    let mut other = 0;
    let walk = |(ray, &triangle): (&ProbeRay, &u32)| {
        let any = ray.shadow != 0;
        let (visits, hit) = cpu.visits(ray.origin.into(), ray.direction.into(), ray.t_max, any);
        other += usize::from(!any && hit.unwrap_or(u32::MAX) != triangle);
        visits
    };
    let traced = recorded.rays.iter().zip(&recorded.triangles);
    let all: Vec<Visits> = traced.map(walk).collect();
    assert!(
        other as f64 <= OTHER_HITS * all.len() as f64,
        "{}: {other} of {} rays hit something else",
        subject.name,
        all.len()
    );
    all
}

/// A name, and what makes its subject.
type Make = (&'static str, fn() -> Subject);

/// How the loops of a traversal are ordered.
#[derive(Clone, Copy)]
struct Loops {
    name: &'static str,
    /// Nodes that a lane visits, at most, until it tests the triangles of the first that has any.
    nodes: usize,
    /// Rays that a lane takes one after the other.
    rays: usize,
    /// Turns after which lanes that have finished a ray take the next.
    turns: usize,
}

const LOOPS: [Loops; 6] = [
    Loops {
        name: "a node and its triangles a turn (ours)",
        nodes: 1,
        rays: 1,
        turns: 1,
    },
    Loops {
        name: "up to 2 nodes, then triangles",
        nodes: 2,
        rays: 1,
        turns: 1,
    },
    Loops {
        name: "up to 4 nodes, then triangles",
        nodes: 4,
        rays: 1,
        turns: 1,
    },
    Loops {
        name: "ours, next ray of 2 every turn",
        nodes: 1,
        rays: 2,
        turns: 1,
    },
    Loops {
        name: "ours, next ray of 8 every turn",
        nodes: 1,
        rays: 8,
        turns: 1,
    },
    Loops {
        name: "ours, next ray of 8 every 8 turns",
        nodes: 1,
        rays: 8,
        turns: 8,
    },
];

/// A lane: the rays that it takes, where among them it is, and at which of that one's nodes.
struct Lane<'a> {
    rays: Vec<&'a Visits>,
    ray: usize,
    node: usize,
}

impl Lane<'_> {
    /// Nodes visited and triangles tested in a turn.
    fn turn(&mut self, nodes: usize) -> (usize, u8) {
        let (mut visited, mut tests) = (0, 0);
        if let Some(ray) = self.rays.get(self.ray) {
            while self.node < ray.len() && visited < nodes && tests == 0 {
                tests = ray[self.node];
                self.node += 1;
                visited += 1;
            }
        }
        (visited, tests)
    }

    /// Goes on to the next ray if this one is at its end; whether there is one to trace.
    fn next(&mut self) -> bool {
        if self
            .rays
            .get(self.ray)
            .is_some_and(|ray| self.node >= ray.len())
        {
            self.ray += 1;
            self.node = 0;
        }
        self.ray < self.rays.len()
    }
}

/// Times that a vector tests a node and a triangle, and looks for new rays, for each of its lanes' rays.
fn in_step(all: &[Visits], loops: Loops) -> [f64; 3] {
    let mut times = [0; 3];
    for vector in all.chunks(LANES * loops.rays) {
        let lane = |lane| Lane {
            rays: vector.iter().skip(lane).step_by(LANES).collect(),
            ray: 0,
            node: 0,
        };
        let mut lanes: Vec<Lane<'_>> = (0..LANES).map(lane).collect();
        let mut busy = true;
        while busy {
            for _ in 0..loops.turns {
                let turns = lanes.iter_mut().map(|lane| lane.turn(loops.nodes));
                let (visited, tests) = turns.fold((0, 0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
                times[0] += visited;
                times[1] += usize::from(tests);
            }
            times[2] += 1;
            busy = lanes
                .iter_mut()
                .filter_map(|lane| lane.next().then_some(()))
                .count()
                > 0;
        }
    }
    times.map(|times| times as f64 * LANES as f64 / all.len() as f64)
}

fn main() {
    let subjects: [Make; 3] = [
        ("whitted-1980", || {
            Subject::of_file("whitted-1980.glb", SIDE)
        }),
        ("spheres", || {
            Subject::new("spheres", rays::spheres().lit(), SIDE)
        }),
        ("book", || Subject::of_file("book.glb", SIDE)),
    ];
    if Effort::chosen() == Effort::Test {
        return;
    }
    let device = support::device();
    for (name, subject) in subjects {
        if !support::wanted(&format!("lanes/{name}")) {
            continue;
        }
        let subject = subject();
        let recorded = subject
            .prepared(&device, &subject.settings)
            .recorded_rays()
            .unwrap_or_else(|error| panic!("{error}"));
        let all = walk_all(&subject, &recorded);
        let mean = |sum: usize| sum as f64 / all.len() as f64;
        println!(
            "lanes/{name}: {} rays, each {:.1} nodes, {:.1} triangles",
            all.len(),
            mean(all.iter().map(Vec::len).sum()),
            mean(all.iter().flatten().map(|&tests| usize::from(tests)).sum()),
        );
        for loops in LOOPS {
            let [nodes, triangles, looks] = in_step(&all, loops);
            println!(
                "  {:<40} {nodes:>6.1} nodes {triangles:>6.1} triangles {looks:>6.1} looks",
                loops.name
            );
        }
    }
}
