//! Reflection and refraction, the stack of media, highlights, and the functions that they are made of.

use glam::{DVec3, Vec3};
use proptest::prelude::*;
use raytree_gpu::{Piece, PieceCall};

use super::trial::{
    Answer, Arguments, EPSILON, Trial, decades, direction, ensure, near, near_vector, roundings,
};

#[derive(Clone, Debug)]
struct Crossing {
    wo: Vec3,
    ns: Vec3,
    ng: Vec3,
    eta_i: f32,
    eta_t: f32,
}

/// The viewer's angle from the shading normal is anything up to 1e-6 rad from grazing; the geometric normal is the same or
/// bent away, but faces the viewer.
fn crossing() -> impl Strategy<Value = Crossing> {
    let angle = prop_oneof![
        0.0..1.57_f64,
        decades(-6.0, 0.0).prop_map(|near| std::f64::consts::FRAC_PI_2 - near)
    ];
    let bend = prop_oneof![Just(0.0), 0.0..0.5_f64];
    let index = || decades(-1.5, 1.5).prop_map(|index| index as f32);
    (direction(), direction(), angle, bend, index(), index())
        .prop_filter("the two directions differ", |(a, b, ..)| {
            a.cross(*b).length() > 0.1
        })
        .prop_map(|(normal, other, angle, bend, eta_i, eta_t)| {
            let n = normal.as_dvec3();
            let along = n.cross(other.as_dvec3()).normalize();
            let wo = angle.cos() * n + angle.sin() * along;
            let ng = (bend.cos() * n + bend.sin() * along.cross(n)).as_vec3();
            Crossing {
                wo: wo.as_vec3(),
                ns: normal,
                ng,
                eta_i,
                eta_t,
            }
        })
}

/// Snell's and Fresnel's (Born and Wolf 1999, 1.5), then the contract's way to keep rays on their side of the facet.
#[test]
fn light_is_split_as_snell_and_fresnel_say() {
    let call = |c: &Crossing| {
        let vectors = Arguments::default().vector(c.wo).vector(c.ns).vector(c.ng);
        vectors.number(c.eta_i).number(c.eta_t).done()
    };
    let judge = |c: &Crossing, answer: Answer<'_>| {
        let [wo, ns, ng] = [c.wo, c.ns, c.ng].map(|v| v.as_dvec3().normalize());
        let (eta_i, eta_t) = (f64::from(c.eta_i), f64::from(c.eta_t));
        let cos_i = ns.dot(wo);
        if cos_i <= 0.0 || (eta_i - eta_t).abs() < 1e-6 * eta_i {
            return Ok(());
        }
        let side = |direction: DVec3, normal: DVec3| {
            direction - 2.0 * direction.dot(normal).min(0.0) * normal
        };
        near("R + T", answer.number(4) + answer.number(5), 1.0, 1e-6)?;
        let reflected = side(2.0 * cos_i * ns - wo, ng);
        near_vector("wr", answer.vector(6), reflected, 1e-6)?;
        let sin_i = ns.cross(wo).length();
        let cos_t_squared = 1.0 - (eta_i / eta_t * sin_i).powi(2);
        if cos_t_squared.abs() < 1e-12 {
            return Ok(());
        }
        let total = answer.word(2) != 0;
        ensure(total == (cos_t_squared < 0.0), || {
            format!("cos_t^2 is {cos_t_squared:e}")
        })?;
        if total {
            return near("R", answer.number(3), 1.0, 0.0);
        }
        let cos_t = cos_t_squared.sqrt();
        let share = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
        let reflectance =
            0.5 * (share(eta_i * cos_i, eta_t * cos_t) + share(eta_t * cos_i, eta_i * cos_t));
        near("R", answer.number(3), reflectance, 1e-6)?;
        near("cos_t", answer.number(1), cos_t, 1e-6)?;
        let bent = -(eta_i / eta_t) * ns.cross(wo.cross(ns)) - cos_t * ns;
        near_vector("wt", answer.vector(9), side(bent, -ng), 1e-6)?;
        near("|wt|", answer.vector(9).length(), 1.0, 4.0 * EPSILON)
    };
    Trial::alone(Piece::Interface).holds(crossing(), call, judge);
}

/// What a stack of at most eight media would do; a step is a medium to enter (0 to 3: 0 is no step) or, plus 4, to leave.
fn right_media(steps: &[u32; 16]) -> (PieceCall, [u32; 16]) {
    let mut stack: Vec<u32> = Vec::new();
    let mut words = PieceCall::default();
    let mut innermost = [0; 16];
    for (k, &step) in steps.iter().enumerate() {
        let medium = step % 4;
        if medium != 0 && step > 4 {
            words[k] = 256 + medium;
            if let Some(place) = stack.iter().rposition(|&inside| inside == medium) {
                stack.remove(place);
            }
        } else if medium != 0 && stack.len() < 8 {
            words[k] = medium;
            stack.push(medium);
        }
        innermost[k] = stack.last().copied().unwrap_or(0);
    }
    (words, innermost)
}

