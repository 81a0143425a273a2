//! The paper's example, and what holds for every tree.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;
use crate::Result;

/// A module of the tests: brackets, or a name and a length; `+` and `-` turn.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sign {
    pub name: String,
    pub length: Option<f64>,
}

impl Sign {
    fn role(&self) -> Role {
        match (self.name.as_str(), self.length) {
            ("[", _) => Role::Open,
            ("]", _) => Role::Close,
            (_, Some(length)) => Role::Advance(length),
            _ => Role::Other,
        }
    }
}

/// `C12[F(2)+]`: a letter with digits is a branch of length 1, or as given in parentheses; other signs are turns.
pub(super) fn words(text: &str) -> Vec<Sign> {
    let mut words: Vec<Sign> = vec![];
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let name_len = rest.find(|d: char| !(d.is_alphanumeric())).unwrap_or(rest.len()).max(1);
        let name_len =
            if c.is_alphabetic() { 1 + rest[1..name_len].find(|d: char| !d.is_ascii_digit()).unwrap_or(name_len - 1) } else { 1 };
        let (name, after) = rest.split_at(name_len);
        let (length, after) = match after.strip_prefix('(').and_then(|a| a.split_once(')')) {
            Some((length, after)) => (length.parse().unwrap(), after),
            None => (1.0, after),
        };
        words.push(Sign { name: name.to_owned(), length: c.is_alphabetic().then_some(length) });
        rest = after;
    }
    words
}

pub(super) fn tree_of(words: &[Sign]) -> WeightedTree {
    WeightedTree::parse(words.iter().map(Sign::role)).unwrap()
}

/// Chain (3) of the paper; its text is lost from the shared copy, the issue has it.
const CHAIN_3: &str = "C1[C2[C3[C4][C5[C6][C7]]][C9[C11][C10]][C8]][C12[C13][C14][C15[C16]]]";

/// One level as the paper writes it: a state has the number of the branch that saved it.
fn written(chain: &Multichain, words: &[Sign], level: usize) -> String {
    let name = |number: u32| {
        let step = &chain.steps()[chain.saved_by(number).unwrap()];
        words[step.modules.start as usize].name.trim_start_matches('C').to_owned()
    };
    let item = |item| match item {
        Item::Module(m) => words[m as usize].name.clone(),
        Item::Save(number) => format!("SAVE({})", name(number)),
        Item::Restore(number) => format!("RESTORE({})", name(number)),
    };
    chain.level(level).iter().flat_map(Step::items).map(item).collect::<Vec<_>>().join(" ")
}

#[test]
fn figure_3_weights() {
    let words = words(CHAIN_3);
    let tree = tree_of(&words);
    let named = |metric| {
        let names = tree.branches().iter().map(|b| words[b.modules.start as usize].name.clone());
        names.zip(weights(&tree, metric)).collect::<BTreeMap<_, _>>()
    };
    let (a, b, c, d) =
        (named(Metric::Children), named(Metric::Descendants), named(Metric::LongestPath), named(Metric::BranchingLength));
    let of = |name: &str| [a[name], b[name], c[name], d[name]];
    assert_eq!(of("C1"), [2.0, 15.0, 5.0, 16.0]);
    assert_eq!(of("C2"), [3.0, 9.0, 4.0, 10.0]);
    assert_eq!(of("C3"), [2.0, 4.0, 3.0, 5.0]);
    assert_eq!(of("C12"), [3.0, 4.0, 3.0, 5.0]);
    assert_eq!(of("C16"), [0.0, 0.0, 1.0, 1.0]);
}

/// §5.4, all nine levels.
#[test]
fn the_nine_levels_of_the_paper() {
    let words = words(CHAIN_3);
    let chain = Multichain::new(&tree_of(&words), Metric::BranchingLength);
    let levels: Vec<String> = (1..=chain.levels()).map(|n| written(&chain, &words, n)).collect();
    assert_eq!(
        levels,
        [
            "C1 SAVE(1) C2 SAVE(2) C3 SAVE(3) C5 SAVE(5) C6",
            "RESTORE(2) C9 SAVE(9) C11",
            "RESTORE(1) C12 SAVE(12) C15 C16",
            "RESTORE(3) C4",
            "RESTORE(5) C7",
            "RESTORE(9) C10",
            "RESTORE(12) C13",
            "RESTORE(2) C8",
            "RESTORE(12) C14",
        ]
    );
}

