//! Open Image Denoise 2, opened at run time: never needed to build, and only there where the user
//! has it.
//!
//! Search     the file or folder that `NEARFAR_OIDN` names; without it the copy that came with the
//!            program, then the system's library path, by the names of [`NAMES`].
//! Interface  the C functions of version 2 (CPU device, filter `RT`); names and types as in its own
//!            documentation, chapter "API". Guarantees an older library, a library of another kind
//!            and a missing one are told apart, each with the fix. The library stays open until the
//!            process ends: its threads do.
//! Cost       opening a tenth of a second; a filter 3 µs of CPU a pixel, and 0.6 kB a pixel while
//!            it works.

use std::ffi::{CStr, OsStr, c_char, c_int, c_void};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};

use glam::Vec3;
use libloading::Library;

use crate::error::{Error, Result};

/// Environment variable with the library's file or folder.
pub const VARIABLE: &str = "NEARFAR_OIDN";

/// What the library is called here, the surest name first.
pub const NAMES: &[&str] = if cfg!(target_os = "windows") {
    &["OpenImageDenoise.dll"]
} else if cfg!(target_os = "macos") {
    &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib"]
} else {
    &["libOpenImageDenoise.so.2", "libOpenImageDenoise.so"]
};

/// `OIDN_DEVICE_TYPE_CPU`.
const DEVICE_CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FORMAT_FLOAT3: c_int = 3;

type Device = *mut c_void;
type Filter = *mut c_void;

/// The functions in use.
#[derive(Debug)]
struct Api {
    new_device: unsafe extern "C" fn(c_int) -> Device,
    set_device_int: unsafe extern "C" fn(Device, *const c_char, c_int),
    set_device_bool: unsafe extern "C" fn(Device, *const c_char, bool),
    get_device_int: unsafe extern "C" fn(Device, *const c_char) -> c_int,
    commit_device: unsafe extern "C" fn(Device),
    get_device_error: unsafe extern "C" fn(Device, *mut *const c_char) -> c_int,
    release_device: unsafe extern "C" fn(Device),
    new_filter: unsafe extern "C" fn(Device, *const c_char) -> Filter,
    set_shared_filter_image: unsafe extern "C" fn(
        Filter,
        *const c_char,
        *mut c_void,
        c_int,
        usize,
        usize,
        usize,
        usize,
        usize,
    ),
    set_filter_bool: unsafe extern "C" fn(Filter, *const c_char, bool),
    commit_filter: unsafe extern "C" fn(Filter),
    execute_filter: unsafe extern "C" fn(Filter),
    release_filter: unsafe extern "C" fn(Filter),
    _library: ManuallyDrop<Library>,
}

impl Api {
    fn load(library: Library) -> std::result::Result<Self, libloading::Error> {
        // SAFETY: each symbol is read as the type that the interface of version 2 gives it, and
        // `Self` keeps the library open.
        unsafe {
            Ok(Self {
                new_device: *library.get(b"oidnNewDevice\0")?,
                set_device_int: *library.get(b"oidnSetDeviceInt\0")?,
                set_device_bool: *library.get(b"oidnSetDeviceBool\0")?,
                get_device_int: *library.get(b"oidnGetDeviceInt\0")?,
                commit_device: *library.get(b"oidnCommitDevice\0")?,
                get_device_error: *library.get(b"oidnGetDeviceError\0")?,
                release_device: *library.get(b"oidnReleaseDevice\0")?,
                new_filter: *library.get(b"oidnNewFilter\0")?,
                set_shared_filter_image: *library.get(b"oidnSetSharedFilterImage\0")?,
                set_filter_bool: *library.get(b"oidnSetFilterBool\0")?,
                commit_filter: *library.get(b"oidnCommitFilter\0")?,
                execute_filter: *library.get(b"oidnExecuteFilter\0")?,
                release_filter: *library.get(b"oidnReleaseFilter\0")?,
                _library: ManuallyDrop::new(library),
            })
        }
    }
}

/// An opened library with a device on the CPU.
#[derive(Debug)]
pub struct Denoiser {
    api: Api,
    device: Device,
    version: [u32; 3],
}

