//! Nested records with typed values, borrowed from the file's bytes.

use super::array::Array;
use super::numbers::in_range;

/// A record: a name, values and nested records.
#[derive(Debug)]
pub(super) struct Element<'a> {
    /// Usually ASCII.
    pub name: &'a [u8],
    pub values: Vec<Value<'a>>,
    pub children: Vec<Element<'a>>,
}

/// A value of a record.
#[derive(Clone, Copy, Debug)]
pub(super) enum Value<'a> {
    Int(i64),
    Real(f64),
    Text(&'a [u8]),
    Array(Array<'a>),
}

impl<'a> Element<'a> {
    /// The first child of this name.
    pub fn child(&self, name: &str) -> Option<&Element<'a>> {
        self.children
            .iter()
            .find(|child| child.name == name.as_bytes())
    }

    /// The value at `index` as an integer.
    pub fn int(&self, index: usize) -> Option<i64> {
        self.values.get(index).and_then(Value::int)
    }

    /// The text at `index`.
    pub fn text(&self, index: usize) -> Option<&'a [u8]> {
        match self.values.get(index) {
            Some(&Value::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// The array that is the first value of the child `name`.
    pub fn array(&self, name: &str) -> Option<Array<'a>> {
        match self.child(name)?.values.first() {
            Some(&Value::Array(array)) => Some(array),
            _ => None,
        }
    }
}

impl Value<'_> {
    /// The value as an integer. Exporters write some enumerations as reals: these are cut off towards zero.
    pub fn int(&self) -> Option<i64> {
        match *self {
            Value::Int(value) => Some(value),
            Value::Real(value) if value.is_finite() => Some(value as i64),
            _ => None,
        }
    }

    /// The value as a real, if later arithmetic with it can't overflow.
    pub fn real(&self) -> Option<f64> {
        match *self {
            Value::Int(value) => Some(value as f64),
            Value::Real(value) if in_range(value) => Some(value),
            _ => None,
        }
    }
}
