//! Processes that die, disagree, or must not start: the campaign's results stay the same.
//!
//! The realisations are synthetic (a set time, an outcome that follows from the index), so that the faults come at
//! the moments they are wanted.

use runout_proto::identity;
use runout_proto::v1::RegisterRequest;
use runout_proto::v1::coordinator_client::CoordinatorClient;
use runout_tests::table::Figures;
use runout_tests::{COARSE, Cluster, recorded, results, wait_for};
use std::collections::BTreeSet;
use std::net::TcpListener;
use std::path::Path;
use std::time::Instant;

fn synthetic() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_synthetic-worker"))
}

/// Stops at the maximum: 60 realisations, whatever the estimates.
fn to_the_maximum() -> String {
    COARSE.replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
}

/// The results of an undisturbed campaign with `workers` workers.
fn undisturbed(campaign: &str, workers: usize, code: i32) -> String {
    let cluster = Cluster::new(campaign);
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let mut workers: Vec<_> = (0..workers).map(|_| cluster.worker(synthetic(), &url, &[], &[])).collect();
    assert_eq!(coordinator.exit_code(), code, "{}", coordinator.errors());
    for worker in &mut workers {
        assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    }
    assert!(!cluster.path("out/coordinator.addr").exists());
    results(&cluster.path("out"))
}

#[test]
fn results_do_not_depend_on_the_number_of_workers() {
    let one = undisturbed(COARSE, 1, 0);
    // Convergence is reached before the maximum, with leases beyond the stopping index in flight.
    assert!((20..60).contains(&one.lines().count()), "{one}");
    assert_eq!(undisturbed(COARSE, 3, 0), one);
}

#[test]
fn killed_and_resumed_equals_never_interrupted() {
    let expected = undisturbed(&to_the_maximum(), 2, 3);
    assert_eq!(expected.lines().count(), 60);

    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let slow = [("SYNTHETIC_MS", "40")];
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let mut first = cluster.worker(synthetic(), &url, &[], &slow);
    let mut second = cluster.worker(synthetic(), &url, &[], &slow);
    wait_for("10 outcomes", || (recorded(&out) >= 10).then_some(()));
    first.kill();
    let mut third = cluster.worker(synthetic(), &url, &[], &slow);
    wait_for("20 outcomes", || (recorded(&out) >= 20).then_some(()));
    coordinator.kill();
    third.kill();
    // The same port, so that the second worker, which has kept trying, finds it again.
    let (_, port) = url.rsplit_once(':').unwrap();
    let listen = format!("127.0.0.1:{port}");
    let mut coordinator = cluster.runout(&[
        "serve",
        "campaign.toml",
        "--out",
        "out",
        "--listen",
        &listen,
        "--heartbeat",
        "0.25",
    ]);
    let mut fourth = cluster.worker(synthetic(), &url, &[], &slow);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(second.exit_code(), 0, "{}", second.errors());
    assert_eq!(fourth.exit_code(), 0, "{}", fourth.errors());
    assert!(second.errors().contains("registering again"), "{}", second.errors());
    assert_eq!(results(&out), expected);

    // A finished campaign says so at once.
    let mut again = cluster.runout(&["serve", "campaign.toml", "--out", "out", "--json"]);
    assert_eq!(again.exit_code(), 3);
    assert!(again.output().contains("\"state\": \"maximum\""), "{}", again.output());
}

#[test]
fn an_index_that_takes_workers_down_is_poison_and_the_campaign_goes_on() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let panics = [("SYNTHETIC_PANICS_AT", "7")];
    let mut worker = cluster.worker(synthetic(), &url, &[], &panics);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    let results = results(&cluster.path("out"));
    assert_eq!(results.lines().count(), 60);
    assert!(results.lines().nth(7).unwrap().contains("\"reason\":\"poison\""), "{results}");
}

/// Every outcome is audited; one of the workers computes other bits.
fn audited() -> String {
    to_the_maximum().replace("audit_fraction = 0.1", "audit_fraction = 1.0")
}

/// The odd worker comes first and alone: it records, and audits itself. Two sound ones contradict it then.
#[test]
fn a_worker_with_other_bits_is_overruled_although_it_came_first_and_its_results_are_run_again() {
    let expected = undisturbed(&audited(), 1, 3);
    let cluster = Cluster::new(&audited());
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &["--json"]);
    let slow = ("SYNTHETIC_MS", "20");
    let odd = [slow, ("SYNTHETIC_OTHER_BITS", "1")];
    let mut odd = cluster.worker(synthetic(), &url, &["--name", "odd"], &odd);
    wait_for("5 outcomes", || (recorded(&out) >= 5).then_some(()));
    let started = Instant::now();
    let sound = |name| cluster.worker(synthetic(), &url, &["--name", name], &[slow]);
    let (mut first, mut second) = (sound("first"), sound("second"));
    assert_eq!(odd.exit_code(), 0, "{}", odd.errors());
    let mut figures = Figures { rounds: 1, recovery: vec![started.elapsed()], ..Figures::default() };
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    for worker in [&mut first, &mut second] {
        assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    }
    let said = coordinator.errors();
    assert!(said.contains("another digest"), "{said}");
    assert!(said.contains("worker odd computes other bits than others and is set aside"), "{said}");
    assert!(said.contains("the outcome recorded first was wrong"), "{said}");
    assert!(!said.contains("worker first computes") && !said.contains("worker second computes"), "{said}");
    assert!(coordinator.output().contains("\"audits_due\": 0"), "{}", coordinator.output());
    figures.take(&out, &expected, &BTreeSet::new());
    figures.settle(
        "worker with wrong bits, first and alone: overruled, its results run again (time until set aside)",
    );
}

