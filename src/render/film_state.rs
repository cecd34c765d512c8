//! What the frames of a film share, in a file: so that a film which was stopped goes on at the
//! frame where it was.
//!
//! A file of `method::decompose::store` with two more elements: `near_box`, the near part in boxes
//! of space, and `film`, how many frames it comes after. The key in its comments has the mark of
//! the film ([`Shots::mark`]).
//!
//! Guarantee  the frames after it are, bit for bit, those of a film that never stopped.

use std::path::Path;

use super::Reuse;
use crate::config::RenderConfig;
use crate::error::{Error, Result};
use crate::input_file;
use crate::method::decompose::DecomposeSettings;
use crate::method::decompose::near::boxes::NearBoxes;
use crate::method::decompose::near::filter::NearPart;
use crate::method::decompose::store::{self, Known};
use crate::method::key::Key;
use crate::method::stage::Inputs;
use crate::ply::{Columns, Rows};
use crate::radiometry::Rgb;
use crate::sampling::Words;
use crate::scene::{Camera, Fingerprint, Scene};

/// What decides the frames of a film, and the mark that tells it from others.
#[derive(Clone, Debug)]
pub struct Shots {
    /// One view a frame.
    pub(super) views: Vec<Camera>,
    pub(super) reuse: Reuse,
    pub(super) scene: Fingerprint,
    mark: String,
}

impl Shots {
    /// The frames of `views`, which start from the file `load` where there is one.
    ///
    /// # Errors
    /// [`Error::Usage`] for views without a direction; when the file cannot be read, or settings
    /// cannot be written as text.
    pub fn new(
        scene: &Scene,
        config: &RenderConfig,
        views: Vec<Camera>,
        reuse: Reuse,
        load: Option<&Path>,
    ) -> Result<Self> {
        let blind = |c: &Camera| {
            let forward = (c.target - c.eye).normalize_or_zero();
            forward.cross(c.up.normalize_or_zero()).length() < 1e-6
        };
        if let Some(i) = views.iter().position(blind) {
            return Err(Error::Usage(format!(
                "frame {} looks at its own eye or along its up vector; move a key view or give \
                 another up",
                i + 1
            )));
        }
        let version = env!("CARGO_PKG_VERSION");
        let (origin, settings) = (scene.origin, config.to_table()?);
        let scene = Fingerprint::new(scene);
        let mut hash = Words(0);
        let text = format!("{version} {scene} {origin:?} {settings} {views:?} {reuse:?}");
        hash.bytes(text.as_bytes());
        if let Some(path) = load {
            hash.bytes(&input_file::read(path)?);
        }
        Ok(Self { views, reuse, scene, mark: format!("{:016x}", hash.0) })
    }

    /// A hash of everything that decides the frames: scene, settings, views, what frames share, and
    /// the file that they start from. The same for every frame.
    pub fn mark(&self) -> &str {
        &self.mark
    }
}

/// What frames share after so many of them.
pub(super) struct FilmState {
    pub(super) known: Known,
    pub(super) near: NearBoxes,
    /// Frames that it comes after.
    pub(super) frames: usize,
}

/// What decides where numbers stand in a file.
type Layout<'a> = (&'a Inputs<'a>, &'a DecomposeSettings);

fn columns() -> [Columns; 2] {
    [
        Columns::new("near_box")
            .floats(["irradiance_r", "irradiance_g", "irradiance_b", "closeness"])
            .integers(["key_low", "key_high"]),
        Columns::new("film").integers(["frames"]),
    ]
}

/// Writes the state.
pub(super) fn save(path: &Path, key: &Key, state: &FilmState, layout: Layout<'_>) -> Result<()> {
    let (mut boxes, mut film) = (Rows::default(), Rows::default());
    for (key, near) in state.near.rows() {
        boxes.push(
            near.irradiance.to_array().into_iter().chain([near.closeness]),
            &key.to_le_bytes(),
        );
    }
    film.push([], &(state.frames as u32).to_le_bytes());
    let [of_boxes, of_film] = columns();
    store::save_with(path, key, &state.known, layout, vec![(of_boxes, boxes), (of_film, film)])
}

/// Reads the state of the film that `key` names.
pub(super) fn load(path: &Path, key: &Key, layout: Layout<'_>) -> Result<FilmState> {
    let columns = columns();
    let (known, rows) = store::load_with(path, key, layout, &columns)?;
    let near = rows[0].iter(&columns[0]).filter_map(|(v, key)| {
        let near = NearPart { irradiance: Rgb::from_slice(&v), closeness: v[3] };
        Some((u64::from_le_bytes(key.try_into().ok()?), near))
    });
    let frames = rows[1].iter(&columns[1]).next();
    let frames = frames.and_then(|(_, bytes)| bytes.try_into().ok()).map(u32::from_le_bytes);
    let near = NearBoxes::from_rows(near);
    Ok(FilmState { known, near, frames: frames.unwrap_or_default() as usize })
}
