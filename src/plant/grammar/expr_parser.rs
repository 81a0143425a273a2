//! Expressions from text: C's operators, `^` for powers, `=` and `==` alike. Defined names become numbers at once.

use std::collections::BTreeMap;

use super::cursor::{Cursor, is_word};
use super::expr::{Env, Expr, FUNCTIONS, Op};
use crate::{Error, Result, Seed};

/// The names that an expression may use.
pub struct Scope<'s> {
    /// Names of the rule's parameters, in their order.
    pub variables: &'s [String],
    /// Defined names and their values.
    pub defines: &'s BTreeMap<String, f64>,
    /// Whether `itNum`, `maxIt` and random numbers have a meaning here.
    pub inside_rule: bool,
}

/// Operators by how tightly they bind, loosest first; longer spellings before their beginnings.
const LEVELS: [&[(&str, Op)]; 5] = [
    &[("||", Op::Or), ("|", Op::Or)],
    &[("&&", Op::And), ("&", Op::And)],
    &[
        ("==", Op::Equal),
        ("=", Op::Equal),
        ("!=", Op::Unequal),
        ("<>", Op::Unequal),
        ("<=", Op::AtMost),
        (">=", Op::AtLeast),
        ("<", Op::Less),
        (">", Op::More),
    ],
    &[("+", Op::Add), ("-", Op::Subtract)],
    &[("*", Op::Multiply), ("/", Op::Divide), ("%", Op::Remainder)],
];

/// Deepest nesting: an expression is computed by recursion.
const DEEPEST: u32 = 64;

/// Reads one expression; stops before whatever cannot continue it.
pub fn parse(cursor: &mut Cursor, scope: &Scope) -> Result<Expr> {
    level(cursor, scope, 0, 0)
}

/// Reads an expression that must be a number by itself.
pub fn parse_number(cursor: &mut Cursor, defines: &BTreeMap<String, f64>) -> Result<f64> {
    cursor.skip_space();
    let place = cursor.place();
    let expr = parse(cursor, &Scope { variables: &[], defines, inside_rule: false })?;
    expr.constant().ok_or_else(|| place.error("a number", "an expression that depends on the chain"))
}

fn level(cursor: &mut Cursor, scope: &Scope, loosest: usize, depth: u32) -> Result<Expr> {
    let Some(operators) = LEVELS.get(loosest) else { return unary(cursor, scope, depth) };
    let mut left = level(cursor, scope, loosest + 1, depth)?;
    let mut length = 0;
    loop {
        cursor.skip_space();
        if cursor.at_arrow() {
            return Ok(left);
        }
        let place = cursor.place();
        let Some((_, op)) = operators.iter().find(|(sign, _)| cursor.take(sign)) else { return Ok(left) };
        // A long sum leans to the left, and its tree is as deep as it is long.
        length += 1;
        check_depth(cursor, depth + length)?;
        let right = level(cursor, scope, loosest + 1, depth + length)?;
        left = fold(Expr::Binary(*op, Box::new((left, right)), place))?;
    }
}

fn check_depth(cursor: &mut Cursor, depth: u32) -> Result<()> {
    if depth < DEEPEST { Ok(()) } else { Err(cursor.place().error(format!("at most {DEEPEST} nested operations"), "more")) }
}

fn unary(cursor: &mut Cursor, scope: &Scope, depth: u32) -> Result<Expr> {
    check_depth(cursor, depth)?;
    if !{
        cursor.skip_space();
        cursor.at_arrow()
    } {
        if cursor.take("-") {
            return fold(Expr::Negate(Box::new(unary(cursor, scope, depth + 1)?)));
        }
        if cursor.take("!") {
            return fold(Expr::Not(Box::new(unary(cursor, scope, depth + 1)?)));
        }
    }
    let base = primary(cursor, scope, depth)?;
    cursor.skip_space();
    let place = cursor.place();
    if !cursor.take("^") {
        return Ok(base);
    }
    let exponent = unary(cursor, scope, depth + 1)?;
    fold(Expr::Binary(Op::Power, Box::new((base, exponent)), place))
}

fn primary(cursor: &mut Cursor, scope: &Scope, depth: u32) -> Result<Expr> {
    const EXPECTED: &str = "a number, a name or `(`";
    cursor.skip_space();
    match cursor.peek() {
        Some('(') => {
            let opened = cursor.place();
            cursor.bump();
            cursor.open += 1;
            let inner = level(cursor, scope, 0, depth + 1)?;
            close(cursor, &format!("an operator, or `)` for the `(` in line {}, column {}", opened.line, opened.column))?;
            Ok(inner)
        }
        Some(c) if c.is_ascii_digit() || c == '.' => number(cursor),
        Some(c) if is_word(c) => name(cursor, scope, depth),
        _ => Err(cursor.error(EXPECTED)),
    }
}

