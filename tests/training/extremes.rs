//! Every setting at the ends of its range and far beyond them: a plan is refused in one line, or it trains. Nothing panics, and
//! no plan that passes its check asks for more than there is.

use super::{kick, skeleton, tiny};
use mimic::learn::Trainer;
use mimic::motion::Motion;
use mimic::run::Plan;
use mimic::schema;
use mimic::task::CharacterModel;
use serde_json::{Value, json};
use std::sync::Arc;

/// Values that no setting is made for, and those in which numbers of files end.
fn strange() -> Vec<Value> {
    vec![
        json!(-1),
        json!(0),
        json!(1e-300),
        json!(1e-30),
        json!(0.5),
        json!(1),
        json!(7),
        json!(1e15),
        json!(u64::MAX),
        json!(1e30),
        json!(1e300),
        Value::Null,
        json!("7"),
        json!([]),
    ]
}

/// The ends of a setting's range.
fn ends(schema: &Value) -> Vec<Value> {
    let names = ["minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"];
    let ends = names.iter().filter_map(|name| schema.get(*name));
    // A whole number is written as one, or it doesn't parse.
    let whole = |end: &Value| match end.as_f64() {
        Some(number) if number.fract() == 0.0 && number < 1e18 => json!(number as i64),
        _ => end.clone(),
    };
    ends.flat_map(|end| [end.clone(), whole(end)]).collect()
}

/// Pointers to all numbers, switches and words of a plan, each with its schema where it has one of its own.
fn settings(value: &Value, schema: &Value, path: String, found: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                let alternatives = schema["oneOf"].as_array().into_iter().flatten();
                let mut parts = alternatives.chain([schema]);
                let part = parts.find_map(|part| part["properties"].get(name));
                let part = part.cloned().unwrap_or_default();
                settings(value, &part, format!("{path}/{name}"), found);
            }
        }
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                settings(item, &schema["items"], format!("{path}/{i}"), found);
            }
        }
        _ => found.push((path, schema.clone())),
    }
}

/// Trains for an iteration, unless that takes long although it is allowed.
fn attempt(plan: &Plan, motions: &[Motion]) -> Result<bool, String> {
    plan.check().map_err(|e| e.to_string())?;
    let samples = plan.environments * plan.horizon;
    let widths: usize = plan.hidden.iter().sum();
    if samples > 1 << 12 || widths > 1 << 10 || plan.ppo.epochs > 10 {
        return Ok(false);
    }
    let model = CharacterModel::new(skeleton()).map_err(|e| e.to_string())?;
    let task = plan.task.build(Arc::new(model), motions);
    let task = task.map_err(|e| e.to_string())?;
    let mut trainer = Trainer::new(plan.trainer(), task).map_err(|e| e.to_string())?;
    trainer.iterate().map_err(|e| e.to_string())?;
    Ok(true)
}

#[test]
fn settings_at_their_ends_train_or_are_refused() {
    let plan = Plan {
        environments: 2,
        group: 2,
        horizon: 2,
        hidden: vec![8],
        ..tiny()
    };
    let value = serde_json::to_value(&plan).expect("a plan can be written");
    let mut all = Vec::new();
    settings(&value, &schema::of::<Plan>(), String::new(), &mut all);
    assert!(all.len() > 70, "{} settings", all.len());
    let motions = [kick()];
    let (mut trained, mut refused) = (0, 0);
    for (path, schema) in all {
        for extreme in ends(&schema).into_iter().chain(strange()) {
            let mut changed = value.clone();
            if let Some(setting) = changed.pointer_mut(&path) {
                *setting = extreme.clone();
            }
            let Ok(plan) = serde_json::from_value::<Plan>(changed) else {
                continue;
            };
            match attempt(&plan, &motions) {
                Ok(did) => trained += i32::from(did),
                Err(message) => {
                    refused += 1;
                    assert!(
                        !message.contains('\n') && message.len() < 1000,
                        "{path} = {extreme}: {message}"
                    );
                }
            }
        }
    }
    assert!(trained > 200 && refused > 200, "{trained} {refused}");
}
