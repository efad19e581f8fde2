//! Faults with figures: processes killed, stopped, paused or stuck at any moment; what it costs, and how long it lasts.
//!
//! The realisations are synthetic: see `faults.rs`.

use runout_tests::table::{Figures, acknowledged};
use runout_tests::{COARSE, Cluster, Process, recorded, results, wait_for};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");
/// Workers say what they were told.
const TELLING: (&str, &str) = ("RUST_LOG", "runout_worker=debug");

/// Stops at the maximum: 60 realisations, whatever the estimates.
fn to_the_maximum() -> String {
    COARSE.replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
}

/// The results of the campaign when nothing goes wrong.
fn undisturbed(campaign: &str) -> String {
    let cluster = Cluster::new(campaign);
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let _worker = cluster.worker(Path::new(SYNTHETIC), &url, &["--slots", "4"], &[]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    results(&cluster.path("out"))
}

/// Random numbers from a seed (SplitMix64), so that a round can be had again.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) % bound
    }
}

/// Waits until the run directory holds more outcomes than `before`; how long that took.
fn until_more(out: &Path, before: usize) -> Duration {
    let started = Instant::now();
    wait_for("another outcome", || (recorded(out) > before).then_some(()));
    started.elapsed()
}

#[derive(Clone, Copy)]
enum Victim {
    Worker(usize),
    Coordinator,
    Everybody,
}

/// Kills processes of one campaign, one victim after the other at random moments, and replaces them.
fn killed_campaign(random: &mut Random, victims: &[Victim], expected: &str, figures: &mut Figures) {
    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let slow = [("SYNTHETIC_MS", "80"), TELLING];
    let worker = |url: &str| cluster.worker(Path::new(SYNTHETIC), url, &[], &slow);
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let mut workers = [worker(&url), worker(&url)];
    let mut told = BTreeSet::new();
    for victim in victims {
        // At a moment that has nothing to do with what the processes do; never after the end, which is far.
        std::thread::sleep(Duration::from_millis(random.below(200)));
        match *victim {
            Victim::Worker(which) => {
                workers[which].kill();
                told.extend(acknowledged(&workers[which].errors()));
                workers[which] = worker(&url);
            }
            Victim::Coordinator => {
                coordinator.kill();
                coordinator = cluster.serve_again("out", &url, &[]);
            }
            Victim::Everybody => {
                coordinator.kill();
                workers.iter_mut().for_each(Process::kill);
                told.extend(workers.iter().flat_map(|w| acknowledged(&w.errors())));
                coordinator = cluster.serve_again("out", &url, &[]);
                workers = [worker(&url), worker(&url)];
            }
        }
        let before = recorded(&out);
        assert!(before < 60, "the campaign was over before the processes could be killed");
        figures.recovery.push(until_more(&out, before));
        figures.rounds += 1;
    }
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    for worker in &mut workers {
        assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
        told.extend(acknowledged(&worker.errors()));
    }
    assert!(told.len() > 20, "workers were told of {told:?} only");
    figures.take(&out, expected, &told);
}

/// At most two workers a campaign: the third loss of one index would be poison.
fn kill_rounds(campaigns: u64, victims: &[Victim], fault: &str) {
    let expected = undisturbed(&to_the_maximum());
    let mut figures = Figures::default();
    for campaign in 0..campaigns {
        let mut victims = victims.to_vec();
        let mut random = Random(campaign);
        for place in (1..victims.len()).rev() {
            victims.swap(place, random.below(place as u64 + 1) as usize);
        }
        killed_campaign(&mut random, &victims, &expected, &mut figures);
    }
    figures.settle(fault);
}

#[test]
fn killed_at_random_moments_nothing_is_lost() {
    let victims = [Victim::Worker(0), Victim::Coordinator, Victim::Worker(1), Victim::Everybody];
    kill_rounds(2, &victims, "kill -9 of coordinator and workers at random moments (quick form)");
}

#[test]
#[ignore = "50 rounds, a minute or two"]
fn killed_at_fifty_random_moments_nothing_is_lost() {
    let victims =
        [Victim::Worker(0), Victim::Coordinator, Victim::Worker(1), Victim::Everybody, Victim::Coordinator];
    kill_rounds(10, &victims, "kill -9 of coordinator and workers at random moments");
}

