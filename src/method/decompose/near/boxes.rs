//! The near part kept in boxes of space between the frames of a film: rays are shot once a box, not
//! once a point and frame.
//!
//! ```text
//! E_near(x) = E_near(x_b)
//! b: box and facing of x as near_noise = "world" has them,   x_b: the first point seen in b
//! ```
//!
//! Nothing moves and the far field of a film is fixed, so the near part is a function of the place
//! alone. A box is about a pixel wide where it is seen first; it is estimated with [`RAYS`] times
//! `near_rays`, which costs less than fresh rays in every frame, is less noisy, and stays (figures
//! in `docs/records/2026-11-decompose.md`).
//!
//! From shading points and their far field comes the near part at every point, before the filter.
//! The result has the same bits for any number of threads, and a camera that rests gets the same
//! values again. It does depend on the order of the frames, for the first point stands for its box.
//! It takes 32 B of memory a box.

use std::collections::HashMap;

use rayon::prelude::*;

use super::filter::NearPart;
use super::noise::NearNoise;
use super::rays::ShortRays;
use crate::error::Result;
use crate::method::decompose::pass3::FarAt;
use crate::method::decompose::{Context, Receiver};
use crate::record::ShadingPoints;
use crate::run::RayKind;

/// Rays of a box in multiples of `near_rays`.
pub const RAYS: u32 = 4;

/// Near part by box.
#[derive(Debug, Default)]
pub struct NearBoxes {
    known: HashMap<u64, NearPart>,
}

impl NearBoxes {
    /// Number of boxes.
    pub fn len(&self) -> usize {
        self.known.len()
    }
    /// True without boxes.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// All boxes, by their keys.
    pub fn rows(&self) -> Vec<(u64, NearPart)> {
        let mut keys: Vec<u64> = self.known.keys().copied().collect();
        keys.sort_unstable();
        keys.into_iter().filter_map(|key| Some((key, *self.known.get(&key)?))).collect()
    }
    /// From all boxes of an earlier run.
    pub fn from_rows(rows: impl IntoIterator<Item = (u64, NearPart)>) -> Self {
        Self { known: rows.into_iter().collect() }
    }

    /// The near part at every point, where `far_at` gives the far field of point i; boxes seen for
    /// the first time are estimated (phase `near`).
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn at(
        &mut self,
        context: &Context<'_>,
        points: &ShadingPoints,
        far_at: &(impl Fn(usize) -> FarAt + Sync),
    ) -> Result<Vec<NearPart>> {
        let run = context.run;
        let count = context.settings.near_rays.saturating_mul(RAYS);
        let keys: Vec<u64> = run.install(|| {
            (0..points.len())
                .into_par_iter()
                .with_min_len(256)
                .map(|i| NearNoise::World.element(points, i))
                .collect()
        });
        let mut new = Vec::new();
        for (i, &key) in keys.iter().enumerate() {
            self.known.entry(key).or_insert_with(|| {
                new.push(i);
                NearPart::default()
            });
        }
        let phase = run.phase("near", new.len() as u64);
        run.rays.add(RayKind::Visibility, new.len() as u64 * u64::from(count));
        let estimate = |&i: &usize| {
            if run.cancelled() {
                return NearPart::default();
            }
            phase.advance(1);
            let far = far_at(i);
            let rays = ShortRays { count, alpha: far.alpha, element: keys[i] };
            rays.near(context, &far.sh, &Receiver::of(points, i)).0
        };
        let found: Vec<NearPart> =
            run.install(|| new.par_iter().with_min_len(64).map(estimate).collect());
        run.check()?;
        for (&i, near) in new.iter().zip(found) {
            self.known.insert(keys[i], near);
        }
        Ok(keys.iter().map(|key| self.known.get(key).copied().unwrap_or_default()).collect())
    }
}