/// Two workers that differ: neither is believed until a third has run it, whenever that comes, and the answer survives
/// a restart of the coordinator in between.
#[test]
fn of_two_workers_that_differ_a_third_decides() {
    let expected = undisturbed(&audited(), 1, 3);
    let cluster = Cluster::new(&audited());
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let slow = ("SYNTHETIC_MS", "40");
    let sound = |name| cluster.worker(synthetic(), &url, &["--name", name], &[slow]);
    let odd = [slow, ("SYNTHETIC_OTHER_BITS", "1")];
    let (mut first, mut odd) = (sound("first"), cluster.worker(synthetic(), &url, &["--name", "odd"], &odd));
    coordinator.wait_until_said("another digest");
    coordinator.kill();
    let mut coordinator = cluster.serve_again("out", &url, &[]);
    wait_for("more outcomes", || (recorded(&out) >= 20).then_some(()));
    assert!(!coordinator.errors().contains("set aside"), "{}", coordinator.errors());
    let mut second = sound("second");
    assert_eq!(odd.exit_code(), 0, "{}", odd.errors());
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    for worker in [&mut first, &mut second] {
        assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    }
    assert!(coordinator.errors().contains("worker odd computes other bits"), "{}", coordinator.errors());
    let mut figures = Figures { rounds: 1, ..Figures::default() };
    figures.take(&out, &expected, &BTreeSet::new());
    figures.settle("two workers differ and the coordinator is killed: a third run decides");
}

/// Two workers that differ end the campaign undecided; a third that comes to the finished one decides.
#[test]
fn what_is_contested_when_the_campaign_ends_is_decided_when_it_is_run_again() {
    let expected = undisturbed(&audited(), 1, 3);
    let cluster = Cluster::new(&audited());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let worker = |name, faults: &[_]| cluster.worker(synthetic(), &url, &["--name", name], faults);
    let both = [worker("first", &[]), worker("odd", &[("SYNTHETIC_OTHER_BITS", "1")])];
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    both.into_iter().for_each(|mut worker| assert_eq!(worker.exit_code(), 0, "{}", worker.errors()));
    assert!(!coordinator.errors().contains("set aside"), "{}", coordinator.errors());

    let mut coordinator = cluster.serve_again("out", &url, &[]);
    coordinator.wait_until_said("contested");
    let mut third = worker("third", &[]);
    assert_eq!(third.exit_code(), 0, "{}", third.errors());
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert!(coordinator.errors().contains("worker odd computes other bits"), "{}", coordinator.errors());
    assert_eq!(results(&cluster.path("out")), expected);
    let mut done = cluster.serve_again("out", &url, &[]);
    assert_eq!(done.exit_code(), 3, "nothing is left to do: {}", done.errors());
}

/// One of three local workers computes other bits: under another name it would be trusted anew.
#[test]
fn a_local_worker_that_was_set_aside_is_not_replaced() {
    let cluster = Cluster::new(&audited());
    let script = cluster.path("worker.sh");
    let text = format!(
        "#!/bin/sh\ncase \"$*\" in *local-2.*) export SYNTHETIC_OTHER_BITS=1;; esac\nexec {} \"$@\"\n",
        synthetic().display()
    );
    std::fs::write(&script, text).unwrap();
    std::fs::set_permissions(&script, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let script = script.to_str().unwrap();
    let mut run = cluster.runout_with(
        &["run", "campaign.toml", "--out", "out", "--workers", "3", "--worker-program", script],
        &[("SYNTHETIC_MS", "40")],
    );
    assert_eq!(run.exit_code(), 3, "{}", run.errors());
    let said = run.errors();
    assert!(said.contains("worker local-2.1 was set aside and is not replaced"), "{said}");
    assert!(!said.contains("local-2.2"), "{said}");
}

#[test]
fn a_realisation_that_hangs_is_cancelled_and_run_again() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, url) = cluster.serve("out", &["--hang", "0.5"]);
    let hangs = [("SYNTHETIC_HANGS_AT", "7")];
    let mut worker = cluster.worker(synthetic(), &url, &[], &hangs);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    assert!(coordinator.errors().contains("realisation 7 takes no more steps"), "{}", coordinator.errors());
    assert!(worker.errors().contains("realisation 7 is not needed any more"), "{}", worker.errors());
    assert_eq!(results(&cluster.path("out")), undisturbed(&to_the_maximum(), 1, 3));
}

