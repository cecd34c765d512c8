//! `nearfar gallery`: pictures that are there are not made again, and the page holds them.

use std::path::PathBuf;
use std::process::{Command, Output};

use crate::support::Folder;

const SCENE: &str = r#"[camera]
eye = [0, 1, 2]
target = [0, 0, 0]
width = 8
height = 8

[[mesh]]
file = "card.obj"

[[light]]
type = "sky"
radiance = [1, 1, 1]
"#;

/// A folder with one scene of the gallery, which is only a card.
struct Checkout(Folder);

impl Checkout {
    fn new(name: &str) -> Self {
        let folder = Folder::new(&format!("gallery-{name}"));
        let card = "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n";
        folder.file("scenes/cornell-box/card.obj", card);
        folder.file("scenes/cornell-box/cornell-box.toml", SCENE);
        Self(folder)
    }
    fn gallery(&self, more: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_nearfar"))
            .args(["gallery", "--quick", "--size", "16x8", "--spp", "2", "-o", "out"])
            .args(more)
            .current_dir(&self.0)
            .env("NEARFAR_SHARED", "nowhere")
            .output()
            .unwrap()
    }
    fn picture(&self, name: &str) -> PathBuf {
        self.0.join("out/cornell-box").join(name)
    }
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn it_goes_on_where_it_stopped() {
    let checkout = Checkout::new("whole");
    let first = checkout.gallery(&[]);
    assert_eq!(first.status.code(), Some(0), "{}", told(&first));
    assert!(told(&first).contains("0 of 4 pictures are there"), "{}", told(&first));
    assert_eq!(String::from_utf8_lossy(&first.stdout), "out/index.html\n");
    for name in ["decomposition", "irradiance-cache", "point-based", "truth"] {
        for extension in ["exr", "json", "key"] {
            let file = checkout.picture(&format!("{name}.{extension}"));
            assert!(file.is_file(), "{}", file.display());
        }
    }
    let film = nearfar::film::read_exr(&checkout.picture("truth.exr")).unwrap();
    assert_eq!((film.width, film.height), (8, 8), "square scenes get the height");
    let page = std::fs::read_to_string(checkout.0.join("out/index.html")).unwrap();
    assert!(page.contains("Cornell box") && page.contains("point-based"));

    let again = checkout.gallery(&[]);
    assert!(told(&again).contains("4 of 4 pictures are there"), "{}", told(&again));
    std::fs::remove_file(checkout.picture("point-based.key")).unwrap();
    let one = checkout.gallery(&[]);
    assert!(told(&one).contains("[1/1] cornell-box: point-based"), "{}", told(&one));

    // A truth that was begun by the same key goes on.
    let key = std::fs::read_to_string(checkout.picture("truth.key")).unwrap();
    std::fs::rename(checkout.picture("truth.key"), checkout.picture("truth.begun")).unwrap();
    let resumed = checkout.gallery(&[]);
    assert!(told(&resumed).contains("[1/1] cornell-box: truth"), "{}", told(&resumed));
    assert_eq!(std::fs::read_to_string(checkout.picture("truth.key")).unwrap(), key);
    assert!(!checkout.picture("truth.begun").exists());

    // Another scene file: all is made anew, and what fails is named.
    let scene = checkout.0.join("scenes/cornell-box/cornell-box.toml");
    std::fs::write(&scene, format!("{SCENE}[settings.point_based]\nbounces = 1000\n")).unwrap();
    let failed = checkout.gallery(&[]);
    assert!(
        failed.status.code() == Some(3) && told(&failed).contains("cornell-box/point-based"),
        "{}",
        told(&failed)
    );
}

#[test]
fn wrong_places_and_names_are_told() {
    let checkout = Checkout::new("wrong");
    let unknown = checkout.gallery(&["--only", "castle"]);
    assert!(unknown.status.code() == Some(2) && told(&unknown).contains("atrium-night"));
    let absent = checkout.gallery(&["--only", "interior"]);
    assert!(absent.status.code() == Some(2) && told(&absent).contains("scenes/"));
    assert!(!checkout.0.join("out").exists());
}
