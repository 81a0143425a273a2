//! Models of other programs: whatever glTF and OBJ allow is read as it is meant, and no broken file does harm.

use std::path::{Path, PathBuf};

use glam::Vec3;
use sphereboard::files;
use sphereboard::model::{bounds, import};

/// The shared meshes with this ending; a visible line when they are not there.
fn shared_meshes(ending: &str) -> Vec<PathBuf> {
    let Some(folder) = files::shared_folder().map(|folder| folder.join("meshes")).filter(|folder| folder.is_dir()) else {
        println!("SKIPPED: the shared meshes are not there");
        return Vec::new();
    };
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.retain(|path| path.extension().is_some_and(|e| e == ending));
    found.sort();
    found
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap().to_string_lossy().into_owned()
}

#[test]
fn the_shared_glb_trees_are_read() {
    for path in shared_meshes("glb") {
        let imported = import::open(&path).unwrap();
        let [wood, leaves] = &imported.parts[..] else { panic!("two parts") };
        let (branch_triangles, leaf_quads, height_m) = match stem(&path).as_str() {
            "eztree_ash_medium" => (9120, 5440, 77.387),
            "eztree_oak_medium" => (3166, 5320, 64.732),
            "eztree_pine_medium" => (10_032, 4920, 51.138),
            other => panic!("what is {other}?"),
        };
        assert_eq!((wood.surface.mesh.triangles.len(), leaves.surface.mesh.triangles.len()), (branch_triangles, 2 * leaf_quads));
        assert_eq!((wood.material.alpha_cutoff, leaves.material.alpha_cutoff), (None, Some(0.5)));
        assert_eq!((wood.name.as_str(), wood.material.name.as_str(), leaves.name.as_str()), ("branches", "branches", "leaves"));
        assert!(imported.parts.iter().all(|part| part.material.texture.is_some() && !part.surface.uvs.is_empty()));
        assert!((bounds(&imported.parts).unwrap().max.y - height_m).abs() < 1e-3, "{path:?}");
        assert!(imported.warnings.is_empty() && imported.tree_model.is_none());
        assert!(imported.parts.iter().flat_map(|p| &p.surface.normals).all(|n: &Vec3| n.is_normalized()));
    }
}

#[test]
fn the_shared_obj_trees_are_read() {
    for path in shared_meshes("obj") {
        let imported = import::open(&path).unwrap();
        let [bark, leaves] = &imported.parts[..] else { panic!("two parts") };
        let (bark_triangles, leaf_quads) = match stem(&path).as_str() {
            "quaternius_Birch_1" => (1210, 552),
            "quaternius_Pine_1" => (148, 258),
            "quaternius_Tree_1" => (444, 180),
            other => panic!("what is {other}?"),
        };
        assert_eq!(bark.surface.mesh.triangulated().count(), bark_triangles);
        assert_eq!((leaves.surface.mesh.triangles.len(), leaves.surface.mesh.quads.len()), (0, leaf_quads));
        assert_eq!((bark.material.alpha_cutoff, leaves.material.alpha_cutoff), (None, Some(0.5)));
        assert!(imported.parts.iter().all(|part| part.material.texture.is_some() && !part.surface.uvs.is_empty()));
        assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
        assert!(imported.parts.iter().flat_map(|p| &p.surface.normals).all(|n: &Vec3| n.is_normalized()));
    }
}