#[test]
fn media_are_a_stack_that_forgets_the_topmost_equal_one() {
    let steps = proptest::array::uniform16(0_u32..8);
    let judge = |steps: &[u32; 16], answer: Answer<'_>| {
        let (_, innermost) = right_media(steps);
        (0..16).try_for_each(|k| {
            ensure(answer.word(k) == innermost[k], || {
                format!(
                    "after step {k} medium {} is innermost, not {}",
                    answer.word(k),
                    innermost[k]
                )
            })
        })
    };
    Trial::alone(Piece::Media).holds(steps, |steps| right_media(steps).0, judge);
}

#[test]
fn logarithm_and_arc_tangent() {
    let s =
        prop_oneof![decades(-20.0, 0.0), (0.0..1.0_f64)].prop_map(|s| (s as f32).min(0.999_999_9));
    let coordinate = || {
        (any::<bool>(), decades(-12.0, 3.0))
            .prop_map(|(up, x)| if up { x as f32 } else { -x as f32 })
    };
    type Call = (f32, f32, f32);
    let call = |(s, y, x): &Call| Arguments::default().number(*s).number(*y).number(*x).done();
    let judge = |(s, y, x): &Call, answer: Answer<'_>| {
        let logarithm = (-f64::from(*s)).ln_1p();
        // Where the builtin does it, 3 ulp are granted (WGSL's accuracy of log).
        let most = roundings(4.0, if *s > 0.5 { 6.0 } else { 4.0 });
        near(
            "ln(1 - s)",
            answer.number(0),
            logarithm,
            most * EPSILON * logarithm.abs(),
        )?;
        let angle = f64::from(*y).atan2(f64::from(*x));
        near(
            "atan2",
            answer.number(1),
            angle,
            8.0 * EPSILON * angle.abs(),
        )
    };
    Trial::alone(Piece::Functions).holds((s, coordinate(), coordinate()), call, judge);
}

/// GGX with the height-correlated Smith visibility (glTF appendix B.3, Heitz 2014), and cos^n, both where the half vector leaves the
/// normal by the angle `h`.
#[test]
fn highlights_keep_their_shape() {
    #[derive(Clone, Debug)]
    struct Shine {
        alpha: f32,
        h: f64,
        cos_o: f32,
        cos_i: f32,
        n: f32,
    }
    let cosine = || decades(-4.0, 0.0).prop_map(|cosine| cosine as f32);
    let alpha = decades(-3.0, 0.0).prop_map(|alpha| alpha as f32);
    let n = decades(-1.0, 6.0).prop_map(|n| n as f32);
    let shine = (alpha, decades(-6.0, 0.19), cosine(), cosine(), n).prop_map(
        |(alpha, h, cos_o, cos_i, n)| Shine {
            alpha,
            h,
            cos_o,
            cos_i,
            n,
        },
    );
    let call = |s: &Shine| {
        let (sin, cos) = s.h.sin_cos();
        let half = Arguments::default()
            .number(s.alpha)
            .number(cos as f32)
            .number((sin * sin) as f32);
        half.number(s.cos_o).number(s.cos_i).number(s.n).done()
    };
    let judge = |s: &Shine, answer: Answer<'_>| {
        let sin_h2 = f64::from((s.h.sin() * s.h.sin()) as f32);
        let cos_h2 = 1.0 - sin_h2;
        let a2 = f64::from(s.alpha).powi(2);
        let (cos_o, cos_i) = (f64::from(s.cos_o), f64::from(s.cos_i));
        let d = a2 / (std::f64::consts::PI * (sin_h2 + a2 * cos_h2).powi(2));
        let smith = |x: f64, y: f64| x * (y * y * (1.0 - a2) + a2).sqrt();
        let lobe = d * 0.5 / (smith(cos_i, cos_o) + smith(cos_o, cos_i));
        near("D V", answer.number(0), lobe, 1e-5 * lobe)?;
        let exponent = 0.5 * f64::from(s.n) * (-sin_h2).ln_1p();
        let power = exponent.exp();
        // exp(x) of a rounded x is off by x roundings.
        near(
            "cos^n",
            answer.number(1),
            power,
            (8.0 + 4.0 * exponent.abs()) * EPSILON * power + 1e-37,
        )
    };
    Trial::alone(Piece::Highlights).holds(shine, call, judge);
}
