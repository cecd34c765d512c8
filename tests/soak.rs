//! Many pictures in one process, from one thread and from several: the same bits, and no growth.

use nearfar::film::Film;
use nearfar::method::Method;
use nearfar::process::resident_bytes;
use nearfar::run::Run;
use nearfar::scene::Scene;

use crate::support::{quick, small_room};

fn picture(scene: &Scene, method: Method, threads: usize) -> Film {
    nearfar::render(scene, &quick(2), method, &Run::new(threads).unwrap()).unwrap().film
}

/// Every channel but those that tell time.
fn same(a: &Film, b: &Film) -> bool {
    let bits = |v: &[f32]| v.iter().map(|x| x.to_bits()).collect::<Vec<u32>>();
    a.channels.len() == b.channels.len()
        && a.channels.iter().all(|(name, v)| b.channels.get(name).map(|w| bits(w)) == Some(bits(v)))
}

#[test]
fn threads_do_not_change_a_bit() {
    let scene = small_room();
    for method in Method::ALL {
        let one = picture(&scene, method, 1);
        for threads in [2, 3, 8] {
            assert!(same(&one, &picture(&scene, method, threads)), "{method:?} × {threads}");
        }
    }
}

#[test]
fn two_scenes_at_once_are_as_one_after_the_other() {
    let (bright, mut dark) = (small_room(), small_room());
    dark.materials.iter_mut().for_each(|m| m.albedo *= 0.25);
    for method in [Method::Decomposition, Method::Path, Method::IrradianceCache] {
        let alone = [&bright, &dark].map(|scene| picture(scene, method, 2));
        let together = std::thread::scope(|s| {
            [&bright, &dark]
                .map(|scene| s.spawn(move || picture(scene, method, 2)))
                .map(|made| made.join().unwrap())
        });
        for (a, b) in alone.iter().zip(&together) {
            assert!(same(a, b), "{method:?}");
        }
    }
}

/// Five hundred pictures of a small size hold no more than the first hundred did.
#[test]
#[ignore = "takes a minute, and other tests of the same process would be counted"]
fn five_hundred_pictures_do_not_grow() {
    let mut scene = small_room();
    (scene.camera.width, scene.camera.height) = (16, 12);
    for method in [Method::Decomposition, Method::Path] {
        let some = |n: usize| (0..n).for_each(|_| drop(picture(&scene, method, 2)));
        some(100);
        let before = resident_bytes();
        some(500);
        let grown = resident_bytes().saturating_sub(before);
        assert!(grown < 1_000_000, "{method:?} grew by {grown} bytes");
    }
}
