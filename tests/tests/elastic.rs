//! Workers that come and go by themselves: before a time limit, after idling, and to a coordinator that has moved.
//!
//! The realisations are synthetic: see `faults.rs`.

use runout_tests::{COARSE, Cluster, Process, recorded, results, wait_for};
use std::path::Path;

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");

/// Longer than any test: it can only be given back.
const FOR_EVER: (&str, &str) = ("SYNTHETIC_MS", "3600000");

/// Stops at the maximum: 60 realisations, whatever the estimates.
fn to_the_maximum() -> String {
    COARSE.replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
}

fn worker(cluster: &Cluster, url: &str, more: &[&str], faults: &[(&str, &str)]) -> Process {
    cluster.worker(Path::new(SYNTHETIC), url, more, faults)
}

#[test]
fn a_worker_is_gone_by_its_time_limit_and_nothing_is_lost_with_it() {
    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let limit = ["--leave-after", "2", "--grace", "0.2"];

    // One that has time for some, one that cannot finish a single one.
    let mut brief = worker(&cluster, &url, &limit, &[("SYNTHETIC_MS", "300")]);
    assert_eq!(brief.exit_code(), 0, "{}", brief.errors());
    assert!(brief.errors().contains("too short for another realisation"), "{}", brief.errors());
    let before = recorded(&out);
    assert!((1..7).contains(&before), "{before} of 300 ms in 2 s");
    let mut stuck = worker(&cluster, &url, &limit, &[FOR_EVER]);
    assert_eq!(stuck.exit_code(), 0, "{}", stuck.errors());
    assert!(stuck.errors().contains("the time limit is near"), "{}", stuck.errors());
    assert_eq!(recorded(&out), before);

    assert!(coordinator.running(), "{}", coordinator.errors());
    let mut last = worker(&cluster, &url, &[], &[]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert!(!coordinator.errors().contains("is lost"), "{}", coordinator.errors());
    assert_eq!(last.exit_code(), 0, "{}", last.errors());
    assert_eq!(results(&out).lines().count(), 60);
}

#[test]
fn an_idle_worker_leaves_if_told_so() {
    let campaign = to_the_maximum()
        .replace("minimum_realisations = 20", "minimum_realisations = 2")
        .replace("maximum_realisations = 60", "maximum_realisations = 2");
    let cluster = Cluster::new(&campaign);
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let busy = [1, 2].map(|_| worker(&cluster, &url, &["--idle-leave", "0.5"], &[FOR_EVER]));
    wait_for("both realisations to be taken", || {
        let mut status = cluster.runout(&["status", &url]);
        assert_eq!(status.exit_code(), 0, "{}", status.errors());
        (status.output().matches("    realisation ").count() == 2).then_some(())
    });
    let mut idle = worker(&cluster, &url, &["--idle-leave", "0.5"], &[]);
    assert_eq!(idle.exit_code(), 0, "{}", idle.errors());
    assert!(idle.errors().contains("nothing to do for long"), "{}", idle.errors());
    // Those that have something to do stay.
    for mut worker in busy {
        assert!(worker.running(), "{}", worker.errors());
    }
    assert!(coordinator.running(), "{}", coordinator.errors());
}

#[test]
fn a_worker_waits_for_a_coordinator_and_follows_it_when_it_moves() {
    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let mut worker = cluster.shell(
        "SYNTHETIC_MS=50 exec synthetic-worker --run-directory out --slots 1 --spool spool --name follower",
    );
    let (mut coordinator, first) = cluster.serve("out", &[]);
    wait_for("outcomes", || (recorded(&out) >= 5).then_some(()));
    coordinator.kill();
    let (mut coordinator, second) = cluster.serve("out", &[]);
    assert_ne!(first, second);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    assert!(
        worker.errors().contains(&format!("the coordinator has moved to {second}")),
        "{}",
        worker.errors()
    );
    assert_eq!(results(&out).lines().count(), 60);
}
