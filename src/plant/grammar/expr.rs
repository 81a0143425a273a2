//! Arithmetic, comparison and boolean expressions over a rule's parameters (Lluch03 §3.1; Prusinkiewicz & Lindenmayer 1990, §1.10.1).
//!
//! Everything is an `f64`; true is 1, and what is not 0 is true. An operation without a result (a division by zero) gives NaN, which
//! runs through to the end, where [`Expr::fault`] finds its place: the way without errors pays nothing for them.

use super::cursor::Place;
use crate::Seed;
use crate::seed::Draws;

/// An operation with two sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Op {
    Or,
    And,
    Equal,
    Unequal,
    Less,
    AtMost,
    More,
    AtLeast,
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
    Power,
}

/// A function: its name, how many arguments, what it computes. Angles are degrees, as the turtle's.
pub const FUNCTIONS: [(&str, usize, Function); 15] = [
    ("abs", 1, Function::Plain(|a| a[0].abs())),
    ("sqrt", 1, Function::Plain(|a| a[0].sqrt())),
    ("exp", 1, Function::Plain(|a| a[0].exp())),
    ("ln", 1, Function::Plain(|a| a[0].ln())),
    ("floor", 1, Function::Plain(|a| a[0].floor())),
    ("ceil", 1, Function::Plain(|a| a[0].ceil())),
    ("round", 1, Function::Plain(|a| a[0].round())),
    ("sign", 1, Function::Plain(|a| if a[0] == 0.0 { 0.0 } else { a[0].signum() })),
    ("sin", 1, Function::Plain(|a| a[0].to_radians().sin())),
    ("cos", 1, Function::Plain(|a| a[0].to_radians().cos())),
    ("tan", 1, Function::Plain(|a| a[0].to_radians().tan())),
    ("atan2", 2, Function::Plain(|a| a[0].atan2(a[1]).to_degrees())),
    ("min", 2, Function::Plain(|a| a[0].min(a[1]))),
    ("max", 2, Function::Plain(|a| a[0].max(a[1]))),
    ("random", 2, Function::Random),
];

/// What a function does with its arguments.
#[derive(Debug, Clone, Copy)]
pub enum Function {
    Plain(fn(&[f64; 2]) -> f64),
    /// Uniform between the two.
    Random,
}

/// An expression as a tree; the parser bounds its depth.
#[derive(Debug, Clone)]
pub enum Expr {
    Number(f64),
    /// A parameter of the rule, by place: first those of the left context, then the predecessor's own, then the right context's.
    Variable(usize),
    /// The number of the derivation that is being applied, from 1 to `maxIt`: so Lluch03's rule `itNum = maxIt` fires in the last.
    Step,
    /// How many derivations there will be.
    Steps,
    Negate(Box<Expr>),
    Not(Box<Expr>),
    Binary(Op, Box<(Expr, Expr)>, Place),
    /// A row of [`FUNCTIONS`].
    Call(usize, Vec<Expr>, Place),
}

/// What an expression is computed from.
#[derive(Debug, Clone)]
pub struct Env<'v> {
    pub variables: &'v [f64],
    pub step: f64,
    pub steps: f64,
    /// The module's own random numbers.
    pub draws: Draws,
}

impl<'v> Env<'v> {
    /// `seed` is the derivation's own, `position` the module's place in the chain.
    pub fn new(variables: &'v [f64], (step, steps): (f64, f64), seed: Seed, position: u64) -> Self {
        Self { variables, step, steps, draws: seed.keyed("", position) }
    }
}

fn truth(value: bool) -> f64 {
    f64::from(u8::from(value))
}

/// NaN stays NaN, everything else becomes 0 or 1.
fn as_truth(value: f64) -> f64 {
    if value.is_nan() { value } else { truth(value != 0.0) }
}

