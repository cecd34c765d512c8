//! The yardstick of the border to Embree: `ffi/embree_loop.cpp`, compiled and run beside the bench.
//!
//! The program gets triangles and rays in a file, builds the scene with the backend's own settings,
//! and then answers requests for one timed run of a stream, so that its runs alternate with ours.
//! Without a C++ compiler (`CXX`, else `c++`) there is no yardstick, and the reason is told. It
//! knows no masks.

use std::fs;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use super::streams::Stream;
use crate::tessellate::Geometry;

/// A running yardstick; stopped and cleaned up when dropped.
#[derive(Debug)]
pub(super) struct NativeLoop {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    folder: PathBuf,
    /// Seconds that its build took.
    pub build_seconds: f64,
}

impl NativeLoop {
    /// Compiles and starts it; the error says why there is none.
    pub fn start(geometry: &Geometry, streams: &[Stream], threads: usize) -> Result<Self, String> {
        if geometry.masks().is_some() {
            return Err("the scene has masks, which the plain loop does not know".into());
        }
        let folder = std::env::temp_dir().join(format!("nearfar-bench-{}", std::process::id()));
        let started = Self::start_in(&folder, geometry, streams, threads);
        if started.is_err() {
            let _ = fs::remove_dir_all(&folder);
        }
        started
    }

    fn start_in(
        folder: &Path,
        geometry: &Geometry,
        streams: &[Stream],
        threads: usize,
    ) -> Result<Self, String> {
        let text = |e: std::io::Error| e.to_string();
        fs::create_dir_all(folder).map_err(text)?;
        let (source, program, file) =
            (folder.join("embree_loop.cpp"), folder.join("embree_loop"), folder.join("rays"));
        fs::write(&source, include_str!("../../ffi/embree_loop.cpp")).map_err(text)?;
        write_rays(&file, geometry, streams).map_err(text)?;
        let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".into());
        let mut command = Command::new(&compiler);
        command
            .args(["-std=c++17", "-O3", "-march=native", "-I", env!("NEARFAR_EMBREE_INCLUDE")])
            .arg(&source)
            .arg("-o")
            .arg(&program);
        let lib = env!("NEARFAR_EMBREE_LIB");
        if !lib.is_empty() {
            command.args(["-L", lib]).arg(format!("-Wl,-rpath,{lib}"));
        }
        let compiled = command
            .args(["-lembree4", "-pthread"])
            .output()
            .map_err(|e| format!("no C++ compiler \"{compiler}\": {e}"))?;
        if !compiled.status.success() {
            return Err(format!(
                "\"{compiler}\" failed: {}",
                String::from_utf8_lossy(&compiled.stderr).lines().next().unwrap_or_default()
            ));
        }
        let mut child = Command::new(&program)
            .arg(&file)
            .arg(threads.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(text)?;
        let input = child.stdin.take();
        let output = child.stdout.take().ok_or("no output")?;
        let mut running = Self {
            child,
            input,
            output: BufReader::new(output),
            folder: folder.into(),
            build_seconds: 0.0,
        };
        let line = running.line()?;
        running.build_seconds = line
            .strip_prefix("build ")
            .and_then(|s| s.trim().parse().ok())
            .ok_or("no build time")?;
        Ok(running)
    }

    fn line(&mut self) -> Result<String, String> {
        let mut line = String::new();
        match self.output.read_line(&mut line) {
            Ok(n) if n > 0 => Ok(line),
            _ => Err("the C++ loop ended early".into()),
        }
    }

    /// One run: seconds, and how many rays hit.
    pub fn run(
        &mut self,
        stream: usize,
        width: usize,
        threads: usize,
    ) -> Result<(f64, usize), String> {
        let input = self.input.as_mut().ok_or("no input")?;
        writeln!(input, "{stream} {width} {threads}").map_err(|e| e.to_string())?;
        input.flush().map_err(|e| e.to_string())?;
        let line = self.line()?;
        let mut words = line.split_whitespace();
        let seconds = words.next().and_then(|w| w.parse().ok());
        let hits = words.next().and_then(|w| w.parse().ok());
        seconds.zip(hits).ok_or_else(|| format!("the C++ loop said \"{}\"", line.trim()))
    }
}

impl Drop for NativeLoop {
    fn drop(&mut self) {
        self.input = None;
        let _ = self.child.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn write_rays(path: &Path, geometry: &Geometry, streams: &[Stream]) -> std::io::Result<()> {
    let mut out = BufWriter::new(fs::File::create(path)?);
    for n in [geometry.positions.len(), geometry.len(), streams.len()] {
        out.write_all(&(n as u64).to_ne_bytes())?;
    }
    for x in geometry.positions.iter().flat_map(|p| p.to_array()) {
        out.write_all(&x.to_ne_bytes())?;
    }
    for i in geometry.triangles.iter().flatten() {
        out.write_all(&i.to_ne_bytes())?;
    }
    for stream in streams {
        out.write_all(&u64::from(stream.any).to_ne_bytes())?;
        out.write_all(&(stream.rays.len() as u64).to_ne_bytes())?;
        for r in &stream.rays {
            for x in
                [r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, r.t_max]
            {
                out.write_all(&x.to_ne_bytes())?;
            }
        }
    }
    out.flush()
}
