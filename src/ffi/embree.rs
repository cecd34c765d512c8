//! Embree's handles with owners, and calls through the shim of `ffi/embree_shim.c`. What is public
//! is safe to call.
//!
//! Handles, enums and calls with scalar or opaque arguments come from `embree4-sys`; everything
//! that touches a ray or a hit goes through `ffi/embree_shim.c`, which is compiled against the
//! installed headers. Error codes come through the shim as plain integers, because a newer library
//! may return codes that the enum of `embree4-sys` does not have.
//!
//! Ownership  a [`Scene`] keeps the [`Triangles`] that Embree shares and the callback asks, and
//!            drops them after Embree's own scene.

use std::ffi::{CStr, CString, c_void};
use std::mem::MaybeUninit;
use std::sync::Arc;

use embree4_sys as sys;
use glam::Vec3;

use crate::error::{Error, Result};
use crate::math::{Hit, Ray};

/// Generated from `ffi/embree_shim.h`.
#[allow(
    non_upper_case_globals,
    non_camel_case_types,
    missing_docs,
    missing_debug_implementations,
    reason = "generated from ffi/embree_shim.h"
)]
#[allow(
    clippy::all,
    clippy::undocumented_unsafe_blocks,
    clippy::allow_attributes_without_reason,
    reason = "generated from ffi/embree_shim.h"
)]
mod shim {
    include!(concat!(env!("OUT_DIR"), "/embree_shim.rs"));
}

// A slice of our rays is a slice of the shim's rays.
const _: () = assert!(
    size_of::<Ray>() == size_of::<shim::NfRay>() && align_of::<Ray>() == align_of::<shim::NfRay>()
);
const _: () = assert!(std::mem::offset_of!(Ray, t_min) == std::mem::offset_of!(shim::NfRay, t_min));
const _: () = assert!(std::mem::offset_of!(Ray, dir) == std::mem::offset_of!(shim::NfRay, dir));
const _: () = assert!(std::mem::offset_of!(Ray, t_max) == std::mem::offset_of!(shim::NfRay, t_max));
const _: () =
    assert!(size_of::<shim::NfHit>() == 16 && size_of::<Vec3>() == 12 && size_of::<bool>() == 1);

/// Hits that cross the border in one call.
const BLOCK: usize = 256;

/// An Embree device.
#[derive(Debug)]
pub struct Device(sys::RTCDevice);

impl Device {
    /// A device that builds with `threads` threads (0 = all), checked against the headers that the
    /// shim was compiled with.
    ///
    /// # Errors
    /// [`Error::Accel`] when the library does not fit those headers, has no filter functions, or
    /// fails its check.
    pub fn new(threads: usize) -> Result<Self> {
        let config =
            CString::new(format!("threads={threads}")).map_err(|e| Error::Accel(e.to_string()))?;
        // SAFETY: `config` is a string with a terminator that lives through the call; the result is
        // owned by `Self` or null.
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
            return Err(Error::Accel(format!(
                "Embree {} was built without filter functions, which masks need",
                dotted(library)
            )));
        }
        // SAFETY: the device is live; the shim makes and releases a scene of its own.
        let fault = match unsafe { shim::nf_self_check(self.0.cast()) } {
            0 => return Ok(()),
            2 => "wrote behind the hit structure",
            _ => "did not find the hit of a test ray",
        };
        Err(Error::Accel(format!(
            "the Embree library is {}, the headers this program was compiled with are {}, and the \
             library {fault}: rebuild against the library's own headers",
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
        (code != 0).then(|| {
            // SAFETY: set by the call above to a static string with a terminator.
            let reason = unsafe { CStr::from_ptr(text) }.to_string_lossy();
            Error::Accel(format!("Embree: {what}: {reason}"))
        })
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
        "the Embree library is {}, but this program was compiled with the headers of {}: install \
         a library of the same major version that is not older, \
         or rebuild against its headers",
        dotted(library),
        dotted(headers)
    )))
}

fn dotted(version: u32) -> String {
    format!("{}.{}.{}", version / 10_000, version / 100 % 100, version % 100)
}

