//! The description of the campaign file is true: it has the parser's keys, its ranges are those of the checks, every
//! campaign of this repository fits the schema, and the reference page in docs/ is the one it makes.

use runout::schema::{self, Key, Kind, Range, SECTIONS, Section};
use runout_core::campaign::{CampaignError, parse_with_profile};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use toml::{Table, Value as Toml};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_owned()
}

/// Campaign files that are sound: those of the repository and the good inputs of the tests.
fn campaigns() -> Vec<PathBuf> {
    let folders = ["elkhorn-river", "salt-creek", "quick", "layered-slope", "readings"]
        .map(|f| root().join("campaigns").join(f));
    let inputs = root().join("coordinator/tests/inputs/good");
    let mut files: Vec<PathBuf> = folders
        .iter()
        .chain([&inputs])
        .flat_map(|folder| std::fs::read_dir(folder).expect("the folder is there"))
        .map(|entry| entry.expect("it can be read").path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    files.sort();
    assert!(files.len() >= 12, "{files:?}");
    files
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Campaigns that together have every section, with every key that they may have at the same time.
fn bases() -> Vec<Table> {
    let mut bases: Vec<Table> = ["given.toml", "section.toml", "measured.toml"]
        .map(|name| read(&root().join("coordinator/tests/inputs/good").join(name)).parse().expect("TOML"))
        .into();
    bases.push(read(&root().join("campaigns/layered-slope/drawdown.toml")).parse().expect("TOML"));
    bases.push(read(&root().join("campaigns/elkhorn-river/paper.toml")).parse().expect("TOML"));
    let target = |text: &str| text.parse::<Table>().expect("TOML");
    let softening = target(
        "residual_cohesion_ratio = 0.5\nresidual_friction_ratio = 0.5\nresidual_dilation_ratio = 0.5\ndisplacement_m = 0.1",
    );
    for base in &mut bases {
        let soil = base["soil"].as_table_mut().expect("a table");
        soil.entry("softening").or_insert(Toml::Table(softening.clone()));
        let stop = base["stop"].as_table_mut().expect("a table");
        if stop["rule"].as_str() == Some("interval") {
            let exceedance = target("distance_m = 5.0\nhalf_width = 0.1");
            stop.insert("exceedance".to_owned(), Toml::Array(vec![Toml::Table(exceedance)]));
        }
        if let Some(layers) = base.get_mut("layers").and_then(Toml::as_array_mut) {
            let layer = layers[0].as_table_mut().expect("a table");
            layer.entry("softening").or_insert(Toml::Table(softening.clone()));
        }
    }
    bases
}

/// The tables of a section in a campaign: several where its header says so.
fn tables<'a>(campaign: &'a mut Table, section: &Section) -> Vec<&'a mut Table> {
    let path: Vec<&str> = match section.name {
        "" => Vec::new(),
        "fit.marginals" => vec!["fit", "marginals", "cohesion_kpa"],
        "softening" => vec!["soil", "softening"],
        name => name.split('.').collect(),
    };
    let mut found = vec![campaign];
    for step in path {
        found = found
            .into_iter()
            .filter_map(|table| table.get_mut(step))
            .flat_map(|value| match value {
                Toml::Table(table) => vec![table],
                Toml::Array(list) => list.iter_mut().filter_map(Toml::as_table_mut).collect(),
                _ => Vec::new(),
            })
            .collect();
    }
    found
}

/// What the program says of a campaign; one with a profile is given a profile.
fn parsed(campaign: &Table) -> Result<(), CampaignError> {
    let profile = campaign["slope"].get("profile").map(|name| {
        let folders = ["coordinator/tests/inputs/good", "campaigns/layered-slope"].map(|f| root().join(f));
        let file = folders.iter().map(|f| f.join(name.as_str().expect("a name"))).find(|f| f.is_file());
        runout_core::campaign::profile::parse(&read(&file.expect("it is there"))).expect("a profile")
    });
    parse_with_profile(&campaign.to_string(), profile.as_ref()).map(|_| ())
}

