//! The turtle on curves and trees whose shape is known.

use glam::Vec3;
use proptest::prelude::*;

use super::derive_tests::{derive, grammar};
use super::{BoneKind, Chain, DeriveParams, Grammar, Skeleton, TurtleParams, boxes, draw};
use crate::geom::Bounds;
use crate::{Error, Seed};

/// What a chain of built-in symbols draws.
fn drawn(chain: &str) -> Skeleton {
    try_draw(chain).unwrap_or_else(|error| panic!("{error}"))
}

fn try_draw(chain: &str) -> Result<Skeleton, Error> {
    let grammar = grammar("axiom F\ncommand T = tropism\ncommand R = R\nturtle turn_deg = 90");
    draw(&Chain::parse(chain)?, &grammar, grammar.turtle(), Seed(1), 0.0)
}

fn drawn_at(grammar: &Grammar, age: f64) -> Skeleton {
    let chain = derive(grammar, age, 1);
    draw(&chain, grammar, grammar.turtle(), Seed(1), age).unwrap_or_else(|error| panic!("{error}"))
}

fn close(a: Vec3, b: Vec3) -> bool {
    a.distance(b) < 1e-4
}

fn tip(skeleton: &Skeleton) -> Vec3 {
    skeleton.bones.last().expect("a bone").end()
}

#[test]
fn rotations_turn_the_way_they_say() {
    // Heading +Y, up +Z, so left is −X. Each turns by 90° and takes a step.
    let cases = [
        ("+F", Vec3::NEG_X),
        ("-F", Vec3::X),
        ("&F", Vec3::NEG_Z),
        ("^F", Vec3::Z),
        ("|F", Vec3::NEG_Y),
        // Left wing down: the left wing then points away from up, and a left turn goes there.
        ("\\+F", Vec3::NEG_Z),
        ("/+F", Vec3::Z),
        ("+(180)F", Vec3::NEG_Y),
        ("R(90)F", Vec3::NEG_X),
        ("R(0,90)F", Vec3::NEG_Z),
        // The roll comes first.
        ("R(90,0,90)F", Vec3::Z),
        ("f(2)F", Vec3::Y * 3.0),
        // Rolled on its side and levelled again, a left turn is horizontal.
        ("&(30)/(50)$+F", Vec3::NEG_X),
    ];
    for (chain, end) in cases {
        assert!(close(tip(&drawn(chain)), end), "{chain}: {}", tip(&drawn(chain)));
    }
    assert!(drawn("&(30)/(50)$F").bones[0].orientation.mul_vec3(Vec3::Z).y > 0.0, "`$` turns the upper side up");
    assert_eq!(tip(&drawn("$F")), Vec3::Y, "a vertical heading has no level");
}

#[test]
fn koch_snowflake_closes() {
    let koch = grammar("axiom F--F--F\nF -> F+F--F+F\nturtle turn_deg = 60");
    let skeleton = drawn_at(&koch, 4.0);
    assert_eq!(skeleton.bones.len(), 3 * 256);
    assert!(tip(&skeleton).length() < 1e-3, "{}", tip(&skeleton));
    // An edge and the star's outer tips round it: 81 steps wide, 81·2/√3 high.
    let size = boxes::of(&skeleton)[0].bounds.expect("bones").size() - Vec3::splat(0.1);
    let mut sides = [size.x, size.y];
    sides.sort_by(f32::total_cmp);
    assert!((sides[0] - 81.0).abs() < 1e-2 && (sides[1] - 81.0 * 2.0 / 3f32.sqrt()).abs() < 1e-2, "{size}");
}

#[test]
fn sierpinski_arrowhead_spans_its_triangle() {
    let text = "axiom A\nA -> B-A-B\nB -> A+B+A\ncommand A = F\ncommand B = F\nturtle turn_deg = 60";
    let skeleton = drawn_at(&grammar(text), 6.0);
    assert_eq!(skeleton.bones.len(), 729);
    assert!((tip(&skeleton).length() - 64.0).abs() < 1e-3, "3^n steps lead 2^n far: {}", tip(&skeleton));
}

#[test]
fn dragon_never_draws_an_edge_twice() {
    let dragon = grammar("symbols X Y\naxiom FX\nX -> X+YF+\nY -> -FX-Y\nturtle turn_deg = 90");
    let skeleton = drawn_at(&dragon, 12.0);
    assert_eq!(skeleton.bones.len(), 4096);
    let edge = |bone: &super::Bone| {
        let mut ends = [bone.start, bone.end()].map(|p| (p.x.round() as i32, p.y.round() as i32));
        ends.sort_unstable();
        ends
    };
    assert_eq!(skeleton.bones.iter().map(edge).collect::<std::collections::BTreeSet<_>>().len(), 4096);
    assert!(close(tip(&skeleton) / 64.0, Vec3::NEG_Y), "(1 + i)^12 = -64: {}", tip(&skeleton));
}