/// §5.3 word for word, with equation 4 for (d) and the metrics' definitions over branches not output for (a)–(c): the oracle for
/// [`visits`]. Every level walks from the root.
fn literal(tree: &WeightedTree, metric: Metric) -> Vec<Vec<u32>> {
    let n = tree.branches().len();
    let lengths: Vec<i64> = metric::whole_lengths(tree).into_iter().map(|l| l as i64).collect();
    let mut output = vec![false; n];
    let mut branching_length = lengths.clone();
    for b in (1..n).rev() {
        branching_length[tree.branches()[b].parent.unwrap() as usize] += branching_length[b];
    }
    let mut levels = vec![];
    while output.contains(&false) {
        let (mut weight, mut finished) = (vec![0i64; n], output.clone());
        for b in (0..n).rev() {
            let children = || tree.children(b).iter().map(|&c| c as usize);
            finished[b] &= children().all(|c| finished[c]);
            weight[b] = match metric {
                Metric::Children => children().filter(|&c| !output[c]).count() as i64,
                Metric::Descendants => children().map(|c| weight[c] + i64::from(!output[c])).sum(),
                Metric::LongestPath => (if output[b] { 0 } else { lengths[b] }) + children().map(|c| weight[c]).max().unwrap_or(0),
                Metric::BranchingLength => branching_length[b],
            };
        }
        let heaviest = |b: usize| {
            let children = tree.children(b).iter().copied().filter(|&c| !finished[c as usize]);
            children.reduce(|best, c| if weight[c as usize] > weight[best as usize] { c } else { best })
        };
        let (mut above, mut n) = (vec![], 0u32);
        while output[n as usize] {
            above.push(n);
            n = heaviest(n as usize).unwrap();
        }
        let mut path = vec![n];
        while let Some(child) = heaviest(*path.last().unwrap() as usize) {
            path.push(child);
        }
        let length_from = |k: usize| path[k..].iter().map(|&b| lengths[b as usize]).sum::<i64>();
        above.iter().for_each(|&k| branching_length[k as usize] -= length_from(0));
        path.iter().enumerate().for_each(|(at, &k)| branching_length[k as usize] -= length_from(at));
        path.iter().for_each(|&b| output[b as usize] = true);
        levels.push(path);
    }
    levels
}

const METRICS: [Metric; 4] = [Metric::Children, Metric::Descendants, Metric::LongestPath, Metric::BranchingLength];

fn assert_literal(tree: &WeightedTree) {
    let branch_at: BTreeMap<u32, u32> = (0u32..).zip(tree.branches()).map(|(b, branch)| (branch.modules.start, b)).collect();
    for metric in METRICS {
        let chain = Multichain::new(tree, metric);
        // Tails go with their branch.
        let branches = |level: &[Step]| level.iter().filter_map(|s| branch_at.get(&s.position).copied()).collect();
        let levels: Vec<Vec<u32>> = (1..=chain.levels()).map(|n| branches(chain.level(n))).collect();
        assert_eq!(levels, literal(tree, metric), "{metric:?}");
    }
}

/// A chain of advances of few different lengths (so that ties abound), turns and brackets, led by a wood module.
pub(super) fn any_words(max: usize) -> impl Strategy<Value = Vec<Sign>> {
    let sign = prop_oneof![4 => Just('['), 4 => Just(']'), 5 => Just('F'), 1 => Just('+'), 1 => Just('-')];
    let length = prop_oneof![Just(0.0), Just(1.0), Just(1.0), Just(2.0), Just(0.1), Just(0.3)];
    prop::collection::vec((sign, length), 0..max).prop_map(|signs| {
        let (mut words, mut open) = (vec![Sign { name: "F".into(), length: Some(1.0) }], 0);
        for (sign, length) in signs {
            match sign {
                '[' => open += 1,
                ']' if open == 0 => continue,
                ']' => open -= 1,
                _ => {}
            }
            words.push(Sign { name: sign.to_string(), length: (sign == 'F').then_some(length) });
        }
        words.extend(std::iter::repeat_n(Sign { name: "]".into(), length: None }, open));
        words
    })
}

