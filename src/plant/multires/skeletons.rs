//! From a grown chain to its levels as skeletons: the multichain read by the same turtle that draws the chain itself (Lluch03 §5.4).

use super::levels::{LevelTurtle, Levels};
use super::stream::{self, Word};
use super::transition::{between, split_level};
use super::{Metric, Multichain, Receiver, Role, WeightedTree};
use crate::plant::turtle::State;
use crate::plant::{Action, Alphabet, Chain, Command, Grammar, Growth, Module, Polygon, Skeleton, Symbol, Turtle, TurtleParams};
use crate::{Error, Result, Seed};

/// The weighted tree of a chain. Wood is what the grammar's table calls a step forward, as long as the turtle would draw it, noise apart.
///
/// # Errors
/// As [`WeightedTree::parse`]; and for a chain with SAVE or RESTORE in it, which is a multichain already.
pub fn weighted_tree(chain: &Chain, grammar: &Grammar, params: &TurtleParams) -> Result<WeightedTree> {
    let commands = commands(chain, grammar);
    let (mut roles, mut scale, mut outer) = (Vec::with_capacity(chain.len()), params.length_scale, vec![]);
    for (position, module) in chain.iter().enumerate() {
        let Command { action, defaults } = &commands[module.symbol.index()];
        let first = module.params.first().or(defaults.first()).copied();
        roles.push(match action {
            Action::Push => {
                outer.push(scale);
                Role::Open
            }
            Action::Pop => {
                scale = outer.pop().unwrap_or(scale);
                Role::Close
            }
            Action::Forward | Action::ForwardPlain => Role::Advance(first.unwrap_or(params.step_m) * scale),
            Action::Lengthen => {
                scale *= first.unwrap_or(params.length_factor);
                Role::Other
            }
            Action::Cut => Role::Cut,
            Action::OpenPolygon => Role::PolygonBegin,
            Action::ClosePolygon => Role::PolygonEnd,
            Action::Save | Action::Restore => {
                return Err(Error::UnreadableChain {
                    position,
                    what: "is a SAVE or RESTORE, so that this is a multichain already",
                });
            }
            _ => Role::Other,
        });
    }
    WeightedTree::parse(roles.into_iter())
}

fn commands(chain: &Chain, grammar: &Grammar) -> Vec<Command> {
    let nothing = || Command { action: Action::Nothing, defaults: vec![] };
    let alphabet = chain.alphabet();
    alphabet.symbols().map(|symbol| grammar.command(alphabet.name(symbol)).unwrap_or_else(nothing)).collect()
}

/// A chain whose modules can be had in any order.
#[derive(Debug, Clone)]
struct Modules<'c> {
    chain: &'c Chain,
    /// Where the parameters of each module begin.
    begins: Vec<u32>,
}

impl<'c> Modules<'c> {
    fn new(chain: &'c Chain) -> Self {
        let arity = |symbol: &Symbol| chain.alphabet().arity(*symbol) as u32;
        let begins =
            chain.symbols().iter().scan(0, |begin, symbol| Some(std::mem::replace(begin, *begin + arity(symbol)))).collect();
        Self { chain, begins }
    }

    fn get(&self, stored: u32) -> Module<'c> {
        let (symbol, begin) = (self.chain.symbols()[stored as usize], self.begins[stored as usize] as usize);
        let alphabet = self.chain.alphabet();
        Module { symbol, name: alphabet.name(symbol), params: &self.chain.params()[begin..begin + alphabet.arity(symbol)] }
    }
}

/// The bytes of a multichain of `chain` ([`stream`]).
///
/// # Errors
/// As [`stream::write`].
pub fn to_bytes(multichain: &Multichain, chain: &Chain) -> Result<Vec<u8>> {
    let modules = Modules::new(chain);
    stream::write(multichain, |stored| {
        let Module { name, params, .. } = modules.get(stored);
        Word { name, params }
    })
}

