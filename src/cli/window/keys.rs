//! Tables of keys: one drives handling, the text on the screen and the command's help.

use winit::keyboard::Key;

/// A key, its name for people, what it does, and that in words.
pub struct Binding<A> {
    /// As winit tells it, in lower case where it is a character.
    pub key: Key<&'static str>,
    /// What stands on it.
    pub name: &'static str,
    /// What it does.
    pub action: A,
    /// In words; empty where the row above says it for both.
    pub words: &'static str,
}

/// A row of a table.
pub const fn row<A>(key: Key<&'static str>, name: &'static str, action: A, words: &'static str) -> Binding<A> {
    Binding { key, name, action, words }
}

/// What that key does, if anything; a letter is the same key with shift.
pub fn action_of<A: Copy>(keys: &[Binding<A>], key: &Key) -> Option<A> {
    let same = |binding: &&Binding<A>| match (&binding.key, key) {
        (Key::Character(ours), Key::Character(pressed)) => pressed.to_lowercase() == *ours,
        (Key::Named(ours), Key::Named(pressed)) => ours == pressed,
        _ => false,
    };
    keys.iter().find(same).map(|binding| binding.action)
}

/// The table in words, a line for each key or group of keys.
pub fn lines<A>(keys: &[Binding<A>]) -> impl Iterator<Item = String> {
    keys.iter().filter(|b| !b.name.is_empty()).map(|b| format!("{:8}{}", b.name, b.words))
}

/// What a command's help says of its keys.
pub fn help<A>(keys: &[Binding<A>]) -> String {
    lines(keys).fold("Keys:".to_owned(), |text, line| format!("{text}\n  {line}"))
}

/// Asserts what holds for every table: no key twice, every row found, with shift too.
#[cfg(test)]
pub fn check<A: Copy + PartialEq + std::fmt::Debug>(keys: &[Binding<A>]) {
    for (number, binding) in keys.iter().enumerate() {
        assert!(keys[..number].iter().all(|other| other.key != binding.key), "{:?} twice", binding.key);
        let pressed = match binding.key {
            Key::Character(c) => Key::Character(c.to_uppercase().into()),
            Key::Named(name) => Key::Named(name),
            _ => panic!("neither character nor name"),
        };
        assert_eq!(action_of(keys, &pressed), Some(binding.action));
    }
    assert_eq!(action_of(keys, &Key::Character("§".into())), None);
}
