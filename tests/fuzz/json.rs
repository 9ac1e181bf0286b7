//! Damage to JSON that stays JSON: glTF and DeepMimic.

use super::random::Random;
use serde_json::{Map, Value};

/// Stands for a number that a [`Value`] can't hold, until the text is written.
const MARK: &str = "\u{1}number";
const BEYOND: [&str; 6] = [
    "1e400",
    "-1e400",
    "1e-400",
    "99999999999999999999",
    "-",
    "NaN",
];

/// A damaged copy as text.
pub fn mutated(original: &Value, random: &mut Random) -> Vec<u8> {
    let mut value = original.clone();
    for _ in 0..random.few() {
        let other = pick(original, random).clone();
        change(place(&mut value, random), other, random);
    }
    let text = value.to_string();
    let mark = Value::from(MARK).to_string();
    match text.contains(&mark) {
        true => text
            .replace(&mark, BEYOND[random.below(BEYOND.len())])
            .into_bytes(),
        false => text.into_bytes(),
    }
}

fn children(value: &Value) -> usize {
    match value {
        Value::Array(list) => list.len(),
        Value::Object(map) => map.len(),
        _ => 0,
    }
}

/// A value somewhere below. Each step down chooses among the entries alike, so that long lists don't get all the damage.
fn pick<'a>(mut value: &'a Value, random: &mut Random) -> &'a Value {
    while children(value) > 0 && !random.one_in(12) {
        let at = random.below(children(value));
        value = match value {
            Value::Array(list) => &list[at],
            Value::Object(map) => map.values().nth(at).expect("it is counted"),
            _ => return value,
        };
    }
    value
}

fn place<'a>(mut value: &'a mut Value, random: &mut Random) -> &'a mut Value {
    while children(value) > 0 && !random.one_in(12) {
        let at = random.below(children(value));
        value = match value {
            Value::Array(list) => &mut list[at],
            Value::Object(map) => map.values_mut().nth(at).expect("it is counted"),
            other => return other,
        };
    }
    value
}

fn change(value: &mut Value, other: Value, random: &mut Random) {
    match random.below(6) {
        0 => *value = other,
        1 => *value = odd(random),
        2 | 3 => nudge(value, random),
        4 => reshape(value, other, random),
        _ => *value = Value::from(MARK),
    }
}

/// A value of another kind.
fn odd(random: &mut Random) -> Value {
    let real = random.real();
    let nested = (0..random.below(200)).fold(Value::Null, |inner, _| Value::from(vec![inner]));
    random
        .of(&[
            Value::Null,
            Value::from(true),
            Value::from(""),
            Value::from("a\nb\u{0}"),
            Value::from(Vec::<Value>::new()),
            Value::Object(Map::new()),
            Value::from(real),
            nested,
        ])
        .clone()
}

/// A number near, or far at an edge; a text cut, doubled or replaced.
fn nudge(value: &mut Value, random: &mut Random) {
    let edge = random.edge();
    *value = match &*value {
        Value::Number(number) => {
            let integer = number.as_i64().unwrap_or_default();
            match random.below(5) {
                0 => Value::from(integer.wrapping_add(1)),
                1 => Value::from(integer.wrapping_sub(1)),
                2 => Value::from(edge),
                3 => Value::from(edge.cast_signed()),
                _ => Value::from(number.as_f64().unwrap_or_default() * random.real()),
            }
        }
        Value::String(text) => {
            let most = text.chars().count();
            match random.below(3) {
                0 => Value::from(text.chars().take(random.below(most)).collect::<String>()),
                1 => Value::from(text.repeat(2)),
                _ => Value::from(*random.of(&[
                    "SCALAR",
                    "VEC3",
                    "VEC4",
                    "MAT4",
                    "STEP",
                    "CUBICSPLINE",
                    "scale",
                ])),
            }
        }
        _ => odd(random),
    };
}

/// Removes, doubles, moves or adds an entry.
fn reshape(value: &mut Value, other: Value, random: &mut Random) {
    let at = random.below(children(value));
    match value {
        Value::Array(list) if !list.is_empty() => match random.below(4) {
            0 => drop(list.remove(at)),
            1 => list.insert(at, list[at].clone()),
            2 => list.insert(at, other),
            _ => {
                let entry = list[at].clone();
                list.extend(vec![entry; 1 << random.below(8)]);
            }
        },
        Value::Object(map) => {
            let key = map.keys().nth(at).cloned().unwrap_or_default();
            match random.below(3) {
                0 => drop(map.remove(&key)),
                1 => drop(map.insert(key, other)),
                _ => drop(map.insert(KEYS[random.below(KEYS.len())].to_owned(), other)),
            }
        }
        value => *value = other,
    }
}

/// Entries that a file may lack and a reader may look for.
const KEYS: [&str; 12] = [
    "byteStride",
    "byteOffset",
    "sparse",
    "children",
    "matrix",
    "rotation",
    "extensions",
    "normalized",
    "inverseBindMatrices",
    "uri",
    "Loop",
    "extras",
];
