//! What grammars may say, and what happens when they say something else.

use proptest::prelude::*;

use super::super::derive_tests::{derive, grammar};
use super::super::{Action, Chain};
use super::Grammar;
use crate::Error;

/// The error's line, column and sentence.
fn fault(result: Result<impl Sized, Error>) -> (u32, u32, String) {
    match result {
        Err(error @ Error::Grammar { line, column, .. }) => (line, column, error.to_string()),
        Err(other) => panic!("another kind of error: {other}"),
        Ok(_) => panic!("no error"),
    }
}

#[test]
fn mistakes_name_their_place_and_what_was_expected() {
    let nested = format!("axiom A\nA > {} -> F", "[".repeat(40));
    let cases = [
        // Text, line, column, what the sentence says.
        ("", 1, 1, "expected an axiom"),
        ("A -> A", 1, 7, "expected an axiom"),
        ("axiom A\nA -> B", 2, 6, "undefined symbol `B`"),
        ("axiom A\nA -> F[+A", 2, 10, "`]` for the `[` in line 2, column 7, but found the end of the text"),
        ("axiom A\nA -> F[+A\nF -> FF", 3, 3, "`]` for the `[` in line 2, column 7, but found an arrow"),
        ("axiom A\nA -> F]A", 2, 7, "a `[` before this bracket"),
        ("axiom A(1)\nA(l,w) -> F(l)", 1, 7, "expected `A` with 2 parameters, as in its rule in line 2, but found `A` with 1"),
        ("axiom A\nA -> +(1,2)A", 2, 6, "at most 1 parameter of `+`"),
        ("axiom A(1)\nA(l) -> F(l2)", 2, 11, "one of the names l, itNum, maxIt, but found the undefined name `l2`"),
        ("axiom A(1)\nA(l) : l > -> F", 2, 12, "a number, a name or `(`, but found an arrow"),
        ("axiom A(1)\nA(l) : (l > 2 -> F", 2, 15, "`)` for the `(` in line 2, column 8"),
        ("axiom A\nA -> A : 0.7\nA -> AA : 0.6", 3, 1, "likelihoods that sum to 1 at most, but found a sum of 1.3"),
        ("axiom A\nA -> A : 1.7", 2, 10, "a likelihood from 0 to 1, but found 1.7"),
        ("axiom A\nA : 0.7 -> A", 2, 5, "a likelihood stands behind the successor"),
        ("axiom A\nA -> F\nA -> FF", 3, 1, "the rule in line 2 always applies"),
        ("axiom A\nA -> F(1/0)", 2, 9, "division by zero"),
        ("axiom A(1)\nA(l) -> F(sqrt(-1))", 2, 11, "sqrt of a value for which it is not defined"),
        ("axiom F(1e999)", 1, 9, "a finite number"),
        ("axiom F(1.2.3)", 1, 9, "a finite number"),
        ("axiom A\nLeaf -> A", 2, 1, "declared first: `symbols NAME`), but found 4 of them, L e a f"),
        ("axiom A\nA F", 2, 1, "one symbol to rewrite"),
        ("axiom A\nA = F", 2, 3, "an arrow"),
        ("axiom A\n[ -> F", 2, 1, "a `]` for this bracket"),
        ("axiom A\nA(1) -> F", 2, 3, "a name for the parameter"),
        ("axiom A\nA(x,x) -> F", 2, 5, "a name not used yet"),
        ("axiom F\naxiom F", 2, 7, "one axiom"),
        ("axiom F F) F", 1, 10, "the end of the line, but found `)`"),
        ("axiom F\ncommand X = warp", 2, 13, "one of none F f"),
        ("axiom F\ncommand X = F(1,2)", 2, 13, "at most 1 parameter of `F`"),
        ("axiom F\ncommand ( = F", 2, 9, "a symbol"),
        ("axiom F\ncommand P = [", 2, 9, "brackets to begin and end branches"),
        ("axiom F\nturtle warp = 2", 2, 8, "one of step_m, turn_deg"),
        ("axiom F\nturtle step_m = -2", 2, 8, "step_m of 0 to 1000 m, but found -2"),
        ("axiom F\nage -1", 2, 5, "an age of at least 0"),
        ("axiom F\ndefine 3 = 4", 2, 8, "a name"),
        ("define x = y", 1, 12, "undefined name `y`"),
        ("axiom F(random(0,1))", 1, 9, "undefined name `random`"),
        ("axiom A\nA -> F(min(1))", 2, 8, "expected 2 arguments, but found 1 argument given to `min`"),
        ("axiom F(1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17)", 1, 7, "at most 16 parameters"),
        ("axiom F\nignore [", 2, 8, "symbols other than brackets"),
        ("axiom A\nA[A] < A -> F", 2, 8, "symbols other than brackets"),
        ("axiom A\nA < A > [A -> F", 2, 9, "a `]` for this bracket"),
        (&nested, 2, 37, "at most 32 brackets open in a context"),
    ];
    for (text, line, column, says) in cases {
        let (found_line, found_column, sentence) = fault(Grammar::parse(text));
        assert!(sentence.contains(says), "{text:?}\n{sentence}");
        assert_eq!((found_line, found_column), (line, column), "{text:?}\n{sentence}");
    }
}