/// What a picture is denoised by: all slices hold width · height values, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The noisy picture, linear, ≥ 0.
    pub color: &'a [Vec3],
    /// Albedo in 0..=1, where there is one.
    pub albedo: Option<&'a [Vec3]>,
    /// Normals; used with albedo only.
    pub normal: Option<&'a [Vec3]>,
    /// Albedo and normals have no noise.
    pub clean: bool,
}

/// Where a library lies that came with the program: beside an installed one (`lib/nearfar`), or in
/// the folder `.oidn` of the checkout that the program was built in.
fn private_copies() -> impl Iterator<Item = PathBuf> {
    let program = std::env::current_exe().and_then(std::fs::canonicalize).unwrap_or_default();
    let above = |levels: usize, folder: &str| {
        program.ancestors().nth(levels).map(|above| above.join(folder)).into_iter()
    };
    let folders = above(2, "lib/nearfar").chain(above(3, ".oidn/lib")).chain(above(4, ".oidn/lib"));
    folders.flat_map(|folder| files(&folder)).filter(|file| file.is_file())
}

/// What the system says, where it says anything.
fn reason(error: &libloading::Error) -> String {
    use std::error::Error as _;
    error.source().map_or_else(|| error.to_string(), ToString::to_string)
}

impl Denoiser {
    /// Opens the library where `NEARFAR_OIDN` or the system has it; `threads` threads at work.
    ///
    /// # Errors
    /// [`Error::Usage`] when there is none or it is not of version 2.
    pub fn open(threads: usize) -> Result<Self> {
        Self::open_from(std::env::var_os(VARIABLE).filter(|v| !v.is_empty()).as_deref(), threads)
    }

    /// As [`Denoiser::open`]; none where nothing names a library and none is found, or where
    /// `NEARFAR_OIDN` is "none".
    ///
    /// # Errors
    /// [`Error::Usage`] when what `NEARFAR_OIDN` names is no library of version 2.
    pub fn found(threads: usize) -> Result<Option<Self>> {
        match std::env::var_os(VARIABLE).filter(|v| !v.is_empty()) {
            Some(named) if named == "none" => Ok(None),
            Some(named) => Self::open_from(Some(&named), threads).map(Some),
            None => Ok(Self::open_from(None, threads).ok()),
        }
    }

    /// As [`Denoiser::open`], with the variable's value given.
    ///
    /// # Errors
    /// As [`Denoiser::open`].
    pub fn open_from(variable: Option<&OsStr>, threads: usize) -> Result<Self> {
        let candidates = match variable {
            Some(place) => {
                let files = files(Path::new(place));
                if files.is_empty() {
                    let names = NAMES.join(" or ");
                    return Err(Error::Usage(format!(
                        "{VARIABLE}={}: no such file, and no folder with {names}: correct or \
                         unset it",
                        place.to_string_lossy()
                    )));
                }
                files
            }
            None => private_copies().chain(NAMES.iter().map(PathBuf::from)).collect(),
        };
        let mut reasons = Vec::new();
        for file in candidates {
            // SAFETY: runs the initialisers of the library that the user named or the system has
            // under this name; those of Open Image Denoise expect nothing of the program.
            match unsafe { Library::new(&file) } {
                Ok(library) => return Self::start(library, &file, threads),
                Err(error) => reasons.push(reason(&error)),
            }
        }
        Err(Error::Usage(format!(
            "Open Image Denoise cannot be opened ({}): install version 2 (its own release, the \
             package libopenimagedenoise2 of a distribution, or the \
             Python package pyoidn) and name its file or folder in {VARIABLE} when the system \
             does not find it, or render without a denoiser",
            reasons.join("; ")
        )))
    }

