//! Embree's handles with owners, and calls through the shim: the only unsafe code of the program.
//!
//! Handles, enums and calls with scalar or opaque arguments come from `embree4-sys`; everything that touches a ray or a hit goes through
//! `ffi/embree_shim.c`, which is compiled against the installed headers. Error codes come through the shim as plain integers, because
//! a newer library may return codes that the enum of `embree4-sys` does not have.

use std::ffi::{CStr, CString, c_void};
use std::mem::MaybeUninit;

use embree4_sys as sys;
use glam::Vec3;

use crate::error::{Error, Result};
use crate::math::{Hit, Ray};
use crate::tessellate::Geometry;

/// Generated from `ffi/embree_shim.h`.
#[allow(non_upper_case_globals, non_camel_case_types, missing_docs, missing_debug_implementations, reason = "generated from ffi/embree_shim.h")]
#[allow(clippy::all, clippy::undocumented_unsafe_blocks, clippy::allow_attributes_without_reason, reason = "generated from ffi/embree_shim.h")]
mod shim {
    include!(concat!(env!("OUT_DIR"), "/embree_shim.rs"));
}

// A slice of our rays is a slice of the shim's rays.
const _: () = assert!(size_of::<Ray>() == size_of::<shim::NfRay>() && align_of::<Ray>() == align_of::<shim::NfRay>());
const _: () = assert!(std::mem::offset_of!(Ray, t_min) == std::mem::offset_of!(shim::NfRay, t_min));
const _: () = assert!(std::mem::offset_of!(Ray, dir) == std::mem::offset_of!(shim::NfRay, dir));
const _: () = assert!(std::mem::offset_of!(Ray, t_max) == std::mem::offset_of!(shim::NfRay, t_max));
const _: () = assert!(size_of::<shim::NfHit>() == 16 && size_of::<Vec3>() == 12 && size_of::<bool>() == 1);

/// Hits that cross the border in one call.
const BLOCK: usize = 256;

/// An Embree device.
#[derive(Debug)]
pub struct Device(sys::RTCDevice);

impl Device {
    /// A device that builds with `threads` threads (0 = all), checked against the headers that the shim was compiled with.
    pub fn new(threads: usize) -> Result<Self> {
        let config = CString::new(format!("threads={threads}")).map_err(|e| Error::Accel(e.to_string()))?;
        // SAFETY: `config` is a string with a terminator that lives through the call; the result is owned by `Self` or null.
        let device = Self(unsafe { sys::rtcNewDevice(config.as_ptr()) });
        if device.0.is_null() {
            return Err(device.error("cannot make a device"));
        }
        device.check()?;
        Ok(device)
    }

    fn property(&self, property: sys::RTCDeviceProperty) -> usize {
        // SAFETY: the device is live; a property is a number.
        unsafe { sys::rtcGetDeviceProperty(self.0, property) as usize }
    }

    /// Version of the library: major · 10000 + minor · 100 + patch.
    pub fn version(&self) -> u32 {
        self.property(sys::RTCDeviceProperty::VERSION) as u32
    }

    fn check(&self) -> Result<()> {
        let library = self.version();
        // SAFETY: a function without arguments that returns a constant.
        let headers = unsafe { shim::nf_header_version() };
        check_versions(library, headers)?;
        if self.property(sys::RTCDeviceProperty::FILTER_FUNCTION_SUPPORTED) == 0 {
            return Err(Error::Accel(format!("Embree {} was built without filter functions, which masks need", dotted(library))));
        }
        // SAFETY: the device is live; the shim makes and releases a scene of its own.
        let fault = match unsafe { shim::nf_self_check(self.0.cast()) } {
            0 => return Ok(()),
            2 => "wrote behind the hit structure",
            _ => "did not find the hit of a test ray",
        };
        Err(Error::Accel(format!(
            "the Embree library is {}, the headers this program was compiled with are {}, and the library {fault}: rebuild against the library's own headers",
            dotted(library),
            dotted(headers)
        )))
    }

    fn error(&self, what: &str) -> Error {
        self.pending_error(what).unwrap_or_else(|| Error::Accel(format!("Embree: {what}")))
    }

