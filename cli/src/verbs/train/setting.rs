//! Single values of a plan, by their path: `ppo.gamma=0.99`.

use mimic::run::Plan;
use serde_json::Value;
use strsim::levenshtein;

/// How many names an error lists.
const SHOWN: usize = 3;

/// The plan with one value changed. `change` is `PATH=VALUE`, the value as in JSON; a plain word needs no quotes.
///
/// # Errors
/// What is wrong about it, in words.
pub fn change(plan: &Plan, change: &str) -> Result<Plan, String> {
    let (path, text) = change
        .split_once('=')
        .ok_or("give a path and a value, e.g. `ppo.gamma=0.99`")?;
    let (path, text) = (path.trim(), text.trim());
    // By way of text, where single precision has its shortest digits.
    let written = serde_json::to_string(plan).map_err(|e| e.to_string())?;
    let mut values: Value = serde_json::from_str(&written).map_err(|e| e.to_string())?;
    let known = paths(&values);
    let pointer = format!("/{}", path.trim_start_matches('/').replace('.', "/"));
    let place = values
        .pointer_mut(&pointer)
        .filter(|_| !path.is_empty())
        .ok_or_else(|| unknown(path, &known))?;
    let old = place.to_string();
    *place = match serde_json::from_str(text) {
        Err(e) if text.starts_with(['{', '[']) => return Err(format!("`{text}` is no JSON: {e}")),
        value => value.unwrap_or_else(|_| Value::from(text)),
    };
    serde_json::from_value(values).map_err(|e| format!("{e}; now it is {old}"))
}

fn unknown(path: &str, known: &[String]) -> String {
    let mut near: Vec<&String> = known.iter().collect();
    near.sort_by_key(|name| distance(path, name));
    let near: Vec<String> = near
        .iter()
        .take(SHOWN)
        .map(|name| format!("`{name}`"))
        .collect();
    format!(
        "there is no setting `{path}`; near it are {}",
        near.join(", ")
    )
}

/// Every path in a plan, those of whole groups as well.
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

/// How far a path is from one that exists; a path's last name alone is as near as the whole.
fn distance(typed: &str, name: &str) -> usize {
    let last = |path: &str| path.rsplit(['.', '/']).next().unwrap_or(path).to_owned();
    levenshtein(typed, name).min(levenshtein(&last(typed), &last(name)))
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
        let said = |text| change(&Plan::default(), text).expect_err("it is wrong");
        assert!(said("task.termination.distance=1").contains("`task.terminations.distance`"));
        assert!(said("gama=1").contains("`ppo.gamma`"));
        assert!(said("ppo.gamma=high").ends_with("now it is 0.95"));
        assert!(said("task.actions.kind=absolute").contains("reach"));
        assert!(said("gamma").contains("ppo.gamma=0.99"));
        assert!(said(r#"task.rewards={"pose": 1"#).contains("no JSON: EOF"));
        assert!(said("=3").contains("no setting"));
    }
}
