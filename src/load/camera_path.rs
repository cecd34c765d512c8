//! Camera path files: TOML, a `[[key]]` for every key view.
//!
//! ```toml
//! [[key]]
//! eye = [0, 1.6, 4]
//! target = [0, 1.2, 0]
//! up = [0, 1, 0]               # optional, like vfov_deg: else as in the scene
//! vfov_deg = 45
//! time = 0                     # in all keys, of any unit, rising; or in none: equally spaced
//! ```

use std::path::Path;

use glam::{DVec3, Vec3};
use serde::Deserialize;
use toml::Spanned;

use super::validate::{check_camera, check_lens};
use crate::error::{Error, Result};
use crate::input_file;
use crate::scene::{Camera, CameraPath};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathFile {
    key: Vec<Spanned<KeyEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KeyEntry {
    eye: DVec3,
    target: DVec3,
    up: Option<Vec3>,
    vfov_deg: Option<f32>,
    time: Option<f32>,
}

fn line_at(text: &str, at: usize) -> usize {
    text[..at.min(text.len())].matches('\n').count() + 1
}

/// Reads a camera path; `camera` is the scene's: image size, and what the keys leave out; `origin`
/// is the scene's too.
///
/// # Errors
/// [`Error::Io`]; [`Error::Input`] with the line of what is wrong.
pub fn load_camera_path(file: &Path, camera: &Camera, origin: DVec3) -> Result<CameraPath> {
    parse(file, &input_file::read_text(file)?, camera, origin)
}

fn parse(file: &Path, text: &str, camera: &Camera, origin: DVec3) -> Result<CameraPath> {
    let entries: PathFile = toml::from_str(text).map_err(|e| {
        Error::input(file, e.span().map(|s| line_at(text, s.start)), e.message().replace('\n', " "))
    })?;
    let mut keys: Vec<(f32, Camera)> = Vec::new();
    let (mut line, mut counted) = (1, 0);
    let timed = entries.key.first().is_some_and(|k| k.get_ref().time.is_some());
    for (i, entry) in entries.key.iter().enumerate() {
        // Lines are counted on from the key before: there may be very many.
        let start = entry.span().start.max(counted);
        line += text[counted..start].matches('\n').count();
        counted = start;
        let (line, k) = (Some(line), entry.get_ref());
        let view = Camera {
            eye: (k.eye - origin).as_vec3(),
            target: (k.target - origin).as_vec3(),
            up: k.up.unwrap_or(camera.up),
            vfov_deg: k.vfov_deg.unwrap_or(camera.vfov_deg),
            ..camera.clone()
        };
        check_lens(&view, file, line)?;
        check_camera(&view, file, line)?;
        if timed != k.time.is_some() {
            return Err(Error::input(
                file,
                line,
                "some keys have a time and some have none: give it in all or in none",
            ));
        }
        let time = k.time.unwrap_or(i as f32);
        if !time.is_finite() || keys.last().is_some_and(|last| last.0 >= time) {
            return Err(Error::input(
                file,
                line,
                format!(
                    "time {time} does not come after that of the key before; order the keys by time"
                ),
            ));
        }
        keys.push((time, view));
    }
    CameraPath::new(keys)
        .ok_or_else(|| Error::input(file, None, "no [[key]]: add key views with eye and target"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_faults() {
        let read = |text: &str| parse(Path::new("p.toml"), text, &Camera::default(), DVec3::ZERO);
        let path = read(
            "[[key]]\neye=[0,0,1]\ntarget=[0,0,0]\n\
             [[key]]\neye=[1,0,1]\ntarget=[0,0,0]\nvfov_deg=60\n",
        )
        .unwrap();
        assert_eq!((path.frame(0, 2).vfov_deg, path.frame(1, 2).vfov_deg), (45.0, 60.0));
        let two = |a: &str, b: &str| {
            format!(
                "[[key]]\neye=[0,0,1]\ntarget=[0,0,0]\n{a}\n\
                 [[key]]\neye=[1,0,1]\ntarget=[0,0,0]\n{b}\n"
            )
        };
        for (text, expected) in [
            (two("time=1", "time=1"), "p.toml:5: time 1 does not come after"),
            (two("time=1", ""), "p.toml:5: some keys have a time"),
            (two("", "vfov_deg=180"), "p.toml:5: camera vfov_deg"),
            (two("", "zoom=3"), "p.toml:8: unknown field `zoom`"),
            (
                "[[key]]\neye=[0,0,0]\ntarget=[0,0,0]\n".into(),
                "p.toml:1: camera eye and target are the same",
            ),
            ("key = []\n".into(), "p.toml: no [[key]]"),
            ("[[key]]\neye=[0,0,0]\n".into(), "p.toml:1: missing field `target`"),
        ] {
            let error = read(&text).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
