//! What the programs write is read by others as docs/results.md says: the ParaView series by meshio, the table of outcomes
//! by pandas and polars, each held against the program's own numbers (tests/python/readers.py); the Python of the page runs.
//!
//! Python and its packages are not ours to install: without them this says loudly that it has tested nothing.
//! `RUNOUT_PYTHON` names an interpreter that has them, for example of a virtual environment made with
//! `python3 -m venv DIR && DIR/bin/pip install pandas pyarrow polars matplotlib meshio`.

use runout_tests::{COARSE, Cluster, say_not_tested, wait_up_to};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Imports of large packages from a cold disk.
const PATIENCE: Duration = Duration::from_secs(300);

/// The interpreter, if it has all packages.
fn python() -> Option<String> {
    let python = std::env::var("RUNOUT_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let tried =
        Command::new(&python).args(["-c", "import pandas, pyarrow, polars, matplotlib, meshio"]).output();
    let why = match tried {
        Ok(output) if output.status.success() => return Some(python),
        Ok(output) => {
            String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or("it says nothing").to_owned()
        }
        Err(e) => e.to_string(),
    };
    say_not_tested("reading results with pandas, polars and meshio", &format!("{python}: {why}"));
    None
}

/// The blocks of Python on the page, by the name in the comment before each.
fn blocks(page: &str) -> Vec<(&str, &str)> {
    let parts = page.split("<!-- run: ").skip(1);
    let found = parts.map(|part| {
        let (name, rest) = part.split_once(" -->\n```python\n").expect("a block follows the comment");
        (name, rest.split_once("```").expect("the block ends").0)
    });
    found.collect()
}

#[test]
fn others_read_what_is_written() {
    let Some(python) = python() else { return };
    let cluster = Cluster::new(&COARSE.replacen("threshold_m = 0.1", "threshold_m = 0.1\nprofile = true", 1));
    let shell = |line: &str| {
        let mut process = cluster.shell(&format!("set -eu\n{line}"));
        wait_up_to(PATIENCE, line, || (!process.running()).then_some(()));
        assert_eq!(process.exit_code(), 0, "{line}\n{}{}", process.output(), process.errors());
        process.output()
    };
    shell(
        "runout simulate campaign.toml --deterministic --every 0.5 --out slide --no-animation --json > outcome.json",
    );
    shell("runout run campaign.toml --out run --no-page");
    shell("runout status run --json > status.json");
    shell("runout results run > outcomes.csv");
    shell("runout results run --format parquet --out outcomes.parquet");

    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/readers.py");
    let said = shell(&format!("'{python}' '{}'", script.display()));
    assert!(said.contains("readers agree"), "{said}");

    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/results.md");
    let page = std::fs::read_to_string(page).expect("docs/results.md");
    let blocks = blocks(&page);
    assert_eq!(blocks.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["pandas", "polars", "meshio"]);
    let outputs: Vec<String> = blocks
        .iter()
        .map(|(name, text)| {
            std::fs::write(cluster.path(&format!("{name}.block")), text).expect("a file");
            // No screen to draw on.
            shell(&format!("MPLBACKEND=Agg '{python}' {name}.block"))
        })
        .collect();
    for picture in ["exceedance.png", "exceedance-polars.png"] {
        let bytes = std::fs::read(cluster.path(picture)).expect("the page's picture");
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 5000, "{picture}: {} bytes", bytes.len());
    }
    let outcome = std::fs::read_to_string(cluster.path("outcome.json")).expect("an outcome");
    let outcome: serde_json::Value = serde_json::from_str(&outcome).expect("JSON");
    let largest: f64 = outputs[2].trim().parse().expect("a number");
    let expected = outcome["max_displacement_m"].as_f64().expect("a number");
    assert!((largest / expected - 1.0).abs() < 1e-12, "{largest} and {expected}");
}
