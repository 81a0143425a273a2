//! The keys of `grove --interactive`.

use winit::keyboard::{Key, NamedKey};

use super::flight::Way;
use crate::cli::window::keys::{Binding, row};
use crate::render::Show;

/// What a key does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// Flies that way for as long as it is held.
    Fly(Way),
    /// Back onto the scene's path, or off it.
    Path,
    /// The next method that takes the species; with shift the one before.
    Method,
    /// The scene's method again.
    SceneMethod,
    /// Culling stays as it is, or follows the camera again.
    Freeze,
    /// Shows that of the surfaces, or how they look again.
    Show(Show),
    /// Saves the picture.
    Screenshot,
    /// Shows or hides the text.
    Help,
    /// Closes the window.
    Quit,
}

/// All keys.
pub const KEYS: &[Binding<Action>] = &[
    row(Key::Character("w"), "w s a d", Action::Fly(Way::Forward), "fly (or arrows; shift: faster)"),
    row(Key::Character("s"), "", Action::Fly(Way::Back), ""),
    row(Key::Character("a"), "", Action::Fly(Way::Left), ""),
    row(Key::Character("d"), "", Action::Fly(Way::Right), ""),
    row(Key::Named(NamedKey::ArrowUp), "", Action::Fly(Way::Forward), ""),
    row(Key::Named(NamedKey::ArrowDown), "", Action::Fly(Way::Back), ""),
    row(Key::Named(NamedKey::ArrowLeft), "", Action::Fly(Way::Left), ""),
    row(Key::Named(NamedKey::ArrowRight), "", Action::Fly(Way::Right), ""),
    row(Key::Character("q"), "q e", Action::Fly(Way::Down), "down, up (drag: look; wheel: speed)"),
    row(Key::Character("e"), "", Action::Fly(Way::Up), ""),
    row(Key::Character("p"), "p", Action::Path, "follow the scene's path, or stop"),
    row(Key::Character("m"), "m M", Action::Method, "next method, the one before"),
    row(Key::Character("0"), "0", Action::SceneMethod, "the scene's method"),
    row(Key::Character("f"), "f", Action::Freeze, "freeze culling: look from outside"),
    row(Key::Character("l"), "l", Action::Show(Show::Levels), "colours of levels of detail"),
    row(Key::Character("n"), "n", Action::Show(Show::Normals), "normals"),
    row(Key::Character("o"), "o", Action::Show(Show::Wireframe), "wireframe"),
    row(Key::Character("c"), "c", Action::Screenshot, "save the picture"),
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