/// A stroke of the tests' turtle: where from, how long, at which heading and depth, by which module, on which stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    pub from: [f64; 2],
    pub length: f64,
    pub heading: f64,
    pub depth: u32,
    pub module: u32,
    pub on: Option<u32>,
}

/// A flat turtle with a bracket stack.
#[derive(Debug, Clone)]
pub(super) struct Flat<'a> {
    words: &'a [Sign],
    state: FlatState,
    stack: Vec<FlatState>,
    strokes: Vec<Stroke>,
}

#[derive(Debug, Clone, Default)]
pub(super) struct FlatState {
    at: [f64; 2],
    heading: f64,
    depth: u32,
    on: Option<u32>,
}

impl<'a> Flat<'a> {
    pub fn new(words: &'a [Sign]) -> Self {
        Self { words, state: FlatState::default(), stack: vec![], strokes: vec![] }
    }

    /// The whole chain, read as it stands.
    pub fn original(words: &'a [Sign]) -> Vec<Stroke> {
        let mut turtle = Self::new(words);
        (0..words.len() as u32).for_each(|m| turtle.read(m, m).unwrap());
        turtle.strokes
    }
}

impl LevelTurtle for Flat<'_> {
    type State = FlatState;
    type Mark = usize;

    fn begin(&mut self, brackets: u32) {
        self.state.depth += brackets;
    }

    fn read(&mut self, stored: u32, position: u32) -> Result<()> {
        let word = &self.words[stored as usize];
        match (word.name.as_str(), word.length) {
            ("[", _) => {
                self.stack.push(self.state.clone());
                self.state.depth += 1;
            }
            ("]", _) => self.state = self.stack.pop().expect("balanced"),
            ("+", _) => self.state.heading += 0.5,
            ("-", _) => self.state.heading -= 0.3,
            (_, Some(length)) => {
                let FlatState { at, heading, depth, on } = self.state;
                self.strokes.push(Stroke { from: at, length, heading, depth, module: position, on });
                self.state.on = Some(self.strokes.len() as u32 - 1);
                self.state.at = [at[0] + length * heading.sin(), at[1] + length * heading.cos()];
            }
            _ => {}
        }
        Ok(())
    }

    fn save(&self) -> FlatState {
        self.state.clone()
    }

    fn restore(&mut self, state: &FlatState) {
        self.state = state.clone();
    }

    fn mark(&self) -> usize {
        self.strokes.len()
    }

    fn rewind(&mut self, mark: usize) {
        self.strokes.truncate(mark);
    }
}

/// The strokes of the first `n` levels.
fn strokes_of(levels: &mut Levels<Flat>, chain: &Multichain, n: usize) -> Vec<Stroke> {
    let mark = levels.first(chain, n).unwrap();
    levels.turtle().strokes[..mark].to_vec()
}

/// Strokes in the order of their modules, standing on modules instead of strokes: what two orders of output have in common.
pub(super) fn in_chain_order(strokes: &[Stroke]) -> Vec<Stroke> {
    let module_of = |on: Option<u32>| on.map(|s| strokes[s as usize].module);
    let mut sorted: Vec<Stroke> = strokes.iter().map(|s| Stroke { on: module_of(s.on), ..*s }).collect();
    sorted.sort_by_key(|s| s.module);
    sorted
}

/// A trunk of `n / 2` pieces with a twig at each fork; twigs of three lengths.
fn caterpillar(n: usize) -> Vec<Sign> {
    words(&(0..n / 2).map(|i| format!("F[F({})]", 1 + i % 3)).collect::<String>())
}

