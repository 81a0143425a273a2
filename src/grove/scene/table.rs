//! A table of parameters in a scene file, from the same table that makes the command line. A value is set while the reader stands on it, so
//! that a wrong one is told with its own line.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error as _, MapAccess, Visitor};

use crate::params::ParamSet;
use crate::repr::Settings;

/// Reads a table, each parameter of which may be missing.
pub fn table<'de, D: Deserializer<'de>, P: ParamSet>(file: D) -> Result<P, D::Error> {
    file.deserialize_map(Whole(PhantomData))
}

/// Reads parameters of methods, a table for each.
pub fn settings<'de, D: Deserializer<'de>>(file: D) -> Result<BTreeMap<String, Settings>, D::Error> {
    let tables = BTreeMap::<String, toml::Table>::deserialize(file)?;
    let of_one =
        |table: toml::Table| table.into_iter().fold(Settings::default(), |all, (name, value)| all.with(&name, text_of(value)));
    Ok(tables.into_iter().map(|(method, table)| (method, of_one(table))).collect())
}

/// A value as the command line has it.
fn text_of(value: toml::Value) -> String {
    match value {
        toml::Value::String(text) => text,
        other => other.to_string(),
    }
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
        let text = text_of(toml::Value::deserialize(value)?);
        self.params.set(self.name, &text).map_err(D::Error::custom)
    }
}
