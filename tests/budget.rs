//! The budget's first row is the picture: the same pass 3, not one built by hand.

use nearfar::bench::budget::{Truth, budget};
use nearfar::compare::errors;
use nearfar::config::RenderConfig;
use nearfar::method::decompose::{Length, NearVisibility, render};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;

use crate::support::{backends, small_room, world};

#[test]
fn the_row_as_rendered_is_the_picture() {
    let w = world(&small_room(), *backends().last().unwrap());
    let (width, height) = (w.camera.width, w.camera.height);
    let (run, stride) = (Run::new(2).unwrap(), 5);
    let mean = vec![Rgb::splat(0.4); (width * height) as usize];
    for near_visibility in [NearVisibility::Rays, NearVisibility::Traced] {
        let mut config = RenderConfig::default();
        config.decompose.alpha = Length::PercentOfDiagonal(8.0);
        config.decompose.near_visibility = near_visibility;
        config.record.spp = 4;
        let inputs = config.inputs(w.diagonal);
        let truth = Truth { mean: mean.clone(), halves: None };
        let rows = budget(&w, &config.decompose, inputs, &truth, stride, 16, &run).unwrap();
        let picture = render(&w, &config.decompose, inputs, &run).unwrap().film.rgb("").unwrap();
        let lattice = |v: &[Rgb]| -> Vec<Rgb> {
            let on = |i: u32| i % stride == stride / 2;
            (0..width * height)
                .filter(|&i| on(i % width) && on(i / width))
                .map(|i| v[i as usize])
                .collect()
        };
        assert_eq!(rows[0].part, "as rendered");
        assert_eq!(rows[0].errors, errors(&lattice(&picture), &lattice(&mean), None));
    }
}