/// Takes the `)` of a parenthesis that raised `open`.
pub fn close(cursor: &mut Cursor, expected: &str) -> Result<()> {
    if !cursor.take(")") {
        return Err(cursor.error(expected));
    }
    cursor.open -= 1;
    Ok(())
}

/// `3`, `.5`, `0.25`, `1e-3`.
fn number(cursor: &mut Cursor) -> Result<Expr> {
    let (place, before) = (cursor.place(), cursor.rest());
    cursor.take_while(|c| c.is_ascii_digit() || c == '.');
    let exponent = cursor.rest().strip_prefix(['e', 'E']).map(|r| r.strip_prefix(['+', '-']).unwrap_or(r));
    if exponent.is_some_and(|r| r.starts_with(|c: char| c.is_ascii_digit())) {
        cursor.bump();
        cursor.bump();
        cursor.take_while(|c| c.is_ascii_digit());
    }
    let text = &before[..before.len() - cursor.rest().len()];
    let value = text.parse::<f64>().ok().filter(|v| v.is_finite());
    value.map(Expr::Number).ok_or_else(|| place.error("a finite number", format!("`{text}`")))
}

fn name(cursor: &mut Cursor, scope: &Scope, depth: u32) -> Result<Expr> {
    let place = cursor.place();
    let word = cursor.take_while(is_word);
    if let Some(index) = scope.variables.iter().position(|v| v == word) {
        return Ok(Expr::Variable(index));
    }
    if let Some(value) = scope.defines.get(word) {
        return Ok(Expr::Number(*value));
    }
    match word {
        "itNum" if scope.inside_rule => return Ok(Expr::Step),
        "maxIt" if scope.inside_rule => return Ok(Expr::Steps),
        "true" => return Ok(Expr::Number(1.0)),
        "false" => return Ok(Expr::Number(0.0)),
        _ => {}
    }
    let Some(row) = FUNCTIONS.iter().position(|f| f.0 == word && (scope.inside_rule || word != "random")) else {
        return Err(place.error(known_names(scope), format!("the undefined name `{word}`")));
    };
    let arguments = arguments(cursor, scope, depth)?;
    let (_, arity, _) = FUNCTIONS[row];
    if arguments.len() != arity {
        let found = format!("{} given to `{word}`", plural(arguments.len(), "argument"));
        return Err(place.error(plural(arity, "argument"), found));
    }
    fold(Expr::Call(row, arguments, place))
}

/// `1 parameter`, `2 parameters`.
pub fn plural(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// `(a, b)`.
pub fn arguments(cursor: &mut Cursor, scope: &Scope, depth: u32) -> Result<Vec<Expr>> {
    if !cursor.take("(") {
        return Err(cursor.error("`(`"));
    }
    cursor.open += 1;
    let mut arguments = vec![level(cursor, scope, 0, depth + 1)?];
    while cursor.take(",") {
        arguments.push(level(cursor, scope, 0, depth + 1)?);
    }
    close(cursor, "an operator, `,` or `)`")?;
    Ok(arguments)
}

fn known_names(scope: &Scope) -> String {
    let mut names: Vec<&str> = scope.variables.iter().map(String::as_str).collect();
    names.extend(scope.defines.keys().map(String::as_str));
    names.extend(scope.inside_rule.then_some(["itNum", "maxIt"]).into_iter().flatten());
    names.truncate(12);
    format!("a number, a function or one of the names {}", names.join(", "))
}

/// Computes what can be computed already.
fn fold(expr: Expr) -> Result<Expr> {
    let constant = match &expr {
        Expr::Negate(inner) | Expr::Not(inner) => inner.constant().is_some(),
        Expr::Binary(_, sides, _) => sides.0.constant().is_some() && sides.1.constant().is_some(),
        Expr::Call(row, arguments, _) => FUNCTIONS[*row].0 != "random" && arguments.iter().all(|a| a.constant().is_some()),
        _ => false,
    };
    if !constant {
        return Ok(expr);
    }
    let env = Env::new(&[], (0.0, 0.0), Seed(0), 0);
    if let Some((place, why)) = expr.fault(&mut env.clone()) {
        return Err::<Expr, Error>(place.unwrap_or_default().error("a finite number", why));
    }
    Ok(Expr::Number(expr.value(&mut env.clone())))
}
