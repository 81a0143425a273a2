//! Random text as a grammar in both formats and as a chain; what can be read is derived and drawn: any answer is fine, a panic or a
//! hang is not.

#![no_main]

use libfuzzer_sys::fuzz_target;
use sphereboard::Seed;
use sphereboard::plant::{Chain, DeriveParams, Grammar, boxes, draw};

/// Ages to try: an axiom, between two derivations, and a few derivations on.
const AGES: [f64; 3] = [0.0, 1.5, 4.0];

fn grow(grammar: &Grammar) {
    for age in AGES {
        let grown = grammar.derive(age, &DeriveParams { max_modules: 5000 }, Seed(1), &mut |_| ());
        let Ok(chain) = grown else { continue };
        if let Ok(skeleton) = draw(&chain, grammar, grammar.turtle(), Seed(1), age) {
            assert!(skeleton.bones.iter().all(|bone| bone.end().is_finite()));
            assert_eq!(boxes::of(&skeleton).len(), skeleton.branches.len());
        }
    }
}

fuzz_target!(|text: &str| {
    if let Ok(grammar) = Grammar::parse(text) {
        grammar.parse_chain(&grammar.axiom().to_string()).expect("what is printed can be read");
        grow(&grammar);
    }
    for grammar in [Grammar::parse_xml(text), Grammar::parse(&format!("axiom A\nA -> {text}"))].into_iter().flatten() {
        grow(&grammar);
    }
    if let Ok(chain) = Chain::parse(text) {
        assert_eq!(Chain::parse(&chain.to_string()).expect("what is printed can be read"), chain);
    }
});