    fn start(library: Library, file: &Path, threads: usize) -> Result<Self> {
        let file = file.display();
        let fix = format!("install version 2, or name another library in {VARIABLE}");
        let api = Api::load(library).map_err(|e| {
            let reason = reason(&e);
            Error::Usage(format!("{file} is not Open Image Denoise 2 ({reason}): {fix}"))
        })?;
        // SAFETY: a function of one number; the handle is owned by `Self` from here on, or null.
        let device = unsafe { (api.new_device)(DEVICE_CPU) };
        let mut denoiser = Self { api, device, version: [0; 3] };
        if device.is_null() {
            return Err(denoiser.error("cannot make a device"));
        }
        // SAFETY: the device is live, the names are strings with a terminator that live through the
        // calls. Affinity is left alone: it would pin the threads of the renderer too.
        unsafe {
            (denoiser.api.set_device_int)(device, c"numThreads".as_ptr(), threads as c_int);
            (denoiser.api.set_device_bool)(device, c"setAffinity".as_ptr(), false);
            (denoiser.api.commit_device)(device);
        }
        denoiser.check("cannot start the device")?;
        // SAFETY: as above.
        let version = unsafe { (denoiser.api.get_device_int)(device, c"version".as_ptr()) } as u32;
        denoiser.version = [version / 10_000, version / 100 % 100, version % 100];
        if denoiser.version[0] != 2 {
            return Err(Error::Usage(format!(
                "{file} is Open Image Denoise {}, which this program does not know: {fix}",
                denoiser.dotted()
            )));
        }
        Ok(denoiser)
    }

    /// The library's version: major, minor, patch.
    pub fn version(&self) -> [u32; 3] {
        self.version
    }

    /// The version as text.
    pub fn dotted(&self) -> String {
        self.version.map(|v| v.to_string()).join(".")
    }

    /// The denoised picture.
    ///
    /// # Errors
    /// [`Error::Render`] when the library says so (memory, hardware).
    ///
    /// # Panics
    /// When a slice has another length than width · height.
    pub fn denoise(&self, input: &Input<'_>) -> Result<Vec<Vec3>> {
        let (width, height) = (input.width, input.height);
        let mut output = vec![Vec3::ZERO; width * height];
        let normal = input.normal.filter(|_| input.albedo.is_some());
        for image in [Some(input.color), input.albedo, normal].into_iter().flatten() {
            assert_eq!(image.len(), width * height, "an image of another size");
        }
        // SAFETY: the device is live, the name a string with a terminator; the filter is released
        // below.
        let filter = unsafe { (self.api.new_filter)(self.device, c"RT".as_ptr()) };
        if filter.is_null() {
            return Err(self.error("cannot make a filter"));
        }
        let set = |name: &CStr, data: *mut c_void| {
            // SAFETY: the filter is live; `data` holds width · height triples of f32 without
            // padding, and lives beyond the filter; inputs are only read.
            unsafe {
                (self.api.set_shared_filter_image)(
                    filter,
                    name.as_ptr(),
                    data,
                    FORMAT_FLOAT3,
                    width,
                    height,
                    0,
                    0,
                    0,
                )
            };
        };
        for (name, image) in
            [(c"color", Some(input.color)), (c"albedo", input.albedo), (c"normal", normal)]
        {
            if let Some(image) = image {
                set(name, image.as_ptr().cast_mut().cast());
            }
        }
        set(c"output", output.as_mut_ptr().cast());
        // SAFETY: the filter is live and its images outlive it; executing on the CPU device returns
        // when the output is written.
        unsafe {
            (self.api.set_filter_bool)(filter, c"hdr".as_ptr(), true);
            (self.api.set_filter_bool)(
                filter,
                c"cleanAux".as_ptr(),
                input.clean && input.albedo.is_some(),
            );
            (self.api.commit_filter)(filter);
            (self.api.execute_filter)(filter);
            (self.api.release_filter)(filter);
        }
        self.check("cannot denoise")?;
        Ok(output)
    }

    /// The device's pending error, if there is one.
    fn check(&self, what: &str) -> Result<()> {
        match self.pending() {
            Some(message) => Err(Error::Render(format!("Open Image Denoise: {what}: {message}"))),
            None => Ok(()),
        }
    }