/// Index and attempt of the outcome that a file of the spool keeps.
fn finished(path: &Path) -> (u64, u32) {
    let name = path.file_stem().and_then(|stem| stem.to_str()).expect("a name");
    let mut numbers = name.split('-').map(|number| number.parse::<u64>().expect("a number"));
    let (index, attempt) = (numbers.next().expect("an index"), numbers.next().expect("an attempt"));
    (index, u32::try_from(attempt).expect("a small number"))
}

#[test]
fn a_coordinator_that_is_away_for_long_is_waited_for_and_gets_everything() {
    let expected = undisturbed(&to_the_maximum());
    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let more = ["--slots", "4"];
    let mut worker = cluster.worker(Path::new(SYNTHETIC), &url, &more, &[("SYNTHETIC_MS", "150"), TELLING]);
    wait_for("8 outcomes", || (recorded(&out) >= 8).then_some(()));
    let told = acknowledged(&worker.errors());
    coordinator.kill();
    let down = Instant::now();
    // Slots finish what they run and keep it.
    let spooled = || -> Vec<PathBuf> {
        let folders = std::fs::read_dir(cluster.path("spool")).into_iter().flatten().flatten();
        let files = folders.filter_map(|folder| std::fs::read_dir(folder.path()).ok()).flatten().flatten();
        files.map(|file| file.path()).filter(|path| path.extension().is_some_and(|e| e == "report")).collect()
    };
    wait_for("outcomes in the spool", || (!spooled().is_empty()).then_some(()));
    let before = recorded(&out);
    // Four times as long as it takes to lose a worker (three heartbeats of 0.25 s).
    wait_for("the end of the outage", || (down.elapsed() > Duration::from_secs(3)).then_some(()));
    let kept = spooled();
    let mut coordinator = cluster.serve_again("out", &url, &[]);
    let mut figures = Figures { rounds: 1, ..Figures::default() };
    figures.recovery.push(until_more(&out, before));
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    assert!(worker.errors().contains("registering again"), "{}", worker.errors());
    let told = told.union(&acknowledged(&worker.errors())).copied().collect();
    figures.take(&out, &expected, &told);
    // What was finished meanwhile was not computed a second time. (Leases whose replies died with the coordinator were.)
    let records = runout::run_directory::read(&out).unwrap().records;
    for path in &kept {
        let (index, attempt) = finished(path);
        let recorded: Vec<u32> =
            records.iter().filter(|r| r.outcome.index == index).map(|record| record.attempt).collect();
        assert_eq!(recorded, [attempt], "{}", path.display());
    }
    // What was under way when the campaign ended may stay: nobody wants it any more.
    assert!(kept.iter().all(|path| !path.exists()), "{kept:?}");
    figures.settle("coordinator down for 3 s (4 times what loses a worker); workers spool and report");
}

#[test]
fn a_worker_paused_until_its_lease_was_given_away_is_welcome_back() {
    let expected = undisturbed(&to_the_maximum());
    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let slow = [("SYNTHETIC_MS", "150"), TELLING];
    let mut paused = cluster.worker(Path::new(SYNTHETIC), &url, &["--name", "paused"], &slow);
    let mut other = cluster.worker(Path::new(SYNTHETIC), &url, &["--name", "other"], &slow);
    wait_for("4 outcomes", || (recorded(&out) >= 4).then_some(()));
    paused.signal("-STOP");
    let stopped = Instant::now();
    wait_for("its loss", || coordinator.errors().contains("worker paused is lost").then_some(()));
    let before = recorded(&out);
    until_more(&out, before);
    let mut figures = Figures { rounds: 1, recovery: vec![stopped.elapsed()], ..Figures::default() };
    paused.signal("-CONT");
    wait_for("its return", || paused.errors().contains("registering again").then_some(()));
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(paused.exit_code(), 0, "{}", paused.errors());
    assert_eq!(other.exit_code(), 0, "{}", other.errors());
    let told = &acknowledged(&paused.errors()) | &acknowledged(&other.errors());
    figures.take(&out, &expected, &told);
    figures.settle("worker paused (SIGSTOP) and resumed after its lease was given away");
}

