//! What is in the gallery: which scenes, in which order, and which pictures of each.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// A scene of the gallery.
#[derive(Debug)]
pub(super) struct SceneEntry {
    /// Folder below `scenes`, or file below `tests/references`.
    pub(super) name: &'static str,
    /// Title of its section.
    pub(super) title: &'static str,
    /// Text below that.
    pub(super) text: &'static str,
    /// Pictures are as wide as they are high.
    square: bool,
    /// With the point-based method: in the full gallery, in the quick one.
    cloud: [bool; 2],
    /// With pictures along alpha.
    sweep: bool,
    /// With the ways to find out whether near surfaces are seen.
    visibility: bool,
    /// With hand-placed lights, uncorrected and corrected.
    by_hand: bool,
    /// Read from `tests/references`; its meshes are not in the checkout.
    outside: bool,
}

const PLAIN: SceneEntry = SceneEntry {
    name: "",
    title: "",
    text: "A model given from outside.",
    square: false,
    cloud: [false; 2],
    sweep: false,
    visibility: false,
    by_hand: false,
    outside: false,
};
const OUTSIDE: SceneEntry = SceneEntry { outside: true, ..PLAIN };

/// In the page's order.
static SCENES: [SceneEntry; 14] = [
    SceneEntry {
        name: "cornell-box",
        title: "Cornell box",
        text: "The published box.",
        square: true,
        cloud: [true; 2],
        ..PLAIN
    },
    SceneEntry {
        name: "atrium",
        title: "Atrium",
        text: "Sun and sky from above; light reaches the arcades after several bounces.",
        cloud: [true, false],
        ..PLAIN
    },
    SceneEntry {
        name: "atrium-night",
        title: "Atrium at night",
        text: "Dozens of lamps.",
        ..PLAIN
    },
    SceneEntry {
        name: "cathedral-day",
        title: "Cathedral by day",
        text: "Sun through the windows.",
        ..PLAIN
    },
    SceneEntry {
        name: "cathedral-night",
        title: "Cathedral by night",
        text: "Hundreds of small lights.",
        ..PLAIN
    },
    SceneEntry {
        name: "interior",
        title: "Interior",
        text: "A hall full of mouldings, all its light through the windows of the gallery behind \
               the colonnade.",
        cloud: [true, false],
        sweep: true,
        ..PLAIN
    },
    SceneEntry {
        name: "sky-plaza",
        title: "Plaza under an HDR sky",
        text: "Lit by an environment map alone.",
        ..PLAIN
    },
    SceneEntry {
        name: "manually-lit",
        title: "Lit by hand",
        text: "Hand-placed lights and a flat ambient term.",
        by_hand: true,
        ..PLAIN
    },
    SceneEntry {
        name: "nested-slats",
        title: "Failure case: nested slats",
        text: "Boxes of slats inside one another: most near surfaces are hidden by nearer ones.",
        square: true,
        sweep: true,
        visibility: true,
        ..PLAIN
    },
    SceneEntry {
        name: "foliage",
        title: "Failure case: foliage",
        text: "Leaves hide one another.",
        visibility: true,
        ..PLAIN
    },
    SceneEntry { name: "sponza_day", title: "Sponza by day", ..OUTSIDE },
    SceneEntry { name: "sponza_night", title: "Sponza by night", ..OUTSIDE },
    SceneEntry { name: "veach_ajar", title: "The door ajar", ..OUTSIDE },
    SceneEntry { name: "dining_room", title: "Dining room", ..OUTSIDE },
];

impl SceneEntry {
    /// The scene's file.
    pub(super) fn file(&self) -> PathBuf {
        if self.outside {
            Path::new("tests/references").join(format!("{}.toml", self.name))
        } else {
            self.folder().join(format!("{}.toml", self.name))
        }
    }
    fn folder(&self) -> PathBuf {
        Path::new("scenes").join(self.name)
    }
    /// Files that the pictures depend on: all of the scene's folder but texts and its own pair of
    /// pictures.
    ///
    /// # Errors
    /// [`Error::Io`] when the folder cannot be read.
    pub(super) fn files(&self) -> Result<Vec<PathBuf>> {
        if self.outside {
            return Ok(vec![self.file()]);
        }
        let (mut open, mut files) = (vec![self.folder()], Vec::new());
        while let Some(folder) = open.pop() {
            let io = |source| Error::Io { path: folder.clone(), source };
            for entry in std::fs::read_dir(&folder).map_err(io)? {
                let path = entry.map_err(io)?.path();
                let text = path.extension().is_some_and(|e| e == "md");
                if path.is_dir() {
                    open.push(path);
                } else if !text && !path.ends_with("pair.png") {
                    files.push(path);
                }
            }
        }
        files.sort();
        Ok(files)
    }
}