    fn error(&self, what: &str) -> Error {
        Error::Render(format!(
            "Open Image Denoise: {what}: {}",
            self.pending().unwrap_or_else(|| "no reason given".into())
        ))
    }

    fn pending(&self) -> Option<String> {
        let mut text = std::ptr::null();
        // SAFETY: a live device, or null for errors of making one; `text` is set to a string that
        // lives until the next call on this thread.
        let code = unsafe { (self.api.get_device_error)(self.device, &raw mut text) };
        if code == 0 {
            return None;
        }
        // SAFETY: not null, and set by the call above to a string with a terminator.
        let message = (!text.is_null())
            .then(|| unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned());
        Some(message.unwrap_or_else(|| format!("error {code}")))
    }
}

impl Drop for Denoiser {
    fn drop(&mut self) {
        if !self.device.is_null() {
            // SAFETY: the handle is owned, and no filter of it is left.
            unsafe { (self.api.release_device)(self.device) };
        }
    }
}

/// The file itself, or the libraries in the folder or its `lib`.
fn files(place: &Path) -> Vec<PathBuf> {
    if place.is_file() {
        return vec![place.into()];
    }
    [place.to_owned(), place.join("lib")]
        .iter()
        .flat_map(|dir| NAMES.iter().map(move |n| dir.join(n)))
        .filter(|f| f.is_file())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream};

    fn refused(place: &Path) -> String {
        match Denoiser::open_from(Some(place.as_os_str()), 1) {
            Err(Error::Usage(message)) => message,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn what_is_not_there_or_not_it_is_refused_with_a_fix() {
        let folder = std::env::temp_dir().join(format!("nearfar-oidn-{}", std::process::id()));
        assert!(refused(&folder).contains("correct or unset it"));
        std::fs::create_dir_all(folder.join("lib")).unwrap();
        assert!(refused(&folder).contains(NAMES[0]));
        let file = folder.join("lib").join(NAMES[0]);
        std::fs::write(&file, "no library").unwrap();
        for place in [&folder, &file] {
            let message = refused(place);
            assert!(
                message.contains("cannot be opened")
                    && message.contains("install version 2")
                    && message.contains(VARIABLE),
                "{message}"
            );
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn another_library_is_refused() {
        // The C library is there on every Linux, and has no such function.
        let Some(libc) = [
            "/lib/x86_64-linux-gnu/libc.so.6",
            "/lib64/libc.so.6",
            "/usr/lib/libc.so.6",
            "/lib/aarch64-linux-gnu/libc.so.6",
        ]
        .into_iter()
        .find(|f| Path::new(f).is_file()) else {
            eprintln!("skipped: no C library at the usual places");
            return;
        };
        let message = refused(Path::new(libc));
        assert!(
            message.contains("is not Open Image Denoise 2") && message.contains("oidnNewDevice"),
            "{message}"
        );
    }

    #[test]
    fn a_flat_picture_stays_flat_and_loses_its_noise() {
        let Ok(denoiser) = Denoiser::open(1) else {
            eprintln!("skipped: no Open Image Denoise here");
            return;
        };
        assert_eq!(denoiser.version()[0], 2);
        let (width, height, flat) = (40, 30, Vec3::new(0.5, 0.25, 2.0));
        let mut rng = Rng::new(1, Stream::Test, 0, 0);
        let noisy: Vec<Vec3> = (0..width * height)
            .map(|_| flat * 2.0 * Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()))
            .collect();
        let out = |color: &[Vec3]| {
            denoiser
                .denoise(&Input { width, height, color, albedo: None, normal: None, clean: false })
                .unwrap()
        };
        let deviation = |picture: &[Vec3]| {
            (picture.iter().map(|&c| (c / flat - 1.0).length_squared()).sum::<f32>()
                / (3 * picture.len()) as f32)
                .sqrt()
        };
        // A network is no identity: measured 0.013 with 2.5.1, most of it at the corners. Noise:
        // 0.58 before, 0.15 after.
        assert!(deviation(&out(&vec![flat; width * height])) < 0.05);
        assert!(deviation(&out(&noisy)) < 0.5 * deviation(&noisy));
    }
}
