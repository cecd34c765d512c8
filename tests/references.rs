//! The scenes of the references load, and show what the references showed.

use std::path::{Path, PathBuf};

use nearfar::load::load;
use nearfar::tessellate::Geometry;

fn shared() -> Option<PathBuf> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared");
    let path = PathBuf::from(std::env::var("NEARFAR_SHARED").unwrap_or_else(|_| default.into()));
    if !path.join("scenes").is_dir() {
        eprintln!("skipped: no reference models at {}", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn scenes_of_the_references_load() {
    if shared().is_none() {
        return;
    }
    for (name, triangles, size, lights) in [
        ("cornell", 32, (256, 256), 0),
        ("sponza_day", 66_450, (320, 180), 2),
        ("sponza_night", 66_450, (320, 180), 11),
        ("veach_ajar", 51_658, (320, 180), 0),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/references")
            .join(format!("{name}.toml"));
        let loaded = load(&path, &[]).unwrap();
        assert_eq!(loaded.warnings, Vec::<String>::new(), "{name}");
        let scene = &loaded.scene;
        assert_eq!(
            scene.meshes.iter().map(|m| m.triangles.len()).sum::<usize>(),
            triangles,
            "{name}"
        );
        assert_eq!(
            ((scene.camera.width, scene.camera.height), scene.lights.len()),
            (size, lights),
            "{name}"
        );
        assert!(
            scene.meshes.iter().all(|m| m.normals.is_empty())
                && scene.materials.iter().all(|m| m.opacity == 1.0),
            "{name}"
        );
        assert!(Geometry::new(scene).len() > triangles * 9 / 10, "{name}");
    }
}
