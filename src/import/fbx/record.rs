//! Nested records with typed values, borrowed from the file's bytes.

use super::array::Array;
use super::numbers::in_range;

/// A record: a name, values and nested records.
#[derive(Debug)]
pub(super) struct Element<'a> {
    pub name: &'a [u8],
    pub values: Vec<Value<'a>>,
    pub children: Vec<Element<'a>>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Value<'a> {
    Int(i64),
    Real(f64),
    Text(&'a [u8]),
    Array(Array<'a>),
}

impl<'a> Element<'a> {
    pub fn child(&self, name: &str) -> Option<&Element<'a>> {
        self.children
            .iter()
            .find(|child| child.name == name.as_bytes())
    }

    pub fn int(&self, index: usize) -> Option<i64> {
        self.values.get(index).and_then(Value::int)
    }

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
    /// Reals are cut off towards zero, as exporters write some enumerations as reals.
    pub fn int(&self) -> Option<i64> {
        match *self {
            Value::Int(value) => Some(value),
            Value::Real(value) if value.is_finite() => Some(value as i64),
            _ => None,
        }
    }

    /// Only values that later arithmetic can't overflow.
    pub fn real(&self) -> Option<f64> {
        match *self {
            Value::Int(value) => Some(value as f64),
            Value::Real(value) if in_range(value) => Some(value),
            _ => None,
        }
    }
}
