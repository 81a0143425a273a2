//! The keys of `view`.

use winit::keyboard::{Key, NamedKey};

use crate::cli::window::keys::{Binding, row};
use crate::render::{Show, Stage};

/// What a key does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// How far the picture is taken.
    Stage(Stage),
    /// Shows that of the surfaces, or how they look again.
    Show(Show),
    /// Lets outlines grow or not.
    Growth,
    /// More or less wind, m/s.
    Wind(f64),
    /// The next backdrop.
    Background,
    /// Turns the sun round the tree, °.
    TurnSun(f32),
    /// Lifts the sun, °.
    LiftSun(f32),
    /// Turns the viewer round the tree or himself, °.
    Turn(f32),
    /// Lifts the viewer or his look, °.
    Lift(f32),
    /// Goes nearer (below 1) or farther, as a factor of the distance; walking, forward or back.
    Approach(f32),
    /// Walking, to the right by metres; in orbit, turns.
    Sidestep(f32),
    /// Between orbit and walking.
    Walk,
    /// Back to where it began.
    Home,
    /// Saves the picture.
    Screenshot,
    /// Shows or hides the text.
    Help,
    /// Closes the window.
    Quit,
}

/// All keys.
pub const KEYS: &[Binding<Action>] = &[
    row(Key::Character("1"), "1", Action::Stage(Stage::Unshaped), "surfaces as they are (She fig. 15b)"),
    row(Key::Character("2"), "2", Action::Stage(Stage::Reshaped), "grown outlines (fig. 15c)"),
    row(Key::Character("3"), "3", Action::Stage(Stage::Antialiased), "smoothed edges (fig. 15d)"),
    row(Key::Character("4"), "4", Action::Stage(Stage::Lit), "light (fig. 15e)"),
    row(Key::Character("g"), "g", Action::Growth, "growth of outlines on or off"),
    row(Key::Character("f"), "f", Action::Show(Show::Wireframe), "wireframe on or off"),
    row(Key::Character("n"), "n", Action::Show(Show::Normals), "normals on or off"),
    row(Key::Character("l"), "l", Action::Show(Show::Levels), "colours of levels of detail on or off"),
    row(Key::Named(NamedKey::ArrowLeft), "arrows", Action::Turn(-5.0), "turn and lift the view (or drag)"),
    row(Key::Named(NamedKey::ArrowRight), "", Action::Turn(5.0), ""),
    row(Key::Named(NamedKey::ArrowUp), "", Action::Lift(5.0), ""),
    row(Key::Named(NamedKey::ArrowDown), "", Action::Lift(-5.0), ""),
    row(Key::Character("w"), "w s a d", Action::Approach(0.9), "nearer, farther, left, right (or wheel)"),
    row(Key::Character("s"), "", Action::Approach(1.0 / 0.9), ""),
    row(Key::Character("a"), "", Action::Sidestep(-1.0), ""),
    row(Key::Character("d"), "", Action::Sidestep(1.0), ""),
    row(Key::Named(NamedKey::Tab), "tab", Action::Walk, "orbit or walk"),
    row(Key::Named(NamedKey::Home), "home", Action::Home, "back to the first view"),
    row(Key::Character("["), "[ ]", Action::TurnSun(-10.0), "turn the sun"),
    row(Key::Character("]"), "", Action::TurnSun(10.0), ""),
    row(Key::Character("-"), "- +", Action::LiftSun(-5.0), "lower or raise the sun"),
    row(Key::Character("+"), "", Action::LiftSun(5.0), ""),
    row(Key::Character("="), "", Action::LiftSun(5.0), ""),
    row(Key::Character(","), ", .", Action::Wind(-2.0), "less or more wind"),
    row(Key::Character("."), "", Action::Wind(2.0), ""),
    row(Key::Character("b"), "b", Action::Background, "next backdrop"),
    row(Key::Character("p"), "p", Action::Screenshot, "save the picture"),
    row(Key::Character("h"), "h", Action::Help, "show or hide this text"),
    row(Key::Named(NamedKey::Escape), "esc", Action::Quit, "close"),
];

#[cfg(test)]
mod tests {
    #[test]
    fn no_two_rows_have_the_same_key_and_every_row_is_found() {
        crate::cli::window::keys::check(super::KEYS);
    }
}