fn words_in_ticks(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn the_keys_are_those_that_the_parser_knows() {
    for section in SECTIONS {
        let mut seen = false;
        for mut base in bases() {
            if parsed(&base).is_err() || tables(&mut base, section).is_empty() {
                continue;
            }
            seen = true;
            tables(&mut base, section)[0].insert("not_a_key".to_owned(), Toml::Boolean(true));
            let Err(CampaignError::Form { message, .. }) = parsed(&base) else {
                panic!("{}: an unknown key is taken", section.header)
            };
            let known: BTreeSet<String> = message
                .lines()
                .filter(|line| line.contains("unknown field"))
                .flat_map(words_in_ticks)
                .filter(|word| word != "not_a_key")
                .collect();
            let described: BTreeSet<String> = section.keys.iter().map(|key| key.name.to_owned()).collect();
            assert_eq!(described, known, "{}", section.header);
        }
        assert!(seen, "no sound campaign has {}", section.header);
    }
}

#[test]
fn what_is_needed_is_missed_and_what_is_not_is_not() {
    for section in SECTIONS {
        for key in section.keys {
            for mut base in bases() {
                for table in tables(&mut base, section) {
                    table.remove(key.name);
                }
                if tables(&mut base, section).is_empty() {
                    continue;
                }
                let missed = match parsed_form(&base) {
                    Err(message) => message.contains(&format!("missing field `{}`", key.name)),
                    Ok(()) => false,
                };
                assert_eq!(missed, key.absent.is_none(), "{} {}", section.header, key.name);
            }
        }
    }
}

/// What the parser says of the form alone.
fn parsed_form(campaign: &Table) -> Result<(), String> {
    toml::from_str::<runout_core::campaign::file::CampaignFile>(&campaign.to_string())
        .map(|_| ())
        .map_err(|e| e.to_string())
}

/// Numbers just beyond the ends of a range, and the ends themselves where they are not in it.
fn beyond(range: &Range) -> Vec<f64> {
    let mut values = Vec::new();
    if let Some((low, allowed)) = range.low {
        values.push(if allowed { low - 1e-3 * low.abs().max(1.0) } else { low });
    }
    if let Some((high, allowed)) = range.high {
        values.push(if allowed { high + 1e-3 * high.abs().max(1.0) } else { high });
    }
    values
}

/// Values of a key that its description does not allow.
fn refused(kind: &Kind) -> Vec<Toml> {
    match kind {
        Kind::Number(range) => beyond(range).into_iter().map(Toml::Float).collect(),
        Kind::Whole(least, _) if *least > 0 => vec![Toml::Integer(*least as i64 - 1)],
        Kind::Words(_) => vec![Toml::String("not-a-word".to_owned())],
        Kind::With(name, range) => beyond(range)
            .into_iter()
            .map(|value| Toml::Table([((*name).to_owned(), Toml::Float(value))].into_iter().collect()))
            .collect(),
        Kind::Either(kinds) => kinds.iter().flat_map(refused).collect(),
        _ => Vec::new(),
    }
}

#[test]
fn what_is_beyond_a_range_is_refused_and_the_key_named() {
    let mut tried = 0;
    for section in SECTIONS {
        for key in section.keys {
            for value in refused(&key.kind) {
                for mut base in bases() {
                    let there = tables(&mut base, section).first().is_some_and(|t| t.contains_key(key.name));
                    if !there {
                        continue;
                    }
                    tables(&mut base, section)[0].insert(key.name.to_owned(), value.clone());
                    match parsed(&base) {
                        Err(CampaignError::Value { key: named, .. }) => {
                            assert!(
                                named.contains(key.name),
                                "{} {} = {value}: {named}",
                                section.header,
                                key.name
                            )
                        }
                        other => panic!("{} {} = {value}: {other:?}", section.header, key.name),
                    }
                    tried += 1;
                }
            }
        }
    }
    assert!(tried > 150, "{tried}");
}

#[test]
fn the_ends_that_a_range_includes_are_taken() {
    for section in SECTIONS {
        for key in section.keys {
            let Kind::Number(range) = &key.kind else { continue };
            for (end, allowed) in [range.low, range.high].into_iter().flatten() {
                for mut base in bases() {
                    let there = tables(&mut base, section).first().is_some_and(|t| t.contains_key(key.name));
                    if !allowed || !there {
                        continue;
                    }
                    tables(&mut base, section)[0].insert(key.name.to_owned(), Toml::Float(end));
                    // Something else may be wrong with it then: a foundation that ends above the ground, say.
                    if let Err(CampaignError::Value { allowed, .. }) = parsed(&base) {
                        let by_range = ["it must be 0 or greater", "it must be from", "it must be in"];
                        assert!(
                            !by_range.iter().any(|words| allowed.starts_with(words)),
                            "{}: {allowed}",
                            key.name
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn every_campaign_fits_the_schema() {
    let schema = schema::json();
    for path in campaigns() {
        let campaign: Toml = toml::from_str(&read(&path)).expect("TOML");
        let document = serde_json::to_value(&campaign).expect("JSON");
        let faults = faults(&schema, &schema, &document, "");
        assert!(faults.is_empty(), "{}: {faults:?}", path.display());
    }
}

#[test]
fn what_does_not_fit_is_found() {
    let schema = schema::json();
    let file = root().join("campaigns/elkhorn-river/campaign.toml");
    let campaign: Toml = toml::from_str(&read(&file)).expect("TOML");
    let sound = serde_json::to_value(&campaign).expect("JSON");
    let changes: [(&str, Value, &str); 8] = [
        ("/field/rotation_deg", 91.into(), "/field/rotation_deg"),
        ("/field/autocorrelation", "exponential".into(), "/field/autocorrelation"),
        ("/mesh/points_per_cell_side", 2.5.into(), "/mesh/points_per_cell_side"),
        ("/soil/porosity", 0.into(), "/soil/porosity"),
        ("/slope/base", serde_json::json!({ "friction": -1 }), "/slope/base"),
        ("/site/columns", serde_json::json!({ "cohesion": "c" }), "/site/columns"),
        ("/analysis/stop_at_rest", "yes".into(), "/analysis/stop_at_rest"),
        ("/stop", serde_json::json!({ "rule": "paper" }), "/stop"),
    ];
    for (place, value, named) in changes {
        let mut wrong = sound.clone();
        *wrong.pointer_mut(place).expect("it is there") = value;
        let faults = faults(&schema, &schema, &wrong, "");
        assert!(faults.iter().any(|fault| fault.starts_with(named)), "{place}: {faults:?}");
    }
    let mut wrong = sound;
    wrong["soil"]["cohesion"] = 3.into();
    assert_eq!(faults(&schema, &schema, &wrong, ""), ["/soil: unknown cohesion"]);
}

/// Why `value` does not fit `schema`: the parts of draft 7 that the schema uses, and a panic at any other.
fn faults(root: &Value, schema: &Value, value: &Value, at: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (word, rule) in schema.as_object().expect("a schema is an object") {
        let sub = |schema: &Value| faults(root, schema, value, at);
        let number = || value.as_f64().zip(rule.as_f64());
        let list = value.as_array();
        let fits = match word.as_str() {
            "$schema" | "title" | "description" | "definitions" | "properties" => true,
            "$ref" => {
                let place = rule.as_str().and_then(|r| r.strip_prefix('#')).expect("a place in the schema");
                found.extend(sub(root.pointer(place).unwrap_or_else(|| panic!("{place}"))));
                true
            }
            "allOf" => {
                rule.as_array().expect("a list").iter().for_each(|schema| found.extend(sub(schema)));
                true
            }
            "anyOf" => rule.as_array().expect("a list").iter().any(|schema| sub(schema).is_empty()),
            "type" => match rule.as_str().expect("a word") {
                "object" => value.is_object(),
                "array" => value.is_array(),
                "string" => value.is_string(),
                "boolean" => value.is_boolean(),
                "integer" => value.is_u64() || value.is_i64(),
                "number" => value.is_number(),
                other => panic!("type {other}"),
            },
            "enum" => rule.as_array().expect("a list").contains(value),
            "minimum" => number().is_none_or(|(value, end)| value >= end),
            "maximum" => number().is_none_or(|(value, end)| value <= end),
            "exclusiveMinimum" => number().is_none_or(|(value, end)| value > end),
            "exclusiveMaximum" => number().is_none_or(|(value, end)| value < end),
            "minItems" => list.is_none_or(|list| list.len() as u64 >= rule.as_u64().expect("a number")),
            "maxItems" => list.is_none_or(|list| list.len() as u64 <= rule.as_u64().expect("a number")),
            "items" => {
                for (i, item) in list.into_iter().flatten().enumerate() {
                    found.extend(faults(root, rule, item, &format!("{at}/{i}")));
                }
                true
            }
            "required" => {
                let names = rule.as_array().expect("a list").iter().filter_map(Value::as_str);
                names.filter(|name| value.is_object() && value.get(name).is_none()).for_each(|name| {
                    found.push(format!("{at}: {name} is missing"));
                });
                true
            }
            "propertyNames" => value
                .as_object()
                .into_iter()
                .flatten()
                .all(|(name, _)| faults(root, rule, &name.as_str().into(), at).is_empty()),
            "additionalProperties" => {
                for (name, value) in value.as_object().into_iter().flatten() {
                    let place = format!("{at}/{name}");
                    match schema.get("properties").and_then(|known| known.get(name)) {
                        Some(known) => found.extend(faults(root, known, value, &place)),
                        None if rule.is_object() => found.extend(faults(root, rule, value, &place)),
                        None => found.push(format!("{at}: unknown {name}")),
                    }
                }
                true
            }
            other => panic!("the schema uses {other}, which this test does not know"),
        };
        if !fits {
            found.push(format!("{at}: {value} does not fit {word} {rule}"));
        }
    }
    found
}

#[test]
fn the_reference_page_is_up_to_date() {
    let file = root().join("docs/campaign-file.md");
    assert!(
        std::fs::read_to_string(&file).is_ok_and(|text| text == schema::page()),
        "write it anew: target/release/runout schema --page > docs/campaign-file.md"
    );
}

#[test]
fn every_number_has_a_unit_and_every_key_a_meaning() {
    for section in SECTIONS {
        assert!(section.meaning.ends_with('.'), "{}", section.header);
        for key in section.keys {
            let Key { name, kind, meaning, .. } = key;
            assert!(meaning.len() > 7 && meaning.ends_with('.'), "{name}: {meaning}");
            let number = matches!(kind, Kind::Number(_) | Kind::Pair | Kind::Line);
            assert!(!number || !key.unit().is_empty(), "{name}");
        }
    }
}

#[test]
fn the_command_prints_both() {
    let printed = |more: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_runout")).arg("schema").args(more).output().expect("it starts");
        assert!(output.status.success());
        String::from_utf8(output.stdout).expect("text")
    };
    assert_eq!(serde_json::from_str::<Value>(&printed(&[])).expect("JSON"), schema::json());
    assert_eq!(printed(&["--page"]), schema::page());
}
