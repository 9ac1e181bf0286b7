//! The reference in `docs/settings.md`: every setting of a plan with its meaning, range and value in each preset, made from the
//! comments and attributes of the fields.
//!
//! `MIMIC_WRITE_DOCS=1` writes it.

use mimic::run::{PRESETS, Plan};
use mimic::schema;
use serde_json::Value;
use std::collections::BTreeMap;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/settings.md");
/// The reference stands behind this line.
const MARK: &str = "<!-- Written by tests/settings.rs: MIMIC_WRITE_DOCS=1 -->\n";

/// Settings by their path in a plan.
type Settings<T> = BTreeMap<String, T>;

/// The value of every setting, as one would type it.
fn values(plan: &Plan) -> Settings<String> {
    fn walk(path: &str, value: &Value, found: &mut Settings<String>) {
        match value {
            Value::Object(fields) => {
                for (name, value) in fields {
                    walk(&join(path, name), value, found);
                }
            }
            value => {
                found.insert(path.to_owned(), value.to_string().replace('"', ""));
            }
        }
    }
    // By way of text, where single precision has its shortest digits.
    let text = serde_json::to_string(plan).expect("a plan can be written");
    let mut found = Settings::new();
    let value = serde_json::from_str(&text).expect("and read");
    walk("", &value, &mut found);
    found
}

/// The schema of every setting, and under `…` of every group of settings.
fn schemas() -> (Settings<Value>, Settings<Value>) {
    fn walk(
        path: &str,
        schema: &Value,
        groups: &mut Settings<Value>,
        single: &mut Settings<Value>,
    ) {
        let alternatives = schema["oneOf"].as_array().into_iter().flatten();
        let parts: Vec<&Value> = alternatives
            .chain([schema])
            .filter(|part| part.get("properties").is_some())
            .collect();
        if parts.is_empty() {
            single.insert(path.to_owned(), schema.clone());
            return;
        }
        groups.insert(path.to_owned(), schema.clone());
        for (name, property) in parts
            .iter()
            .filter_map(|part| part["properties"].as_object())
            .flatten()
        {
            walk(&join(path, name), property, groups, single);
        }
    }
    let (mut groups, mut single) = (Settings::new(), Settings::new());
    walk("", &schema::of::<Plan>(), &mut groups, &mut single);
    (groups, single)
}

fn join(path: &str, name: &str) -> String {
    [path, name].join(".").trim_start_matches('.').to_owned()
}

/// A comment as text: lines joined, links to other items as plain code.
fn description(schema: &Value) -> String {
    let text = schema["description"].as_str().unwrap_or_default();
    text.replace('\n', " ")
        .replace("[`", "`")
        .replace("`]", "`")
}

/// What a setting can be set to, if its kind doesn't say it.
fn range(schema: &Value) -> Option<String> {
    let unit = schema["x-unit"].as_str().map(|unit| format!(" {unit}"));
    let unit = unit.unwrap_or_default();
    let is_optional = schema["type"]
        .as_array()
        .is_some_and(|types| types.contains(&"null".into()));
    let or_null = if is_optional { ", or `null`" } else { "" };
    let items = schema::range(&schema["items"]).unwrap_or_default();
    let numbers = match schema.get("x-ascending") {
        Some(_) => format!("`[least, most]`, both {items}"),
        None if schema.get("items").is_some() => format!("a list of numbers, each {items}"),
        None => schema::range(schema)?,
    };
    Some(format!(
        "{}{unit}{or_null}",
        numbers.trim_start_matches("of ")
    ))
}

/// The value of the preset `default`, and those of the others where they differ.
fn defaults(name: &str, presets: &[Settings<String>]) -> String {
    let shown = |value: Option<&String>| value.map_or("none".to_owned(), |v| format!("`{v}`"));
    let first = shown(presets[0].get(name));
    let others = PRESETS
        .iter()
        .zip(presets)
        .skip(1)
        .map(|(preset, values)| (preset, shown(values.get(name))));
    let others = others.filter(|(_, value)| *value != first);
    let others: String = others
        .map(|(preset, value)| format!(", {value} in `{}`", preset.name))
        .collect();
    format!("{first}{others}")
}

