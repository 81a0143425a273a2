//! What the turtle can be told (Prusinkiewicz & Lindenmayer 1990, §1.5 and §1.6.3; Truelsen §3.1.2), and which symbols tell it.

/// One thing that a turtle does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Nothing: the symbol is only for rewriting.
    Nothing,
    /// Forward with wood; inside a polygon: forward, and a corner.
    Forward,
    /// Forward without wood; inside a polygon: forward, and a corner.
    Jump,
    /// Forward with wood, never a corner.
    ForwardPlain,
    /// Forward without wood, never a corner.
    JumpPlain,
    /// Left about the up vector.
    TurnLeft,
    /// Right about the up vector.
    TurnRight,
    /// Nose down.
    PitchDown,
    /// Nose up.
    PitchUp,
    /// Left wing down.
    RollLeft,
    /// Left wing up.
    RollRight,
    /// Half a turn about the up vector.
    TurnAround,
    /// Rolls until the left vector is horizontal, upper side up.
    Level,
    /// Truelsen's R: three angles, turn, pitch and roll; the roll comes first, since it chooses the side of the parent.
    Rotate,
    /// A branch begins.
    Push,
    /// The branch ends.
    Pop,
    /// The rest of the branch is dropped.
    Cut,
    /// Diameter of the wood from here on, metres; without parameter: the current one times `width_factor`.
    Width,
    /// Lengths from here on are multiplied; without parameter by `length_factor`.
    Lengthen,
    /// The next tint; with a parameter: that tint.
    Tint,
    /// How strongly wood from here on bends with the tropism.
    Tropism,
    /// A leaf here: its length as a multiple of `leaf_length_m`, and its width over its length.
    Leaf,
    /// A polygon begins.
    OpenPolygon,
    /// A corner of the polygon.
    Corner,
    /// The polygon ends.
    ClosePolygon,
    /// Keeps the state under a number (Lluch03 §5.3).
    Save,
    /// Goes on from the state under that number.
    Restore,
}

/// How a grammar calls an action: its word, the action, most parameters, and whether the word is a symbol without being declared.
const WORDS: [(&str, Action, usize, bool); 30] = [
    ("none", Action::Nothing, 16, false),
    ("F", Action::Forward, 1, true),
    ("f", Action::Jump, 1, true),
    ("G", Action::ForwardPlain, 1, true),
    ("g", Action::JumpPlain, 1, true),
    ("+", Action::TurnLeft, 1, true),
    ("-", Action::TurnRight, 1, true),
    ("&", Action::PitchDown, 1, true),
    ("^", Action::PitchUp, 1, true),
    ("\\", Action::RollLeft, 1, true),
    ("/", Action::RollRight, 1, true),
    ("|", Action::TurnAround, 0, true),
    ("$", Action::Level, 0, true),
    ("R", Action::Rotate, 3, false),
    ("[", Action::Push, 0, true),
    ("]", Action::Pop, 0, true),
    ("%", Action::Cut, 0, true),
    ("!", Action::Width, 1, true),
    ("\"", Action::Lengthen, 1, true),
    ("'", Action::Tint, 1, true),
    ("T", Action::Tropism, 1, false),
    ("L", Action::Leaf, 2, true),
    ("~", Action::Leaf, 2, true),
    ("{", Action::OpenPolygon, 0, true),
    (".", Action::Corner, 0, true),
    ("}", Action::ClosePolygon, 0, true),
    ("SAVE", Action::Save, 1, true),
    ("RESTORE", Action::Restore, 1, true),
    ("leaf", Action::Leaf, 2, false),
    ("tropism", Action::Tropism, 1, false),
];

impl Action {
    /// The action that a command table calls `word`.
    pub fn from_word(word: &str) -> Option<Self> {
        WORDS.iter().find(|w| w.0 == word).map(|w| w.1)
    }

    /// Every word that a command table may use, in order.
    pub fn words() -> impl Iterator<Item = &'static str> {
        WORDS.iter().map(|w| w.0)
    }

    /// Most parameters that it uses.
    pub fn most_parameters(self) -> usize {
        WORDS.iter().find(|w| w.1 == self).map_or(0, |w| w.2)
    }
}

/// An action and the parameters that it has where a module brings none.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// What is done.
    pub action: Action,
    /// With what, when the module has no parameters.
    pub defaults: Vec<f64>,
}

impl Command {
    /// What a symbol means that no command table mentions; `None` for symbols without a meaning of their own.
    pub fn builtin(name: &str) -> Option<Self> {
        let word = WORDS.iter().find(|w| w.0 == name && w.3)?;
        Some(Self { action: word.1, defaults: vec![] })
    }
}
