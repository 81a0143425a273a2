//! A table of parameters in a scene file, from the same table that makes the command line. A value is set while the reader stands on it, so
//! that a wrong one is told with its own line.

use std::fmt;
use std::marker::PhantomData;

use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error as _, MapAccess, Visitor};

use crate::params::ParamSet;

/// Reads a table, each parameter of which may be missing.
pub fn table<'de, D: Deserializer<'de>, P: ParamSet>(file: D) -> Result<P, D::Error> {
    file.deserialize_map(Whole(PhantomData))
}

struct Whole<P>(PhantomData<P>);

impl<'de, P: ParamSet> Visitor<'de> for Whole<P> {
    type Value = P;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a table of parameters")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<P, A::Error> {
        let mut params = P::default();
        while let Some(name) = map.next_key::<String>()? {
            map.next_value_seed(One { params: &mut params, name: &name })?;
        }
        Ok(params)
    }
}

/// The value of one parameter.
struct One<'a, P> {
    params: &'a mut P,
    name: &'a str,
}

impl<'de, P: ParamSet> DeserializeSeed<'de> for One<'_, P> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, value: D) -> Result<(), D::Error> {
        let text = match toml::Value::deserialize(value)? {
            toml::Value::String(text) => text,
            other => other.to_string(),
        };
        self.params.set(self.name, &text).map_err(D::Error::custom)
    }
}
