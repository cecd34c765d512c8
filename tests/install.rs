//! The program finds the Embree that lies beside it, wherever the checkout went.
#![cfg(all(target_os = "linux", feature = "embree"))]

use std::path::{Path, PathBuf};
use std::process::Command;

const PROGRAM: &str = env!("CARGO_BIN_EXE_nearfar");

/// Where the loader finds Embree and its TBB for a program.
fn libraries(program: &Path) -> Vec<PathBuf> {
    // The test runner's own library path must not help.
    let output = Command::new("ldd").arg(program).env_remove("LD_LIBRARY_PATH").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(!text.contains("not found"), "{text}");
    text.lines()
        .filter_map(|line| line.trim().split_once(" => "))
        .filter(|(name, _)| name.starts_with("libembree4") || name.starts_with("libtbb"))
        .map(|(_, found)| found.split(" (").next().unwrap().into())
        .collect()
}

#[test]
fn an_installed_program_needs_no_checkout() {
    let own = libraries(Path::new(PROGRAM));
    assert!(own.len() >= 2, "Embree and TBB: {own:?}");
    let of_system = |p: &PathBuf| p.starts_with("/lib") || p.starts_with("/usr/lib");
    if own.iter().all(of_system) {
        eprintln!("skipped: Embree is the system's");
        return;
    }
    let prefix = std::env::temp_dir().join(format!("nearfar-install-{}", std::process::id()));
    let made = Command::new("make")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env_remove("DESTDIR")
        .args(["install", "CARGO=true"])
        .arg(format!("PROGRAM={PROGRAM}"))
        .arg(format!("PREFIX={}", prefix.display()))
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));

    let moved = prefix.with_extension("moved");
    std::fs::rename(&prefix, &moved).unwrap();
    let installed = moved.join("bin/nearfar");
    let found = libraries(&installed);
    assert_eq!(found.len(), own.len(), "{found:?}");
    for library in &found {
        let real = library.canonicalize().unwrap();
        assert!(real.starts_with(&moved), "{} is not beside the program", real.display());
    }
    let version = Command::new(&installed).env_clear().arg("--version").output().unwrap();
    assert!(version.status.success() && version.stdout.starts_with(b"nearfar "), "{version:?}");
    std::fs::remove_dir_all(moved).unwrap();
}