#[test]
fn brackets_make_branches_with_parents() {
    let skeleton = drawn("F(2)[+F[-FF]]!F");
    let bones = &skeleton.bones;
    let of = |i: usize| (bones[i].parent, bones[i].kind, bones[i].depth);
    assert_eq!(bones.len(), 4, "FF straight on is one bone, longer");
    assert_eq!(of(0), (None, BoneKind::Trunk, 0));
    assert_eq!(of(1), (Some(0), BoneKind::Branch, 1));
    assert_eq!(of(2), (Some(1), BoneKind::Branch, 2));
    assert_eq!(of(3), (Some(0), BoneKind::Trunk, 0));
    assert_eq!(bones[2].length_m, 2.0);
    assert!(close(bones[1].start, Vec3::Y * 2.0) && close(bones[2].end(), Vec3::new(-1.0, 4.0, 0.0)));
    let radii: Vec<f32> = bones.iter().flat_map(|b| [b.start_radius_m, b.end_radius_m]).collect();
    let expected = [0.05, 0.05, 0.035, 0.035, 0.0245, 0.0245, 0.05, 0.035];
    assert!(radii.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "each level thinner, and a cone at `!`: {radii:?}");
    let levels: Vec<_> = skeleton.branches.iter().map(|b| (b.parent, b.level, b.bones.clone())).collect();
    assert_eq!(levels, [(None, 0, 0..4), (Some(0), 1, 1..3), (Some(1), 2, 2..3)]);
}

#[test]
fn widths_lengths_tints_and_cuts() {
    let bones = drawn("!(0.4)F\"(0.5)F[F]'+F'(7)-F").bones;
    assert_eq!(bones.iter().map(|b| b.length_m).collect::<Vec<_>>(), [1.0, 0.5, 0.5, 0.5, 0.5]);
    assert!(bones.iter().all(|b| (b.end_radius_m - 0.2).abs() < 1e-6), "a width that was set stays in brackets");
    assert_eq!(bones.iter().map(|b| b.tint).collect::<Vec<_>>(), [0, 0, 0, 1, 7]);
    assert_eq!(drawn("F[+F%F[F]F]-F").bones.len(), 3, "`%` drops the rest of its branch and no more");
    assert_eq!(drawn("F%F[F]F").bones.len(), 1);
}

#[test]
fn leaves_and_polygons() {
    let skeleton = drawn("F[+L(2)]~");
    let leaf = skeleton.bones[1];
    assert_eq!((leaf.kind, leaf.parent, leaf.depth), (BoneKind::Leaf, Some(0), 1));
    assert!((leaf.length_m - 0.2).abs() < 1e-6 && (leaf.start_radius_m - 0.06).abs() < 1e-6);
    assert!(close(leaf.start, Vec3::Y) && close(leaf.heading(), Vec3::NEG_X));
    // Prusinkiewicz & Lindenmayer 1990, fig. 1.25: the outline of a leaf returns to where it began.
    let leaf = drawn("F{-(22)f+(22)f+(22)f-(22)|-(22)f+(22)f+(22)f}");
    assert_eq!((leaf.bones.len(), leaf.polygons[0].corners.len()), (1, 6));
    assert!(close(leaf.polygons[0].corners[5], Vec3::Y));
    let dots = drawn("{.[+G.]G.}");
    let expected = [Vec3::ZERO, Vec3::NEG_X, Vec3::Y];
    assert!(dots.polygons[0].corners.iter().zip(expected).all(|(a, b)| close(*a, b)), "{dots:?}");
    assert_eq!(dots.bones.len(), 2, "G draws, F in a polygon does not");
    assert!(drawn("{.f}").polygons.is_empty(), "two corners are no shape");
}

#[test]
fn tropism_bends_towards_its_direction_and_never_past_it() {
    let steps = "+(80)".to_owned() + &"F".repeat(60);
    let droop = drawn(&format!("T(0.2){steps}"));
    assert_eq!(droop.bones.len(), 60, "a bent branch is many bones");
    assert!(close(droop.bones[59].heading(), Vec3::NEG_Y), "{}", droop.bones[59].heading());
    let rise = drawn(&format!("T(-10){steps}"));
    assert!(close(rise.bones[1].heading(), Vec3::Y), "however strong: {}", rise.bones[1].heading());
    assert!(close(drawn(&steps).bones[0].heading(), drawn(&format!("T(0){steps}")).bones[0].heading()));
}

