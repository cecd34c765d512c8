//! The types that a setting can have.

use super::{Range, from};

/// One word of a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Choice {
    /// As it is written.
    pub name: &'static str,
    /// What it does.
    pub meaning: &'static str,
}

/// A type that a setting can have; enums get theirs from `choices!`.
pub trait Value: Sized {
    /// Name in the reference.
    const KIND: &'static str;
    /// Whether ranges apply.
    const NUMERIC: bool = false;
    /// Range where the declaration gives none: finite and not negative.
    const RANGE: Range = from(0.0);
    /// What an error adds on how to write it.
    const SPELLING: &'static str = "";
    /// From TOML; `None` when it is of another type.
    fn read(value: &toml::Value) -> Option<Self>;
    /// As it is written.
    fn show(&self) -> String;
    /// What ranges compare; `None` where there is nothing to compare.
    fn number(&self) -> Option<f64> {
        None
    }
    /// The words it can be, of a choice.
    fn choices() -> Vec<Choice> {
        Vec::new()
    }
}

impl Value for bool {
    const KIND: &'static str = "true or false";
    fn read(value: &toml::Value) -> Option<Self> {
        value.as_bool()
    }
    fn show(&self) -> String {
        self.to_string()
    }
}

impl Value for u32 {
    const KIND: &'static str = "whole number";
    const NUMERIC: bool = true;
    fn read(value: &toml::Value) -> Option<Self> {
        value.as_integer()?.try_into().ok()
    }
    fn show(&self) -> String {
        self.to_string()
    }
    fn number(&self) -> Option<f64> {
        Some((*self).into())
    }
}

impl Value for u64 {
    const KIND: &'static str = "whole number";
    const NUMERIC: bool = true;
    fn read(value: &toml::Value) -> Option<Self> {
        value.as_integer()?.try_into().ok()
    }
    fn show(&self) -> String {
        self.to_string()
    }
    fn number(&self) -> Option<f64> {
        Some(*self as f64)
    }
}

impl Value for f64 {
    const KIND: &'static str = "number";
    const NUMERIC: bool = true;
    fn read(value: &toml::Value) -> Option<Self> {
        value.as_float().or_else(|| value.as_integer().map(|i| i as Self))
    }
    fn show(&self) -> String {
        self.to_string()
    }
    fn number(&self) -> Option<f64> {
        Some(*self)
    }
}

impl Value for f32 {
    const KIND: &'static str = f64::KIND;
    const NUMERIC: bool = true;
    fn read(value: &toml::Value) -> Option<Self> {
        f64::read(value).map(|v| v as Self)
    }
    fn show(&self) -> String {
        self.to_string()
    }
    /// The number as written: 0.1 is 0.1, not what lies next to it in 32 bits.
    fn number(&self) -> Option<f64> {
        self.to_string().parse().ok()
    }
}

impl<T: Value> Value for Option<T> {
    const KIND: &'static str = T::KIND;
    const NUMERIC: bool = T::NUMERIC;
    const RANGE: Range = T::RANGE;
    const SPELLING: &'static str = T::SPELLING;
    fn read(value: &toml::Value) -> Option<Self> {
        T::read(value).map(Some)
    }
    fn show(&self) -> String {
        self.as_ref().map_or_else(String::new, T::show)
    }
    fn number(&self) -> Option<f64> {
        self.as_ref().and_then(T::number)
    }
    fn choices() -> Vec<Choice> {
        T::choices()
    }
}

impl Value for Vec<[f32; 3]> {
    const KIND: &'static str = "list of RGB triples";
    fn read(value: &toml::Value) -> Option<Self> {
        let triple = |v: &toml::Value| -> Option<[f32; 3]> {
            let numbers: Option<Vec<f32>> = v.as_array()?.iter().map(f32::read).collect();
            numbers?.try_into().ok()
        };
        value.as_array()?.iter().map(triple).collect()
    }
    fn show(&self) -> String {
        format!("{self:?}")
    }
}
