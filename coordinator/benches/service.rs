//! Speed of the coordinator and of the commands that only read: leases and reports with durable acknowledgement, the
//! results and the report of a thousand outcomes, and whole commands from start to exit. Run with
//! `cargo bench -p runout --bench service [-- FILTER]`; wall time, by criterion.
//!
//! Leases and reports go the service's way (engine, store's thread, disk) without gRPC: each pair waits for two syncs of
//! the disk under the temporary folder, which the pairs of other workers share.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use runout::engine::{Engine, Step};
use runout::load::{self, Loaded};
use runout::queue::{LeaseAnswer, Settings, WorkerId};
use runout::report::{self, Material, Replays};
use runout::run_directory::{self, Contents, RunDirectory};
use runout::status;
use runout::store::Store;
use runout::store::log::{Entry, Record};
use runout::writer::{Job, Writer};
use runout_core::estimate::Estimator;
use runout_core::gimp::Energy;
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Workers that lease and report at the same time.
const WORKERS: [usize; 4] = [1, 8, 64, 1000];
/// Outcomes in the run directory that is read.
const OUTCOMES: u64 = 1000;

criterion_group! {
    name = service;
    // The whole file within half a minute: spreads of some per cent are enough here.
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    targets = leases_and_reports, results_and_report, commands
}
criterion_main!(service);

fn leases_and_reports(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("lease and report, durable");
    for workers in WORKERS {
        group.throughput(Throughput::Elements(workers as u64));
        group.bench_function(format!("{workers} workers"), |bencher| {
            bencher.iter_custom(|rounds| pairs(workers, rounds));
        });
    }
    group.finish();
}

/// Time in which each of `workers` leases and reports `rounds` times, one after the other.
fn pairs(workers: usize, rounds: u64) -> Duration {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (store, contents) = Store::open(folder.path()).expect("a new store");
    let mut campaign = quick().campaign;
    // However many pairs are asked for, the campaign does not end.
    campaign.stop.maximum_realisations = u64::MAX;
    let estimator = Estimator::new(&campaign.stop, &campaign.model.sample, &campaign.run);
    let mut engine = Engine::new(Settings::new(campaign.seed, 0.0, u64::MAX), estimator, &contents, 1);
    let ids: Vec<WorkerId> =
        (0..workers).map(|i| engine.register(&format!("worker-{i}"), 1, &[], Duration::ZERO)).collect();
    let (writer, thread) = Writer::start(store).expect("a thread");
    let engine = RefCell::new(engine);
    let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
    let begun = Instant::now();
    let all = async {
        let works = ids.iter().map(|id| work(&engine, &writer, *id, rounds));
        // One task each, on this thread: the engine is behind one lock in the service as well.
        let mut works: Vec<_> = works.map(Box::pin).collect();
        std::future::poll_fn(|context| {
            works.retain_mut(|work| work.as_mut().poll(context).is_pending());
            if works.is_empty() { std::task::Poll::Ready(()) } else { std::task::Poll::Pending }
        })
        .await;
    };
    runtime.block_on(all);
    let taken = begun.elapsed();
    drop(writer);
    thread.join().expect("the store's thread ends");
    taken
}

/// What one worker of one slot asks the service for.
async fn work(engine: &RefCell<Engine>, writer: &Writer, id: WorkerId, rounds: u64) {
    let now = Duration::ZERO;
    let mut done = 0;
    while done < rounds {
        let answer = engine.borrow_mut().lease(id, now).expect("it is registered");
        let LeaseAnswer::Assigned(lease) = answer else {
            // Too far ahead of the slowest: ask again once others have reported.
            tokio::task::yield_now().await;
            continue;
        };
        let reserved = engine.borrow().queue().is_reserved(lease);
        let ahead = engine.borrow_mut().reserve();
        let reservation = async {
            if !ahead.is_empty() {
                writer.write(Job::Reservation(ahead.clone())).await.expect("the disk works");
                engine.borrow_mut().reserved(ahead);
            }
        };
        let attempts = engine.borrow().queue().attempts(lease.index);
        let given = async {
            if !reserved {
                writer.write(Job::Attempts(lease.index, attempts)).await.expect("the disk works");
            }
        };
        given.await;
        // Stable outcomes: no stopping rule ends the campaign.
        let outcome = outcome(lease.index, OutcomeKind::Stable);
        let step = engine.borrow_mut().report(id, lease.attempt, outcome, 1.0, now);
        let Step::Store(entry, _) = step.expect("it is registered") else {
            panic!("nothing was reported before")
        };
        let report = async { writer.write(Job::Entry(entry.clone())).await.expect("the disk works") };
        tokio::join!(reservation, report);
        engine.borrow_mut().stored(&entry);
        done += 1;
    }
}

