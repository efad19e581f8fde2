//! The description as a JSON schema (draft 7, which editors of TOML know).

use super::keys::PROPERTIES;
use super::{Key, Kind, Range, SECTIONS, Section};
use serde_json::{Map, Value, json};

/// The schema of a campaign file.
pub fn json() -> Value {
    let (top, sections) = SECTIONS.split_first().expect("the top level comes first");
    let definitions: Map<String, Value> =
        sections.iter().map(|section| (section.name.to_owned(), table(section))).collect();
    let mut schema = table(top);
    schema["$schema"] = json!("http://json-schema.org/draft-07/schema#");
    schema["title"] = json!("Runout campaign");
    schema["definitions"] = Value::Object(definitions);
    schema
}

fn table(section: &Section) -> Value {
    let properties: Map<String, Value> =
        section.keys.iter().map(|key| (key.name.to_owned(), property(key))).collect();
    let required: Vec<&str> =
        section.keys.iter().filter(|key| key.absent.is_none()).map(|key| key.name).collect();
    json!({
        "type": "object",
        "description": section.meaning,
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

fn property(key: &Key) -> Value {
    let mut described = key.meaning.to_owned();
    if !matches!(key.unit(), "" | "1") {
        described += &format!(" Unit: {}.", key.unit());
    }
    if let Some(absent) = key.absent {
        described += &format!(" Absent: {absent}.");
    }
    let mut value = kind(&key.kind);
    if value.get("$ref").is_some() {
        // Beside a reference draft 7 reads nothing.
        value = json!({ "allOf": [value] });
    }
    value["description"] = json!(described);
    value
}

fn kind(of: &Kind) -> Value {
    let section = |name: &str| json!({ "$ref": format!("#/definitions/{name}") });
    let point = || json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 });
    match of {
        Kind::Text => json!({ "type": "string" }),
        Kind::Words(words) => json!({ "type": "string", "enum": words }),
        Kind::Number(range) => number(range),
        Kind::Whole(least, most) => {
            let mut value = json!({ "type": "integer", "minimum": least });
            if *most < u64::MAX {
                value["maximum"] = json!(most);
            }
            value
        }
        Kind::Flag => json!({ "type": "boolean" }),
        Kind::Pair => point(),
        Kind::Line => json!({ "type": "array", "items": point(), "minItems": 1 }),
        Kind::Matrix => {
            json!({ "type": "array", "items": { "type": "array", "items": { "type": "number" } } })
        }
        Kind::With(name, range) => json!({
            "type": "object",
            "properties": { (*name): number(range) },
            "required": [name],
            "additionalProperties": false,
        }),
        Kind::Either(kinds) => json!({ "anyOf": kinds.iter().map(kind).collect::<Vec<_>>() }),
        Kind::Table(name) => section(name),
        Kind::Tables(name) => json!({ "type": "array", "items": section(name) }),
        Kind::ByProperty(each) => json!({
            "type": "object",
            "propertyNames": { "enum": PROPERTIES },
            "additionalProperties": kind(each),
        }),
    }
}

fn number(range: &Range) -> Value {
    let mut value = json!({ "type": "number" });
    if let Some((low, allowed)) = range.low {
        value[if allowed { "minimum" } else { "exclusiveMinimum" }] = json!(low);
    }
    if let Some((high, allowed)) = range.high {
        value[if allowed { "maximum" } else { "exclusiveMaximum" }] = json!(high);
    }
    value
}
