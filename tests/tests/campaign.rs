//! A real campaign on a coarse slope: the same results to the byte for one worker, for two, for two threads that share each
//! realisation, and killed with -9 (the coordinator once, workers twice) and resumed.

use runout_tests::{COARSE, Cluster, Process, programs, recorded, signal, wait_for};

/// Stops at the maximum, 40 realisations, so that there is time to be killed in.
fn campaign() -> String {
    COARSE
        .replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
        .replace("maximum_realisations = 60", "maximum_realisations = 40")
}

fn run(cluster: &Cluster, workers: &str) -> Process {
    let arguments =
        ["run", "campaign.toml", "--out", "out", "--workers", workers, "--json", "--heartbeat", "0.5"];
    cluster.runout(&arguments)
}

/// `runout results`, without the last three columns: attempt, worker and wall time.
fn results(cluster: &Cluster) -> String {
    let mut process = cluster.runout(&["results", "out"]);
    assert_eq!(process.exit_code(), 0, "{}", process.errors());
    let table = process.output();
    assert!(table.lines().next().unwrap().ends_with("attempt,worker,wall_s"), "{table}");
    table.lines().map(|line| line.rsplitn(4, ',').last().unwrap().to_owned() + "\n").collect()
}

fn finished(cluster: &Cluster, mut process: Process) -> String {
    // 3: the maximum was reached, as this campaign wants.
    assert_eq!(process.exit_code(), 3, "{}", process.errors());
    assert!(process.output().contains("\"state\": \"maximum\""), "{}", process.output());
    results(cluster)
}

#[test]
fn one_worker_two_workers_two_threads_and_killed_and_resumed_give_the_same_bytes() {
    let one = Cluster::new(&campaign());
    let expected = finished(&one, run(&one, "1"));
    assert_eq!(expected.lines().count(), 41);

    let two = Cluster::new(&campaign());
    assert_eq!(finished(&two, run(&two, "2")), expected);

    let threads = Cluster::new(&campaign());
    let (mut coordinator, url) = threads.serve("out", &[]);
    let mut worker =
        threads.worker(&programs().join("runout-worker"), &url, &["--slots", "1", "--threads", "2"], &[]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    assert_eq!(results(&threads), expected);

    let killed = Cluster::new(&campaign());
    let out = killed.path("out");
    let mut process = run(&killed, "2");
    for count in [3, 8] {
        wait_for("outcomes", || (recorded(&out) >= count).then_some(()));
        let worker = wait_for("a worker", || process.children().first().copied());
        signal("-KILL", worker);
    }
    wait_for("outcomes", || (recorded(&out) >= 12).then_some(()));
    process.kill();
    assert!(recorded(&out) < 40, "the campaign was over before it could be killed");
    let resumed = run(&killed, "2");
    assert_eq!(finished(&killed, resumed), expected);
}
