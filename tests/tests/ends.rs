//! How a campaign ends, and what is said of it: audits, abort, impatience, workers that cannot start, a watcher.
//!
//! The realisations are synthetic: see `faults.rs`.

use runout_tests::{COARSE, Cluster, Process, recorded, results, wait_for};
use std::path::Path;

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");

/// Longer than any test: whoever waits for it has not been told to stop.
const FOR_EVER: (&str, &str) = ("SYNTHETIC_MS", "3600000");

/// Stops at the maximum: 60 realisations, whatever the estimates.
fn to_the_maximum() -> String {
    COARSE.replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
}

/// Signals until the process has ended: signals in quick succession count as one.
fn insist(process: &mut Process) {
    wait_for("its end", || {
        let running = process.running();
        if running {
            process.terminate();
        }
        (!running).then_some(())
    });
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

#[test]
fn every_audit_is_run_with_one_worker_and_with_two() {
    let campaign = to_the_maximum().replace("audit_fraction = 0.1", "audit_fraction = 0.9");
    for workers in ["1", "2"] {
        let cluster = Cluster::new(&campaign);
        let mut run = cluster.runout(&[
            "run",
            "campaign.toml",
            "--out",
            "out",
            "--json",
            "--heartbeat",
            "0.25",
            "--workers",
            workers,
            "--worker-program",
            SYNTHETIC,
        ]);
        assert_eq!(run.exit_code(), 3, "{}", run.errors());
        let status = json(&run.output());
        assert_eq!(status["audits_due"], 0, "{status}");
        let agreed = status["audits_agreed"].as_u64().unwrap();
        assert!(agreed > 40, "{status}");
        // Without a coordinator the same is read from the run directory.
        let mut later = cluster.runout(&["status", "out", "--json"]);
        assert_eq!(later.exit_code(), 0, "{}", later.errors());
        let later = json(&later.output());
        assert_eq!((&later["audits_due"], &later["audits_agreed"]), (&0.into(), &agreed.into()));
    }
}

#[test]
fn a_failed_analysis_ends_a_campaign_that_asks_for_it() {
    let campaign = to_the_maximum().replace("on_failure = \"exclude\"", "on_failure = \"abort\"");
    let cluster = Cluster::new(&campaign);
    let run = ["run", "campaign.toml", "--out", "out", "--workers", "2", "--heartbeat", "0.25"];
    let run = [&run[..], &["--worker-program", SYNTHETIC]].concat();
    let mut first = cluster.runout_with(&run, &[("SYNTHETIC_FAILS_AT", "7")]);
    assert_eq!(first.exit_code(), 1, "{}", first.errors());
    assert!(first.output().contains("ended by a failed analysis, realisation 7"), "{}", first.output());
    assert_eq!(results(&cluster.path("out")).lines().count(), 8);
    let mut again = cluster.runout(&run);
    assert_eq!(again.exit_code(), 1, "{}", again.errors());
    assert_eq!(again.output(), first.output());
}

#[test]
fn a_second_signal_ends_at_once() {
    let cluster = Cluster::new(&to_the_maximum());
    let patient = ["--grace", "3600"];
    let (mut coordinator, url) = cluster.serve("out", &patient);
    let mut worker = cluster.worker(Path::new(SYNTHETIC), &url, &patient, &[FOR_EVER]);
    worker.wait_until_said("registered");
    wait_for("its lease", || {
        let mut status = cluster.runout(&["status", "out"]);
        status.wait();
        status.output().contains("realisation 0 (attempt 1)").then_some(())
    });
    coordinator.terminate();
    coordinator.wait_until_said("interrupted: waiting up to");
    assert!(coordinator.running());
    insist(&mut coordinator);
    assert_eq!(coordinator.exit_code(), 130, "{}", coordinator.errors());
    worker.terminate();
    worker.wait_until_said("asked to leave");
    assert!(worker.running());
    insist(&mut worker);
    assert_eq!(worker.exit_code(), 143, "{}", worker.errors());
    // The address that is left behind leads nobody astray.
    let mut status = cluster.runout(&["status", "out", "--watch"]);
    assert_eq!(status.exit_code(), 130, "{}", status.errors());
    assert!(status.output().contains("interrupted"), "{}", status.output());
}

#[test]
fn local_workers_that_cannot_start_end_the_command_and_say_why() {
    let cluster = Cluster::new(&to_the_maximum());
    let run = ["run", "campaign.toml", "--out", "out", "--workers", "2", "--worker-program"];
    let mut refused =
        cluster.runout_with(&[&run[..], &[SYNTHETIC]].concat(), &[("SYNTHETIC_BUILD", "0.0.1")]);
    assert_eq!(refused.exit_code(), 1, "{}", refused.errors());
    let said = refused.errors();
    assert!(said.contains("the worker's build is 0.0.1, the coordinator's is"), "{said}");
    assert!(said.contains("error: no local worker is left"), "{said}");
    // Nobody tries again what cannot succeed.
    assert!(!said.contains("it is replaced"), "{said}");

    let mut crashing = cluster.runout(&[&run[..], &["/bin/false"]].concat());
    assert_eq!(crashing.exit_code(), 1, "{}", crashing.errors());
    assert!(crashing.errors().contains("ended with exit status: 1"), "{}", crashing.errors());

    // The campaign is as good as new.
    let mut sound = cluster.runout(&[&run[..], &[SYNTHETIC]].concat());
    assert_eq!(sound.exit_code(), 3, "{}", sound.errors());
}

#[test]
fn a_watcher_sees_the_campaign_to_its_end_and_all_names_are_there() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let mut unread = cluster.shell("runout status out --watch | true; runout status out --json | true");
    let mut watcher = cluster.runout(&["status", &url, "--json"]);
    assert_eq!(watcher.exit_code(), 0, "{}", watcher.errors());
    let status = json(&watcher.output());
    let names = [
        "state",
        "realisations",
        "samples",
        "stable",
        "failed",
        "mean_m",
        "variance_m2",
        "mean_interval_m",
        "p_failure",
        "rule",
        "workers",
        "eta_s",
    ];
    for name in names {
        assert!(status.get(name).is_some(), "{name} is missing: {status}");
    }
    let mut lines = cluster.runout(&["status", "out", "--watch", "--every", "0.2", "--json"]);
    let mut watcher = cluster.runout(&["status", "out", "--watch", "--every", "0.2"]);
    wait_for("its first look", || watcher.output().contains("running").then_some(()));
    let mut worker = cluster.worker(Path::new(SYNTHETIC), &url, &[], &[]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    assert!(coordinator.output().contains("runout report out"), "{}", coordinator.output());
    // A watcher ends as the campaign does.
    assert_eq!(watcher.exit_code(), 3, "{}", watcher.errors());
    assert!(watcher.output().contains("coarse: maximum"), "{}", watcher.output());
    assert!(!watcher.output().contains('\x1b'), "no escapes where there is no terminal");
    assert_eq!(lines.exit_code(), 3, "{}", lines.errors());
    let states: Vec<String> = lines.output().lines().map(|l| json(l)["state"].to_string()).collect();
    assert_eq!(states.last().map(String::as_str), Some("\"maximum\""), "{states:?}");
    assert!(states.len() > 1 && states[..states.len() - 1].iter().all(|s| s == "\"running\""), "{states:?}");
    assert_eq!(recorded(&cluster.path("out")), 60);
    // A reader that goes away ends a watcher, and quietly.
    unread.wait();
    assert_eq!(unread.errors(), "");
}
