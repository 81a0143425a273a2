//! The paper's example, and what holds for every tree.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;
use crate::Result;

/// A module of the tests: brackets, or a name and a length; `+` and `-` turn.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Word {
    pub name: String,
    pub length: Option<f64>,
}

impl Word {
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
pub(super) fn words(text: &str) -> Vec<Word> {
    let mut words: Vec<Word> = vec![];
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
        words.push(Word { name: name.to_owned(), length: c.is_alphabetic().then_some(length) });
        rest = after;
    }
    words
}

pub(super) fn tree_of(words: &[Word]) -> WeightedTree {
    WeightedTree::parse(words.iter().map(Word::role)).unwrap()
}

/// Chain (3) of the paper; its text is lost from the shared copy, the issue has it.
const CHAIN_3: &str = "C1[C2[C3[C4][C5[C6][C7]]][C9[C11][C10]][C8]][C12[C13][C14][C15[C16]]]";

/// One level as the paper writes it: a state has the number of the branch that saved it.
fn written(chain: &Multichain, words: &[Word], level: usize) -> String {
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
        let levels: Vec<Vec<u32>> =
            (1..=chain.levels()).map(|n| chain.level(n).iter().map(|s| branch_at[&s.position]).collect()).collect();
        assert_eq!(levels, literal(tree, metric), "{metric:?}");
    }
}

/// A chain of advances of few different lengths (so that ties abound), turns and brackets, led by a wood module.
pub(super) fn any_words(max: usize) -> impl Strategy<Value = Vec<Word>> {
    let sign = prop_oneof![4 => Just('['), 4 => Just(']'), 5 => Just('F'), 1 => Just('+'), 1 => Just('-')];
    let length = prop_oneof![Just(0.0), Just(1.0), Just(1.0), Just(2.0), Just(0.1), Just(0.3)];
    prop::collection::vec((sign, length), 0..max).prop_map(|signs| {
        let (mut words, mut open) = (vec![Word { name: "F".into(), length: Some(1.0) }], 0);
        for (sign, length) in signs {
            match sign {
                '[' => open += 1,
                ']' if open == 0 => continue,
                ']' => open -= 1,
                _ => {}
            }
            words.push(Word { name: sign.to_string(), length: (sign == 'F').then_some(length) });
        }
        words.extend(std::iter::repeat_n(Word { name: "]".into(), length: None }, open));
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
    words: &'a [Word],
    state: FlatState,
    stack: Vec<FlatState>,
}

#[derive(Debug, Clone, Default)]
pub(super) struct FlatState {
    at: [f64; 2],
    heading: f64,
    depth: u32,
    on: Option<u32>,
}

impl<'a> Flat<'a> {
    pub fn new(words: &'a [Word]) -> Self {
        Self { words, state: FlatState::default(), stack: vec![] }
    }

    /// The whole chain, read as it stands.
    pub fn original(words: &'a [Word]) -> Vec<Stroke> {
        let (mut turtle, mut strokes) = (Self::new(words), vec![]);
        (0..words.len() as u32).for_each(|m| turtle.read(m, m, &mut strokes).unwrap());
        strokes
    }
}

impl LevelTurtle for Flat<'_> {
    type State = FlatState;
    type Shape = Stroke;

    fn begin(&mut self, depth: u32) {
        self.state.depth = depth;
    }

    fn read(&mut self, stored: u32, position: u32, strokes: &mut Vec<Stroke>) -> Result<()> {
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
                strokes.push(Stroke { from: at, length, heading, depth, module: position, on });
                self.state.on = Some(strokes.len() as u32 - 1);
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
}

/// Strokes in the order of their modules, standing on modules instead of strokes: what two orders of output have in common.
pub(super) fn in_chain_order(strokes: &[Stroke]) -> Vec<Stroke> {
    let module_of = |on: Option<u32>| on.map(|s| strokes[s as usize].module);
    let mut sorted: Vec<Stroke> = strokes.iter().map(|s| Stroke { on: module_of(s.on), ..*s }).collect();
    sorted.sort_by_key(|s| s.module);
    sorted
}

/// A trunk of `n / 2` pieces with a twig at each fork; twigs of three lengths.
fn caterpillar(n: usize) -> Vec<Word> {
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
            let strokes = lazily.first(&chain, n).unwrap().to_vec();
            prop_assert!(strokes.starts_with(&before));
            prop_assert_eq!(&strokes[before.len()..], lazily.level(&chain, n).unwrap());
            prop_assert!(strokes.iter().enumerate().all(|(s, stroke)| stroke.on.is_none_or(|on| (on as usize) < s)));
            before = strokes;
        }
        prop_assert_eq!(in_chain_order(&before), in_chain_order(&Flat::original(&words)));
        prop_assert_eq!(lazily.first(&chain, usize::MAX).unwrap().len(), before.len());
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
    }

    /// The first from the root, every later one from a state that an earlier one saved, each to a leaf.
    #[test]
    fn every_level_is_one_path(words in any_words(120), metric in prop::sample::select(&METRICS)) {
        let chain = Multichain::new(&tree_of(&words), metric);
        for n in 1..=chain.levels() {
            let level = chain.level(n);
            prop_assert_eq!(level[0].restore.is_some(), n > 1);
            prop_assert!(level[1..].iter().all(|step| step.restore.is_none()));
            prop_assert!(level.last().unwrap().save.is_none());
            let saved: Vec<u32> = chain.first(n - 1).iter().filter_map(|s| s.save).collect();
            prop_assert!(level[0].restore.is_none_or(|number| saved.contains(&number)));
        }
    }
}
