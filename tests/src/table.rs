//! Figures of a fault: how often it was caused, what it cost, and how long it lasted. Every test of a fault writes its
//! own to `target/faults/`; `cargo test --release -p runout-tests --test table -- --ignored --nocapture` prints all of
//! them as one table.

use crate::{programs, results};
use runout::store::log::Entry;
use runout::store::scan::{Line, Place, scan_file};
use runout::store::wire::Gist;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::time::Duration;

/// What became of a fault.
#[derive(Debug, Default)]
pub struct Figures {
    /// How often the fault was caused.
    pub rounds: u64,
    /// Outcomes that a worker was told are recorded, or that were seen in the log, and that are not there at the end.
    pub lost: u64,
    /// Indices with more than one recorded outcome.
    pub duplicated: u64,
    /// Results that are not those of the undisturbed campaign, to the byte.
    pub wrong: u64,
    /// From the end of the fault (or from the fault, where it does not end) to the next recorded outcome.
    pub recovery: Vec<Duration>,
}

impl Figures {
    /// Compares a run directory with the results of the undisturbed campaign and with what was acknowledged.
    ///
    /// # Panics
    /// The run directory cannot be read.
    pub fn take(&mut self, out: &Path, expected: &str, acknowledged: &BTreeSet<u64>) {
        let mut times: BTreeMap<u64, u64> = BTreeMap::new();
        let log = out.join("outcomes.log");
        let scanned = scan_file(&log, Place::default(), |line: Line<'_, Gist>| {
            if let Entry::Outcome(record) = line.entry {
                *times.entry(record.index).or_default() += 1;
            }
            Ok(())
        });
        scanned.expect("a log");
        self.lost += acknowledged.iter().filter(|index| !times.contains_key(index)).count() as u64;
        self.duplicated += times.values().filter(|count| **count > 1).count() as u64;
        let found = results(out);
        let (found, expected): (Vec<&str>, Vec<&str>) = (found.lines().collect(), expected.lines().collect());
        let differ = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
        self.wrong += (differ + found.len().abs_diff(expected.len())) as u64;
    }

    /// Writes the figures for the table under the words `fault`, and insists that nothing was lost, duplicated or wrong.
    ///
    /// # Panics
    /// Something was.
    pub fn settle(&self, fault: &str) {
        let ms = |d: Duration| d.as_secs_f64() * 1e3;
        let mut recovery = self.recovery.clone();
        recovery.sort();
        let row = serde_json::json!({
            "fault": fault,
            "rounds": self.rounds,
            "lost": self.lost,
            "duplicated": self.duplicated,
            "wrong": self.wrong,
            "recovery_median_ms": recovery.get(recovery.len() / 2).copied().map(ms),
            "recovery_longest_ms": recovery.last().copied().map(ms),
        });
        let folder = programs().parent().expect("the target folder").join("faults");
        fs::create_dir_all(&folder).expect("a folder");
        let name: String = fault.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        fs::write(folder.join(format!("{name}.json")), row.to_string()).expect("a file");
        assert_eq!((self.lost, self.duplicated, self.wrong), (0, 0, 0), "lost, duplicated, wrong: {row}");
    }
}

/// Indices that a worker was told are recorded, from what it said at the level `debug`.
pub fn acknowledged(said: &str) -> BTreeSet<u64> {
    let index = |line: &str| {
        let (_, rest) = line.split_once("realisation ")?;
        let (index, rest) = rest.split_once(", attempt ")?;
        let told = rest.ends_with("VERDICT_RECORDED") || rest.ends_with("VERDICT_DUPLICATE");
        told.then(|| index.parse().ok()).flatten()
    };
    said.lines().filter_map(index).collect()
}

/// The table of all figures in `target/faults`, as Markdown.
///
/// # Panics
/// A file there is none of ours.
pub fn table() -> String {
    let folder = programs().parent().expect("the target folder").join("faults");
    let mut rows: Vec<String> = fs::read_dir(&folder)
        .into_iter()
        .flatten()
        .flatten()
        .filter(|entry| entry.path().extension().is_some_and(|e| e == "json"))
        .map(|entry| {
            let text = fs::read_to_string(entry.path()).expect("a file");
            let row: serde_json::Value = serde_json::from_str(&text).expect("figures are JSON");
            let seconds =
                |key: &str| row[key].as_f64().map_or("-".to_owned(), |ms| format!("{:.2}", ms / 1e3));
            format!(
                "| {} | {} | {} | {} | {} | {} | {} |",
                row["fault"].as_str().expect("a fault has words"),
                row["rounds"],
                row["lost"],
                row["duplicated"],
                row["wrong"],
                seconds("recovery_median_ms"),
                seconds("recovery_longest_ms"),
            )
        })
        .collect();
    rows.sort();
    let head = "| fault | rounds | lost | duplicated | wrong | to recover, s (median) | (longest) |";
    format!("{head}\n|---|---:|---:|---:|---:|---:|---:|\n{}\n", rows.join("\n"))
}
