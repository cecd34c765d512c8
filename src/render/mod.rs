//! The door: one call from a scene, settings and a method to a finished picture.
//!
//! ```text
//! Scene, RenderConfig, Method, Run  →  Renderer (world)  →  Rendered (film, statistics)  →  files
//! ```
//! [`render`] does what `nearfar render` does: it builds the world, runs the method, brings the
//! picture towards the truth where `converge.enabled` asks for it, denoises it as `denoise` says,
//! and fills in the file's header and the statistics. [`Renderer`] is the same in steps, for
//! several pictures of one scene: it keeps the triangles and the ray structure, starts from kept
//! proxies and records, continues ground truths, and tells the irradiance at given points.
//!
//! | File | Job |
//! |---|---|
//! | `renderer` | [`Renderer`]: the steps |
//! | `dispatch` | which function a [`Method`] is |
//! | `checkpoint` | [`Checkpoint`]: progressive pictures that can be gone on with |
//! | `expected` | [`Expected`]: the phases of a picture and what they cost |
//! | `unfinished` | [`keeping`]: all other jobs that can be gone on with |
//! | `kept` | [`Kept`]: files of earlier work to start from and to write |
//! | `flight` | [`Flight`]: the frames of a camera path |
//! | `film_state` | [`Shots`]: whose frames they are; films that go on |
//! | `irradiance` | [`Renderer::irradiance`]: light at points that no camera needs to see |
//! | `header` | what an image file says of its making |
//! | `statistics` | [`Statistics`]: what is told of a render |
//! | `view` | whether the camera stands where it can see anything |
//!
//! Guarantees: the same scene, settings and seed give the same bits for any number of threads, by
//! whichever way they are asked for. Nothing is printed; warnings and progress go to the
//! `Run`'s reporter.

mod checkpoint;
mod dispatch;
mod expected;
mod film_state;
mod flight;
mod header;
mod irradiance;
mod kept;
mod renderer;
mod statistics;
mod unfinished;
mod view;

pub use checkpoint::Checkpoint;
pub use expected::Expected;
pub use film_state::Shots;
pub use flight::{Flight, Frame, Reuse};
pub use header::describe;
pub use irradiance::{PointIrradiance, SurfacePoints};
pub use kept::Kept;
pub use renderer::{Rendered, Renderer};
pub use statistics::{OfPicture, RunStatistics, Statistics};
pub use unfinished::{job_key, keeping};
pub use view::{CAMERA_INSIDE_WALL, camera_inside_wall};

use crate::config::RenderConfig;
use crate::error::Result;
use crate::method::Method;
use crate::run::Run;
use crate::scene::Scene;

/// Renders `scene` by `method` as `config` says.
///
/// # Errors
/// Settings out of range, a backend or denoiser that cannot be had, memory that does not suffice,
/// [`crate::error::Error::Interrupted`].
pub fn render(scene: &Scene, config: &RenderConfig, method: Method, run: &Run) -> Result<Rendered> {
    Renderer::new(scene, config, run)?.render(method)
}
