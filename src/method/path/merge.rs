//! Several ground truths of one scene as one: the sums of all their samples.
//!
//! ```text
//! n = Σ n_f        S = Σ S_f        mean = S / n = Σ n_f mean_f / Σ n_f        (per pixel)
//! ```
//! Files that differ by their seeds alone hold independent samples of one picture, so that sums,
//! sums of squares and numbers of samples add up to those of one longer render: means are weighted
//! by samples, and variances follow. The even and the odd samples stay the two halves; where both
//! files have an odd number in a pixel, the halves of one change places, so that the numbers of
//! the two still differ by one at most.
//!
//! Input   films with running sums (layers `state.*`) and the key that says of what they are.
//! Output  a film as path tracing makes it, with its sums and a key that names all seeds, in rising
//!         order: merged films can be merged again.
//! Guarantees  the order of the films does not matter to a bit. Films of other scenes, cameras,
//!             settings, backends or sizes, and films that share a seed, are refused.
//! Not     going on with a merged film: it belongs to no single seed. The certificate of a
//!         converging picture: those keep no sums.
//! Cost    one look at every sum.

use super::pixels::{self, Pixel};
use super::resume::{self, KEY};
use crate::error::{Error, Result};
use crate::film::{COMPLETE, Film};

fn refuse<T>(what: &str) -> Result<T> {
    Err(Error::Usage(format!("cannot merge: {what}")))
}

/// Version and hash of a key, and its seeds.
fn parts(key: &str) -> Option<(&str, Vec<u64>)> {
    let (what, seeds) = key.rsplit_once('-')?;
    let seeds: Vec<u64> = seeds.split('+').map(|s| s.parse().ok()).collect::<Option<_>>()?;
    Some((what, seeds))
}

/// All samples of some films, which must have been made alike but for their seeds.
///
/// # Errors
/// [`Error::Usage`] for fewer than two films, films without running sums or with damaged ones,
/// films of another scene, camera, size, setting or backend, and seeds that come twice.
pub fn merge(films: &[Film]) -> Result<Film> {
    if films.len() < 2 {
        return refuse("give two pictures at least");
    }
    let mut found: Vec<(Vec<u64>, &Film)> = Vec::new();
    let mut what = None;
    for film in films {
        let Some(key) = film.header.get(KEY) else {
            return refuse("a picture was not made by path tracing, or without its key");
        };
        let Some((of, seeds)) = parts(key) else { return refuse("a picture's key is damaged") };
        let (first, size) = *what.get_or_insert((of, (film.width, film.height)));
        if first != of {
            return refuse(resume::difference(&format!("{of}-0"), &format!("{first}-0")));
        }
        if size != (film.width, film.height) {
            return refuse("the pictures have different sizes");
        }
        found.push((seeds, film));
    }
    found.sort_by(|a, b| a.0.cmp(&b.0));
    let mut seeds: Vec<u64> = found.iter().flat_map(|(seeds, _)| seeds.clone()).collect();
    seeds.sort_unstable();
    if let Some(twice) = seeds.windows(2).find(|w| w[0] == w[1]) {
        return refuse(&format!(
            "seed {} comes twice: the same noise again would look like certainty; render one of \
             the pictures with another seed",
            twice[0]
        ));
    }
    let mut sum: Option<Vec<Pixel>> = None;
    for (_, film) in &found {
        let key = film.header.get(KEY).map_or("", String::as_str);
        let own = resume::pixels_from(film, key, film.width, film.height)?;
        match &mut sum {
            None => sum = Some(own),
            Some(sum) => sum.iter_mut().zip(&own).for_each(|(sum, own)| sum.join(own)),
        }
    }
    let (first, pixels) = (found[0].1, sum.unwrap_or_default());
    let mut film = pixels::film(&pixels, first.width, first.height);
    film.origin = first.origin;
    film.header = first.header.clone();
    resume::add_state(&mut film, &pixels);
    let named: Vec<String> = seeds.iter().map(u64::to_string).collect();
    let named = named.join("+");
    let complete = found.iter().all(|(_, f)| f.header.get(COMPLETE).is_none_or(|c| c != "false"));
    let fewest = pixels.iter().map(|p| p.count).min().unwrap_or(0);
    for (name, value) in [
        (KEY, format!("{}-{named}", what.map_or("", |(of, _)| of))),
        (COMPLETE, complete.to_string()),
        ("nearfar.seed", named),
        ("nearfar.spp", fewest.to_string()),
        ("nearfar.noise_relmse", format!("{:e}", pixels::noise(&pixels))),
    ] {
        film.header.insert(name.into(), value);
    }
    Ok(film)
}