#[test]
fn a_straggler_is_repeated_by_an_idle_worker() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let mut slow = cluster.worker(synthetic(), &url, &["--name", "slow"], &[("SYNTHETIC_MS", "3600000")]);
    wait_for("its lease", || {
        let mut status = cluster.runout(&["status", &url, "--json"]);
        status.wait();
        status.output().contains("\"attempt\": 1").then_some(())
    });
    let mut idle = cluster.worker(synthetic(), &url, &["--name", "idle"], &[]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(idle.exit_code(), 0, "{}", idle.errors());
    assert_eq!(slow.exit_code(), 0, "{}", slow.errors());
    assert_eq!(results(&cluster.path("out")), undisturbed(&to_the_maximum(), 1, 3));
}

#[test]
fn sigterm_drains_coordinator_and_worker() {
    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let slow = [("SYNTHETIC_MS", "30")];
    let mut worker = cluster.worker(synthetic(), &url, &[], &slow);
    wait_for("5 outcomes", || (recorded(&out) >= 5).then_some(()));
    worker.terminate();
    assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    let mut worker = cluster.worker(synthetic(), &url, &["--give-up-after", "1"], &slow);
    wait_for("10 outcomes", || (recorded(&out) >= 10).then_some(()));
    coordinator.terminate();
    assert_eq!(coordinator.exit_code(), 130, "{}", coordinator.errors());
    assert!(!out.join("coordinator.addr").exists());
    // It keeps trying for as long as it was told to.
    assert_eq!(worker.exit_code(), 1);
    assert!(worker.errors().contains("has not answered"), "{}", worker.errors());
    // Nothing was lost: no index was given out in vain but those beyond what is recorded.
    let mut status = cluster.runout(&["status", "out", "--json"]);
    assert_eq!(status.exit_code(), 0);
    assert!(status.output().contains("\"state\": \"interrupted\""), "{}", status.output());
}

#[test]
fn what_must_not_start_does_not() {
    let cluster = Cluster::new(&to_the_maximum());
    let (_coordinator, url) = cluster.serve("out", &[]);
    let refused = |arguments: &[&str], expected: &str| {
        let mut process = cluster.runout(arguments);
        assert_eq!(process.exit_code(), 2, "{}", process.errors());
        assert!(process.errors().contains(expected), "{}", process.errors());
    };
    // A second coordinator for the same run directory.
    refused(&["serve", "campaign.toml", "--out", "out", "--listen", "127.0.0.1:0"], "another coordinator");
    // A run directory of another campaign: the difference is shown.
    let other = to_the_maximum().replace("height_m = 15.0", "height_m = 14.0");
    std::fs::write(cluster.path("other.toml"), other).unwrap();
    let (_other, _) = cluster.serve("second", &[]);
    drop(_other);
    refused(
        &["serve", "other.toml", "--out", "second", "--listen", "127.0.0.1:0"],
        "model.slope.surface.uniform.height_m: 15.0 -> 14.0",
    );
    // A directory that holds something else.
    std::fs::create_dir(cluster.path("full")).unwrap();
    std::fs::write(cluster.path("full/thesis.txt"), "").unwrap();
    refused(&["serve", "campaign.toml", "--out", "full", "--listen", "127.0.0.1:0"], "thesis.txt");
    // A port in use, and one that others could reach.
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    refused(&["serve", "campaign.toml", "--out", "third", "--listen", &address], "cannot listen on");
    refused(&["serve", "campaign.toml", "--out", "third", "--listen", "0.0.0.0:0"], "--insecure");
    assert!(!cluster.path("third").exists());
    // The coordinator is still there.
    let mut status = cluster.runout(&["status", &url]);
    assert_eq!(status.exit_code(), 0, "{}", status.errors());
    assert!(status.output().contains("running"), "{}", status.output());
}

#[test]
fn a_worker_of_another_build_or_machine_is_refused() {
    let cluster = Cluster::new(&to_the_maximum());
    let (_coordinator, url) = cluster.serve("out", &[]);
    let sound = RegisterRequest {
        protocol: identity::PROTOCOL,
        build: identity::build(),
        fingerprint: identity::fingerprint(identity::kernel().unwrap()),
        name: "test".into(),
        slots: 1,
        held: vec![],
        machine: None,
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut client = CoordinatorClient::connect(url).await.unwrap();
        client.register(sound.clone()).await.unwrap();
        let requests = [
            (RegisterRequest { protocol: 999, ..sound.clone() }, "the worker's protocol is 999"),
            (RegisterRequest { build: "0.0.1".into(), ..sound.clone() }, "the worker's build is 0.0.1"),
            (RegisterRequest { fingerprint: "00".into(), ..sound.clone() }, "computes other bits"),
            (RegisterRequest { slots: 0, ..sound.clone() }, "slots = 0 is not allowed"),
            (RegisterRequest { name: "\u{7}".into(), ..sound }, "printable"),
        ];
        for (request, expected) in requests {
            let status = client.register(request).await.unwrap_err();
            assert!(status.message().contains(expected), "{}", status.message());
        }
    });
}
