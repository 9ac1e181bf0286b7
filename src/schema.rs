//! Checks settings against the ranges that stand beside their fields.
//!
//! Types that hold settings derive [`JsonSchema`]. A field's comment becomes its description, and its attributes become its
//! range and unit, so that the check, the error message and `docs/settings.md` all have one source:
//!
//! - `range(min = …, max = …)`: bounds that are allowed themselves;
//! - `extend("exclusiveMinimum" = …)` and `extend("exclusiveMaximum" = …)`: bounds that aren't;
//! - `extend("x-unit" = "…")`: the unit;
//! - `extend("x-ascending" = true)`: a pair `[least, most]`.
//!
//! What no single field can say (one rate below another, weights that sum to something) is checked by the type itself.

use crate::explain::{Explain, Explanation, explained};
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;

/// A setting with a value that isn't allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutOfRange {
    /// The path of the setting in a plan, e.g. `task.physics.control_hz`.
    pub setting: String,
    /// The value, as it would stand in a file.
    pub value: String,
    /// What is allowed, in words: "a number from 0 to 1".
    pub allowed: String,
}

impl Explain for OutOfRange {
    fn explain(&self) -> Explanation {
        Explanation::input(format!("{} is not allowed", self.value))
            .place(format!("setting `{}`", self.setting))
            .remedy(format!("give {}", self.allowed))
    }
}

explained!(OutOfRange);

/// The JSON Schema of a type that holds settings, with the schemas of its parts written out in place.
pub fn of<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    settings.into_generator().into_root_schema_for::<T>().into()
}

/// Checks every value of `settings` against its field's range; `path` is where the settings stand in a plan, empty for a
/// whole plan.
///
/// # Errors
/// The first value that is out of its range, or that no file can hold because it isn't finite.
pub fn check<T>(settings: &T, path: &str) -> Result<(), OutOfRange>
where
    T: JsonSchema + Serialize + DeserializeOwned + PartialEq,
{
    // By way of text, where single precision has its shortest digits.
    let value: Value = serde_json::to_string(settings)
        .and_then(|text| serde_json::from_str(&text))
        .unwrap_or_default();
    check_value(&of::<T>(), &value, path)?;
    // JSON has no word for NaN and infinity, so an optional setting with such a value would pass as left out.
    match serde_json::from_value::<T>(value) {
        Ok(read) if read == *settings => Ok(()),
        _ => Err(OutOfRange {
            setting: path.to_owned(),
            value: "NaN or an infinite number".to_owned(),
            allowed: "finite numbers".to_owned(),
        }),
    }
}

fn check_value(schema: &Value, value: &Value, path: &str) -> Result<(), OutOfRange> {
    match value {
        Value::Object(fields) => {
            let schema = &variant(schema, value)["properties"];
            for (name, value) in fields {
                let path = [path, name].join(".");
                check_value(&schema[name], value, path.trim_start_matches('.'))?;
            }
            Ok(())
        }
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                check_value(&schema["items"], item, &format!("{path}[{i}]"))?;
            }
            check_order(schema, items, path)
        }
        Value::Number(number) if is_within(schema, number.as_f64().unwrap_or(f64::NAN)) => Ok(()),
        // A number that isn't finite is written as null, too.
        Value::Number(_) => Err(out_of_range(schema, value, path)),
        Value::Null if schema["type"] == "number" => Err(out_of_range(schema, value, path)),
        _ => Ok(()),
    }
}

/// Of a schema with alternatives, the one whose fixed values (such as `kind`) are those of `value`.
fn variant<'a>(schema: &'a Value, value: &Value) -> &'a Value {
    let alternatives = schema["oneOf"].as_array();
    let is_meant = |alternative: &&Value| {
        let properties = alternative["properties"].as_object();
        let mut fixed = properties
            .into_iter()
            .flatten()
            .filter_map(|(name, property)| Some((name, property.get("const")?)));
        fixed.all(|(name, constant)| value[name] == *constant)
    };
    alternatives
        .and_then(|alternatives| alternatives.iter().find(is_meant))
        .unwrap_or(schema)
}

fn bound(schema: &Value, name: &str) -> Option<f64> {
    schema.get(name).and_then(Value::as_f64)
}

fn is_within(schema: &Value, number: f64) -> bool {
    bound(schema, "minimum").is_none_or(|least| number >= least)
        && bound(schema, "maximum").is_none_or(|most| number <= most)
        && bound(schema, "exclusiveMinimum").is_none_or(|low| number > low)
        && bound(schema, "exclusiveMaximum").is_none_or(|high| number < high)
        && number.is_finite()
}

