//! A scene file to an EXR: `cargo run --release --example render -- SCENE.toml OUT.exr`.

use nearfar::film::{Precision, write_exr};
use nearfar::{Method, RenderConfig, Result, Run, load, render};

fn main() -> Result<()> {
    let names: Vec<String> = std::env::args().skip(1).collect();
    let [scene, out] = names.as_slice() else {
        return Err(nearfar::Error::Usage("render SCENE.toml OUT.exr".into()));
    };
    let loaded = load(scene.as_ref(), &[])?;
    let config = RenderConfig::from_table(loaded.settings)?;
    let done = render(&loaded.scene, &config, Method::Decomposition, &Run::new(0)?)?;
    write_exr(&done.film, out.as_ref(), Precision::Full)
}
