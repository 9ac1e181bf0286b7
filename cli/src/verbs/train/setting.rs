//! Single settings of a plan, by their path: `ppo.gamma=0.99`.

use crate::failure::{Failure, Outcome};
use mimic::explain::nearest;
use mimic::run::Plan;
use serde_json::Value;

/// How many similar names an error lists.
const SHOWN: usize = 3;

/// The plan with one setting changed. `change` is `PATH=VALUE`, the value as in JSON; a plain word needs no quotes.
pub fn change(plan: &Plan, change: &str) -> Outcome<Plan> {
    let wrong = |cause: String| Failure::user(cause).with_place(format!("`--set {change}`"));
    let (path, text) = change.split_once('=').ok_or_else(|| {
        wrong("there is no value".into())
            .with_remedy("give a path and a value, e.g. `ppo.gamma=0.99`")
    })?;
    let (path, text) = (path.trim(), text.trim());
    // Through text, in which an f32 has its shortest digits: 0.95, not 0.949999988.
    let written = serde_json::to_string(plan);
    let values = written.and_then(|written| serde_json::from_str(&written));
    let mut values: Value = values.map_err(|e| wrong(e.to_string()))?;
    let known = paths(&values);
    let pointer = format!("/{}", path.trim_start_matches('/').replace('.', "/"));
    let place = values
        .pointer_mut(&pointer)
        .filter(|_| !path.is_empty())
        .ok_or_else(|| {
            wrong(format!("there is no setting `{path}`"))
                .with_remedy(format!("use one such as {}", similar(path, &known)))
        })?;
    let old = place.to_string();
    *place = match serde_json::from_str(text) {
        Err(e) if text.starts_with(['{', '[']) => {
            return Err(wrong(format!("the value is not JSON: {e}"))
                .with_remedy(format!("give a value such as the present one, {old}")));
        }
        value => value.unwrap_or_else(|_| Value::from(text)),
    };
    serde_json::from_value(values).map_err(|e| {
        wrong(in_words(&e)).with_remedy(format!("give a value such as the present one, {old}"))
    })
}

/// What is wrong with a value, without the names of a programming language.
pub fn in_words(error: &serde_json::Error) -> String {
    let kinds = [
        (&["f32", "f64"][..], "a number"),
        (
            &["u8", "u16", "u32", "u64", "usize"],
            "a whole number from 0",
        ),
        (&["i8", "i16", "i32", "i64", "isize"], "a whole number"),
        (&["sequence"], "list"),
        (&["map"], "object"),
    ];
    let said = error.to_string();
    let word = |word: &str| {
        let bare = word.trim_end_matches([',', '.']);
        let kind = kinds.iter().find(|(names, _)| names.contains(&bare));
        kind.map_or_else(|| word.to_owned(), |(_, kind)| word.replace(bare, kind))
    };
    // Only what is expected: what was found is the caller's own.
    match said.split_once("expected ") {
        Some((found, expected)) => {
            let expected: Vec<String> = expected.split(' ').map(word).collect();
            format!("{found}expected {}", expected.join(" "))
        }
        None => said,
    }
}

/// The paths of all settings of a plan, without groups of settings.
pub fn known(plan: &Plan) -> Vec<String> {
    let values = serde_json::to_value(plan).unwrap_or_default();
    let single = |path: &String| {
        let pointer = format!("/{}", path.replace('.', "/"));
        values
            .pointer(&pointer)
            .is_some_and(|value| !value.is_object())
    };
    paths(&values).into_iter().filter(single).collect()
}

/// The names most similar to `path`, in a sentence.
fn similar(path: &str, known: &[String]) -> String {
    let near = nearest(path, known, SHOWN);
    let near: Vec<String> = near.iter().map(|name| format!("`{name}`")).collect();
    near.join(", ")
}

/// The paths of all settings in a plan, and those of groups of settings.
fn paths(value: &Value) -> Vec<String> {
    let Value::Object(fields) = value else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (name, value) in fields {
        found.push(name.clone());
        found.extend(paths(value).iter().map(|inner| format!("{name}.{inner}")));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use mimic::task::{Actions, ImitationSettings, Terminations};

    #[test]
    fn a_change_changes_one_value() {
        let plan = Plan::default();
        let of = |distance| Plan {
            task: ImitationSettings {
                terminations: Terminations {
                    distance,
                    ..Terminations::default()
                },
                ..ImitationSettings::default()
            }
            .into(),
            ..Plan::default()
        };
        for path in ["task.terminations.distance", "/task/terminations/distance"] {
            let changed = change(&plan, &format!("{path}=0.4"));
            assert_eq!(changed, Ok(of(Some(0.4))));
        }
        let free = change(&plan, "task.terminations.distance=null");
        assert_eq!(free, Ok(of(None)));
        let wide = change(&plan, "hidden=[64, 32]").map(|p| p.hidden);
        assert_eq!(wide, Ok(vec![64, 32]));
        let smooth = change(&plan, "activation=tanh").map(|p| serde_json::json!(p.activation));
        assert_eq!(smooth, Ok("tanh".into()));
        let whole = change(&plan, r#"task.actions={"kind": "absolute", "reach": 1}"#);
        let absolute = ImitationSettings {
            actions: Actions::Absolute { reach: 1.0 },
            ..ImitationSettings::default()
        };
        assert_eq!(whole.map(|p| p.task), Ok(absolute.into()));
    }

    #[test]
    fn a_wrong_change_is_explained() {
        let said = |text| {
            let failure = change(&Plan::default(), text).expect_err("it is wrong");
            failure.message().unwrap_or_default()
        };
        assert!(said("task.termination.distance=1").contains("`task.terminations.distance`"));
        assert!(said("gama=1").contains("`ppo.gamma`"));
        assert!(said("ppo.gamma=high").ends_with("the present one, 0.95"));
        for (wrong, expected) in [
            ("ppo.gamma=high", "expected a number;"),
            ("samples=many", "expected a whole number from 0;"),
            ("samples=-1", "expected a whole number from 0;"),
            ("environments=1.5", "expected a whole number from 0;"),
            ("hidden=8", "expected a list;"),
        ] {
            assert!(said(wrong).contains(expected), "{wrong}: {}", said(wrong));
        }
        assert!(said("task.actions.kind=absolute").contains("reach"));
        assert!(said("gamma").contains("ppo.gamma=0.99"));
        assert!(said(r#"task.rewards={"pose": 1"#).contains("not JSON: EOF"));
        assert!(said("=3").contains("no setting"));
    }
}
