//! `--set KEY=VALUE`: a campaign with some keys changed, without another file.
//!
//! The key is dotted (`analysis.courant_number`), the value in TOML's syntax (`0.4`, `"one-phase"`, `[1.0, 2.0]`). What
//! comes out is checked like any campaign: an unknown key or a value out of range is the usual error.

use runout_core::campaign::file::CampaignFile;
use std::fmt;
use std::str::FromStr;
use toml::{Table, Value};

/// A key of the campaign file and the value it takes instead.
#[derive(Debug, Clone, PartialEq)]
pub struct Override {
    key: String,
    value: Value,
}

impl FromStr for Override {
    type Err = String;

    fn from_str(text: &str) -> Result<Override, String> {
        let (key, value) =
            text.split_once('=').ok_or("it must be KEY=VALUE, for example mesh.cell_size_m=0.8")?;
        let key = key.trim();
        if key.split('.').any(|part| part.is_empty() || part.contains(char::is_whitespace)) {
            return Err(format!("`{key}` is no key of a campaign file, for example mesh.cell_size_m"));
        }
        let value = value.trim();
        let mut table: Table = toml::from_str(&format!("value = {value}")).map_err(|_| {
            format!(
                "`{value}` is no TOML value; text needs quotes, for example 'water.ground_surface=\"closed\"'"
            )
        })?;
        match (table.remove("value"), table.is_empty()) {
            (Some(value), true) => Ok(Override { key: key.to_owned(), value }),
            _ => Err(format!("`{value}` is more than one TOML value")),
        }
    }
}

impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "--set {}={}", self.key, self.value)
    }
}

/// Campaign text with the overrides applied.
///
/// # Errors
/// An override that fits no campaign: which one, and why. Faults that `text` has by itself are left for the
/// reader of the result to find.
pub fn apply(text: &str, overrides: &[Override]) -> Result<String, (Override, String)> {
    let Ok(written) = toml::from_str::<Table>(text) else { return Ok(text.to_owned()) };
    let mut table = written.clone();
    for change in overrides {
        set(&mut table, change).map_err(|why| (change.clone(), why))?;
    }
    let Some(why) = fault(&table) else {
        // A table always has a text: the error cannot come.
        return Ok(toml::to_string(&table).unwrap_or_else(|_| text.to_owned()));
    };
    // Several may belong together, so that only the whole is judged; the one that has the fault by itself is to blame.
    let has_it = |change: &&Override| {
        let mut alone = written.clone();
        set(&mut alone, change).is_ok() && fault(&alone).as_ref() == Some(&why)
    };
    match overrides.iter().find(has_it).or(overrides.first()) {
        Some(change) if fault(&written).is_none() => Err((change.clone(), why)),
        // The file has faults of its own: they are reported with its lines.
        _ => Ok(text.to_owned()),
    }
}

/// Why a table is no campaign file: a missing or unknown key, or a wrong type.
fn fault(table: &Table) -> Option<String> {
    table.clone().try_into::<CampaignFile>().err().map(|e| e.to_string().trim_end().to_owned())
}

fn set(table: &mut Table, change: &Override) -> Result<(), String> {
    let mut parts: Vec<&str> = change.key.split('.').collect();
    let last = parts.pop().unwrap_or_default();
    let mut inner = table;
    for part in parts {
        let entry = inner.entry(part).or_insert_with(|| Value::Table(Table::new()));
        inner = entry.as_table_mut().ok_or_else(|| format!("`{part}` is a value, not a section"))?;
    }
    inner.insert(last.to_owned(), change.value.clone());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMPAIGN: &str = include_str!("../tests/inputs/good/given.toml");

    fn with(changes: &[&str]) -> Result<String, (Override, String)> {
        let changes: Vec<Override> = changes.iter().map(|c| c.parse().unwrap()).collect();
        apply(CAMPAIGN, &changes)
    }

    #[test]
    fn keys_at_every_depth_take_the_new_value() {
        let text = with(&["mesh.cell_size_m=0.25", "water.ground_surface=\"closed\"", "seed = 9"]).unwrap();
        let campaign = runout_core::campaign::parse(&text).unwrap();
        assert_eq!(campaign.seed, 9);
        assert_eq!(campaign.model.mesh.cell_size_m, 0.25);
        assert_eq!(campaign.model.water.ground_surface, runout_core::campaign::GroundSurface::Closed);
    }

    #[test]
    fn without_overrides_the_campaign_is_the_same() {
        let parse = |text: &str| runout_core::campaign::parse(text).unwrap();
        assert_eq!(parse(&with(&[]).unwrap()), parse(CAMPAIGN));
    }

    #[test]
    fn an_unknown_key_or_a_wrong_type_is_named() {
        let (change, why) = with(&["mesh.cell_size_m=0.25", "mesh.cell_size=0.25"]).unwrap_err();
        assert_eq!(change.to_string(), "--set mesh.cell_size=0.25");
        assert!(why.contains("unknown field `cell_size`") && why.contains("`cell_size_m`"), "{why}");
        let (_, why) = with(&["seed=\"nine\""]).unwrap_err();
        assert!(why.contains("invalid type"), "{why}");
        let (_, why) = with(&["seed.deep=1"]).unwrap_err();
        assert!(why.contains("`seed` is a value"), "{why}");
    }

    #[test]
    fn keys_of_a_new_section_are_judged_together() {
        let section =
            ["residual_cohesion_ratio=0.5", "residual_friction_ratio=0.5", "residual_dilation_ratio=1.0"];
        let mut changes = section.map(|key| format!("soil.softening.{key}")).to_vec();
        let all = |changes: &[String]| with(&changes.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(all(&changes).unwrap_err().1.contains("missing field `displacement_m`"));
        changes.push("soil.softening.displacement_m=0.2".into());
        assert!(runout_core::campaign::parse(&all(&changes).unwrap()).is_ok());
    }

    #[test]
    fn what_is_no_override_is_refused() {
        for text in
            ["mesh", "=1", "mesh..x=1", "mesh.cell_size_m=", "water.ground_surface=closed", "seed=1\nname=2"]
        {
            assert!(text.parse::<Override>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_key_that_the_file_lacks_may_be_given() {
        let lacking = CAMPAIGN.replace("courant_number", "# courant_number");
        let change = ["analysis.courant_number=0.5".parse().unwrap()];
        let campaign = runout_core::campaign::parse(&apply(&lacking, &change).unwrap()).unwrap();
        assert_eq!(campaign.model.analysis.courant_number, 0.5);
    }
}