#[test]
fn noise_is_seeded_and_has_its_size() {
    let grammar = grammar(&format!("axiom {}\nturtle turn_noise_deg = 5\nturtle length_noise = 0.1", "[+(45)F]".repeat(4000)));
    let chain = derive(&grammar, 0.0, 1);
    let drawn = |seed| draw(&chain, &grammar, grammar.turtle(), Seed(seed), 0.0).expect("it draws");
    let skeleton = drawn(1);
    assert_eq!(skeleton, drawn(1));
    assert_ne!(skeleton, drawn(2));
    let spread = |values: Vec<f32>| {
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / values.len() as f32).sqrt())
    };
    let (mean, deviation) = spread(skeleton.bones.iter().map(|b| b.length_m).collect());
    assert!((mean - 1.0).abs() < 0.01 && (deviation - 0.1).abs() < 0.01, "{mean} ± {deviation}");
    let (mean, deviation) = spread(skeleton.bones.iter().map(|b| (-b.heading().x).atan2(b.heading().y).to_degrees()).collect());
    assert!((mean - 45.0).abs() < 0.5 && (deviation - 5.0).abs() < 0.5, "{mean}° ± {deviation}°");
}

#[test]
fn a_grown_skeleton_keeps_directions() {
    let young = drawn("F[+F(2)L]f[-F{.f-f}]F");
    let old = young.grown(10.0);
    assert_eq!(old.bones.len(), young.bones.len());
    for (a, b) in young.bones.iter().zip(&old.bones) {
        assert!(close(a.start * 10.0, b.start) && a.orientation == b.orientation && a.start_radius_m == b.start_radius_m);
        assert_eq!(b.length_m, if a.kind == BoneKind::Leaf { a.length_m } else { a.length_m * 10.0 });
    }
    let side = |s: &Skeleton| s.polygons[0].corners[0].distance(s.polygons[0].corners[1]);
    assert!((side(&old) - side(&young)).abs() < 1e-4 && close(old.polygons[0].corners[0], young.polygons[0].corners[0] * 10.0));
    assert_eq!(young.grown(f32::NAN), young);
}

/// The longest distance from a point of one skeleton to the nearest of the other (Hausdorff): how much a jump between them shows.
fn jump(a: &Skeleton, b: &Skeleton) -> f32 {
    let points =
        |s: &Skeleton| s.bones.iter().flat_map(|b| (0..=8).map(|i| b.start.lerp(b.end(), i as f32 / 8.0))).collect::<Vec<_>>();
    let to_bone = |p: Vec3, bone: &super::Bone| {
        let along = (p - bone.start).dot(bone.heading()).clamp(0.0, bone.length_m);
        p.distance(bone.start + bone.heading() * along)
    };
    let far = |from: &Skeleton, to: &Skeleton| {
        let nearest = |p: Vec3| to.bones.iter().map(|bone| to_bone(p, bone)).fold(f32::INFINITY, f32::min);
        points(from).into_iter().map(nearest).fold(0.0, f32::max)
    };
    far(a, b).max(far(b, a))
}

#[test]
fn ages_between_derivations_join_without_a_jump() {
    let plants = [
        "axiom F\nF -> F+F--F+F\nturtle turn_deg = 60",
        "axiom A(1,0.1)\nA(l,w) -> !(w)F(l)[+(30)A(l*0.8,w*0.7)]/(137)[-(30)A(l*0.7,w*0.7)]",
        "symbols X\naxiom X\nX -> F[+X]F[-X]+X\nF -> FF\nturtle turn_deg = 20",
        "axiom A\nA -> F(1)[+L][-L]A\nF(l) -> F(l*1.3)\nL -> L",
        "axiom FA\nA -> [+FA]/(90)B\nB -> F&A",
    ];
    for text in plants {
        let grammar = grammar(text);
        for age in 1..4 {
            let (age, moment) = (f64::from(age), 1e-6);
            let (whole, after, before) =
                (drawn_at(&grammar, age), drawn_at(&grammar, age + moment), drawn_at(&grammar, age - moment));
            assert!(jump(&whole, &after) < 1e-3, "{text}: {} just after {age}", jump(&whole, &after));
            assert!(jump(&whole, &before) < 1e-3, "{text}: {} just before {age}", jump(&whole, &before));
            let (half, next) = (drawn_at(&grammar, age + 0.5), drawn_at(&grammar, age + 1.0));
            assert!(jump(&whole, &half) > 1e-2 && jump(&next, &half) > 1e-2, "{text}: half way is neither");
        }
    }
}

