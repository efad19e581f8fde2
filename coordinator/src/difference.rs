//! The difference of two JSON documents, key by key, for people.

use serde_json::Value;
use std::collections::BTreeSet;

/// Most differences that are listed.
const MOST: usize = 20;

/// One line for each place where `found` differs from `expected`: `key: expected -> found`.
pub fn lines(expected: &Value, found: &Value) -> Vec<String> {
    let mut lines = Vec::new();
    walk("", expected, found, &mut lines);
    if lines.len() > MOST {
        let more = lines.len() - MOST;
        lines.truncate(MOST);
        lines.push(format!("and {more} more"));
    }
    lines
}

fn walk(path: &str, expected: &Value, found: &Value, lines: &mut Vec<String>) {
    match (expected, found) {
        (Value::Object(a), Value::Object(b)) => {
            let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            for key in keys {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                walk(&path, a.get(key).unwrap_or(&Value::Null), b.get(key).unwrap_or(&Value::Null), lines);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (place, (a, b)) in a.iter().zip(b).enumerate() {
                walk(&format!("{path}[{place}]"), a, b, lines);
            }
        }
        _ if expected == found => {}
        _ => lines.push(format!("{path}: {expected} -> {found}")),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    #[test]
    fn each_difference_is_named_by_its_key() {
        let a = json!({"seed": 1, "model": {"mesh": {"cell": 0.5}, "same": [1, 2]}, "random": [{"p": 1.0}]});
        let b = json!({"seed": 2, "model": {"mesh": {"cell": 0.4}, "same": [1, 2]}, "random": [{"p": 1.5}]});
        let expected = ["model.mesh.cell: 0.5 -> 0.4", "random[0].p: 1.0 -> 1.5", "seed: 1 -> 2"];
        assert_eq!(super::lines(&a, &b), expected);
        assert!(super::lines(&a, &a).is_empty());
    }
}