/// The modules that have been received, as a chain in the order of the stream: what [`SkeletonLevels::of`] wants beside
/// [`Receiver::chain`].
///
/// # Errors
/// [`Error::BrokenStream`] for more symbols, or more parameters, than chains can have.
pub fn received_modules(receiver: &Receiver) -> Result<Chain> {
    let words = || (0..receiver.modules() as u32).filter_map(|stored| receiver.word(stored));
    let mut alphabet = Alphabet::default();
    let full = Error::BrokenStream { offset: 0, what: "begins a stream with more symbols or parameters than an L-system can have" };
    if words().any(|word| alphabet.intern(word.name, word.params.len()).is_none()) {
        return Err(full);
    }
    let mut chain = Chain::new(alphabet.into());
    for Word { name, params } in words() {
        let symbol = chain.alphabet().find(name, params.len()).expect("all symbols were just put in");
        chain.push(symbol, params);
    }
    Ok(chain)
}

/// How much of a skeleton belongs to a level of detail.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Extent {
    /// The first so many bones, leaves among them.
    pub bones: usize,
    /// The first so many polygons.
    pub polygons: usize,
}

/// The turtle of [`draw`](crate::plant::draw), reading a multichain.
#[derive(Debug, Clone)]
pub struct SkeletonTurtle<'c> {
    modules: Modules<'c>,
    commands: Vec<Command>,
    turtle: Turtle,
}

impl LevelTurtle for SkeletonTurtle<'_> {
    type State = State;
    type Mark = Extent;

    fn begin(&mut self, brackets: u32) {
        self.turtle.enter(brackets);
    }

    fn read(&mut self, stored: u32, position: u32) -> Result<()> {
        let module = self.modules.get(stored);
        self.turtle.obey(&self.commands[module.symbol.index()], module, u64::from(position), Growth::DONE)
    }

    fn save(&self) -> State {
        self.turtle.state()
    }

    fn restore(&mut self, state: &State) {
        self.turtle.go_back(*state);
    }

    fn mark(&self) -> Extent {
        let Skeleton { bones, polygons, .. } = self.turtle.so_far();
        Extent { bones: bones.len(), polygons: polygons.len() }
    }

    fn rewind(&mut self, mark: Extent) {
        self.turtle.forget(mark.bones, mark.polygons);
    }
}

/// The levels of detail of a chain, drawn as they are asked for. Bones and polygons are in order of output, so that every level is a
/// prefix of the next; their parents are numbers in the same order. Noise is that of the original chain: all levels together are, but for
/// the order, exactly what [`draw`](crate::plant::draw) makes of it. (A chain between two derivations is read as fully grown.)
#[derive(Debug)]
pub struct SkeletonLevels<'c> {
    multichain: Multichain,
    levels: Levels<SkeletonTurtle<'c>>,
}

impl<'c> SkeletonLevels<'c> {
    /// Sorts the branches of `chain` by `metric`; nothing is drawn yet.
    ///
    /// # Errors
    /// As [`weighted_tree`], and [`Error::Parameter`] for the turtle's parameters.
    pub fn new(chain: &'c Chain, grammar: &Grammar, params: &TurtleParams, seed: Seed, metric: Metric) -> Result<Self> {
        Self::of(Multichain::new(&weighted_tree(chain, grammar, params)?, metric), chain, grammar, params, seed)
    }

    /// The levels of a multichain whose modules stand in `chain`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the turtle's parameters; [`Error::Internal`] for a multichain of another chain.
    pub fn of(multichain: Multichain, chain: &'c Chain, grammar: &Grammar, params: &TurtleParams, seed: Seed) -> Result<Self> {
        if multichain.steps().iter().any(|step| step.modules.end as usize > chain.len()) {
            return Err(Error::Internal { stage: "multichain", what: "it names modules that its chain does not have".to_owned() });
        }
        let turtle = Turtle::new(params, seed)?;
        let turtle = SkeletonTurtle { modules: Modules::new(chain), commands: commands(chain, grammar), turtle };
        Ok(Self { multichain, levels: Levels::new(turtle) })
    }

    /// The multichain.
    pub fn multichain(&self) -> &Multichain {
        &self.multichain
    }

    /// How many levels there are.
    pub fn count(&self) -> usize {
        self.multichain.levels()
    }

    /// Draws level of detail `n` where it is missing, and says how much of [`so_far`](Self::so_far) it is.
    ///
    /// # Errors
    /// [`Error::Turtle`].
    pub fn extent(&mut self, n: usize) -> Result<Extent> {
        self.levels.first(&self.multichain, n)
    }