/// The scenes that are there, of those that are wanted (all when none is named).
///
/// # Errors
/// [`Error::Usage`] for names that are none, and when there is no scene.
pub(super) fn present(only: &[String]) -> Result<Vec<&'static SceneEntry>> {
    let names: Vec<&str> = SCENES.iter().map(|s| s.name).collect();
    if let Some(unknown) = only.iter().find(|o| !names.contains(&o.as_str())) {
        let names = names.join(", ");
        return Err(Error::Usage(format!("--only {unknown}: the scenes are {names}")));
    }
    let shared = std::env::var_os("NEARFAR_SHARED").map_or("../shared".into(), PathBuf::from);
    let outside = shared.join("scenes").is_dir();
    let wanted = |s: &&SceneEntry| only.is_empty() || only.iter().any(|o| o == s.name);
    let found: Vec<&SceneEntry> = SCENES
        .iter()
        .filter(wanted)
        .filter(|s| s.file().is_file() && (outside || !s.outside))
        .collect();
    if found.is_empty() {
        let message = "no scene of the gallery is here: run it in the folder that holds scenes/";
        return Err(Error::Usage(message.into()));
    }
    Ok(found)
}

/// One picture.
#[derive(Debug)]
pub(super) struct Picture {
    pub(super) scene: &'static SceneEntry,
    /// Name of its file.
    pub(super) name: String,
    /// Share of the time, a guess.
    pub(super) weight: f64,
    /// `render` or `reference`.
    pub(super) command: &'static str,
    /// What it is told besides the scene, its size and its files.
    pub(super) options: Vec<String>,
}

/// Name of the ground truths.
pub(super) const TRUTH: &str = "truth";

/// How everything is rendered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    /// Width and height of pictures that are not square.
    pub(super) size: (u32, u32),
    /// Samples per pixel of ground truths.
    pub(super) spp: u32,
    /// Fewer pictures.
    pub(super) quick: bool,
}

impl Plan {
    /// Values of alpha along which pictures are made, per cent of the extent.
    pub(super) fn alphas(&self) -> &'static [f64] {
        if self.quick { &[0.0, 1.0, 2.0, 4.0, 16.0] } else { &[0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0] }
    }

    /// Width and height of a scene's pictures.
    pub(super) fn size_of(&self, scene: &SceneEntry) -> (u32, u32) {
        if scene.square { (self.size.1, self.size.1) } else { self.size }
    }

    /// The pictures of a scene, in the order in which they are made.
    pub(super) fn pictures(&self, scene: &'static SceneEntry) -> Vec<Picture> {
        let mut all = Vec::new();
        let mut add = |name: &str, weight: f64, options: &str| {
            let (command, options) = options.split_once(' ').unwrap_or((options, ""));
            all.push(Picture {
                scene,
                name: name.into(),
                weight,
                command: if command == "reference" { "reference" } else { "render" },
                options: options.split_whitespace().map(str::to_owned).collect(),
            });
        };
        if scene.by_hand {
            let method = "render --method local-correction --half";
            add("uncorrected", 2.0, &format!("{method} --set local.correction=false"));
            add("corrected", 4.0, method);
        }
        add("decomposition", 5.0, "render --aov far,near,location --half");
        add("irradiance-cache", 7.0, "render --method irradiance-cache --aov location --half");
        let spp = self.spp;
        add(TRUTH, 6.0 + f64::from(spp) / 8.0, &format!("reference --spp {spp} --half"));
        if scene.cloud[usize::from(self.quick)] {
            add("point-based", 10.0, "render --method point-based --half");
        }
        if scene.visibility {
            for (how, weight) in [("assumed", 5.0), ("traced", 7.0)] {
                let setting = format!("decompose.near_visibility=\"{how}\"");
                add(how, weight, &format!("render --half --set {setting}"));
            }
        }
        if scene.sweep {
            for alpha in self.alphas() {
                let options = format!("render --alpha {alpha}% --half");
                add(&format!("alpha-{alpha}"), 5.0, &options);
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_have_the_pictures_they_ask_for() {
        let plan = |quick| Plan { size: (640, 360), spp: 64, quick };
        let names = |scene: &str, quick| -> Vec<String> {
            let scene = SCENES.iter().find(|s| s.name == scene).unwrap();
            plan(quick).pictures(scene).into_iter().map(|p| p.name).collect()
        };
        let usual = ["decomposition", "irradiance-cache", "truth"];
        assert_eq!(names("sky-plaza", false), usual);
        assert!(names("atrium", false).contains(&"point-based".to_owned()));
        assert!(!names("atrium", true).contains(&"point-based".to_owned()));
        assert_eq!(names("manually-lit", true)[..2], ["uncorrected", "corrected"]);
        let slats = names("nested-slats", false);
        assert!(slats.contains(&"assumed".to_owned()) && slats.contains(&"alpha-0.5".to_owned()));
        let slats = SCENES.iter().find(|s| s.name == "nested-slats").unwrap();
        assert_eq!(plan(true).size_of(slats), (360, 360));
        let truth = plan(true).pictures(slats).into_iter().find(|p| p.name == TRUTH).unwrap();
        assert_eq!(
            (truth.command, &truth.options[..2]),
            ("reference", &["--spp", "64"].map(String::from)[..])
        );
    }
}
