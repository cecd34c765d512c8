//! Irradiance at points of a scene, which face upwards:
//! `cargo run --release --example irradiance -- SCENE.toml X,Y,Z X,Y,Z`.
#![allow(clippy::print_stdout, reason = "an example shows what it found")]

use glam::Vec3;
use nearfar::render::SurfacePoints;
use nearfar::{Error, RenderConfig, Renderer, Result, Run, load};

fn main() -> Result<()> {
    let mut names = std::env::args().skip(1);
    let scene = names.next().unwrap_or("scenes/cornell-box/cornell-box.toml".into());
    let mut points = SurfacePoints::default();
    for text in names {
        let numbers: Vec<f32> = text.split(',').filter_map(|t| t.parse().ok()).collect();
        let [x, y, z] = numbers[..] else { return Err(Error::Usage(format!("{text}: X,Y,Z"))) };
        points.p.push(Vec3::new(x, y, z));
        points.n.push(Vec3::Y);
    }
    let loaded = load(scene.as_ref(), &[])?;
    let config = RenderConfig::from_table(loaded.settings)?;
    let run = Run::new(0)?;
    let found = Renderer::new(&loaded.scene, &config, &run)?.irradiance(&points)?;
    for (p, e) in points.p.iter().zip(found) {
        println!("{p}: direct {}, indirect {} W/m²", e.direct, e.indirect);
    }
    Ok(())
}