#[test]
fn levels_are_the_literal_ones_on_telling_shapes() {
    assert_literal(&tree_of(&words(CHAIN_3)));
    assert_literal(&tree_of(&caterpillar(120)));
    let nested = "F[F".repeat(40) + &"]F".repeat(40);
    assert_literal(&tree_of(&words(&nested)));
    let star = format!("F{}", (0..60).map(|i| format!("[F({})]", i * 7 % 5)).collect::<String>());
    assert_literal(&tree_of(&words(&star)));
    let doubled = (0..6).fold("F".to_owned(), |t, _| format!("F[{t}][{t}]"));
    assert_literal(&tree_of(&words(&doubled)));
    let no_length = (0..5).fold("F(0)".to_owned(), |t, _| format!("F(0)[{t}][{t}]"));
    assert_literal(&tree_of(&words(&no_length)));
    assert_literal(&tree_of(&[]));
}

proptest! {
    #[test]
    fn levels_are_the_literal_ones(words in any_words(160)) {
        assert_literal(&tree_of(&words));
    }

    #[test]
    fn every_level_holds_the_one_before_and_the_last_is_the_original(words in any_words(120), metric in prop::sample::select(&METRICS)) {
        let chain = Multichain::new(&tree_of(&words), metric);
        let mut lazily = Levels::new(Flat::new(&words));
        let mut before: Vec<Stroke> = vec![];
        for n in 1..=chain.levels() {
            prop_assert_eq!(lazily.drawn(), n - 1, "nothing is drawn before it is asked for");
            let strokes = strokes_of(&mut lazily, &chain, n);
            prop_assert!(strokes.starts_with(&before));
            prop_assert_eq!(lazily.turtle().strokes.len(), strokes.len(), "nor anything beyond it");
            prop_assert!(strokes.iter().enumerate().all(|(s, stroke)| stroke.on.is_none_or(|on| (on as usize) < s)));
            before = strokes;
        }
        prop_assert_eq!(in_chain_order(&before), in_chain_order(&Flat::original(&words)));
        prop_assert_eq!(strokes_of(&mut lazily, &chain, usize::MAX).len(), before.len());
    }

    #[test]
    fn there_are_no_more_modules_than_before(words in any_words(200), metric in prop::sample::select(&METRICS)) {
        let chain = Multichain::new(&tree_of(&words), metric);
        prop_assert!(chain.items().count() <= words.len(), "{} > {}", chain.items().count(), words.len());
        let mut modules: Vec<u32> = chain.steps().iter().flat_map(|s| s.modules.clone()).collect();
        modules.sort_unstable();
        prop_assert!(modules.windows(2).all(|w| w[0] < w[1]), "each module at most once");
        let kept = |m: usize| modules.binary_search(&(m as u32)).is_ok();
        prop_assert!(words.iter().enumerate().all(|(m, w)| kept(m) || matches!(w.role(), Role::Open | Role::Close)));
        prop_assert_eq!(chain.saves(), chain.items().filter(|i| matches!(i, Item::Save(_))).count());
    }

    /// The first from the root, every later one from a state that an earlier one saved, each to a leaf.
    #[test]
    fn every_level_is_one_path(words in any_words(120), metric in prop::sample::select(&METRICS)) {
        let chain = Multichain::new(&tree_of(&words), metric);
        for n in 1..=chain.levels() {
            let level = chain.level(n);
            prop_assert_eq!(level[0].restore.is_some(), n > 1);
            // Within a level, only a tail makes it necessary to go back, by one branch.
            prop_assert!(level.windows(3).all(|w| w[2].restore.is_none() || w[2].restore == w[0].save && w[1].save.is_none()));
            prop_assert!(level.last().unwrap().save.is_none());
            let saved: Vec<u32> = chain.first(n - 1).iter().filter_map(|s| s.save).collect();
            prop_assert!(level[0].restore.is_none_or(|number| saved.contains(&number)));
        }
    }
}

/// What a stream says of each module of the tests.
fn word<'a>(signs: &'a [Sign]) -> impl Fn(u32) -> Word<'a> {
    |stored| {
        let Sign { name, length } = &signs[stored as usize];
        Word { name, params: length.as_slice() }
    }
}