/// A triangle mesh that Embree shares.
///
/// Memory safety does not rest on implementations: [`Scene::build`] asks for the slices once,
/// checks what it got, and keeps the owner's [`Arc`] as long as Embree holds them, so they stay
/// borrowed.
pub trait Triangles: std::fmt::Debug + Send + Sync + 'static {
    /// Vertices.
    fn positions(&self) -> &[Vec3];
    /// Three vertices a triangle.
    fn indices(&self) -> &[[u32; 3]];
    /// Whether some triangle is not there everywhere; only then [`Triangles::exists`] is asked.
    /// Asked once.
    fn masked(&self) -> bool;
    /// True when the surface exists at barycentrics (u, v). Asked from inside queries, on any
    /// thread; a panic ends the process.
    fn exists(&self, triangle: u32, u: f32, v: f32) -> bool;
}

/// A committed scene of one triangle mesh.
#[derive(Debug)]
pub struct Scene {
    handle: sys::RTCScene,
    /// What Embree asks at masked hits: at an address that stays.
    mask: Option<Box<shim::NfMask>>,
    _triangles: Arc<dyn Triangles>,
}

// SAFETY: queries on a committed scene are thread-safe by Embree's contract, and `Scene` offers
// nothing but queries; the mask is a function pointer and a pointer to the triangles, which are
// `Send` and `Sync` themselves.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

unsafe extern "C" fn exists<T: Triangles>(
    user: *const c_void,
    triangle: u32,
    u: f32,
    v: f32,
) -> u8 {
    // SAFETY: `user` is the `T` that `Scene::build` stored; the scene owns it and is borrowed by
    // the running query.
    let triangles = unsafe { &*user.cast::<T>() };
    triangles.exists(triangle, u, v).into()
}

impl Scene {
    /// Builds over the triangles: positions are copied, indices are shared.
    ///
    /// # Errors
    /// [`Error::Accel`] for more triangles than Embree can number, an index out of range, or no
    /// memory left.
    pub fn build<T: Triangles>(device: &Device, owner: &Arc<T>) -> Result<Self> {
        // Once each: what is checked here is what Embree gets.
        let (positions, indices) = (owner.positions(), owner.indices());
        let (vertices, triangles) = (positions.len(), indices.len());
        if triangles >= shim::NF_MISS as usize || vertices > u32::MAX as usize {
            return Err(Error::Accel(format!(
                "{triangles} triangles with {vertices} vertices are more than Embree can number"
            )));
        }
        if let Some(i) = indices.iter().flatten().find(|&&i| i as usize >= vertices) {
            return Err(Error::Accel(format!(
                "vertex index {i} is out of range: there are {vertices} vertices"
            )));
        }
        let mask = owner.masked().then(|| {
            Box::new(shim::NfMask { exists: Some(exists::<T>), user: Arc::as_ptr(owner).cast() })
        });
        // SAFETY: the device is live; the handle is owned by `scene` from here on.
        let handle = unsafe { sys::rtcNewScene(device.0) };
        let scene = Self { handle, mask, _triangles: Arc::<T>::clone(owner) };
        if scene.handle.is_null() {
            return Err(device.error("cannot make a scene"));
        }
        // SAFETY: the scene is live and not yet committed.
        unsafe {
            sys::rtcSetSceneFlags(scene.handle, sys::RTCSceneFlags::ROBUST);
            sys::rtcSetSceneBuildQuality(scene.handle, sys::RTCBuildQuality::MEDIUM);
        }
        if triangles > 0 {
            scene.attach(device, positions, indices)?;
        }
        // SAFETY: the scene is live, its geometry is committed.
        unsafe { sys::rtcCommitScene(scene.handle) };
        match device.pending_error("cannot build the scene") {
            Some(error) => Err(error),
            None => Ok(scene),
        }
    }

