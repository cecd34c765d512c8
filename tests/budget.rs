//! The budget's first row is the picture: the same pass 3, not one built by hand.

use nearfar::bench::budget::budget;
use nearfar::compare::{Truth, compare};
use nearfar::config::RenderConfig;
use nearfar::length::Length;
use nearfar::method::decompose::{NearVisibility, render};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;

use crate::support::{backends, small_room, world};

#[test]
fn the_row_as_rendered_is_the_picture() {
    let w = world(&small_room(), *backends().last().unwrap());
    let (width, height) = (w.camera.width, w.camera.height);
    let (run, stride) = (Run::new(2).unwrap(), 5);
    let truth = Truth::exact(width, height, &vec![Rgb::splat(0.4); (width * height) as usize]);
    for near_visibility in [NearVisibility::Rays, NearVisibility::Traced] {
        let mut config = RenderConfig::default();
        config.decompose.alpha = Length::Percent(8.0);
        config.decompose.near_visibility = near_visibility;
        config.record.spp = 4;
        config.follow();
        let inputs = config.inputs(w.diagonal);
        let rows = budget(&w, &config.decompose, inputs, &truth, stride, 16, &run).unwrap();
        let film = render(&w, &config.decompose, inputs, &run).unwrap().film;
        assert_eq!(rows[0].part, "as rendered");
        assert_eq!(rows[0].errors, compare(&film, "a.exr".as_ref(), &truth).unwrap().errors);
        // The lattice is the picture's pixels too.
        let (picture, mean) = (film.rgb("").unwrap(), truth.quiet());
        let on = |i: u32| i % stride == stride / 2;
        let pixels: Vec<u32> =
            (0..width * height).filter(|&i| on(i % width) && on(i / width)).collect();
        let bias = |i: &u32| f64::from((picture[*i as usize] - mean[*i as usize]).element_sum());
        let expected = pixels.iter().map(bias).sum::<f64>() / pixels.len() as f64 / 1.2;
        assert_eq!(rows[1].part, "as rendered, on the lattice");
        assert!((rows[1].errors.bias - expected).abs() < 1e-6, "{}", rows[1].errors.bias);
    }
}