#[test]
fn everything_that_a_grammar_may_say() {
    let text = "# A comment.\n title Oak\n\ndefine R = 2 * (1 - 0.5^2)   # 1.5\nsymbols Leaf, B\nignore + -\n\
        command B = F(0.1)\nturtle turn_deg = 30\nage 4\naxiom: A(R, .1)\n\
        A(l,w) : l > 0.1 & !(w > 3) -> F(l)[\n   +(30) Leaf A(l*0.8, w*0.7) # in a branch\n ] : 0.6; B -> Leaf";
    let grammar = grammar(text);
    assert_eq!(grammar.title(), "Oak");
    assert_eq!(grammar.axiom().to_string(), "A(1.5,0.1)");
    assert_eq!((grammar.initial_age(), grammar.turtle().turn_deg), (Some(4.0), 30.0));
    let command = grammar.command("B").expect("in the table");
    assert_eq!((command.action, command.defaults.as_slice()), (Action::Forward, [0.1].as_slice()));
    assert!(grammar.command("A").is_none());
    let grown = derive(&grammar, 1.0, 0).to_string();
    assert_eq!(grown, "F(1.5)[+(30) Leaf A(1.2000000000000002,0.06999999999999999)]");
}

#[test]
fn expressions_follow_the_usual_rules() {
    let value =
        |text: &str| derive(&grammar(&format!("axiom A(2,3)\nA(x,y) -> F({text})")), 1.0, 0).iter().next().map(|m| m.params[0]);
    let cases = [
        ("1+2*3^2", 19.0),
        ("-2^2", -4.0),
        ("2^3^2", 512.0),
        ("2^-1", 0.5),
        ("10-4-3", 3.0),
        ("x/y*y", 2.0),
        ("7 % 4", 3.0),
        ("x < y && y <= 3", 1.0),
        ("x = 2 == 1", 1.0),
        ("x <> 2 || y != 3", 0.0),
        ("!(x > 1)", 0.0),
        ("min(x, y) + max(x, y)*10", 32.0),
        ("floor(2.7) + ceil(2.2) + abs(-1) + sign(-3)", 5.0),
        ("round(100*sin(30)) + cos(180)", 49.0),
        ("random(x, x)", 2.0),
    ];
    for (text, expected) in cases {
        assert_eq!(value(text), Some(expected), "{text}");
    }
}

#[test]
fn chains_read_back() {
    let third = "C1[C2[C3[C4][C5[C6][C7]]][C9[C11][C10]][C8]][C12[C13][C14][C15[C16]]]";
    assert_eq!(Chain::parse(third).expect("Lluch03's chain (3)").to_string(), third);
    let multi = "C1 SAVE(1) C2 SAVE(2) C3C5C6 RESTORE(2) C9";
    assert_eq!(Chain::parse(multi).expect("a multichain").to_string(), multi);
    assert_eq!(Chain::parse("F 1 2").expect("digits").len(), 3);
    assert_eq!(Chain::parse("F1 2\n F").expect("digits").to_string(), "F1 2F");
    assert_eq!(Chain::parse("").expect("nothing").len(), 0);
    assert_eq!(fault(Chain::parse("F[F")).0, 1);
    assert_eq!(fault(Chain::parse("F(x)")).1, 3);
    assert_eq!(fault(Chain::parse("F\n)")).0, 2);
}