#[test]
fn boxes_hold_their_branches_and_no_more() {
    let skeleton = drawn("F(4)[+F(3)[^F(2)]][-(45)F]F(5)L[]");
    let boxes = boxes::of(&skeleton);
    let levels: Vec<_> = boxes.iter().map(|b| (b.parent, b.level)).collect();
    assert_eq!(levels, [(None, 0), (Some(0), 1), (Some(1), 2), (Some(0), 1), (Some(0), 1)]);
    let bounds = |i: usize| boxes[i].bounds.expect("wood in it");
    assert!(close(bounds(2).min, Vec3::new(-3.0245, 3.9755, -0.0245)) && close(bounds(2).max, Vec3::new(-2.9755, 4.0245, 2.0245)));
    assert!(close(bounds(1).max, Vec3::new(0.035, 4.035, 2.0245)), "children are in it: {:?}", bounds(1));
    assert_eq!(boxes[4].bounds, None);
    // Every box against a plain search.
    for (branch, found) in skeleton.branches.iter().zip(&boxes) {
        let bones = &skeleton.bones[branch.bones.start as usize..branch.bones.end as usize];
        let ends = bones.iter().map(boxes::of_bone).flat_map(|b| [b.min, b.max]);
        assert_eq!(found.bounds, Bounds::of(ends));
    }
    let unlisted = Skeleton { branches: vec![], ..skeleton };
    assert_eq!(boxes::of(&unlisted)[0].bounds, Some(bounds(0)));
}

#[test]
fn deep_chains_do_not_overflow() {
    let depth = 200_000;
    let chain = "[F(0.001)".repeat(depth) + &"]".repeat(depth);
    let skeleton = drawn(&chain);
    assert_eq!((skeleton.bones.len(), skeleton.branches.len()), (depth, depth + 1));
    assert!((boxes::of(&skeleton)[0].bounds.expect("wood").size().y - 200.0).abs() < 1.0);
}

#[test]
fn chains_that_no_turtle_can_follow() {
    let fail = |chain: &str| try_draw(chain).expect_err("an error").to_string();
    for (chain, says) in [
        ("F(-1)", "module 1 of the chain, F: expected a number of at least 0, but found -1"),
        ("F!(-1)", "module 2 of the chain, !"),
        ("F}", "a `{` before it"),
        ("F{.f", "a `}` for every `{`"),
        ("F(1e300)F", "within the range of numbers"),
        ("!(1e300)F", "within the range of numbers"),
        ("L(1e300)", "within the range of numbers"),
        ("T(1e9)F", "a tropism from -10 to 10"),
        ("RESTORE(3)F", "the number of a SAVE before it"),
    ] {
        assert!(fail(chain).contains(says), "{chain}: {}", fail(chain));
    }
    let grammar = grammar("axiom F");
    let mut open = Chain::new(grammar.alphabet().clone());
    open.push(super::Symbol::POP, &[]);
    assert!(draw(&open, &grammar, grammar.turtle(), Seed(1), 0.0).is_err(), "a chain made by hand may be unbalanced");
    for (name, value) in [("tropism", f64::NAN), ("tropism", f64::INFINITY), ("tropism_y", 0.0), ("step_m", f64::NAN)] {
        let mut params = TurtleParams::default();
        match name {
            "tropism" => params.tropism = value,
            "tropism_y" => params.tropism_y = value,
            _ => params.step_m = value,
        }
        let chain = Chain::parse("F").expect("a chain");
        assert!(matches!(draw(&chain, &grammar, &params, Seed(1), 0.0), Err(Error::Parameter { .. })), "{name} {value}");
    }
}

proptest! {
    #[test]
    fn every_chain_draws_or_says_why(chain in "([FfGgL+\\-&^/|$!'\"%{}.]|\\[|\\]|F\\([0-9]\\)){0,80}", age in 0.0f64..3.0) {
        if let Ok(skeleton) = try_draw(&chain) {
            for (i, bone) in skeleton.bones.iter().enumerate() {
                prop_assert!(bone.parent.is_none_or(|p| (p as usize) < i));
                prop_assert!(bone.end().is_finite() && bone.orientation.is_normalized());
            }
        }
        let text = format!("axiom A\nA -> F{chain}A : 0.8\nF -> FF : 0.5\nF(x) -> [F(x*2)]");
        if let Ok(grammar) = Grammar::parse(&text) {
            let chain = grammar.derive(age, &DeriveParams { max_modules: 100_000 }, Seed(1), &mut |_| ());
            let _ = chain.and_then(|chain| draw(&chain, &grammar, grammar.turtle(), Seed(1), age));
        }
    }
}
