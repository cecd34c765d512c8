//! Assignments from outside: `path.spp=64` as text, and a value put at its dotted key.

use toml::{Table, Value};

use crate::error::{Error, Result};

/// A dotted key and the text of its value, from `key=value`.
///
/// # Errors
/// [`Error::Usage`] without `=` or with an empty part of the key.
pub fn parse_assignment(text: &str) -> Result<(String, String)> {
    let (key, value) = text.split_once('=').ok_or_else(|| {
        Error::Usage(format!(
            "\"{text}\" is no assignment: write key=value, for example path.spp=64"
        ))
    })?;
    let key = key.trim();
    if key.is_empty() || key.split('.').any(|k| k.trim().is_empty()) {
        return Err(Error::Usage(format!("\"{text}\": \"{key}\" is not a dotted key")));
    }
    Ok((key.to_owned(), value.trim().to_owned()))
}

/// A TOML value, else the text itself.
pub fn parse_value(text: &str) -> Value {
    format!("v = {text}")
        .parse::<Table>()
        .ok()
        .filter(|t| t.len() == 1)
        .and_then(|mut t| t.remove("v"))
        .unwrap_or_else(|| Value::String(text.to_owned()))
}

/// Puts a value at a dotted key, making sections on the way.
///
/// # Errors
/// [`Error::Setting`] when a part of the way is a value.
pub fn set(table: &mut Table, key: &str, value: Value) -> Result<()> {
    match key.split_once('.') {
        None => {
            table.insert(key.to_owned(), value);
            Ok(())
        }
        Some((section, rest)) => {
            match table.entry(section).or_insert_with(|| Value::Table(Table::new())) {
                Value::Table(inner) => set(inner, rest, value),
                _ => Err(Error::setting(key, format!("\"{section}\" is a value, not a section"))),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn assignments() {
        assert_eq!(parse_assignment("path.spp = 3").unwrap(), ("path.spp".into(), "3".into()));
        assert_eq!(parse_value("[1, 2.5]").as_array().unwrap().len(), 2);
        assert_eq!(parse_value("ignore"), Value::String("ignore".into()));
        assert!(parse_assignment("path.spp").is_err() && parse_assignment("path..spp=1").is_err());
        let mut t = Table::new();
        set(&mut t, "a.b.c", Value::Integer(1)).unwrap();
        assert_eq!(t.to_string().replace(' ', ""), "[a.b]\nc=1\n");
        assert!(set(&mut t, "a.b.c.d", Value::Integer(1)).is_err());
    }
}
