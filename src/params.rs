//! Parameter tables. A stage declares its parameters once with [`params!`](crate::params!); that one declaration is the struct, its
//! defaults, its validation, its command-line options, its help text and its rows in every report.

use serde::Serialize;

use crate::{Error, Result};

/// What values a parameter takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A real number in `min..=max`.
    Real {
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A whole number in `min..=max`.
    Whole {
        /// Smallest allowed value.
        min: u32,
        /// Largest allowed value.
        max: u32,
    },
    /// A power of two in `min..=max`.
    PowerOfTwo {
        /// Smallest allowed value.
        min: u32,
        /// Largest allowed value.
        max: u32,
    },
    /// One of several words, each with its meaning.
    Choice(&'static [(&'static str, &'static str)]),
}

impl Kind {
    /// The allowed values in words: `0.5 to 3`, `one of low, medium, high`.
    pub fn range(&self) -> String {
        match self {
            Kind::Real { min, max } => format!("{min} to {max}"),
            Kind::Whole { min, max } => format!("a whole number from {min} to {max}"),
            Kind::PowerOfTwo { min, max } => format!("a power of two from {min} to {max}"),
            Kind::Choice(words) => format!("one of {}", words.iter().map(|w| w.0).collect::<Vec<_>>().join(", ")),
        }
    }
}

/// One parameter: everything a user may ask about it.
#[derive(Debug, Clone)]
pub struct ParamSpec {
    /// Field name, `snake_case`; the command line spells it with hyphens.
    pub name: &'static str,
    /// What it does, one or two sentences.
    pub meaning: &'static str,
    /// Allowed values.
    pub kind: Kind,
    /// Unit of the value, empty for pure numbers and choices.
    pub unit: &'static str,
    /// The default, as text that parses back.
    pub default: String,
    /// Where the default comes from: a section of a paper, or "ours: reason".
    pub source: &'static str,
}

impl ParamSpec {
    /// The option's name on the command line, without the dashes.
    pub fn flag(&self) -> String {
        self.name.replace('_', "-")
    }

    /// A value or a range with the unit behind it: `8 px`, `5 to 80°`, `0 to 1`.
    pub fn with_unit(&self, text: &str) -> String {
        let space = if matches!(self.unit, "" | "°") { "" } else { " " };
        format!("{text}{space}{}", self.unit)
    }
}

/// A stage's parameters, as a table that can be walked, set by name and checked.
pub trait ParamSet: Default + Clone + Serialize {
    /// The table, in order of declaration.
    fn specs() -> Vec<ParamSpec>;
    /// Sets one field from text. Errors name the field, its range and the value.
    fn set(&mut self, name: &str, value: &str) -> Result<()>;
    /// Checks every field against its range.
    fn validate(&self) -> Result<()>;
}

/// A type that a parameter can have.
pub trait ParamValue: Sized {
    /// The kind, given the declared range (ignored by choices).
    fn kind(range: Option<(f64, f64)>) -> Kind;
    /// From text.
    fn parse(text: &str) -> Option<Self>;
    /// To text that parses back.
    fn show(&self) -> String;
    /// Whether the value lies in `kind`.
    fn fits(&self, kind: &Kind) -> bool;
}

impl ParamValue for f64 {
    fn kind(range: Option<(f64, f64)>) -> Kind {
        let (min, max) = range.unwrap_or((f64::MIN, f64::MAX));
        Kind::Real { min, max }
    }
    fn parse(text: &str) -> Option<Self> {
        text.parse().ok()
    }
    fn show(&self) -> String {
        self.to_string()
    }
    fn fits(&self, kind: &Kind) -> bool {
        matches!(kind, Kind::Real { min, max } if (*min..=*max).contains(self))
    }
}

impl ParamValue for u32 {
    fn kind(range: Option<(f64, f64)>) -> Kind {
        let (min, max) = range.map_or((0, u32::MAX), |(a, b)| (a as u32, b as u32));
        Kind::Whole { min, max }
    }
    fn parse(text: &str) -> Option<Self> {
        text.parse().ok()
    }
    fn show(&self) -> String {
        self.to_string()
    }
    fn fits(&self, kind: &Kind) -> bool {
        matches!(kind, Kind::Whole { min, max } if (*min..=*max).contains(self))
    }
}

/// A number of texels or the like that has to be a power of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct PowerOfTwo(pub u32);

impl ParamValue for PowerOfTwo {
    fn kind(range: Option<(f64, f64)>) -> Kind {
        let (min, max) = range.map_or((1, 1 << 31), |(a, b)| (a as u32, b as u32));
        Kind::PowerOfTwo { min, max }
    }
    fn parse(text: &str) -> Option<Self> {
        text.parse().ok().map(Self)
    }
    fn show(&self) -> String {
        self.0.to_string()
    }
    fn fits(&self, kind: &Kind) -> bool {
        matches!(kind, Kind::PowerOfTwo { min, max } if self.0.is_power_of_two() && (*min..=*max).contains(&self.0))
    }
}

/// Parses `value` into `field`, or says what was expected. Used by the code that [`params!`](crate::params!) writes.
pub fn set_field<T: ParamValue>(field: &mut T, spec: &ParamSpec, value: &str) -> Result<()> {
    match T::parse(value).filter(|v| v.fits(&spec.kind)) {
        Some(v) => {
            *field = v;
            Ok(())
        }
        None => Err(refusal(spec, if value.is_empty() { "empty".to_owned() } else { value.to_owned() })),
    }
}

/// Checks `field` against its range. Used by the code that [`params!`](crate::params!) writes.
pub fn check_field<T: ParamValue>(field: &T, spec: &ParamSpec) -> Result<()> {
    if field.fits(&spec.kind) { Ok(()) } else { Err(refusal(spec, field.show())) }
}

fn refusal(spec: &ParamSpec, found: String) -> Error {
    Error::Parameter { name: format!("--{}", spec.flag()), expected: spec.with_unit(&spec.kind.range()), found }
}

/// Declares a stage's parameter struct and implements [`ParamSet`] for it.
///
/// ```
/// sphereboard::params! {
///     /// How a thing is smoothed.
///     pub struct SmoothParams {
///         /// Radius of the kernel.
///         radius_px: f64 = 2.0, in 0.0..=50.0, unit "px", source "ours: two pixels hide sensor noise";
///     }
/// }
/// use sphereboard::params::ParamSet;
/// let mut p = SmoothParams::default();
/// assert!(p.set("radius_px", "51").unwrap_err().to_string().contains("--radius-px must be 0 to 50 px, but is 51"));
/// ```
#[macro_export]
macro_rules! params {
    ($(#[$outer:meta])* pub struct $name:ident {
        $( $(#[doc = $meaning:literal])+ $field:ident : $ty:ty = $default:expr, $(in $min:literal ..= $max:literal,)?
           unit $unit:literal, source $source:literal; )+
    }) => {
        $(#[$outer])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name { $( $(#[doc = $meaning])+ pub $field: $ty, )+ }

        impl Default for $name {
            fn default() -> Self {
                Self { $( $field: $default, )+ }
            }
        }

        impl $crate::params::ParamSet for $name {
            fn specs() -> Vec<$crate::params::ParamSpec> {
                use $crate::params::ParamValue;
                vec![ $( $crate::params::ParamSpec {
                    name: stringify!($field),
                    meaning: concat!($($meaning),+).trim(),
                    kind: {
                        #[allow(unused_mut, unused_assignments)]
                        let mut range = None;
                        $( range = Some(($min as f64, $max as f64)); )?
                        <$ty as ParamValue>::kind(range)
                    },
                    unit: $unit,
                    default: { let value: $ty = $default; value.show() },
                    source: $source,
                }, )+ ]
            }

            fn set(&mut self, name: &str, value: &str) -> $crate::Result<()> {
                let specs = Self::specs();
                let spec = |field| specs.iter().find(|s| s.name == field).expect("the table holds every field");
                match name {
                    $( stringify!($field) => $crate::params::set_field(&mut self.$field, spec(stringify!($field)), value), )+
                    _ => Err($crate::Error::UnknownParameter {
                        name: name.to_owned(),
                        known: specs.iter().map(|s| s.name).collect::<Vec<_>>().join(", "),
                    }),
                }
            }

            fn validate(&self) -> $crate::Result<()> {
                let specs = Self::specs();
                let spec = |field| specs.iter().find(|s| s.name == field).expect("the table holds every field");
                $( $crate::params::check_field(&self.$field, spec(stringify!($field)))?; )+
                Ok(())
            }
        }
    };
}

/// Declares an enum whose variants are words on the command line, usable as a parameter's type.
#[macro_export]
macro_rules! choices {
    ($(#[$outer:meta])* pub enum $name:ident { $( #[doc = $meaning:literal] $variant:ident = $word:literal, )+ }) => {
        $(#[$outer])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        pub enum $name { $( #[doc = $meaning] #[serde(rename = $word)] $variant, )+ }

        impl $crate::params::ParamValue for $name {
            fn kind(_: Option<(f64, f64)>) -> $crate::params::Kind {
                const WORDS: &[(&str, &str)] = &[ $( ($word, $meaning.trim_ascii()), )+ ];
                $crate::params::Kind::Choice(WORDS)
            }
            fn parse(text: &str) -> Option<Self> {
                match text { $( $word => Some(Self::$variant), )+ _ => None }
            }
            fn show(&self) -> String {
                match self { $( Self::$variant => $word.to_owned(), )+ }
            }
            fn fits(&self, _: &$crate::params::Kind) -> bool {
                true
            }
        }
    };
}
