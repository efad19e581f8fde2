//! `runout submit` as far as it goes without a batch system; with one, the system tests take it (tests/tests/slurm.rs).

use std::fs;
use std::process::{Command, Output};
use tempfile::TempDir;

const CAMPAIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../campaigns/quick/campaign.toml");

/// A folder with the program `runout`, something in the place of `runout-worker`, which is only looked for here, and an
/// empty folder.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    // Not by this process: what another test starts meanwhile would hold the new file open for writing, and it could not be
    // executed ("text file busy").
    let copied =
        Command::new("cp").arg(env!("CARGO_BIN_EXE_runout")).arg(folder.path().join("runout")).status();
    assert!(copied.unwrap().success());
    fs::write(folder.path().join("runout-worker"), "").unwrap();
    fs::create_dir(folder.path().join("slope 7")).unwrap();
    folder
}

fn submit(folder: &TempDir, more: &[&str]) -> Output {
    Command::new(folder.path().join("runout"))
        .args(["submit", "slurm", CAMPAIGN, "--out", "run 1"])
        .args(more)
        .current_dir(folder.path().join("slope 7"))
        // No sbatch, wherever this runs.
        .env("PATH", "/nowhere")
        .output()
        .unwrap()
}

fn files_made(folder: &TempDir) -> usize {
    fs::read_dir(folder.path().join("slope 7")).unwrap().count()
}

#[test]
fn a_dry_run_prints_the_scripts_and_leaves_nothing() {
    let folder = folder();
    let output =
        submit(&folder, &["--workers", "3", "--time", "1:00:00", "--dry-run", "--", "--partition=p"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    for part in [
        "#SBATCH --array=1-3",
        "--signal=B:USR1@120",
        "serve \"$run_directory/campaign.toml\"",
        "--partition=p",
    ] {
        assert!(said.contains(part), "{part} in\n{said}");
    }
    let run_directory = format!("run_directory='{}'", folder.path().join("slope 7").join("run 1").display());
    assert!(said.contains(&run_directory), "{run_directory} in\n{said}");
    assert_eq!(files_made(&folder), 0);
}

#[test]
fn without_sbatch_it_says_what_to_do() {
    let folder = folder();
    let output = submit(&folder, &["--workers", "3", "--time", "60"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(said.contains("sbatch cannot be started") && said.contains("--dry-run"), "{said}");
}

#[test]
fn bad_limits_and_flags_are_refused() {
    let folder = folder();
    for (arguments, message) in [
        (&["--workers", "3", "--time", "1"][..], "--time 1: it must be from 2 minutes"),
        (&["--workers", "0", "--time", "60"], "--workers"),
        (&["--workers", "3", "--time", "60", "--", "-t10"], "-t10 after `--`: give the limit with --time"),
    ] {
        let output = submit(&folder, arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(message), "{message} in\n{said}");
    }
    assert_eq!(files_made(&folder), 0);
}