    fn pending_error(&self, what: &str) -> Option<Error> {
        let mut text = std::ptr::null();
        // SAFETY: a device or null are allowed; the shim sets `text` to a static string.
        let code = unsafe { shim::nf_take_error(self.0.cast(), &mut text) };
        // SAFETY: set by the call above to a static string with a terminator.
        (code != 0).then(|| Error::Accel(format!("Embree: {what}: {}", unsafe { CStr::from_ptr(text) }.to_string_lossy())))
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if !self.0.is_null() {
            // SAFETY: the handle is owned; scenes made from it hold references of their own.
            unsafe { sys::rtcReleaseDevice(self.0) };
        }
    }
}

/// The rule of versions: the same major version, and a library that is not older than the headers.
fn check_versions(library: u32, headers: u32) -> Result<()> {
    if library / 10_000 == headers / 10_000 && library >= headers {
        return Ok(());
    }
    Err(Error::Accel(format!(
        "the Embree library is {}, but this program was compiled with the headers of {}: install a library of the same major version that is not older, \
         or rebuild against its headers",
        dotted(library),
        dotted(headers)
    )))
}

fn dotted(version: u32) -> String {
    format!("{}.{}.{}", version / 10_000, version / 100 % 100, version % 100)
}

/// A committed scene of one triangle mesh. The caller keeps the geometry alive and unchanged as long as the scene.
#[derive(Debug)]
pub struct Scene(sys::RTCScene);

// SAFETY: queries on a committed scene are thread-safe by Embree's contract, and `Scene` offers nothing but queries.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

/// What the mask callback is given: a stable address for Embree, owned by the Rust scene.
#[derive(Debug)]
pub struct Mask(Box<shim::NfMask>);

// SAFETY: a function pointer and a pointer to a `Geometry` that is only read.
unsafe impl Send for Mask {}
// SAFETY: as above.
unsafe impl Sync for Mask {}

impl Mask {
    /// A mask that asks `geometry`, which must outlive every query.
    pub fn new(geometry: &Geometry) -> Self {
        Self(Box::new(shim::NfMask { exists: Some(exists), user: std::ptr::from_ref(geometry).cast() }))
    }
}

unsafe extern "C" fn exists(user: *const c_void, triangle: u32, u: f32, v: f32) -> u8 {
    // SAFETY: `user` is the geometry given to `Mask::new`, alive and unchanged while the scene exists (`EmbreeScene` owns both).
    let geometry = unsafe { &*user.cast::<Geometry>() };
    geometry.exists(triangle, u, v).into()
}

impl Scene {
    /// Builds over the triangles of `geometry`: positions are copied, indices are shared, `mask` is kept as a pointer.
    /// All three must stay in place, unchanged, as long as the scene: `EmbreeScene` sees to that.
    pub fn build(device: &Device, geometry: &Geometry, mask: Option<&Mask>) -> Result<Self> {
        let (vertices, triangles) = (geometry.positions.len(), geometry.triangles.len());
        if triangles >= shim::NF_MISS as usize || vertices > u32::MAX as usize {
            return Err(Error::Accel(format!("{triangles} triangles with {vertices} vertices are more than Embree can number")));
        }
        if let Some(i) = geometry.triangles.iter().flatten().find(|&&i| i as usize >= vertices) {
            return Err(Error::Accel(format!("vertex index {i} is out of range: there are {vertices} vertices")));
        }
        // SAFETY: the device is live; the scene is owned by `scene` from here on.
        let scene = Self(unsafe { sys::rtcNewScene(device.0) });
        if scene.0.is_null() {
            return Err(device.error("cannot make a scene"));
        }
        // SAFETY: the scene is live and not yet committed.
        unsafe {
            sys::rtcSetSceneFlags(scene.0, sys::RTCSceneFlags::ROBUST);
            sys::rtcSetSceneBuildQuality(scene.0, sys::RTCBuildQuality::MEDIUM);
        }
        if triangles > 0 {
            scene.attach(device, geometry, mask)?;
        }
        // SAFETY: the scene is live, its geometry is committed.
        unsafe { sys::rtcCommitScene(scene.0) };
        match device.pending_error("cannot build the scene") {
            Some(error) => Err(error),
            None => Ok(scene),
        }
    }