    /// All bones and polygons drawn so far, without branches (a level has no brackets).
    pub fn so_far(&self) -> &Skeleton {
        self.levels.turtle().turtle.so_far()
    }

    /// Level of detail `n` by itself.
    ///
    /// # Errors
    /// [`Error::Turtle`].
    pub fn skeleton(&mut self, n: usize) -> Result<Skeleton> {
        let Extent { bones, polygons } = self.extent(n)?;
        let all = self.so_far();
        Ok(Skeleton { bones: all.bones[..bones].to_vec(), polygons: all.polygons[..polygons].to_vec(), branches: vec![] })
    }

    /// The tree on its way from level of detail `n` to `m` ≥ `n`, at `t` from 0 to 1: see [`between`]. Polygons grow like leaves.
    ///
    /// # Errors
    /// [`Error::Turtle`].
    pub fn transition(&mut self, n: usize, m: usize, t: f32) -> Result<Skeleton> {
        let (kept, all) = (self.extent(n.min(m))?, self.skeleton(m)?);
        let bones = between(&all.bones, kept.bones, t);
        let t = if t.is_nan() { 1.0 } else { t };
        let grow = |(p, polygon): (usize, &Polygon)| match polygon.parent.map(|b| b as usize) {
            Some(b) if p >= kept.polygons && t < 1.0 => {
                let (was, is) = (all.bones[b].end(), bones[b].end());
                Polygon { corners: polygon.corners.iter().map(|corner| is + t * (*corner - was)).collect(), ..polygon.clone() }
            }
            _ => polygon.clone(),
        };
        let shown = if t <= 0.0 { kept.polygons } else { all.polygons.len() };
        let polygons = all.polygons[..shown].iter().enumerate().map(grow).collect();
        Ok(Skeleton { bones, polygons, branches: vec![] })
    }

