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

/// Five hundred pictures of a small size hold no more than the first hundred did. In a process of
/// its own with one heap: of several, one for each thread that ever ran at the same time, the
/// allocator keeps now more, now less.
#[test]
#[ignore = "takes a minute"]
fn five_hundred_pictures_do_not_grow() {
    if std::env::var_os("MALLOC_ARENA_MAX").is_none() {
        let name = "soak::five_hundred_pictures_do_not_grow";
        let alone = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--ignored", "--exact", name])
            .env("MALLOC_ARENA_MAX", "1")
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&alone.stdout);
        assert!(alone.status.success() && said.contains("1 passed"), "{said}");
        return;
    }
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