fn fixture(name: &str) -> String {
    let path = format!("{}/tests/plant/truelsen/{name}.xml", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).expect("a fixture")
}

#[test]
fn truelsens_four_files() {
    let parse = |name: &str| Grammar::parse_xml(&fixture(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(derive(&parse("algae"), 7.0, 1).len(), 34);
    let stochastic = parse("ab_stochastic");
    assert_eq!((stochastic.initial_age(), stochastic.title()), (Some(2.0), "AB stochastic"));
    assert_eq!(derive(&stochastic, 1.0, 1).to_string(), "AB");
    let plant = parse("fractal_plant");
    assert_eq!(derive(&plant, 1.0, 1).to_string(), "F-[[X]+YF]+F[+FX]-FX");
    assert!(derive(&plant, 2.0, 1).to_string().starts_with("FLFL-[[F-[[X]+YF]+F[+FX]-FX]+"));
    let turn = plant.command("-").expect("a command");
    assert_eq!((turn.action, turn.defaults.as_slice()), (Action::Rotate, [-40.0, -50.0, 60.0].as_slice()));
    // Z becomes X in one of ten derivations and else stays Z.
    let text = fixture("fractal_plant").replace("START=\"X\"", &format!("START=\"{}\"", "Z".repeat(10_000)));
    let young = derive(&Grammar::parse_xml(&text).expect("many Z"), 1.0, 3);
    let becomes = young.iter().filter(|m| m.name == "X").count();
    assert!(becomes.abs_diff(1000) < 180 && young.len() == 10_000, "{becomes}");
    let tree = parse("simple_tree");
    assert!(tree.warnings().is_empty());
    assert_eq!(derive(&tree, 2.0, 1).to_string(), "FFaF[Fa[B]b[B]bFc[B]aF]bF[Fa[B]b[B]bFc[B]aF]bFFcF[Fa[B]b[B]bFc[B]aF]aFF");
}

/// Each printed file, with the corrections that make it the file beside it: before each of them, the error of a line.
#[test]
fn truelsens_misprints_are_errors_with_line_numbers() {
    type Correction = (u32, &'static str, &'static [(&'static str, &'static str)]);
    let files: [(&str, &[Correction]); 4] = [
        (
            "fractal_plant",
            &[
                (24, "a symbol of one character, but found \"[ \"", &[("\"[ \"", "\"[\"")]),
                (15, "a `[` before this bracket", &[("F-[X]+YF]", "F-[[X]+YF]")]),
                (20, "the undefined symbol `p`", &[("P=\"p\"", "P=\"F\"")]),
            ],
        ),
        (
            "simple_tree",
            &[
                (11, "a symbol of one character, but found \"[ \"", &[("CHAR=\"[ \"", "CHAR=\"[\"")]),
                (25, "a symbol of one character, but found \"[ \"", &[("SYMBOL=\"[ \"", "SYMBOL=\"[\"")]),
                (25, "one of the commands F, R, [, ], L, but found \" \"", &[("CMD=\" \"", "CMD=\"[\"")]),
            ],
        ),
        (
            "algae",
            &[
                (3, "well-formed XML", &[("<LSYSTEM_", "<LSYSTEM ")]),
                (5, "well-formed XML", &[("<<", "<")]),
                (
                    5,
                    "well-formed XML",
                    &[("<VARIABLE_", "<VARIABLE "), ("INITIATOR_", "INITIATOR "), ("PRODUCTION_", "PRODUCTION ")],
                ),
                (5, "one of the attributes CHAR, DESC, but found `_DESC`", &[(" _", " ")]),
                (9, "a likelihood from 0 to 1, but found \"\"", &[(" LIKELIHOOD=\"\"", "")]),
            ],
        ),
        (
            "ab_stochastic",
            &[
                (3, "well-formed XML", &[("<LSYSTEM_", "<LSYSTEM ")]),
                (5, "well-formed XML", &[("<VARIABLE_", "<VARIABLE ")]),
                (9, "well-formed XML", &[("INITIATOR_", "INITIATOR ")]),
                (10, "well-formed XML", &[("PRODUCTION_", "PRODUCTION ")]),
            ],
        ),
    ];
    for (name, corrections) in files {
        let mut text = fixture(&format!("{name}_as_printed"));
        for (line, says, mended) in corrections {
            let (found, _, sentence) = fault(Grammar::parse_xml(&text));
            assert!(found == *line && sentence.contains(says), "{name}: {sentence}");
            text = mended.iter().fold(text, |text, (from, to)| text.replace(from, to));
        }
        let mended = Grammar::parse_xml(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
        let by_hand = Grammar::parse_xml(&fixture(name)).expect("a fixture");
        assert_eq!(derive(&mended, 3.0, 1), derive(&by_hand, 3.0, 1), "{name}");
        // Simple tree rewrites what it declares constant: understood, and said.
        assert_eq!(mended.warnings().len(), if name == "simple_tree" { 3 } else { 0 });
    }
}

#[test]
fn other_faults_of_xml() {
    let within = |inside: &str| {
        Grammar::parse_xml(&format!("<LSYSTEM>\n<VARIABLE CHAR=\"A\"/>\n<INITIATOR START=\"A\"/>\n{inside}</LSYSTEM>"))
    };
    assert!(within("").is_ok());
    let cases = [
        ("<TREE/>", "one of the elements VARIABLE"),
        ("5 <VARIABLE CHAR=\"B\"/>", "but found the text `5`"),
        ("<VARIABLE/>", "the attribute CHAR"),
        ("<VARIABLE CHAR=\"A\"/>", "a symbol not declared yet"),
        ("<INITIATOR START=\"A\"/>", "one INITIATOR"),
        ("<PRODUCTION P=\"A\" S=\"AQ\"/>", "undefined symbol `Q`"),
        ("<PRODUCTION P=\"A\" S=\"[A\"/>", "a `]` for this bracket"),
        ("<PRODUCTION P=\"A\" S=\"A\" LIKELIHOOD=\"nan\"/>", "a likelihood from 0 to 1"),
        ("<PRODUCTION P=\"A\" S=\"A\" LIKELIHOOD=\".7\"/><PRODUCTION P=\"A\" S=\"AA\" LIKELIHOOD=\".7\"/>", "sum of 1.4"),
        ("<COMMAND SYMBOL=\"A\" CMD=\"F\" ARG=\"inf\"/>", "numbers with commas"),
        ("<COMMAND SYMBOL=\"A\" CMD=\"R\" ARG=\"1,2,3,4\"/>", "1 to 3 angles"),
        ("<COMMAND SYMBOL=\"A\" CMD=\"F\"><B/></COMMAND>", "nothing inside COMMAND"),
    ];
    for (inside, says) in cases {
        let (line, _, sentence) = fault(within(inside));
        assert!(line == 4 && sentence.contains(says), "{inside}: {sentence}");
    }
    assert!(fault(Grammar::parse_xml("")).2.contains("XML"));
    assert!(fault(Grammar::parse_xml("<LSYSTEM INITAGE=\"-1\"/>")).2.contains("an age"));
    assert!(fault(Grammar::parse_xml("<LSYSTEM/>")).2.contains("an axiom"));
}

proptest! {
    #[test]
    fn no_text_makes_the_parser_panic(text in "([A-C]|F|\\[|\\]|\\(|\\)|->|:|<|>|,|[0-9.]|\\+|-|\\n| |axiom |define |x|=|\\*|/|\\^|!|#|é){0,60}") {
        let _ = Grammar::parse(&text);
        let _ = Grammar::parse(&format!("axiom A\nA -> {text}"));
        let _ = Grammar::parse_xml(&text);
        let _ = Chain::parse(&text);
    }

    #[test]
    fn deep_texts_do_not_overflow(depth in 0usize..20_000) {
        let _ = Grammar::parse(&format!("axiom A\nA -> {}", "[".repeat(depth)));
        let _ = Grammar::parse(&format!("axiom F({}", "(".repeat(depth)));
        let _ = Grammar::parse(&format!("axiom F({}1)", "-".repeat(depth)));
        let _ = Grammar::parse(&format!("axiom F({}1)", "1+".repeat(depth)));
        let _ = Grammar::parse(&format!("axiom F({}1)", "2^".repeat(depth)));
        let _ = Grammar::parse(&format!("axiom A A > {} -> F", "[A".repeat(depth) + &"]".repeat(depth)));
    }
}