fn results_and_report(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let dir = finished_run(&folder);
    criterion.bench_function("reading 1,000 outcomes", |bencher| {
        bencher.iter(|| run_directory::read(&dir).expect("it is sound"));
    });
    let loaded = quick();
    let view = run_directory::read(&dir).expect("it is sound");
    let outcomes: Vec<Outcome> =
        status::results(&loaded.campaign, &view).iter().map(|record| record.outcome.clone()).collect();
    criterion.bench_function(&format!("report of {} outcomes", outcomes.len()), |bencher| {
        bencher.iter(|| {
            report::report(&Material {
                campaign: &loaded.campaign,
                campaign_text: &loaded.campaign_text,
                site: loaded.site.as_ref(),
                fit: &loaded.fit,
                spec: &loaded.spec,
                outcomes: &outcomes,
                notes: &[],
                prepared: None,
                replays: &Replays::default(),
                work: &[],
            })
        });
    });
}

/// From start to exit, as a user waits for them.
fn commands(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let dir = finished_run(&folder);
    let mut group = criterion.benchmark_group("command");
    for (name, path) in
        [("fit", quick_file()), ("check", quick_file()), ("status", dir.clone()), ("results", dir)]
    {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let status = Command::new(env!("CARGO_BIN_EXE_runout"))
                    .arg(name)
                    .arg(&path)
                    .stdout(Stdio::null())
                    .stderr(Stdio::null())
                    .status();
                assert!(status.expect("the command starts").success(), "{name}");
            });
        });
    }
    group.finish();
}

fn quick_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../campaigns/quick/campaign.toml")
}

fn quick() -> Loaded {
    load::load(&quick_file()).expect("the example is sound")
}

/// A run directory of the quick campaign with [`OUTCOMES`] outcomes that nobody has computed.
fn finished_run(folder: &TempDir) -> PathBuf {
    let loaded = quick();
    let dir = folder.path().join("run");
    let contents = Contents {
        campaign_text: &loaded.campaign_text,
        site_text: loaded.site_text.as_deref(),
        profile_text: loaded.profile_text.as_deref(),
        spec: &loaded.spec,
    };
    let directory = RunDirectory::open(&dir, contents).expect("the folder is new");
    let entries: Vec<Entry> = (0..OUTCOMES)
        .map(|index| {
            let outcome = outcome(index, OutcomeKind::Runout);
            Entry::Outcome(Record { outcome, attempt: 1, worker: "bench-1".to_owned(), wall_s: 1.0 })
        })
        .collect();
    let (mut store, _) = Store::open(directory.path()).expect("a new store");
    store.commit(&entries, &[]).expect("the disk works");
    dir
}

/// Its distances are spread over some metres, evenly and in no order.
fn outcome(index: u64, outcome: OutcomeKind) -> Outcome {
    let distance_m = 1.0 + 9.0 * (index as f64 * 0.618_034).fract();
    let measures = Measures {
        max_displacement_m: distance_m,
        displacement_q999_m: distance_m,
        toe_advance_m: distance_m,
        crest_retreat_m: 0.3 * distance_m,
        moved_area_m2: 10.0 * distance_m,
        deposit_height_at_toe_m: 0.1 * distance_m,
        time_to_rest_s: Some(distance_m),
    };
    Outcome {
        index,
        outcome,
        reason: Reason::AtRest,
        measures: Some(measures),
        energy: Some(Energy { outer_work_j: 1e5 * distance_m, ..Energy::default() }),
        energy_drifted: false,
        simulated_s: distance_m,
        steps: 10_000 + index,
        points: 10_125,
        profile: None,
        digest: format!("{index:032x}"),
    }
}
