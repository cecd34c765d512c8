//! One table of settings: what a room can be told, declared once, beside the code that obeys it.
//!
//! A room writes a `section!`. The macro makes of it the struct, its
//! `Default`, parsing, checking, and the entries of the reference; there is no second list.
//!
//! ```text
//! section! {
//!     /// What the section is about: the first words of its part of the reference.
//!     pub struct LampSettings in "lamp" {
//!         /// What the setting means. Default, range and unit are not repeated here.
//!         rays: u32 = 16, in from(1.0).to(4096.0), unit "rays";
//!         /// A length has the type `Length`, never a plain number.
//!         reach: Length = Length::Percent(5.0), in above(0.0);
//!         /// A setting that follows another until it is set.
//!         fade: Option<Length> = None, follows "half of lamp.reach";
//!         /// One of several words: an enum made by `choices!`.
//!         form: Form = Form::Round;
//!     }
//! }
//! ```
//!
//! * Without `in`, a number must be finite and not negative; NaN is never allowed.
//! * `pub struct X in "x", checked by together` calls `self.together()` after the ranges: for rules
//!   that concern two settings.
//! * `also { … }` holds fields that the code needs and nobody sets; `sections { … }` holds
//!   sections. `RenderConfig` (room `config`) is the section that holds all.
//! * A new setting needs nothing else. The page `docs/guide/settings.md` is written anew by
//!   `nearfar settings --markdown`; a test compares.
//!
//! Input   a TOML value for a key. Output  the typed value, or [`Error::Setting`], which names the
//!         dotted key, the value, and what is allowed.

mod macros;
mod nearest;
mod page;
mod range;
mod value;

use crate::error::{Error, Result};

pub(crate) use macros::{choices, section};
pub use nearest::nearest;
pub use page::page;
pub use range::{Range, above, from};
pub use value::{Choice, Value};

/// One entry of the reference.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Setting {
    /// Dotted key: `path.spp`.
    pub key: String,
    /// Type: "whole number", "length", "choice", ….
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Default as it would be written, or what it follows.
    pub default: String,
    /// What is allowed; empty where the type says it all.
    pub range: String,
    /// Unit; empty for plain numbers and for types that have one of their own.
    pub unit: &'static str,
    /// What it does.
    pub meaning: String,
    /// The words of a choice, with their meanings.
    pub choices: Vec<Choice>,
}

/// The settings of one section.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Group {
    /// Name of the section; empty for keys without one.
    pub name: &'static str,
    /// What it is about.
    pub meaning: String,
    /// Its entries, as declared.
    pub settings: Vec<Setting>,
}

/// What `section!` makes.
pub trait Section {
    /// Name before the dot; empty for the whole.
    const NAME: &'static str;
    /// Its own entries, and after them those of the sections in it.
    fn groups() -> Vec<Group>;
    /// Reads one value; ranges are left to [`Section::validate`].
    ///
    /// # Errors
    /// [`Error::Setting`] for unknown keys and values of another type.
    fn set(&mut self, key: &str, value: &toml::Value) -> Result<()>;
    /// Whether every value is in its range, and what belongs together fits.
    ///
    /// # Errors
    /// [`Error::Setting`] for the first that is not.
    fn validate(&self) -> Result<()>;
}

/// Sets every key of a section's table.
///
/// # Errors
/// As [`Section::set`]; a plain value in place of the table.
pub fn set_all<S: Section>(section: &mut S, value: &toml::Value) -> Result<()> {
    let toml::Value::Table(table) = value else {
        return Err(Error::setting(
            S::NAME,
            format!("is a section, not a value: write {}.KEY = VALUE", S::NAME),
        ));
    };
    table.iter().try_for_each(|(key, value)| section.set(key, value))
}

/// The name of a key with its section.
pub fn dotted(section: &str, key: &str) -> String {
    if section.is_empty() { key.to_owned() } else { format!("{section}.{key}") }
}

/// Reads one value.
///
/// # Errors
/// [`Error::Setting`] when it is of another type.
pub fn read<T: Value>(key: &str, range: Range, value: &toml::Value) -> Result<T> {
    T::read(value).ok_or_else(|| refuse::<T>(key, &value.to_string(), range))
}

/// Checks one value.
///
/// # Errors
/// [`Error::Setting`] when it is out of its range.
pub fn check<T: Value>(key: &str, range: Range, value: &T) -> Result<()> {
    match value.number() {
        Some(number) if !range.contains(number) => Err(refuse::<T>(key, &value.show(), range)),
        _ => Ok(()),
    }
}

fn refuse<T: Value>(key: &str, value: &str, range: Range) -> Error {
    let words: Vec<&str> = T::choices().iter().map(|c| c.name).collect();
    let allowed = match (words.is_empty(), T::NUMERIC) {
        (false, _) => format!("one of {}", words.join(", ")),
        (_, true) => format!("a {}, {range}{}", T::KIND, T::SPELLING),
        _ => format!("{}{}", T::KIND, T::SPELLING),
    };
    let meant = nearest(value.trim_matches('"'), words)
        .map_or_else(String::new, |word| format!("; did you mean \"{word}\"?"));
    Error::setting(key, format!("{value} is not allowed: write {allowed}{meant}"))
}

/// An entry of the reference.
pub fn entry<T: Value>(
    key: String,
    default: &T,
    follows: Option<&str>,
    range: Range,
    unit: &'static str,
    meaning: &str,
) -> Setting {
    Setting {
        key,
        kind: T::KIND,
        default: follows.map_or_else(|| default.show(), |other| format!("follows: {other}")),
        range: if T::NUMERIC { range.to_string() } else { String::new() },
        unit,
        meaning: meaning.trim().to_owned(),
        choices: T::choices(),
    }
}
