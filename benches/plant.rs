//! Derivation and drawing at ten million modules:
//!
//! * `derive-10m/…`: the whole derivation from the axiom to at least 10⁷ modules (the issue asks for less than a second on 4 cores);
//! * `draw-1m`: the turtle over a million modules, on one core.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use sphereboard::Seed;
use sphereboard::plant::{Chain, DeriveParams, Grammar, draw};

/// Name and text of each grammar; each is derived until it has 10⁷ modules.
const GRAMMARS: [(&str, &str); 4] = [
    ("plain", "axiom A\nA -> AB\nB -> A"),
    ("tree", "axiom A(1,0.1)\nA(l,w) -> !(w)F(l)[+(30)A(l*0.8,w*0.7)][-(30)A(l*0.7,w*0.7)]"),
    (
        "stochastic",
        "axiom A(1,0.1)\nA(l,w) : l > 0.001 -> !(w)F(l)[+(30)A(l*0.8,w*0.7)][-(random(20,40))A(l*0.75,w*0.7)]A(l*0.7,w) : 0.6\n\
         A(l,w) : l > 0.001 -> F(l)[/(137)A(l*0.9,w*0.9)]A(l,w) : 0.4",
    ),
    ("context", "ignore + -\naxiom B(1)A(1)\nB(s) < A(x) -> B(x)[+A(x+1)]A(x*0.5)\nA(x) -> B(x)[-A(x)]A(x)\nB(s) -> B(s*0.9)"),
];

fn derived(grammar: &Grammar, age: f64) -> Chain {
    grammar.derive(age, &DeriveParams::default(), Seed(1), &mut |_| ()).expect("within the limits")
}

fn derivation(c: &mut Criterion) {
    let mut group = c.benchmark_group("derive-10m");
    group.sample_size(10).measurement_time(Duration::from_secs(8));
    for (name, text) in GRAMMARS {
        let grammar = Grammar::parse(text).expect("a sound grammar");
        let (age, modules) = (1..60)
            .map(|age| (f64::from(age), derived(&grammar, f64::from(age)).len()))
            .find(|(_, modules)| *modules >= 10_000_000)
            .expect("every grammar explodes");
        eprintln!("{name}: {modules} modules at age {age}");
        group.bench_function(name, |b| b.iter(|| derived(black_box(&grammar), age)));
    }
    group.finish();
}

fn drawing(c: &mut Criterion) {
    let mut group = c.benchmark_group("draw-1m");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    let grammar = Grammar::parse(GRAMMARS[1].1).expect("a sound grammar");
    let chain = derived(&grammar, 17.0);
    eprintln!("drawing {} modules", chain.len());
    group.bench_function("tree", |b| {
        b.iter(|| draw(black_box(&chain), &grammar, grammar.turtle(), Seed(1), 17.0).expect("it draws"))
    });
    group.finish();
}

criterion_group!(benches, derivation, drawing);
criterion_main!(benches);
