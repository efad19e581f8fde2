//! Disks that are full, may not be written, or give back something else than was written.
//!
//! The realisations are synthetic: see `faults.rs`.

use runout_tests::table::Figures;
use runout_tests::{COARSE, Cluster, programs, recorded, results, wait_for};
use std::fs::{self, File, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");

const RUN: [&str; 8] =
    ["run", "campaign.toml", "--out", "out", "--workers", "2", "--worker-program", SYNTHETIC];

/// Stops at so many realisations, whatever the estimates.
fn stopping_at(maximum: usize) -> String {
    COARSE
        .replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
        .replace("maximum_realisations = 60", &format!("maximum_realisations = {maximum}"))
}

#[test]
fn a_full_disk_ends_the_campaign_and_room_lets_it_go_on() {
    // Far more than there is room for.
    let cluster = Cluster::new(&stopping_at(100_000));
    let out = cluster.path("out");
    let mut full = cluster.runout_limited(&RUN, 640, &[("SYNTHETIC_MS", "0")]);
    assert_eq!(full.exit_code(), 1, "{}", full.errors());
    assert!(full.errors().contains("error: cannot store outcomes"), "{}", full.errors());
    let advice = "nothing acknowledged is lost, repair this and run the command again";
    assert!(full.errors().contains(advice), "{}", full.errors());
    assert!(full.errors().contains("File too large"), "{}", full.errors());
    let kept = recorded(&out);
    assert!(kept > 20, "{kept} outcomes were recorded before the disk was full");

    // The stopping rule is no part of the campaign's identity: the run goes on with another maximum.
    fs::write(cluster.path("campaign.toml"), stopping_at(kept + 20)).unwrap();
    let mut again = cluster.runout(&RUN);
    assert_eq!(again.exit_code(), 3, "{}", again.errors());
    assert_eq!(results(&out).lines().count(), kept + 20);

    let undisturbed = Cluster::new(&stopping_at(kept + 20));
    assert_eq!(undisturbed.runout(&RUN).exit_code(), 3);
    let mut figures = Figures { rounds: 1, ..Figures::default() };
    figures.take(&out, &results(&undisturbed.path("out")), &(0..kept as u64).collect());
    figures.settle("disk full under the coordinator: it ends, and goes on once there is room");
}

#[test]
fn what_may_not_be_written_is_named() {
    let cluster = Cluster::new(&stopping_at(60));
    fs::write(cluster.path("file"), "").unwrap();
    let serve = |out: &str| {
        let mut process =
            cluster.runout(&["serve", "campaign.toml", "--out", out, "--listen", "127.0.0.1:0"]);
        assert_eq!(process.exit_code(), 2, "{}", process.errors());
        process.errors()
    };
    let said = serve("file");
    assert!(said.contains("error: file: "), "{said}");

    let locked = cluster.path("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, Permissions::from_mode(0o555)).unwrap();
    if File::create(locked.join("probe")).is_err() {
        let said = serve("locked/out");
        assert!(said.contains("error: locked/out: Permission denied"), "{said}");
        let said = serve("locked");
        assert!(said.contains("error: locked/coordinator.lock: Permission denied"), "{said}");
        return;
    }
    // This user may write anywhere: the same as nobody, with a copy of the program that nobody can reach.
    fs::remove_file(locked.join("probe")).unwrap();
    fs::copy(programs().join("runout"), cluster.path("runout")).unwrap();
    open_to_all(&cluster.path("."));
    let as_nobody = |out: &str| {
        let line = format!(
            "exec setpriv --reuid=65534 --regid=65534 --clear-groups ./runout serve campaign.toml --out {out} \
             --listen 127.0.0.1:0"
        );
        let mut process = cluster.shell(&line);
        assert_eq!(process.exit_code(), 2, "{}", process.errors());
        process.errors()
    };
    let said = as_nobody("locked/out");
    assert!(said.contains("error: locked/out: Permission denied"), "{said}");
    let said = as_nobody("locked");
    assert!(said.contains("error: locked/coordinator.lock: Permission denied"), "{said}");
    // A campaign of somebody else's: it can be read and not continued.
    let mut finished = cluster.runout(&RUN);
    assert_eq!(finished.exit_code(), 3, "{}", finished.errors());
    let said = as_nobody("out");
    assert!(said.contains("error: out/coordinator.lock: Permission denied"), "{said}");
    let mut status =
        cluster.shell("exec setpriv --reuid=65534 --regid=65534 --clear-groups ./runout status out");
    assert_eq!(status.exit_code(), 0, "{}", status.errors());
    assert!(status.output().contains("maximum"), "{}", status.output());
}

/// Everybody may read the folder and what lies in it.
fn open_to_all(folder: &Path) {
    fs::set_permissions(folder, Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn a_worker_whose_disk_is_full_reports_from_memory() {
    let cluster = Cluster::new(&stopping_at(60));
    let (mut coordinator, url) = cluster.serve("out", &[]);
    // No file may hold a byte where it runs; what it says goes through a pipe.
    let line = format!(
        "(trap '' XFSZ; ulimit -f 0; exec {SYNTHETIC} --coordinator {url} --slots 2 --spool spool) 2>&1 | cat >&2"
    );
    let mut worker = cluster.shell(&line);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    worker.wait();
    assert!(
        worker.errors().contains("the outcome is not spooled and lives in memory only"),
        "{}",
        worker.errors()
    );

    let undisturbed = Cluster::new(&stopping_at(60));
    assert_eq!(undisturbed.runout(&RUN).exit_code(), 3);
    let mut figures = Figures { rounds: 1, ..Figures::default() };
    let all = (0..60).collect();
    figures.take(&cluster.path("out"), &results(&undisturbed.path("out")), &all);
    figures.settle("disk full under a worker's spool, throughout");
}

#[test]
fn damage_is_named_and_outcomes_are_restored() {
    let undisturbed = Cluster::new(&stopping_at(60));
    assert_eq!(undisturbed.runout(&RUN).exit_code(), 3);

    let cluster = Cluster::new(&stopping_at(60));
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let mut worker = cluster.worker(Path::new(SYNTHETIC), &url, &[], &[("SYNTHETIC_MS", "20")]);
    wait_for("10 outcomes", || (recorded(&out) >= 10).then_some(()));
    coordinator.kill();
    worker.kill();

    // One digit of the third outcome.
    let log = out.join("outcomes.log");
    let text = fs::read_to_string(&log).unwrap();
    let third = text.lines().nth(2).unwrap();
    fs::write(&log, text.replace(third, &third.replace("\"index\":2", "\"index\":3"))).unwrap();
    let mut status = cluster.runout(&["status", "out"]);
    assert_eq!(status.exit_code(), 0, "{}", status.errors());
    assert!(status.output().contains("damage: line 3: checksum or form is wrong"), "{}", status.output());
    let mut table = cluster.runout(&["results", "out"]);
    assert_eq!(table.exit_code(), 0, "{}", table.errors());
    assert!(table.errors().contains("line 3: checksum or form is wrong"), "{}", table.errors());

    // A spec that was tampered with is nobody's campaign.
    let spec = out.join("spec.json");
    let frozen = fs::read_to_string(&spec).unwrap();
    let damaged = |text: &str, expected: &str| {
        fs::write(&spec, text).unwrap();
        let commands: [&[&str]; 4] = [&["status", "out"], &["results", "out"], &["report", "out"], &RUN];
        for command in commands {
            let mut process = cluster.runout(command);
            assert_eq!(process.exit_code(), 2, "{command:?}: {}", process.errors());
            let said = process.errors();
            assert!(said.contains("spec.json: ") && said.contains(expected), "{command:?}: {said}");
        }
    };
    damaged(&frozen.replace("\"seed\": 20231", "\"seed\": 20232"), "the file was changed");
    damaged(&frozen[..frozen.len() / 2], "not a frozen spec");
    fs::write(&spec, &frozen).unwrap();

    let mut resumed = cluster.runout(&RUN);
    assert_eq!(resumed.exit_code(), 3, "{}", resumed.errors());
    assert!(resumed.errors().contains("outcomes.log: 1 outcomes restored from sled"), "{}", resumed.errors());
    assert_eq!(results(&out), results(&undisturbed.path("out")));
}