fn check_order(schema: &Value, items: &[Value], path: &str) -> Result<(), OutOfRange> {
    let numbers = || items.iter().filter_map(Value::as_f64);
    if schema.get("x-ascending").is_none() || numbers().is_sorted() {
        return Ok(());
    }
    let shown: Vec<String> = numbers().map(number).collect();
    Err(OutOfRange {
        setting: path.to_owned(),
        value: format!("[{}]", shown.join(", ")),
        allowed: "the smaller number first".to_owned(),
    })
}

fn out_of_range(schema: &Value, value: &Value, path: &str) -> OutOfRange {
    let kind = match schema["format"].as_str() {
        Some(format) if format.starts_with("uint") => "a whole number",
        _ => "a number",
    };
    let range = range(schema).unwrap_or_else(|| "that is finite".to_owned());
    OutOfRange {
        setting: path.to_owned(),
        value: value
            .as_f64()
            .map_or_else(|| "NaN or an infinite number".to_owned(), number),
        allowed: format!("{kind} {range}"),
    }
}

/// The numbers that a schema allows, in words: "from 0 to 1", "above 0"; `None` where it allows all.
pub fn range(schema: &Value) -> Option<String> {
    let shown = |name| bound(schema, name).map(number);
    let low = match (shown("minimum"), shown("exclusiveMinimum")) {
        (_, Some(low)) => Some(format!("above {low}")),
        (Some(least), _) => Some(least),
        _ => None,
    };
    let is_open = bound(schema, "exclusiveMinimum").is_some();
    let high = match (shown("maximum"), shown("exclusiveMaximum")) {
        (_, Some(high)) => Some(format!("below {high}")),
        (Some(most), _) => Some(most),
        _ => None,
    };
    let words = match (low, high) {
        (Some(low), None) if is_open => low,
        (Some(low), None) => format!("of {low} or more"),
        (Some(low), Some(high)) if is_open => format!("{low}, up to {high}"),
        (Some(low), Some(high)) => format!("from {low} to {high}"),
        (None, Some(high)) => format!("up to {high}"),
        (None, None) => return None,
    };
    Some(words)
}

/// A number as one would type it.
fn number(number: f64) -> String {
    match number.abs() {
        size if size != 0.0 && !(1e-4..1e7).contains(&size) => format!("{number:e}"),
        _ => number.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
    struct Sample {
        #[schemars(range(min = 1, max = 1000))]
        steps: u32,
        #[schemars(extend("exclusiveMinimum" = 0))]
        rate: Option<f64>,
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1))]
        decay: f32,
        #[schemars(inner(range(min = 0.1)), extend("x-ascending" = true))]
        pair: Option<[f64; 2]>,
        kind: Kind,
    }

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
    #[serde(tag = "kind", rename_all = "kebab-case")]
    enum Kind {
        Near {
            #[schemars(range(max = 1.0))]
            reach: f32,
        },
        Far {
            #[schemars(range(max = 10.0))]
            reach: f32,
        },
    }

    fn sample() -> Sample {
        Sample {
            steps: 1,
            rate: None,
            decay: 0.9,
            pair: Some([0.1, 0.1]),
            kind: Kind::Far { reach: 10.0 },
        }
    }

    fn said(change: impl Fn(&mut Sample)) -> String {
        let mut wrong = sample();
        change(&mut wrong);
        check(&wrong, "all").expect_err("out of range").to_string()
    }

    #[test]
    fn a_value_out_of_range_is_named_with_its_range() {
        assert_eq!(check(&sample(), "all"), Ok(()));
        assert_eq!(
            said(|s| s.steps = 0),
            "setting `all.steps`: 0 is not allowed; give a whole number from 1 to 1000"
        );
        assert_eq!(
            said(|s| s.rate = Some(0.0)),
            "setting `all.rate`: 0 is not allowed; give a number above 0"
        );
        assert_eq!(
            said(|s| s.decay = 1.0),
            "setting `all.decay`: 1 is not allowed; give a number from 0 to below 1"
        );
        assert_eq!(
            said(|s| s.pair = Some([0.0, 1.0])),
            "setting `all.pair[0]`: 0 is not allowed; give a number of 0.1 or more"
        );
        assert_eq!(
            said(|s| s.pair = Some([2.0, 1.5])),
            "setting `all.pair`: [2, 1.5] is not allowed; give the smaller number first"
        );
        assert_eq!(
            said(|s| s.kind = Kind::Near { reach: 2.0 }),
            "setting `all.kind.reach`: 2 is not allowed; give a number up to 1"
        );
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused_in_every_kind_of_field() {
        assert!(said(|s| s.decay = f32::NAN).contains("all.decay"));
        assert!(said(|s| s.rate = Some(f64::NAN)).contains("finite"));
        assert!(said(|s| s.rate = Some(f64::INFINITY)).contains("finite"));
    }
}
