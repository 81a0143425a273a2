//! CSV with any usual delimiter; the first line names the columns.

use csv::{ByteRecord, ReaderBuilder};

use super::{Collector, Column, Coordinates, Inventory, Row, number, refused, said};
use crate::Result;

/// What a list needs.
const EXPECTED: &str = "a first line that names columns x and y, lon and lat, or easting and northing";

/// Reads a table.
pub fn read(bytes: &[u8]) -> Result<Inventory> {
    let first = bytes.split(|b| *b == b'\n').next().unwrap_or_default();
    let delimiter = [b',', b';', b'\t', b'|'].into_iter().max_by_key(|d| (first.iter().filter(|b| *b == d).count(), *d == b','));
    let delimiter = delimiter.unwrap_or(b',');
    let mut reader = ReaderBuilder::new().delimiter(delimiter).flexible(true).has_headers(false).from_reader(bytes);
    let mut record = ByteRecord::new();
    let unreadable = |error: csv::Error| refused("a table", error.to_string());
    if !reader.read_byte_record(&mut record).map_err(unreadable)? {
        return Err(refused(EXPECTED, "an empty file".to_owned()));
    }
    let columns: Vec<Option<Column>> = record.iter().map(|name| Column::called(&String::from_utf8_lossy(name))).collect();
    // The first that is called so; a list that has both kinds of coordinates means metres.
    let place = |column: Column| columns.iter().position(|c| *c == Some(column));
    let (at, coordinates) = match (place(Column::East), place(Column::North), place(Column::Longitude), place(Column::Latitude)) {
        (Some(east), Some(north), _, _) => ([east, north], Coordinates::Plane),
        (_, _, Some(lon), Some(lat)) => ([lon, lat], Coordinates::Degrees),
        _ => return Err(refused(EXPECTED, format!("`{}`", String::from_utf8_lossy(&first[..first.len().min(80)]).trim()))),
    };
    let (species, photograph) = (place(Column::Name), place(Column::Photograph));
    let (height, crown_width) = (place(Column::Height), place(Column::CrownWidth));
    let comma = delimiter != b',';
    let mut collector = Collector::new(coordinates, "line");
    while reader.read_byte_record(&mut record).map_err(unreadable)? {
        let line = record.position().map_or(0, |at| at.line() as usize + empty_lines(bytes, at.byte()));
        let text = String::from_utf8_lossy;
        let field = |column: Option<usize>| column.and_then(|c| record.get(c)).map(text);
        let [named, shown, high, wide] = [species, photograph, height, crown_width].map(field);
        let row = Row {
            at: at.map(|c| record.get(c).map(text).and_then(|t| number(&t, comma))),
            name: shown.as_deref().and_then(said).or_else(|| named.as_deref().and_then(said)),
            height: high.as_deref().and_then(said),
            crown_width: wide.as_deref().and_then(said),
            comma,
        };
        collector.take(line, &row)?;
    }
    Ok(collector.inventory)
}

/// Empty lines from `at` on: a record is said to begin where the one before it ended.
fn empty_lines(bytes: &[u8], at: u64) -> usize {
    let rest = usize::try_from(at).ok().and_then(|at| bytes.get(at..)).unwrap_or_default();
    rest.iter().take_while(|b| matches!(b, b'\n' | b'\r')).filter(|b| **b == b'\n').count()
}