    fn attach(&self, device: &Device, positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<()> {
        // SAFETY: the device is live; the handle is released below, after the scene has taken its
        // own reference.
        let mesh = unsafe { sys::rtcNewGeometry(device.0, sys::RTCGeometryType::TRIANGLE) };
        let n = positions.len();
        // SAFETY: `mesh` is live. Embree allocates `n` vertices of 12 bytes and the padding it
        // wants; the copy stays inside. The shared indices are in range (checked by the caller on
        // this very slice); they are borrowed from what `_triangles` points to, which no one can
        // borrow mutably or move while the scene holds it. The mask is owned by the scene.
        unsafe {
            let buffer = sys::rtcSetNewGeometryBuffer(
                mesh,
                sys::RTCBufferType::VERTEX,
                0,
                sys::RTCFormat::FLOAT3,
                12,
                n,
            );
            if buffer.is_null() {
                sys::rtcReleaseGeometry(mesh);
                return Err(device.error("cannot allocate the vertices"));
            }
            std::ptr::copy_nonoverlapping(positions.as_ptr(), buffer.cast::<Vec3>(), n);
            let indices = triangles.as_ptr().cast::<c_void>();
            sys::rtcSetSharedGeometryBuffer(
                mesh,
                sys::RTCBufferType::INDEX,
                0,
                sys::RTCFormat::UINT3,
                indices,
                0,
                12,
                triangles.len(),
            );
            if let Some(mask) = &self.mask {
                shim::nf_set_mask(mesh.cast(), &**mask);
            }
            sys::rtcCommitGeometry(mesh);
            sys::rtcAttachGeometry(self.handle, mesh);
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
            // SAFETY: the scene is committed; `Ray` has the layout of `NfRay` (asserted above); the
            // block has room for `rays.len()` hits.
            unsafe {
                shim::nf_closest(
                    self.handle.cast(),
                    rays.as_ptr().cast(),
                    block.as_mut_ptr().cast(),
                    rays.len(),
                    width as u32,
                )
            };
            for (hit, raw) in hits.iter_mut().zip(&block) {
                // SAFETY: the call above wrote the first `rays.len()` hits.
                let raw = unsafe { raw.assume_init_ref() };
                *hit = (raw.triangle != shim::NF_MISS).then_some(Hit {
                    t: raw.t,
                    u: raw.u,
                    v: raw.v,
                    triangle: raw.triangle,
                });
            }
        }
    }

    /// Any hits; the slices have equal length.
    pub fn occluded(&self, rays: &[Ray], occluded: &mut [bool], width: usize) {
        assert_eq!(rays.len(), occluded.len());
        // SAFETY: the scene is committed; `Ray` has the layout of `NfRay`; the shim writes 0 or 1
        // to each of the `rays.len()` bytes.
        unsafe {
            shim::nf_occluded(
                self.handle.cast(),
                rays.as_ptr().cast(),
                occluded.as_mut_ptr().cast(),
                rays.len(),
                width as u32,
            )
        };
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        if !self.handle.is_null() {
            // SAFETY: the handle is owned and no query is running: they borrow `self`.
            unsafe { sys::rtcReleaseScene(self.handle) };
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

    #[derive(Debug)]
    struct OutOfRange;
    impl Triangles for OutOfRange {
        fn positions(&self) -> &[Vec3] {
            &[Vec3::ZERO; 3]
        }
        fn indices(&self) -> &[[u32; 3]] {
            &[[0, 1, 3]]
        }
        fn masked(&self) -> bool {
            false
        }
        fn exists(&self, _: u32, _: f32, _: f32) -> bool {
            true
        }
    }

    /// Right when first asked, out of range from then on.
    #[derive(Debug, Default)]
    struct Liar(std::sync::atomic::AtomicUsize);
    impl Triangles for Liar {
        fn positions(&self) -> &[Vec3] {
            const { &[Vec3::ZERO, Vec3::X, Vec3::Y] }
        }
        fn indices(&self) -> &[[u32; 3]] {
            match self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed) {
                0 => &[[0, 1, 2]],
                _ => &[[1 << 30, 1 << 30, 1 << 30]],
            }
        }
        fn masked(&self) -> bool {
            false
        }
        fn exists(&self, _: u32, _: f32, _: f32) -> bool {
            true
        }
    }

    #[test]
    fn what_was_checked_is_what_embree_gets() {
        let liar = Arc::new(Liar::default());
        let scene = Scene::build(&Device::new(1).unwrap(), &liar).unwrap();
        let mut hit = [None];
        scene.closest(&[Ray::new(Vec3::new(0.2, 0.2, 1.0), -Vec3::Z)], &mut hit, 1);
        let Some(Hit { t, triangle: 0, .. }) = hit[0] else { panic!("{hit:?}") };
        assert!((t - 1.0).abs() < 1e-6, "{t}");
    }

    #[test]
    fn indices_out_of_range_are_refused() {
        let error =
            Scene::build(&Device::new(1).unwrap(), &Arc::new(OutOfRange)).unwrap_err().to_string();
        assert!(error.contains("vertex index 3 is out of range"), "{error}");
    }
}