    /// The tree at any level between 0 and [`count`](Self::count), whole or not.
    ///
    /// # Errors
    /// [`Error::Turtle`].
    pub fn at(&mut self, level: f64) -> Result<Skeleton> {
        let (n, t) = split_level(level, self.count());
        self.transition(n, n + 1, t)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::Reception;
    use super::*;
    use crate::plant::{Bone, draw};

    const METRICS: [Metric; 4] = [Metric::Children, Metric::Descendants, Metric::LongestPath, Metric::BranchingLength];

    /// A small tree with everything that a turtle knows: leaves, a polygon, widths, scaling, noise.
    fn grammar() -> Grammar {
        Grammar::parse(
            "axiom A(1)\nA(l) -> F(l)\"(0.9)[+(30)!(0.02)A(l*0.8)L][-(25)/(90)A(l*0.7)[&L]]F(l*0.5){.+f(0.1).-f(0.1).}[^(20)A(l*0.5)]'L",
        )
        .unwrap()
    }

    fn params() -> TurtleParams {
        TurtleParams { turn_noise_deg: 3.0, length_noise: 0.1, tropism: 0.1, ..TurtleParams::default() }
    }

    /// Bones whose parents are told by content, in an order that does not depend on theirs.
    fn sorted(skeleton: &Skeleton) -> Vec<String> {
        let bone = |b: &Bone| format!("{b:?} on {:?}", b.parent.map(|p| Bone { parent: None, ..skeleton.bones[p as usize] }));
        let parentless = |b: &Bone| bone(b).replace(&format!("parent: {:?}, kind", b.parent), "kind");
        let mut all: Vec<String> = skeleton.bones.iter().map(parentless).collect();
        all.extend(skeleton.polygons.iter().map(|p| {
            format!("{:?} {:?}", Polygon { parent: None, ..p.clone() }, p.parent.map(|b| parentless(&skeleton.bones[b as usize])))
        }));
        all.sort();
        all
    }

    #[test]
    fn all_levels_together_are_the_tree_that_the_turtle_draws() {
        let grammar = grammar();
        let chain = grammar.derive(4.0, &Default::default(), Seed(3), &mut |_| ()).unwrap();
        let original = draw(&chain, &grammar, &params(), Seed(3), 4.0).unwrap();
        assert!(original.bones.len() > 100 && original.polygons.len() > 10);
        for metric in METRICS {
            let mut levels = SkeletonLevels::new(&chain, &grammar, &params(), Seed(3), metric).unwrap();
            let whole = levels.skeleton(usize::MAX).unwrap();
            assert_eq!(sorted(&whole), sorted(&original), "{metric:?}");
            let half = levels.skeleton(levels.count() / 2).unwrap();
            assert!(whole.bones.starts_with(&half.bones) && whole.polygons.starts_with(&half.polygons));
            assert!(half.bones.len() < whole.bones.len());
        }
    }

    #[test]
    fn a_received_stream_draws_the_same_tree() {
        let grammar = grammar();
        let chain = grammar.derive(3.0, &Default::default(), Seed(3), &mut |_| ()).unwrap();
        let mut sent = SkeletonLevels::new(&chain, &grammar, &params(), Seed(3), Metric::BranchingLength).unwrap();
        let bytes = to_bytes(sent.multichain(), &chain).unwrap();
        let whole = sent.skeleton(usize::MAX).unwrap();
        for length in [0, 7, bytes.len() / 3, bytes.len() - 1, bytes.len()] {
            let receiver = Receiver::read(&bytes[..length]).unwrap();
            let modules = received_modules(&receiver).unwrap();
            let mut levels = SkeletonLevels::of(receiver.chain().clone(), &modules, &grammar, &params(), Seed(3)).unwrap();
            // A polygon that is not closed yet is not drawn.
            let got = levels.skeleton(usize::MAX).unwrap();
            let bones_are_prefix = got.bones.iter().zip(&whole.bones).filter(|(a, b)| a != b).count() <= 1;
            assert!(bones_are_prefix && whole.polygons.starts_with(&got.polygons), "{length} bytes");
            if receiver.reception() == Reception::Whole {
                assert_eq!(got, whole);
            }
        }
    }

    #[test]
    fn the_paper_s_tree_as_a_chain() {
        let chain = Chain::parse("C1[C2[C3[C4][C5[C6][C7]]][C9[C11][C10]][C8]][C12[C13][C14][C15[C16]]]").unwrap();
        let names =
            |m: Module| if m.name.starts_with('C') { Role::Advance(1.0) } else { [Role::Open, Role::Close][m.symbol.index()] };
        let roles: Vec<Role> = chain.iter().map(names).collect();
        let multichain = Multichain::new(&WeightedTree::parse(roles.into_iter()).unwrap(), Metric::BranchingLength);
        let names: Vec<&str> = chain.iter().map(|m| m.name).collect();
        let drawn: Vec<&str> =
            multichain.steps().iter().flat_map(|s| &names[s.modules.start as usize..s.modules.end as usize]).copied().collect();
        assert_eq!(drawn.join(" "), "C1 C2 C3 C5 C6 C9 C11 C12 C15 C16 C4 C7 C10 C13 C8 C14");
    }

    #[test]
    fn a_multichain_is_not_sorted_twice() {
        let (chain, grammar) = (Chain::parse("F SAVE(1) F RESTORE(1) F").unwrap(), grammar());
        assert!(weighted_tree(&chain, &grammar, &params()).unwrap_err().to_string().contains("multichain already"));
    }

    proptest! {
        #[test]
        fn between_levels_nothing_jumps(level in 0.0f64..40.0) {
            let grammar = grammar();
            let chain = grammar.derive(3.0, &Default::default(), Seed(3), &mut |_| ()).unwrap();
            let mut levels = SkeletonLevels::new(&chain, &grammar, &params(), Seed(3), Metric::BranchingLength).unwrap();
            let n = level.floor();
            prop_assert_eq!(levels.at(n).unwrap(), levels.skeleton(n as usize).unwrap());
            let (now, then) = (levels.at(level).unwrap(), levels.at(level + 1e-4).unwrap());
            for (a, b) in now.bones.iter().zip(&then.bones) {
                prop_assert!((a.end() - b.end()).length() < 0.01 && a.end_radius_m <= b.end_radius_m + 1e-6);
            }
            for (a, b) in now.polygons.iter().zip(&then.polygons) {
                prop_assert!(a.corners.iter().zip(&b.corners).all(|(a, b)| (a - b).length() < 0.01));
            }
        }
    }
}