/// The tree that has been received, drawn.
fn drawn(receiver: &Receiver) -> Vec<Stroke> {
    let sign = |stored| {
        let Word { name, params } = receiver.word(stored).unwrap();
        Sign { name: name.to_owned(), length: params.first().copied() }
    };
    let signs: Vec<Sign> = (0..receiver.modules() as u32).map(sign).collect();
    strokes_of(&mut Levels::new(Flat::new(&signs)), receiver.chain(), usize::MAX)
}

proptest! {
    #[test]
    fn every_prefix_of_a_stream_is_a_tree(words in any_words(60), metric in prop::sample::select(&METRICS)) {
        let chain = Multichain::new(&tree_of(&words), metric);
        let bytes = stream::write(&chain, word(&words)).unwrap();
        let whole = strokes_of(&mut Levels::new(Flat::new(&words)), &chain, usize::MAX);
        let mut piecewise = Receiver::default();
        let mut levels = 0;
        for cut in 0..=bytes.len() {
            let prefix = Receiver::read(&bytes[..cut]).unwrap();
            prop_assert!(whole.starts_with(&drawn(&prefix)));
            prop_assert_eq!(prefix.chain(), piecewise.chain());
            prop_assert_eq!(prefix.reception(), piecewise.reception());
            prop_assert!(prefix.whole_levels() >= levels);
            levels = prefix.whole_levels();
            prop_assert_eq!(prefix.chain().first(levels), chain.first(levels).iter().zip(prefix.chain().steps()).map(|(step, got)| {
                Step { modules: got.modules.clone(), ..step.clone() }
            }).collect::<Vec<_>>());
            if let Reception::MidModule { offset, bytes: waiting } = prefix.reception() {
                prop_assert_eq!(offset + waiting, cut);
            }
            piecewise.push(&bytes[cut..(cut + 1).min(bytes.len())]).unwrap();
        }
        prop_assert_eq!(piecewise.reception(), Reception::Whole);
        prop_assert_eq!(levels, chain.levels());
        prop_assert_eq!(drawn(&piecewise), whole);
        prop_assert_eq!(in_chain_order(&drawn(&piecewise)), in_chain_order(&Flat::original(&words)));
    }

    #[test]
    fn damaged_streams_are_refused_or_read_but_never_fatal(words in any_words(60), harm in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)) {
        let chain = Multichain::new(&tree_of(&words), Metric::BranchingLength);
        let mut bytes = stream::write(&chain, word(&words)).unwrap();
        harm.iter().for_each(|(at, byte)| *at.get_mut(&mut bytes) = *byte);
        let mut receiver = Receiver::default();
        let _ = receiver.push(&bytes);
        let held = receiver.chain().steps().iter().flat_map(|s| s.modules.clone());
        prop_assert!(held.eq(0..receiver.modules() as u32));
    }
}

#[test]
fn a_cut_in_mid_module_is_said_and_a_broken_stream_refused() {
    let words = words("F(1)[+F(2)][-F(3)]");
    let chain = Multichain::new(&tree_of(&words), Metric::BranchingLength);
    let bytes = stream::write(&chain, word(&words)).unwrap();
    // Magic 5, branch 3, symbol 4, module 1 + 8.
    assert_eq!(Receiver::read(&bytes[..15]).unwrap().reception(), Reception::MidModule { offset: 12, bytes: 3 });
    assert_eq!(Receiver::read(&bytes[..21]).unwrap().reception(), Reception::BetweenModules);
    assert_eq!(Receiver::read(&bytes).unwrap().reception(), Reception::Whole);
    let refused = |bytes: &[u8]| Receiver::read(bytes).unwrap_err().to_string();
    assert!(refused(b"SBMX").contains("byte 0 does not begin"));
    assert!(refused(&[&bytes[..], &[0]].concat()).contains("follows the end"));
    assert!(refused(b"SBMC\x01\x06").contains("byte 5 has a symbol that was never introduced"));
    assert!(refused(b"SBMC\x01\x03\x00\x00\x01\x00").contains("byte 8 restores a state"));
    assert!(refused(b"SBMC\x01\x03\xff\xff\xff\xff\x0f\x00").contains("more brackets"));
    assert!(refused(&[b"SBMC\x01".as_slice(), &[0xff; 10]].concat()).contains("64 bits"));
}
