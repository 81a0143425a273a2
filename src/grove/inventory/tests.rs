use super::*;
use proptest::prelude::*;

fn flat(side_m: f32) -> HeightField {
    HeightField::flat(side_m).unwrap()
}

fn species() -> Vec<SpeciesSize> {
    let kind = |name: &str, also: &str, height_m: f32| SpeciesSize {
        name: name.to_owned(),
        also: vec![also.to_owned()],
        share: 1.0,
        height_m,
        crown_width_m: 0.5 * height_m,
        trunk_radius_m: 0.2,
    };
    vec![kind("oak", "English oak (Quercus robur)", 16.0), kind("spruce", "Norway spruce (Picea abies)", 20.0)]
}

fn planted(text: &str, side_m: f32) -> (Vec<Planted>, Vec<Warning>) {
    let inventory = read(text.as_bytes()).unwrap();
    let frame = inventory.frame(None, [side_m; 2]);
    inventory.plant(&frame, &flat(side_m), &species(), &PlantingParams::default(), Seed(1))
}

#[test]
fn a_table_is_planted_where_it_says() {
    let text = "ID;Northing;EASTING;Species;Height [m];note\n1;10,5;-3;Quercus robur;8;x\n2;-20;4;Picea abies;;\n3;0;0;oak;NA;\n";
    let (trees, warnings) = planted(text, 100.0);
    assert_eq!(warnings, []);
    assert_eq!(trees.iter().map(|t| t.species).collect::<Vec<_>>(), [0, 1, 0]);
    assert_eq!((trees[0].position.x, trees[0].position.z, trees[0].scale), (-3.0, -10.5, 0.5));
    assert_eq!((trees[1].position.x, trees[1].position.z, trees[1].scale), (4.0, 20.0, 1.0));
}

#[test]
fn bad_rows_are_told_by_line_and_skipped() {
    let text = "x,y,height,crown_width\n1,2,8,\nNaN,2,8,\n3\n\n4,5,-2,\n4,5,1e9,\n6,7,,4\n900,0,5,\n8,9,tall,\n";
    let (trees, warnings) = planted(text, 100.0);
    assert_eq!(trees.len(), 2);
    assert!([0.5, 0.4].contains(&trees[1].scale), "by its crown, {}", trees[1].scale);
    let told = &warnings[0].message;
    for part in [
        "6 rows",
        "line 3: its place is NaN",
        "line 4: it has no place",
        "line 6: its height is -2",
        "line 7: its height is 1e9",
        "and 1 more",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
}

#[test]
fn files_without_coordinates_are_refused() {
    for text in
        ["", "a,b\n1,2\n", "1,2,3\n", "x\n1\n", "{}", "{\"features\": 3}", "{\"features\": [3]}", "{\"features\": [", "\0\0\u{1}"]
    {
        assert!(read(text.as_bytes()).is_err(), "{text:?}");
    }
    assert!(read(b"lon,height\n1,2\n").unwrap_err().to_string().contains("`lon,height`"));
    assert_eq!(read(b"x,y\n").unwrap().entries.len(), 0);
}

#[test]
fn longitudes_and_latitudes_are_laid_flat_and_it_is_said() {
    let text = "latitude,longitude\n52.0,13.0\n52.001,13.0\n52.0,13.001\n0,0\n";
    let (trees, warnings) = planted(text, 1000.0);
    assert_eq!(trees.len(), 3, "one lies off the ground, in the Gulf of Guinea");
    let (north, east) = (trees[1].position - trees[0].position, trees[2].position - trees[0].position);
    assert!((north.z + 111.2).abs() < 0.5 && north.x == 0.0, "{north}");
    assert!((east.x - 68.46).abs() < 0.5 && east.z == 0.0, "{east}");
    assert!(warnings[0].message.contains("laid flat") && warnings[1].message.contains("line 5"), "{warnings:?}");
}

#[test]
fn a_map_of_the_same_coordinates_places_the_list() {
    let inventory = read(b"x,y\n500010,5799990\n").unwrap();
    let map =
        Georeference { origin: [500_000.0, 5_800_000.0], pixel: [1.0; 2], unit_m: [1.0; 2], geographic: false, epsg: Some(32_633) };
    assert_eq!(inventory.frame(Some(&map), [100.0; 2]).to_scene([500_010.0, 5_799_990.0]), [10.0, 10.0]);
    let centred = inventory.frame(None, [100.0; 2]);
    assert_eq!(centred.to_scene([500_010.0, 5_799_990.0]), [0.0, 0.0]);
    assert!(centred.warning.unwrap().message.contains("about its own middle"));
}

#[test]
fn geojson_points_are_read_and_others_told() {
    let text = r#"{"type": "FeatureCollection", "name": "trees", "features": [
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [7.0, 50.0, 3]}, "properties": {"Species": "Picea abies", "HEIGHT": 10, "q": [1]}},
        {"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[0, 0], [1, 1]]}, "properties": {}},
        {"type": "Feature", "geometry": null, "properties": null},
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": ["a", 2]}, "properties": null},
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [700, 50]}, "properties": {"species": "baobab"}}]}"#;
    let (trees, warnings) = planted(text, 100.0);
    assert_eq!(trees.len(), 1);
    assert_eq!((trees[0].species, trees[0].scale), (1, 0.5));
    let told = warnings.iter().map(|w| w.message.as_str()).collect::<Vec<_>>().join("\n");
    for part in
        ["feature 2: it is LineString", "feature 3: it is nothing", "feature 4: it has no place", "feature 5: 700, 50", "baobab"]
    {
        assert!(told.contains(part), "{part}: {told}");
    }
    let crs = r#"{"features": [{"geometry": {"type": "Point", "coordinates": [700, 50]}}], "crs": {"properties": {"name": "urn:ogc:def:crs:EPSG::25833"}}}"#;
    assert_eq!(read(crs.as_bytes()).unwrap().coordinates, Coordinates::Plane);
}

