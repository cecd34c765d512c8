//! Hostile inputs by kind: what is given to the program, and what it may make of it.
//!
//! ```text
//! kind → cases: files in a folder, arguments, what is right → the program → `Case::judge`
//! ```
//! Every case has the same small scene ([`SCENE`], a square under a sky, and its files); a kind
//! replaces one of them or the arguments. Nothing is random: the same cases, always.

mod counts;
mod files;
mod numbers;
mod shapes;
mod words;

use std::path::Path;
use std::process::Command;

use nearfar::film::{Film, read_exr};

use super::Folder;

/// The square; corners (±1, ±1, 0).
pub const SQUARE: &str = "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\n\
                          vt 1 1\nvt 0 1\nvn 0 0 1\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";
/// Its material.
pub const LIBRARY: &str = "newmtl m\nKd 0.5 0.4 0.3\n";
/// Camera, square, sky, lamp.
pub const SCENE: &str = "[camera]\neye = [0, 0, 3]\ntarget = [0, 0, 0]\nwidth = 8\nheight = 6\n\
                         [[mesh]]\nfile = \"a.obj\"\n[[light]]\ntype = \"sky\"\nradiance = 1\n";

/// A thing in the folder of a case.
#[derive(Clone, Debug)]
pub enum Entry {
    /// A file of these bytes.
    File(Vec<u8>),
    /// A folder.
    Folder,
    /// A pipe without a writer.
    Pipe,
    /// A symbolic link to this.
    Link(&'static str),
    /// Nothing: what the folder had is taken away.
    Nothing,
}

impl From<&str> for Entry {
    fn from(text: &str) -> Self {
        Self::File(text.into())
    }
}
impl From<String> for Entry {
    fn from(text: String) -> Self {
        Self::File(text.into())
    }
}
impl From<Vec<u8>> for Entry {
    fn from(bytes: Vec<u8>) -> Self {
        Self::File(bytes)
    }
}

/// What may come of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Right {
    /// The picture of the plain scene, to the bit.
    Plain,
    /// A picture.
    Picture,
    /// A refusal that has this in it.
    Refused(&'static str),
    /// A picture of light, or a refusal.
    Told,
}

/// One input.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its kind and what it is, for messages.
    pub name: String,
    entries: Vec<(String, Entry)>,
    arguments: Vec<String>,
    right: Right,
}

/// A case that renders the scene with some entries replaced.
pub fn case(name: impl Into<String>, right: Right, entries: Vec<(&str, Entry)>) -> Case {
    Case {
        name: name.into(),
        entries: entries.into_iter().map(|(name, e)| (name.to_owned(), e)).collect(),
        arguments: render("s.toml", "direct"),
        right,
    }
}

impl Case {
    /// With other arguments.
    pub fn arguments(mut self, arguments: &[&str]) -> Self {
        self.arguments = arguments.iter().map(|&a| a.to_owned()).collect();
        self
    }
    /// With more of them.
    pub fn and(mut self, arguments: &[&str]) -> Self {
        self.arguments.extend(arguments.iter().map(|&a| a.to_owned()));
        self
    }
    /// By another method.
    pub fn by(mut self, method: &str) -> Self {
        self.arguments = render("s.toml", method);
        self
    }

    /// Makes the folder.
    pub fn folder(&self, name: &str) -> Folder {
        let folder = Folder::new(name);
        for (name, text) in [("a.obj", SQUARE), ("a.mtl", LIBRARY), ("s.toml", SCENE)] {
            folder.file(name, text);
        }
        for (name, entry) in &self.entries {
            let path = folder.join(name);
            let _ = std::fs::remove_file(&path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            match entry {
                Entry::File(bytes) => drop(folder.file(name, bytes)),
                Entry::Folder => std::fs::create_dir_all(&path).unwrap(),
                Entry::Pipe => {
                    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
                }
                Entry::Link(to) => std::os::unix::fs::symlink(to, &path).unwrap(),
                Entry::Nothing => {}
            }
        }
        folder
    }

    /// The program that is to be run in it.
    pub fn program(&self, folder: &Folder) -> Command {
        let mut program = Command::new(env!("CARGO_BIN_EXE_nearfar"));
        program.current_dir(folder).args(&self.arguments);
        program
    }

    /// What is wrong with what came of it, if anything is.
    pub fn judge(&self, folder: &Folder, code: Option<i32>, said: &str) -> Option<String> {
        let out = folder.join("out.exr");
        let fault = match (code, self.right) {
            _ if said.contains("panicked") => Some("panicked".into()),
            (Some(0), Right::Refused(_)) => Some("was accepted".into()),
            (Some(0), right) if out.exists() => picture(&out, right == Right::Plain),
            (Some(0), Right::Told) => None,
            (Some(0), _) => Some("made no picture".into()),
            (Some(2), Right::Plain | Right::Picture) => Some("was refused".into()),
            (Some(2), _) if out.exists() => Some("was refused and left a picture".into()),
            (Some(2), _) if said.trim().is_empty() => Some("was refused without a word".into()),
            (Some(2), Right::Refused(word)) if !said.contains(word) => {
                Some(format!("does not say {word:?}"))
            }
            (Some(2), _) => None,
            (code, _) => Some(format!("ended with {code:?}")),
        };
        fault.map(|fault| format!("{}: {fault}\n  {}", self.name, said.trim()))
    }
}

/// Arguments of a small render.
fn render(scene: &str, method: &str) -> Vec<String> {
    let little = ["record.spp=1", "proxy.photons=500", "decompose.rays=16", "gather.rays=8"];
    let mut all = vec!["render", scene, "-q", "-o", "out.exr", "--method", method];
    little.iter().for_each(|one| all.extend(["--set", one]));
    if method == "path" {
        all.extend(["--spp", "2"]);
    }
    all.into_iter().map(str::to_owned).collect()
}

/// What is wrong with a picture: light that is none, or another than that of the plain scene.
fn picture(path: &Path, plain: bool) -> Option<String> {
    static PLAIN: std::sync::OnceLock<Film> = std::sync::OnceLock::new();
    let film = match read_exr(path) {
        Ok(film) => film,
        Err(e) => return Some(e.to_string()),
    };
    let bad = |c: &glam::Vec3| !c.is_finite() || c.min_element() < 0.0;
    if let Some(c) = film.rgb("").unwrap_or_default().into_iter().find(bad) {
        return Some(format!("shows {c}"));
    }
    let expected = || {
        let case = case("plain", Right::Picture, Vec::new());
        let folder = case.folder("hostile-plain");
        assert!(case.program(&folder).status().unwrap().success());
        read_exr(&folder.join("out.exr")).unwrap()
    };
    (plain && film.rgb("") != PLAIN.get_or_init(expected).rgb(""))
        .then(|| "shows another picture than the plain scene".into())
}

/// All cases, kind by kind; where two kinds have the same one, it is there once.
pub fn cases() -> Vec<Case> {
    let mut all =
        [numbers::cases(), words::cases(), files::cases(), counts::cases(), shapes::cases()]
            .concat();
    let mut names = std::collections::HashSet::new();
    all.retain(|case| names.insert(case.name.clone()));
    all
}
