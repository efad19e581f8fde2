//! A wall clock that jumps. Leases, heartbeats and hangs are measured with the monotonic clock, so that setting the
//! time of day (by hand, by NTP after a long drift, by a virtual machine that was suspended) loses no worker.
//!
//! libfaketime stands between the processes and the wall clock; the monotonic clock stays what it is, as with a real
//! jump.

use runout_tests::table::Figures;
use runout_tests::{COARSE, Cluster, recorded, results, wait_for};
use std::fs;
use std::path::{Path, PathBuf};

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");

/// Where Debian puts the library.
fn faketime() -> Option<PathBuf> {
    let folders = fs::read_dir("/usr/lib").ok()?.flatten();
    folders.map(|folder| folder.path().join("faketime/libfaketime.so.1")).find(|path| path.is_file())
}

#[test]
fn jumps_of_the_wall_clock_lose_nobody() {
    let Some(library) = faketime() else {
        eprintln!(
            "SKIPPED: jumps of the wall clock (libfaketime is not installed: apt-get install libfaketime)"
        );
        return;
    };
    let campaign = COARSE.replace("mean_half_width = 0.2", "mean_half_width = 1e-6");
    let undisturbed = Cluster::new(&campaign);
    let (mut coordinator, url) = undisturbed.serve("out", &[]);
    let _worker = undisturbed.worker(Path::new(SYNTHETIC), &url, &["--slots", "4"], &[]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());

    let cluster = Cluster::new(&campaign);
    let out = cluster.path("out");
    let clock = cluster.path("clock");
    fs::write(&clock, "+0").unwrap();
    let variables = [
        ("LD_PRELOAD", library.to_str().unwrap()),
        ("FAKETIME_TIMESTAMP_FILE", clock.to_str().unwrap()),
        ("FAKETIME_NO_CACHE", "1"),
        ("FAKETIME_DONT_FAKE_MONOTONIC", "1"),
        ("SYNTHETIC_MS", "120"),
    ];
    let serve = ["serve", "campaign.toml", "--out", "out", "--listen", "127.0.0.1:0", "--heartbeat", "0.25"];
    let mut coordinator = cluster.runout_with(&serve, &variables);
    let address = out.join("coordinator.addr");
    let url = wait_for("the address", || fs::read_to_string(&address).ok()).trim().to_owned();
    let mut workers =
        ["a", "b"].map(|name| cluster.worker(Path::new(SYNTHETIC), &url, &["--name", name], &variables));
    let mut figures = Figures::default();
    let mut late = None;
    for jump in ["+400d", "-400d", "+1h", "-30y"] {
        let before = recorded(&out);
        fs::write(&clock, jump).unwrap();
        // A worker that comes now is noted under another year: the clock does jump.
        let late = late.get_or_insert_with(|| {
            cluster.worker(Path::new(SYNTHETIC), &url, &["--name", "late"], &variables)
        });
        late.wait_until_said("registered");
        wait_for("more outcomes", || (recorded(&out) >= before + 4).then_some(()));
        figures.rounds += 1;
    }
    let mut now = cluster.shell("date +%Y");
    now.wait();
    let mut late = late.expect("there were jumps");
    assert!(!late.errors().starts_with(now.output().trim()), "the clock did not jump: {}", late.errors());
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    for worker in workers.iter_mut().chain([&mut late]) {
        assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    }
    assert!(!coordinator.errors().contains("is lost"), "{}", coordinator.errors());
    assert!(!coordinator.errors().contains("takes no more steps"), "{}", coordinator.errors());
    let records = runout::run_directory::read(&out).unwrap().records;
    assert!(records.iter().all(|record| (0.0..60.0).contains(&record.wall_s)), "{records:?}");
    figures.take(&out, &results(&undisturbed.path("out")), &(0..60).collect());
    figures.settle("jumps of the wall clock by 1 h to 30 years, both ways");
}