    fn attach(&self, device: &Device, geometry: &Geometry, mask: Option<&Mask>) -> Result<()> {
        // SAFETY: the device is live; the handle is released below, after the scene has taken its own reference.
        let mesh = unsafe { sys::rtcNewGeometry(device.0, sys::RTCGeometryType::TRIANGLE) };
        let n = geometry.positions.len();
        // SAFETY: `mesh` is live. Embree allocates `n` vertices of 12 bytes and the padding it wants; the copy stays inside. The shared
        // indices are live, in range (checked by the caller) and unchanged as long as the scene; so is the mask.
        unsafe {
            let buffer = sys::rtcSetNewGeometryBuffer(mesh, sys::RTCBufferType::VERTEX, 0, sys::RTCFormat::FLOAT3, 12, n);
            if buffer.is_null() {
                sys::rtcReleaseGeometry(mesh);
                return Err(device.error("cannot allocate the vertices"));
            }
            std::ptr::copy_nonoverlapping(geometry.positions.as_ptr(), buffer.cast::<Vec3>(), n);
            let indices = geometry.triangles.as_ptr().cast::<c_void>();
            sys::rtcSetSharedGeometryBuffer(mesh, sys::RTCBufferType::INDEX, 0, sys::RTCFormat::UINT3, indices, 0, 12, geometry.triangles.len());
            if let Some(mask) = mask {
                shim::nf_set_mask(mesh.cast(), &*mask.0);
            }
            sys::rtcCommitGeometry(mesh);
            sys::rtcAttachGeometry(self.0, mesh);
            sys::rtcReleaseGeometry(mesh);
        }
        match device.pending_error("cannot make the mesh") {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    /// Closest hits; the slices have equal length.
    pub fn closest(&self, rays: &[Ray], hits: &mut [Option<Hit>], width: usize) {
        assert_eq!(rays.len(), hits.len());
        let mut block = [const { MaybeUninit::<shim::NfHit>::uninit() }; BLOCK];
        for (rays, hits) in rays.chunks(BLOCK).zip(hits.chunks_mut(BLOCK)) {
            // SAFETY: the scene is committed; `Ray` has the layout of `NfRay` (asserted above); the block has room for `rays.len()` hits.
            unsafe { shim::nf_closest(self.0.cast(), rays.as_ptr().cast(), block.as_mut_ptr().cast(), rays.len(), width as u32) };
            for (hit, raw) in hits.iter_mut().zip(&block) {
                // SAFETY: the call above wrote the first `rays.len()` hits.
                let raw = unsafe { raw.assume_init_ref() };
                *hit = (raw.triangle != shim::NF_MISS).then_some(Hit { t: raw.t, u: raw.u, v: raw.v, triangle: raw.triangle });
            }
        }
    }

    /// Any hits; the slices have equal length.
    pub fn occluded(&self, rays: &[Ray], occluded: &mut [bool], width: usize) {
        assert_eq!(rays.len(), occluded.len());
        // SAFETY: the scene is committed; `Ray` has the layout of `NfRay`; the shim writes 0 or 1 to each of the `rays.len()` bytes.
        unsafe { shim::nf_occluded(self.0.cast(), rays.as_ptr().cast(), occluded.as_mut_ptr().cast(), rays.len(), width as u32) };
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        if !self.0.is_null() {
            // SAFETY: the handle is owned and no query is running: they borrow `self`.
            unsafe { sys::rtcReleaseScene(self.0) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_must_match() {
        assert!(check_versions(40_303, 40_303).is_ok());
        assert!(check_versions(40_400, 40_303).is_ok());
        let older = check_versions(40_303, 40_400).unwrap_err().to_string();
        assert!(older.contains("4.3.3") && older.contains("4.4.0"), "{older}");
        assert!(check_versions(50_000, 40_400).is_err());
    }

    #[test]
    fn device_passes_its_check() {
        let device = Device::new(1).unwrap();
        assert!(device.version() >= 40_300);
        assert!(device.pending_error("nothing").is_none());
    }

    #[test]
    fn indices_out_of_range_are_refused() {
        let geometry = Geometry { positions: vec![Vec3::ZERO; 3], triangles: vec![[0, 1, 3]], ..Geometry::default() };
        let error = Scene::build(&Device::new(1).unwrap(), &geometry, None).unwrap_err().to_string();
        assert!(error.contains("vertex index 3 is out of range"), "{error}");
    }
}
