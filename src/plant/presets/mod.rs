//! The trees that come with the program: L-systems in our text format, each with the bark and the leaves it wears. Metres.
//!
//! All of them are built alike. Axes grow by a segment per derivation and set out side axes on the way, whose lengths follow the
//! crown's outline; the ages given are those at which nothing grows any more, and every younger age is a younger tree.

use super::grammar::Grammar;
use super::mesh::{BarkKind, LeafKind};
use crate::{Error, Result};

/// A tree that comes with the program.
#[derive(Debug, Clone, Copy)]
pub struct Preset {
    /// What the command line calls it.
    pub name: &'static str,
    /// What a gardener calls it.
    pub common: &'static str,
    /// Its L-system.
    pub text: &'static str,
    /// Its leaves' picture.
    pub leaf: LeafKind,
    /// Its bark's picture.
    pub bark: BarkKind,
    /// What one leaf quad shows.
    pub shows: &'static str,
    /// Leaf quads of the grown tree, whatever the seed.
    pub leaves: usize,
    /// Height of the grown tree, metres, within a tenth whatever the seed.
    pub height_m: f64,
}

/// Every preset, in the order of the contact sheet.
pub const PRESETS: [Preset; 10] = [
    Preset {
        name: "oak",
        common: "English oak (Quercus robur): a broad crown on crooked limbs",
        text: include_str!("oak.lsys"),
        leaf: LeafKind::Lobed,
        bark: BarkKind::Furrowed,
        shows: "a twig end of eight leaves",
        leaves: 20_281,
        height_m: 16.6,
    },
    Preset {
        name: "lime",
        common: "small-leaved lime (Tilia cordata): a round crown",
        text: include_str!("lime.lsys"),
        leaf: LeafKind::Heart,
        bark: BarkKind::Furrowed,
        shows: "a twig of seven leaves",
        leaves: 17_226,
        height_m: 17.0,
    },
    Preset {
        name: "birch",
        common: "silver birch (Betula pendula): white, slender, twigs that hang",
        text: include_str!("birch.lsys"),
        leaf: LeafKind::Birch,
        bark: BarkKind::White,
        shows: "a twig of eleven leaves",
        leaves: 8_140,
        height_m: 17.4,
    },
    Preset {
        name: "willow",
        common: "weeping willow (Salix babylonica): curtains of hanging shoots",
        text: include_str!("willow.lsys"),
        leaf: LeafKind::Narrow,
        bark: BarkKind::Furrowed,
        shows: "a length of shoot with seventeen leaves",
        leaves: 16_184,
        height_m: 13.2,
    },
    Preset {
        name: "acacia",
        common: "umbrella acacia (Vachellia tortilis): a flat crown on spreading stems",
        text: include_str!("acacia.lsys"),
        leaf: LeafKind::Feather,
        bark: BarkKind::Furrowed,
        shows: "one twice-feathered leaf",
        leaves: 8_064,
        height_m: 9.6,
    },
    Preset {
        name: "poplar",
        common: "Lombardy poplar (Populus nigra 'Italica'): a tall column",
        text: include_str!("poplar.lsys"),
        leaf: LeafKind::Oval,
        bark: BarkKind::Furrowed,
        shows: "a twig of nine leaves",
        leaves: 11_970,
        height_m: 24.6,
    },
    Preset {
        name: "pine",
        common: "Scots pine (Pinus sylvestris): separate clouds of needles on a bare red stem",
        text: include_str!("pine.lsys"),
        leaf: LeafKind::Tuft,
        bark: BarkKind::Plated,
        shows: "a tuft of needles at a shoot's end",
        leaves: 7_644,
        height_m: 19.6,
    },
    Preset {
        name: "spruce",
        common: "Norway spruce (Picea abies): a cone of drooping whorls",
        text: include_str!("spruce.lsys"),
        leaf: LeafKind::Spray,
        bark: BarkKind::Smooth,
        shows: "a flat spray of shoots with needles",
        leaves: 15_559,
        height_m: 23.4,
    },
    Preset {
        name: "juniper",
        common: "common juniper (Juniperus communis): a narrow cone, green to the ground",
        text: include_str!("juniper.lsys"),
        leaf: LeafKind::Scale,
        bark: BarkKind::Stringy,
        shows: "a plume of shoots with scales",
        leaves: 12_483,
        height_m: 7.2,
    },
    Preset {
        name: "yew",
        common: "yew (Taxus baccata): wide, dark and dense",
        text: include_str!("yew.lsys"),
        leaf: LeafKind::Yew,
        bark: BarkKind::Stringy,
        shows: "a flat twig of needles",
        leaves: 48_160,
        height_m: 12.6,
    },
];

/// The preset of that name.
pub fn preset(name: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| preset.name == name)
}

impl Preset {
    /// Its L-system, read.
    ///
    /// # Errors
    /// [`Error::Internal`] when its text is wrong, which the tests rule out.
    pub fn grammar(&self) -> Result<Grammar> {
        Grammar::parse(self.text)
            .map_err(|cause| Error::Internal { stage: "plant::presets", what: format!("{}: {cause}", self.name) })
    }
}