#[test]
fn a_realisation_that_does_not_see_its_cancellation_ends_its_worker_and_nothing_else() {
    let expected = undisturbed(&to_the_maximum());
    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &["--hang", "0.5"]);
    let more = ["--name", "stuck", "--stuck-after", "0.5", "--slots", "2"];
    let faults = [("SYNTHETIC_STUCK_AT", "7"), ("SYNTHETIC_MS", "40"), TELLING];
    let started = Instant::now();
    let mut stuck = cluster.worker(Path::new(SYNTHETIC), &url, &more, &faults);
    assert_eq!(stuck.exit_code(), 1, "{}", stuck.errors());
    let mut figures = Figures { rounds: 1, recovery: vec![started.elapsed()], ..Figures::default() };
    assert!(stuck.errors().contains("realisation 7 was cancelled"), "{}", stuck.errors());
    assert!(coordinator.errors().contains("realisation 7 takes no more steps"), "{}", coordinator.errors());
    assert!(coordinator.running(), "{}", coordinator.errors());
    let mut other = cluster.worker(Path::new(SYNTHETIC), &url, &["--name", "other"], &[TELLING]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(other.exit_code(), 0, "{}", other.errors());
    // It gave its leases back: the worker was not lost.
    assert!(!coordinator.errors().contains("worker stuck is lost"), "{}", coordinator.errors());
    let told = &acknowledged(&stuck.errors()) | &acknowledged(&other.errors());
    figures.take(&out, &expected, &told);
    figures.settle("computation that never sees its cancellation: its worker ends (time until then)");
}

/// A stuck computation holds nobody up who is asked to leave, either.
#[test]
fn sigterm_to_everything_ends_everything_in_time_and_the_campaign_goes_on() {
    let expected = undisturbed(&to_the_maximum());
    let cluster = Cluster::new(&to_the_maximum());
    let out = cluster.path("out");
    let (mut coordinator, url) = cluster.serve("out", &["--grace", "1"]);
    let patient = ["--grace", "1"];
    let faults = [("SYNTHETIC_STUCK_AT", "0"), TELLING];
    let mut stuck = cluster.worker(Path::new(SYNTHETIC), &url, &patient, &faults);
    wait_for("its lease", || {
        let mut status = cluster.runout(&["status", &url, "--json"]);
        status.wait();
        status.output().contains("\"attempt\": 1").then_some(())
    });
    let slow = [("SYNTHETIC_MS", "40"), TELLING];
    let mut sound = cluster.worker(Path::new(SYNTHETIC), &url, &patient, &slow);
    wait_for("5 outcomes", || (recorded(&out) >= 5).then_some(()));
    let asked = Instant::now();
    for process in [&coordinator, &sound, &stuck] {
        process.terminate();
    }
    assert_eq!(coordinator.exit_code(), 130, "{}", coordinator.errors());
    assert_eq!(sound.exit_code(), 0, "{}", sound.errors());
    assert_eq!(stuck.exit_code(), 0, "{}", stuck.errors());
    let mut figures = Figures { rounds: 1, recovery: vec![asked.elapsed()], ..Figures::default() };
    assert!(asked.elapsed() > Duration::from_secs(1), "nothing was stuck: {:?}", asked.elapsed());
    // Coordinator: grace, then at most 5 s each for open calls and the store. Worker: grace, 1 s for what does not end,
    // 5 s to take leave. No assertion on speed: these are the programs' own limits.
    assert!(asked.elapsed() < Duration::from_secs(1 + 5 + 5), "{:?}", asked.elapsed());
    let told = &acknowledged(&sound.errors()) | &acknowledged(&stuck.errors());

    let mut coordinator = cluster.serve_again("out", &url, &[]);
    let mut worker = cluster.worker(Path::new(SYNTHETIC), &url, &[], &[TELLING]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    figures.take(&out, &expected, &(&told | &acknowledged(&worker.errors())));
    figures
        .settle("SIGTERM to everything at once, one computation stuck; resumed (time until all have left)");
}
