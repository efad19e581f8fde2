//! Networks that are slow, lossy or cut. The network is a proxy (see `proxy.rs` of the kit); the real thing, network
//! namespaces and `netem`, is an ignored test for a machine where this user is root.
//!
//! The realisations are synthetic: see `faults.rs`.

use runout_tests::proxy::Proxy;
use runout_tests::table::{Figures, acknowledged};
use runout_tests::{COARSE, Cluster, programs, recorded, results, wait_for};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");
const TELLING: (&str, &str) = ("RUST_LOG", "runout_worker=debug");

/// Stops at the maximum: 60 realisations, whatever the estimates.
fn to_the_maximum() -> String {
    COARSE.replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
}

fn undisturbed() -> String {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let _worker = cluster.worker(Path::new(SYNTHETIC), &url, &["--slots", "4"], &[]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    results(&cluster.path("out"))
}

#[test]
fn both_sides_of_a_partition_finish_the_same_index_and_one_outcome_is_recorded() {
    let expected = undisturbed();
    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let proxy = Proxy::to(&url);
    let slow = [("SYNTHETIC_MS", "100"), TELLING];
    let mut cut_off = cluster.worker(Path::new(SYNTHETIC), proxy.url(), &["--name", "cut-off"], &slow);
    let mut other = cluster.worker(Path::new(SYNTHETIC), &url, &["--name", "other"], &slow);
    wait_for("4 outcomes", || (recorded(&out) >= 4).then_some(()));
    proxy.cut();
    let cut = Instant::now();
    wait_for("its loss", || coordinator.errors().contains("worker cut-off is lost").then_some(()));
    let before = recorded(&out);
    wait_for("more outcomes", || (recorded(&out) >= before + 3).then_some(()));
    proxy.heal();
    let healed = Instant::now();
    wait_for("its return", || cut_off.errors().contains("registering again").then_some(()));
    let mut figures = Figures { rounds: 1, recovery: vec![healed.elapsed()], ..Figures::default() };
    assert!(cut.elapsed() > Duration::from_millis(750), "three heartbeats have been missed");
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(cut_off.exit_code(), 0, "{}", cut_off.errors());
    assert_eq!(other.exit_code(), 0, "{}", other.errors());
    // What it finished behind the cut had been run again by the other: equal, and dropped.
    assert!(cut_off.errors().contains("VERDICT_DUPLICATE"), "{}", cut_off.errors());
    let told = &acknowledged(&cut_off.errors()) | &acknowledged(&other.errors());
    figures.take(&out, &expected, &told);
    figures
        .settle("network partition; both sides finish the same index; healed (time until registered again)");
}

#[test]
fn a_slow_network_that_loses_segments_costs_time_only() {
    let expected = undisturbed();
    let cluster = Cluster::new(&to_the_maximum());
    // A heartbeat and its answer take 0.2 s on this network, and each loss as much again.
    let (mut coordinator, url) = cluster.serve("out", &["--hang", "60"]);
    let proxy = Proxy::to(&url);
    proxy.slow(Duration::from_millis(100), 100);
    let started = Instant::now();
    let more = ["--slots", "8"];
    let mut workers = [0, 1].map(|_| cluster.worker(Path::new(SYNTHETIC), proxy.url(), &more, &[TELLING]));
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    let mut figures = Figures { rounds: 1, recovery: vec![started.elapsed()], ..Figures::default() };
    for worker in &mut workers {
        assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    }
    assert!(proxy.lost() > 0, "no segment was lost");
    let told = &acknowledged(&workers[0].errors()) | &acknowledged(&workers[1].errors());
    figures.take(&cluster.path("out"), &expected, &told);
    figures.settle("slow network: 100 ms each way, 1 % of segments late by 200 ms (time of 60 realisations)");
}

/// A network namespace for the workers, joined to this one by a pair of devices, taken down at the end.
struct Namespace(&'static str);

impl Namespace {
    fn make() -> Result<Namespace, String> {
        let namespace = Namespace("runout-test");
        let steps = [
            "ip netns add runout-test",
            "ip link add runout-test0 type veth peer name eth0 netns runout-test",
            "ip addr add 10.213.7.1/24 dev runout-test0",
            "ip link set runout-test0 up",
            "ip -n runout-test addr add 10.213.7.2/24 dev eth0",
            "ip -n runout-test link set eth0 up",
            "ip -n runout-test link set lo up",
            "tc qdisc add dev runout-test0 root netem delay 100ms loss 1%",
            "tc -n runout-test qdisc add dev eth0 root netem delay 100ms loss 1%",
        ];
        for step in steps {
            let done = Command::new("sh").args(["-c", step]).output().map_err(|e| e.to_string())?;
            if !done.status.success() {
                return Err(format!("{step}: {}", String::from_utf8_lossy(&done.stderr)));
            }
        }
        Ok(namespace)
    }
}

impl Drop for Namespace {
    fn drop(&mut self) {
        // The devices go with it.
        let _ = Command::new("ip").args(["netns", "del", self.0]).status();
    }
}

#[test]
#[ignore = "it needs root, network namespaces and netem; it fails where they are missing"]
fn a_network_with_100_ms_and_one_per_cent_of_loss_costs_time_only() {
    let expected = undisturbed();
    let _namespace = Namespace::make().unwrap_or_else(|why| panic!("NO REAL NETWORK HERE: {why}"));
    let cluster = Cluster::new(&to_the_maximum());
    let listen = "10.213.7.1:17421";
    let arguments = ["serve", "campaign.toml", "--out", "out", "--listen", listen, "--insecure"];
    let mut coordinator = cluster.runout(&arguments);
    wait_for("the coordinator", || cluster.path("out/coordinator.addr").exists().then_some(()));
    let started = Instant::now();
    let line = format!(
        "exec ip netns exec runout-test {SYNTHETIC} --coordinator http://{listen} --slots 8 --spool spool"
    );
    let _ = programs();
    let mut workers = [cluster.shell(&line), cluster.shell(&line)];
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    let mut figures = Figures { rounds: 1, recovery: vec![started.elapsed()], ..Figures::default() };
    for worker in &mut workers {
        assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    }
    figures.take(&cluster.path("out"), &expected, &Default::default());
    figures.settle("slow network by netem: 100 ms and 1 % loss each way (time of 60 realisations)");
}