/// The words that a setting can be, each with its meaning.
fn words(schema: &Value) -> String {
    let words = schema["oneOf"].as_array().into_iter().flatten();
    let word = |word: &Value| {
        Some(format!(
            "  - `{}`: {}\n",
            word["const"].as_str()?,
            description(word)
        ))
    };
    words.filter_map(word).collect()
}

/// The alternatives of a group, by their `kind`.
fn kinds(schema: &Value) -> String {
    let kinds = schema["oneOf"].as_array().into_iter().flatten();
    let kind = |kind: &Value| {
        let name = kind["properties"]["kind"]["const"].as_str()?;
        Some(format!("  - `{name}`: {}\n", description(kind)))
    };
    kinds.filter_map(kind).collect()
}

fn reference() -> String {
    let presets: Vec<_> = PRESETS
        .iter()
        .map(|preset| values(&(preset.plan)()))
        .collect();
    let (groups, single) = schemas();
    let mut text = String::new();
    for (group, schema) in &groups {
        let title = if group.is_empty() {
            "The run".to_owned()
        } else {
            format!("`{group}`")
        };
        text += &format!("### {title}\n\n");
        if !group.is_empty() {
            text += &format!("{}\n\n", description(schema));
        }
        let is_inside = |name: &str| match name.rsplit_once('.') {
            Some((parent, _)) => parent == group,
            None => group.is_empty(),
        };
        for (name, schema) in single.iter().filter(|(name, _)| is_inside(name)) {
            text += &format!("- **`{name}`**");
            let kinds = if name.ends_with(".kind") {
                kinds(&groups[group])
            } else {
                String::new()
            };
            let meaning = if kinds.is_empty() {
                description(schema)
            } else {
                "Which of these it is.".to_owned()
            };
            text += &format!(": {meaning}\n");
            if let Some(range) = range(schema) {
                text += &format!("  Range: {range}.\n");
            }
            text += &format!(
                "  Default: {}.\n{kinds}{}",
                defaults(name, &presets),
                words(schema)
            );
        }
        text += "\n";
    }
    text + "## The presets side by side\n\n" + &table(&presets)
}

fn table(presets: &[Settings<String>]) -> String {
    let mut names: Vec<&String> = presets.iter().flat_map(|values| values.keys()).collect();
    names.sort();
    names.dedup();
    let mut text = String::from("| setting |");
    PRESETS
        .iter()
        .for_each(|p| text += &format!(" `{}` |", p.name));
    text += &format!("\n|{}\n", "---|".repeat(PRESETS.len() + 1));
    for name in names {
        text += &format!("| `{name}` |");
        for values in presets {
            text += &format!(" {} |", values.get(name).map_or("", |value| value));
        }
        text += "\n";
    }
    text
}

#[test]
fn the_page_describes_every_setting() {
    let page = std::fs::read_to_string(PAGE).expect("the page");
    let (prose, written) = page.split_once(MARK).expect("the mark of the reference");
    let reference = reference();
    if std::env::var_os("MIMIC_WRITE_DOCS").is_some_and(|set| set == "1") {
        std::fs::write(PAGE, format!("{prose}{MARK}{reference}")).expect("it is written");
        return;
    }
    let differing = reference.lines().zip(written.lines()).find(|(a, b)| a != b);
    assert_eq!(
        differing, None,
        "MIMIC_WRITE_DOCS=1 writes docs/settings.md anew"
    );
    assert_eq!(reference, written);
}

#[test]
fn every_setting_has_a_meaning() {
    let (_, single) = schemas();
    let silent: Vec<_> = single
        .iter()
        .filter(|(name, schema)| description(schema).is_empty() && !name.ends_with(".kind"))
        .collect();
    assert!(silent.is_empty(), "{silent:?}");
}

/// The schema knows every value of a plan, and the presets are in their ranges.
#[test]
fn the_schema_and_the_presets_agree() {
    let (_, single) = schemas();
    for preset in PRESETS {
        let plan = (preset.plan)();
        assert_eq!(schema::check(&plan, ""), Ok(()), "{}", preset.name);
        for name in values(&plan).keys() {
            assert!(single.contains_key(name), "{name}");
        }
    }
}
