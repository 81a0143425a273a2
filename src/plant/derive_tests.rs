//! Worked examples of the papers and of the books they build on, as exact expectations.

use super::{Chain, DeriveParams, Grammar};
use crate::{Error, Seed};

pub(super) fn grammar(text: &str) -> Grammar {
    Grammar::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

pub(super) fn derive(grammar: &Grammar, age: f64, seed: u64) -> Chain {
    grammar.derive(age, &DeriveParams::default(), Seed(seed), &mut |_| ()).unwrap_or_else(|error| panic!("{error}"))
}

fn derived(text: &str, age: u32) -> String {
    derive(&grammar(text), f64::from(age), 1).to_string()
}

#[test]
fn algae() {
    let rules = "axiom A\nA -> AB\nB -> A";
    let printed = ["A", "AB", "ABA", "ABAAB", "ABAABABA", "ABAABABAABAAB", "ABAABABAABAABABAABABA"];
    for (age, expected) in printed.into_iter().enumerate() {
        assert_eq!(derived(rules, age as u32), expected, "n = {age}");
    }
    // The paper prints 37 letters for n = 7; each word is the one before and the one before that (Fibonacci).
    let seventh = format!("{}{}", printed[6], printed[5]);
    assert_eq!(seventh.len(), 34);
    assert_eq!(derived(rules, 7), seventh);
}

/// Lluch03's system (1); its chain (2) leaves out the children of the second branch.
const SYSTEM_1: &str = "symbols B\naxiom A(1)\n\
    A(l) : itNum < maxIt -> B(l)[A(l/2)A(l/2)]\n\
    A(l) : itNum = maxIt -> B(l)";

#[test]
fn lluch_system_1() {
    assert_eq!(derived(SYSTEM_1, 1), "B(1)");
    assert_eq!(derived(SYSTEM_1, 2), "B(1)[B(0.5)B(0.5)]");
    assert_eq!(derived(SYSTEM_1, 3), "B(1)[B(0.5)[B(0.25)B(0.25)]B(0.5)[B(0.25)B(0.25)]]");
}

#[test]
fn dragon_curve_turns() {
    let rules = "symbols X Y\naxiom FX\nX -> X+YF+\nY -> -FX-Y";
    for n in 0..=12u32 {
        let chain = derive(&grammar(rules), f64::from(n), 1);
        // X and Y draw nothing; `+` and `-` between two steps are one turn, and turns that nothing follows do not count.
        let (mut turns, mut turn, mut steps) = (vec![], 0, 0);
        for module in &chain {
            match module.name {
                "+" => turn += 1,
                "-" => turn -= 1,
                "F" => {
                    turns.extend((steps > 0).then_some(turn));
                    (turn, steps) = (0, steps + 1);
                }
                _ => {}
            }
        }
        assert_eq!(steps, 1 << n);
        // The regular paper-folding sequence (OEIS A014577): turn k, from 1, follows the bit above k's lowest set bit.
        let folded: Vec<i32> = (1..1u32 << n).map(|k| if (k >> (k.trailing_zeros() + 1)) & 1 == 0 { 1 } else { -1 }).collect();
        assert_eq!(turns, folded, "n = {n}");
    }
}

#[test]
fn stochastic_frequencies() {
    let axiom = "B".repeat(10_000);
    let chain = derive(&grammar(&format!("symbols C\naxiom {axiom}\nB -> A : 0.1\nB -> C : 0.7\nA -> A")), 1.0, 5);
    let count = |name| chain.iter().filter(|m| m.name == name).count();
    // Six standard deviations of a binomial: 6·√(10,000·p·(1 − p)).
    assert!(count("A").abs_diff(1000) < 180, "{}", count("A"));
    assert!(count("C").abs_diff(7000) < 275, "{}", count("C"));
    assert!(count("B").abs_diff(2000) < 240, "the rest stays: {}", count("B"));
}

#[test]
fn the_stochastic_example_of_truelsen_always_grows_one_letter_an_age_at_least() {
    let grammar = grammar("symbols C\naxiom A\nA -> AB\nB -> A : 0.1\nB -> C : 0.9");
    for seed in 0..20 {
        let lengths: Vec<usize> = (0..8).map(|age| derive(&grammar, f64::from(age), seed).len()).collect();
        assert!(lengths.windows(2).all(|w| w[1] > w[0]), "{lengths:?}");
    }
    assert_ne!(derive(&grammar, 12.0, 1), derive(&grammar, 12.0, 2));
    assert_eq!(derive(&grammar, 12.0, 3), derive(&grammar, 12.0, 3));
}

#[test]
fn koch_and_sierpinski() {
    assert_eq!(derived("axiom F\nF -> F+F--F+F", 1), "F+F--F+F");
    let koch = "axiom F--F--F\nF -> F+F--F+F";
    let names = |text: &str, age| derived(text, age).matches('F').count();
    assert_eq!(names(koch, 4), 3 * 256);
    let arrowhead = "axiom A\nA -> B-A-B\nB -> A+B+A";
    assert_eq!(derived(arrowhead, 2), "A+B+A-B-A-B-A+B+A");
}

#[test]
fn a_signal_runs_up_a_string() {
    // Prusinkiewicz & Lindenmayer 1990, §1.8.
    let rules = "axiom baaaaaaaa\nb < a -> b\nb -> a";
    assert_eq!(derived(rules, 0), "baaaaaaaa");
    assert_eq!(derived(rules, 1), "abaaaaaaa");
    assert_eq!(derived(rules, 2), "aabaaaaaa");
    assert_eq!(derived(rules, 8), "aaaaaaaab");
    assert_eq!(derived(rules, 9), "aaaaaaaaa");
}

#[test]
fn signals_in_a_tree() {
    // Prusinkiewicz & Lindenmayer 1990, fig. 1.30: up from the base into every branch, and down from one tip.
    let acropetal = "ignore + -\nsymbols B\naxiom B[+A]A[-A]A[+A]A\nB < A -> B";
    assert_eq!(derived(acropetal, 1), "B[+B]B[-A]A[+A]A");
    assert_eq!(derived(acropetal, 2), "B[+B]B[-B]B[+A]A");
    assert_eq!(derived(acropetal, 3), "B[+B]B[-B]B[+B]B");
    let basipetal = "ignore + -\nsymbols B\naxiom A[+A]A[-A]A[+A]B\nA > B -> B";
    assert_eq!(derived(basipetal, 1), "A[+A]A[-A]B[+A]B");
    assert_eq!(derived(basipetal, 2), "A[+A]B[-A]B[+A]B");
    assert_eq!(derived(basipetal, 3), "B[+A]B[-A]B[+A]B");
}

#[test]
fn context_of_the_book() {
    // Prusinkiewicz & Lindenmayer 1990, §1.8: BC < S > G[H]M finds S in ABC[DE][SG[HI[JK]L]MNO].
    let rest = "symbols A B C D E G H I J K L M N O X\naxiom ABC[DE][SG[HI[JK]L]MNO]\n";
    assert_eq!(derived(&format!("{rest}BC < S > G[H]M -> X"), 1), "ABC[DE][XG[HI[JK]L]MNO]");
    assert_eq!(derived(&format!("{rest}BC < S > GM -> X"), 1), "ABC[DE][XG[HI[JK]L]MNO]", "side branches may be skipped");
    assert_eq!(derived(&format!("{rest}BD < S -> X"), 1), "ABC[DE][SG[HI[JK]L]MNO]", "D is on another branch");
    assert_eq!(derived(&format!("{rest}S > G[I] -> X"), 1), "ABC[DE][SG[HI[JK]L]MNO]");
}

#[test]
fn contexts_bind_parameters_from_left_to_right() {
    let rules = "axiom A(1)B(2)[A(7)]A(3)\nA(l) < B(x) > A(r) : l < r -> B(l*100+x*10+r)\nA(x) -> A(x)";
    assert_eq!(derived(rules, 1), "A(1)B(123)[A(7)]A(3)");
}

#[test]
fn rules_with_context_go_first_and_the_rest_falls_to_the_one_without_likelihood() {
    assert_eq!(derived("symbols X Y Z\naxiom ZAA\nA -> X\nZ < A -> Y", 1), "ZYX");
    let chain = derive(&grammar(&format!("symbols X Y\naxiom {}\nA -> X : 0.25\nA -> Y", "A".repeat(4000))), 1.0, 9);
    let count = |name| chain.iter().filter(|m| m.name == name).count();
    assert!(count("X").abs_diff(1000) < 170 && count("X") + count("Y") == 4000);
}

#[test]
fn chunks_leave_no_trace() {
    // More modules than a chunk holds, with parameters, contexts, chances and random parameters.
    let text = "ignore X\naxiom A(1,2)\nA(a,b) -> F(a)[A(b,a+1)]X A(a,random(0,b)) : 0.9\nA(a,b) -> A(b,a)\nF(x) < X > A(u,v) : u < v -> X F(x)\nX -> X\nF(x) -> F(x)";
    let grammar = grammar(text);
    let chain = derive(&grammar, 15.0, 4);
    assert!(chain.len() > 40_000, "{}", chain.len());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    assert!(pool.install(|| derive(&grammar, 15.0, 4)) == chain);
    assert_eq!(Chain::parse(&chain.to_string()).expect("its own notation"), chain);
}

#[test]
fn modules_beyond_the_first_chunk_have_their_own_neighbours_and_numbers() {
    let axiom = "A(1)".repeat(20_000);
    let sums = derive(&grammar(&format!("axiom {axiom}\nA(x) < A(y) -> A(x+y)\nA(x) -> A(x)")), 2.0, 1);
    let values: Vec<f64> = sums.iter().map(|m| m.params[0]).collect();
    assert_eq!(values[..2], [1.0, 3.0]);
    assert!(values.len() == 20_000 && values[2..].iter().all(|v| *v == 4.0));
    let random = derive(&grammar(&format!("axiom {axiom}\nA(x) -> A(random(0,1))")), 1.0, 1);
    let mut values: Vec<f64> = random.iter().map(|m| m.params[0]).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    assert_eq!(values.len(), 20_000);
    assert!((values.iter().sum::<f64>() / 20_000.0 - 0.5).abs() < 0.02);
}

#[test]
fn explosions_stop_before_memory_does() {
    let fail = |text: &str, age, max_modules| {
        let params = DeriveParams { max_modules };
        grammar(text).derive(age, &params, Seed(1), &mut |_| ()).expect_err("an explosion")
    };
    let error = fail("axiom A\nA -> AAAAAAAAAA", 60.0, 50_000_000);
    assert!(matches!(error, Error::TooManyModules { step: 8, found: 100_000_000, limit: 50_000_000, .. }), "{error}");
    let wide = "symbols B\naxiom A\nA -> AB(1,2,3,4,5,6,7,8,9,10,11,12)";
    assert!(matches!(fail(wide, 500.0, 400), Error::TooManyModules { what: "parameters", .. }));
    assert!(matches!(fail("axiom A\nA -> A", f64::NAN, 9), Error::Parameter { .. }));
    assert!(matches!(fail("axiom A\nA -> A", 1e9, 9), Error::Parameter { .. }));
}

#[test]
fn faults_of_a_derivation_name_the_rule() {
    let fail = |text: &str| {
        let failed = grammar(text).derive(4.0, &DeriveParams::default(), Seed(1), &mut |_| ());
        failed.expect_err("a fault").to_string()
    };
    let text = fail("axiom A(3)\nA(l) -> F(1/l)A(l-1)");
    assert!(text.contains("line 2, column 12") && text.contains("division by zero in derivation 4"), "{text}");
    let text = fail("axiom A(0)\nA(l) : 1/l > 3 -> F");
    assert!(text.contains("line 2, column 9") && text.contains("division by zero"), "{text}");
    assert!(fail("axiom A(-1)\nA(l) -> A(sqrt(l))").contains("sqrt"));
    assert!(fail("axiom A(1)\nA(l) -> A(l*1e200)").contains("too large"));
    assert!(fail("axiom A(1)\nA(l) -> A(l) : l*2").contains("a likelihood from 0 to 1"));
    assert!(fail("axiom A(.6)\nA(l) -> A(l) : l\nA(l) -> F : l").contains("sum of 1.2"));
}

#[test]
fn short_circuits_do_not_divide() {
    assert_eq!(derived("axiom A(0)\nA(l) : l != 0 && 1/l > 3 -> F\nA(l) : l = 0 || 1/l > 3 -> F(l)", 1), "F(0)");
}

#[test]
fn progress_is_told_after_every_derivation() {
    let mut told = vec![];
    let grammar = grammar("axiom A\nA -> AA");
    grammar.derive(3.5, &DeriveParams::default(), Seed(1), &mut |p| told.push((p.step, p.steps, p.modules))).expect("it derives");
    assert_eq!(told, [(1, 4, 2), (2, 4, 4), (3, 4, 8), (4, 4, 16)]);
}