#[test]
#[ignore = "a timing: run it alone"]
fn a_million_rows() {
    let rows: String = (0..1_000_000).map(|i| format!("{},{},oak,{}.5,7\n", i % 1000 - 500, i / 1000 - 500, 5 + i % 20)).collect();
    let begun = std::time::Instant::now();
    let (trees, warnings) = planted(&format!("x,y,species,height,crown\n{rows}"), 2000.0);
    println!("{} trees from a table in {:?}", trees.len(), begun.elapsed());
    assert!(trees.len() == 1_000_000 && warnings.is_empty());
    let point = |i: u32| {
        format!(
            "{{\"type\":\"Feature\",\"geometry\":{{\"type\":\"Point\",\"coordinates\":[7.{:06},50.{:06}]}},\"properties\":{{\"species\":\"oak\",\"height\":{}}}}}",
            i % 1000,
            i / 1000,
            5 + i % 20
        )
    };
    let text = format!("{{\"features\":[{}]}}", (0..1_000_000).map(point).collect::<Vec<_>>().join(","));
    let begun = std::time::Instant::now();
    println!("{} trees from GeoJSON in {:?}", planted(&text, 2000.0).0.len(), begun.elapsed());
}

proptest! {
    #[test]
    fn any_bytes_are_rows_or_an_error(text in "(x,y|lon;lat|\\{\"features\":\\[)?[\\PC\n,;0-9.-]{0,200}", bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        for input in [text.as_bytes(), &bytes] {
            if let Ok(inventory) = read(input) {
                let frame = inventory.frame(None, [100.0; 2]);
                let (trees, _) = inventory.plant(&frame, &flat(100.0), &species(), &PlantingParams::default(), Seed(1));
                prop_assert!(trees.iter().all(|t| t.position.is_finite() && t.scale.is_finite()));
            }
        }
    }
}
