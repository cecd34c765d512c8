//! Texture statements of MTL files: options, then a file name that may hold spaces.
//!
//! `-s u v w`, `-o u v w`, `-mm base gain` and `-clamp on` become a [`Placement`]: a lookup at
//! (u, v) is one of the image at s · (u, v) + o. Other options are left out and named.

use glam::Vec2;

use crate::scene::Placement;

/// A texture as a statement names it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureStatement {
    /// The file as it stands there, backslashes made slashes; empty where there is none.
    pub file: String,
    /// How it lies on the surface.
    pub placement: Placement,
    /// Options that are not understood, with their values.
    pub left_out: Vec<String>,
}

/// Values that an option takes: at least and at most.
fn values(option: &str) -> [usize; 2] {
    match option {
        "-o" | "-s" | "-t" => [1, 3],
        "-mm" => [2, 2],
        _ => [1, 1],
    }
}

/// Reads what stands after the key of a statement.
pub fn parse(statement: &str) -> TextureStatement {
    let mut out = TextureStatement::default();
    let mut rest = statement.trim();
    while rest.starts_with('-') {
        let (option, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let [least, most] = values(option);
        let mut given: Vec<&str> = Vec::new();
        rest = after.trim_start();
        while given.len() < most {
            let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            // What is no number begins the file's name; the last word can be nothing else.
            let another = given.len() >= least;
            if word.is_empty() || another && (word.parse::<f32>().is_err() || after.is_empty()) {
                break;
            }
            given.push(word);
            rest = after.trim_start();
        }
        let numbers: Vec<f32> = given.iter().filter_map(|w| w.parse().ok()).collect();
        let finite = numbers.len() == given.len() && numbers.iter().all(|x| x.is_finite());
        let pair = |missing: f32| Vec2::new(numbers[0], *numbers.get(1).unwrap_or(&missing));
        let placement = &mut out.placement;
        match option {
            "-s" if finite && !numbers.is_empty() => placement.scale = pair(1.0),
            "-o" if finite && !numbers.is_empty() => placement.offset = pair(0.0),
            "-mm" if finite && numbers.len() == 2 => {
                [placement.base, placement.gain] = [numbers[0], numbers[1]];
            }
            "-clamp" => placement.clamp = given.first().is_some_and(|w| *w == "on"),
            // How values between texels are found is ours.
            "-blendu" | "-blendv" => {}
            _ => out.left_out.push([&[option][..], &given].concat().join(" ")),
        }
    }
    out.file = rest.trim().replace('\\', "/");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options() {
        let plain = parse("my wood.png");
        assert_eq!((&*plain.file, plain.placement), ("my wood.png", Placement::default()));
        let t = parse("-o 0.5 -7.0 0.0 -s 2 10 1 -clamp on tex\\my wood.png");
        assert_eq!(t.file, "tex/my wood.png");
        let Placement { scale, offset, clamp, .. } = t.placement;
        assert_eq!((scale, offset, clamp), (Vec2::new(2.0, 10.0), Vec2::new(0.5, -7.0), true));
        assert!(t.left_out.is_empty());
        let t = parse("-bm 0.3 -mm 0.1 0.5 -imfchan l -blendu off t.png");
        assert_eq!(t.left_out, ["-bm 0.3", "-imfchan l"]);
        assert_eq!((t.placement.base, t.placement.gain, &*t.file), (0.1, 0.5, "t.png"));
    }

    #[test]
    fn one_value_and_names_like_numbers() {
        let t = parse("-s 3 t.png");
        assert_eq!((t.placement.scale, &*t.file), (Vec2::new(3.0, 1.0), "t.png"));
        let t = parse("-o 1 2 7");
        assert_eq!((t.placement.offset, &*t.file), (Vec2::new(1.0, 2.0), "7"));
        for broken in ["-s", "-s 1", "-mm 1 t.png", "-s nan 1 t.png", "-", ""] {
            let _ = parse(broken);
        }
        assert_eq!(parse("-s nan 1 t.png").left_out, ["-s nan 1"]);
    }
}
