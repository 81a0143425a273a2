//! Chain to multichain (Lluch03 §5), parse and sort together, on the shapes that cost most:
//!
//! * `million-branches`: a tree of 10⁶ branches, at most 64 deep, grown at random: under 3 s;
//! * `caterpillar`: 10⁵ branches, a trunk of 50,000 pieces with a twig at each: under 10 s; ten times as many beside it, to show that the
//!   time does not grow with the square of the depth.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use sphereboard::Seed;
use sphereboard::params::ParamValue as _;
use sphereboard::plant::multires::{Metric, Multichain, Role, WeightedTree};

/// Branches of random length, each growing from a random one that stands less than `deep` below the root.
fn random_tree(branches: usize, deep: u32) -> Vec<Role> {
    let mut draws = Seed(1).keyed("bench-multires", 0);
    let (mut roles, mut open) = (vec![Role::Advance(1.0)], 0);
    let mut left = branches - 1;
    while left > 0 {
        if open + 1 < deep && (open == 0 || draws.unit() < 0.5) {
            roles.extend([Role::Open, Role::Advance(0.1 + draws.unit())]);
            (open, left) = (open + 1, left - 1);
        } else {
            roles.push(Role::Close);
            open -= 1;
        }
    }
    roles.extend((0..open).map(|_| Role::Close));
    roles
}

/// Every branch forks into three until the number is reached: the shape of most grammars.
fn threefold(branches: usize) -> Vec<Role> {
    let (mut roles, mut left) = (vec![], branches);
    let mut waiting = vec![Some(1.0)];
    let depth = (branches as f64).log(3.0) as i32;
    while let Some(next) = waiting.pop() {
        let Some(length) = next else {
            roles.push(Role::Close);
            continue;
        };
        if left == 0 {
            continue;
        }
        left -= 1;
        roles.extend([Role::Open, Role::Advance(length)]);
        waiting.push(None);
        if length > 0.5f64.powi(depth) {
            waiting.extend([Some(length / 2.0); 3]);
        }
    }
    roles
}

fn caterpillar(branches: usize) -> Vec<Role> {
    let mut draws = Seed(2).keyed("bench-multires", 0);
    let twig = |length| [Role::Advance(1.0), Role::Open, Role::Advance(length), Role::Close];
    (0..branches / 2).flat_map(|_| twig(draws.unit())).collect()
}

fn conversion(c: &mut Criterion) {
    let mut group = c.benchmark_group("multichain");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    let shapes = [
        ("million-branches", random_tree(1_000_000, 64)),
        ("million-branches-threefold", threefold(1_000_000)),
        ("caterpillar", caterpillar(100_000)),
        ("caterpillar-million", caterpillar(1_000_000)),
    ];
    for (name, roles) in &shapes {
        for metric in [Metric::Children, Metric::Descendants, Metric::LongestPath, Metric::BranchingLength] {
            group.bench_function(format!("{name}/{}", metric.show()), |b| {
                b.iter(|| {
                    let tree = WeightedTree::parse(black_box(roles).iter().copied()).expect("a chain that can be read");
                    Multichain::new(&tree, metric)
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, conversion);
criterion_main!(benches);