impl Expr {
    /// The value; NaN or infinite where there is none, and then [`Expr::fault`] says why.
    pub fn value(&self, env: &mut Env) -> f64 {
        match self {
            Expr::Number(value) => *value,
            Expr::Variable(index) => env.variables.get(*index).copied().unwrap_or(f64::NAN),
            Expr::Step => env.step,
            Expr::Steps => env.steps,
            Expr::Negate(inner) => -inner.value(env),
            Expr::Not(inner) => {
                let value = inner.value(env);
                if value.is_nan() { value } else { truth(value == 0.0) }
            }
            Expr::Binary(op, sides, _) => binary(*op, &sides.0, &sides.1, env),
            Expr::Call(row, arguments, _) => {
                let mut values = [0.0; 2];
                for (value, argument) in values.iter_mut().zip(arguments) {
                    *value = argument.value(env);
                }
                call(*row, &values, arguments.len(), env)
            }
        }
    }

    /// Whether its value hangs on nothing.
    pub fn constant(&self) -> Option<f64> {
        if let Expr::Number(value) = self { Some(*value) } else { None }
    }

    /// The innermost operation without a finite result, and why; `None` when all is well. Computes everything anew with the same
    /// random numbers, so `env` must be as it was.
    pub fn fault(&self, env: &mut Env) -> Option<(Option<Place>, String)> {
        let (children, place): (Vec<&Expr>, _) = match self {
            Expr::Negate(inner) | Expr::Not(inner) => (vec![inner], None),
            // The right side of a decided `and` or `or` is not computed.
            Expr::Binary(op @ (Op::And | Op::Or), sides, place) => {
                let left = sides.0.value(&mut env.clone());
                let decided = !left.is_nan() && (left != 0.0) == (*op == Op::Or);
                (if decided { vec![&sides.0] } else { vec![&sides.0, &sides.1] }, Some(*place))
            }
            Expr::Binary(_, sides, place) => (vec![&sides.0, &sides.1], Some(*place)),
            Expr::Call(_, arguments, place) => (arguments.iter().collect(), Some(*place)),
            _ => (vec![], None),
        };
        let mut inside = env.clone();
        for child in children {
            let before = inside.clone();
            if !child.value(&mut inside).is_finite() {
                return child.fault(&mut before.clone()).map(|(at, why)| (at.or(place), why));
            }
        }
        let value = self.value(env);
        (!value.is_finite()).then(|| (place, self.reason(value)))
    }

    fn reason(&self, value: f64) -> String {
        match self {
            Expr::Binary(Op::Divide | Op::Remainder, ..) if value.is_nan() => "a division by zero".to_owned(),
            Expr::Call(row, ..) => format!("{} of a value for which it is not defined", FUNCTIONS[*row].0),
            _ if value.is_nan() => "no number (NaN)".to_owned(),
            _ => "a number too large".to_owned(),
        }
    }
}

fn binary(op: Op, left: &Expr, right: &Expr, env: &mut Env) -> f64 {
    let a = left.value(env);
    match op {
        Op::Or | Op::And if a.is_nan() => return a,
        Op::Or if a != 0.0 => return 1.0,
        Op::And if a == 0.0 => return 0.0,
        _ => {}
    }
    let b = right.value(env);
    let compared = |holds: bool| if a.is_nan() || b.is_nan() { f64::NAN } else { truth(holds) };
    match op {
        Op::Or | Op::And => as_truth(b),
        Op::Equal => compared(a == b),
        Op::Unequal => compared(a != b),
        Op::Less => compared(a < b),
        Op::AtMost => compared(a <= b),
        Op::More => compared(a > b),
        Op::AtLeast => compared(a >= b),
        Op::Add => a + b,
        Op::Subtract => a - b,
        Op::Multiply => a * b,
        Op::Divide if b == 0.0 => f64::NAN,
        Op::Divide => a / b,
        Op::Remainder => a % b,
        Op::Power => a.powf(b),
    }
}

fn call(row: usize, values: &[f64; 2], count: usize, env: &mut Env) -> f64 {
    // min and max would lose a NaN.
    if values[..count].iter().any(|v| v.is_nan()) {
        return f64::NAN;
    }
    match FUNCTIONS[row].2 {
        Function::Plain(compute) => compute(values),
        Function::Random => values[0] + (values[1] - values[0]) * env.draws.unit(),
    }
}
