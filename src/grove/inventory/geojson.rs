//! GeoJSON (RFC 7946): the points of a FeatureCollection, one after another, so that a million of them need no tree of values.

use std::cell::RefCell;
use std::fmt;

use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

use super::{Collector, Column, Coordinates, Inventory, Row, refused, said};
use crate::{Error, Result};

#[derive(Deserialize)]
struct Feature {
    geometry: Option<Value>,
    properties: Option<Map<String, Value>>,
}

/// Reads a collection of points.
pub fn read(bytes: &[u8]) -> Result<Inventory> {
    let into = Into(RefCell::new(State { collector: Collector::new(Coordinates::Degrees, "feature"), seen: 0, failed: None }));
    let mut json = serde_json::Deserializer::from_slice(bytes);
    let read = Collection(&into).deserialize(&mut json);
    let state = into.0.into_inner();
    if let Some(error) = state.failed {
        return Err(error);
    }
    let plane = read.map_err(|error| refused("a GeoJSON FeatureCollection of points", error.to_string()))?;
    let mut inventory = state.collector.inventory;
    if plane {
        inventory.coordinates = Coordinates::Plane;
    } else {
        // Degrees were taken for granted; what cannot be some is told now that the whole file is known.
        let wrong = |e: &super::Entry| !(e.at[0].abs() <= 180.0 && e.at[1].abs() <= 90.0);
        for entry in inventory.entries.iter().filter(|e| wrong(e)) {
            inventory.skipped.add(entry.line, format!("{}, {} is no longitude and latitude", entry.at[0], entry.at[1]));
        }
        inventory.entries.retain(|e| !wrong(e));
    }
    Ok(inventory)
}

struct State {
    collector: Collector,
    seen: usize,
    /// Too many rows: tells more than the parser's own words.
    failed: Option<Error>,
}

struct Into(RefCell<State>);

/// The whole file; gives whether a `crs` (as files before RFC 7946 have it) names a plane.
struct Collection<'a>(&'a Into);

impl<'de> DeserializeSeed<'de> for Collection<'_> {
    type Value = bool;
    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<bool, D::Error> {
        json.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Collection<'_> {
    type Value = bool;
    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a FeatureCollection")
    }
    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<bool, M::Error> {
        let (mut plane, mut any) = (false, false);
        while let Some(key) = map.next_key::<String>()? {
            match key.as_str() {
                "features" => {
                    map.next_value_seed(Features(self.0))?;
                    any = true;
                }
                "crs" => {
                    let name = map.next_value::<Value>()?.to_string();
                    plane = name.contains("EPSG") && !["4326", "4258", "4269"].iter().any(|number| name.contains(number));
                }
                _ => drop(map.next_value::<serde::de::IgnoredAny>()?),
            }
        }
        if any { Ok(plane) } else { Err(serde::de::Error::missing_field("features")) }
    }
}

struct Features<'a>(&'a Into);

impl<'de> DeserializeSeed<'de> for Features<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<(), D::Error> {
        json.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Features<'_> {
    type Value = ();
    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a list of features")
    }
    fn visit_seq<S: SeqAccess<'de>>(self, mut seq: S) -> Result<(), S::Error> {
        let state = &mut *self.0.0.borrow_mut();
        while let Some(feature) = seq.next_element::<Feature>()? {
            state.seen += 1;
            if let Err(error) = take(&mut state.collector, state.seen, &feature) {
                state.failed = Some(error);
                return Err(serde::de::Error::custom("too many"));
            }
        }
        Ok(())
    }
}

fn take(collector: &mut Collector, number: usize, feature: &Feature) -> Result<()> {
    let geometry = feature.geometry.as_ref();
    let kind = geometry.and_then(|g| g.get("type")).and_then(Value::as_str).unwrap_or("nothing");
    if kind != "Point" {
        collector.inventory.skipped.add(number, format!("it is {kind:.30}, not a Point"));
        return Ok(());
    }
    let coordinate = |axis: usize| geometry.and_then(|g| g.get("coordinates")?.get(axis)?.as_f64());
    let mut row = Row { at: [coordinate(0), coordinate(1)], ..Default::default() };
    let (mut height, mut crown_width, mut species, mut photograph) = (None, None, None, None);
    for (name, value) in feature.properties.iter().flatten() {
        let text = || match value {
            Value::String(text) => Some(text.clone()),
            Value::Number(number) => Some(number.to_string()),
            _ => None,
        };
        let slot = match Column::called(name) {
            Some(Column::Height) => &mut height,
            Some(Column::CrownWidth) => &mut crown_width,
            Some(Column::Name) => &mut species,
            Some(Column::Photograph) => &mut photograph,
            _ => continue,
        };
        *slot = slot.take().or_else(text);
    }
    row.height = height.as_deref().and_then(said);
    row.crown_width = crown_width.as_deref().and_then(said);
    row.name = photograph.as_deref().and_then(said).or_else(|| species.as_deref().and_then(said));
    collector.take_anywhere(number, &row)
}
