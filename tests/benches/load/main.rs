//! Load on a coordinator: how many short jobs a second it hands out and records, durably, from how many workers, and
//! what distribution costs a realisation. Run with `cargo bench -p runout-tests --bench load [-- rates|workers]`.
//!
//! `rates`: one coordinator process on one core (`taskset`), as many simulated workers as asked for on the other, over
//! real gRPC on loopback, each with a connection of its own; jobs take no time. A job is a lease (durable before it is
//! sent) and a report (durable before it is acknowledged). Every worker also sends heartbeats. The processor times of both
//! sides say which of them limits the rate.
//!
//! `workers`: real worker processes with jobs of 50 ms that need no processor, so that two cores can hold eight of
//! them: efficiency is job time over wall time and workers, and what is missing is the overhead of a realisation.

mod calls;

use calls::Calls;
use runout_core::gimp::Kernel;
use runout_proto::identity;
use runout_proto::v1::lease_reply::Kind;
use runout_proto::v1::{
    Energy, HeartbeatReply, HeartbeatRequest, LeaseReply, LeaseRequest, Measures, Outcome, RegisterReply,
    RegisterRequest, ReportReply, ReportRequest, outcome,
};
use runout_tests::{COARSE, Cluster, Process, recorded};
use std::io;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");
/// Time over which rates are counted.
const COUNTED: Duration = Duration::from_secs(10);
/// Time between a simulated worker's heartbeats.
const HEARTBEAT: Duration = Duration::from_secs(5);
/// Time of a synthetic job for the efficiency, ms, and jobs per worker.
const JOB_MS: u64 = 50;
const JOBS_PER_WORKER: u64 = 100;

fn main() {
    let asked = std::env::args().nth(1).filter(|a| !a.starts_with('-'));
    if asked.as_deref().is_none_or(|a| a == "rates") {
        for workers in [1, 32, 1000] {
            rates(workers);
        }
    }
    if asked.as_deref().is_none_or(|a| a == "workers") {
        for workers in [1, 2, 4, 8] {
            efficiency(workers);
        }
    }
}

/// Never converges; as many realisations as fit.
fn campaign(maximum: u64) -> String {
    COARSE
        .replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
        .replace("maximum_realisations = 60", &format!("maximum_realisations = {maximum}"))
        .replace("audit_fraction = 0.1", "audit_fraction = 0.0")
}

/// Puts a process on one core.
fn pin(process: u32, core: u32) {
    let done =
        Command::new("taskset").args(["-a", "-p", "-c", &core.to_string(), &process.to_string()]).output();
    assert!(done.is_ok_and(|d| d.status.success()), "`taskset` is needed");
}

/// Processor time that a process has used, s.
fn processor_s(process: u32) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).expect("it runs");
    let fields: Vec<&str> = stat.rsplit(')').next().expect("a name").split_whitespace().collect();
    let ticks: f64 = fields[11..13].iter().map(|f| f.parse::<f64>().expect("a number")).sum();
    ticks / 100.0
}

#[derive(Default)]
struct Count {
    registered: AtomicU64,
    jobs: AtomicU64,
    /// Time of lease and report together, microseconds.
    waited_us: AtomicU64,
}

fn rates(workers: usize) {
    let cluster = Cluster::new(&campaign(100_000_000));
    let arguments = ["serve", "campaign.toml", "--out", "out", "--listen", "127.0.0.1:0"];
    let coordinator = cluster.runout_with(&arguments, &[("RUST_LOG", "error")]);
    let address = cluster.path("out/coordinator.addr");
    let url = runout_tests::wait_for("the address", || std::fs::read_to_string(&address).ok());
    pin(coordinator.id(), 0);
    pin(std::process::id(), 1);
    let spec_digest =
        runout::run_directory::read(&cluster.path("out")).expect("a run directory").spec.digest();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let count = Arc::new(Count::default());
    let fingerprint = identity::fingerprint(Kernel::best());
    runtime.block_on(async {
        let begun = Instant::now();
        for number in 0..workers {
            let (fingerprint, digest) = (fingerprint.clone(), spec_digest.clone());
            tokio::spawn(work(url.clone(), number, fingerprint, digest, Arc::clone(&count)));
        }
        while count.registered.load(Ordering::Relaxed) < workers as u64 {
            assert!(begun.elapsed() < Duration::from_secs(120), "not all workers can register");
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        let registered = begun.elapsed();
        let (jobs, waited_us) = (count.jobs.load(Ordering::Relaxed), count.waited_us.load(Ordering::Relaxed));
        let (begun, used_s) = (Instant::now(), processor_s(coordinator.id()));
        let own_s = processor_s(std::process::id());
        tokio::time::sleep(COUNTED).await;
        let jobs = (count.jobs.load(Ordering::Relaxed) - jobs) as f64;
        let waited_us = (count.waited_us.load(Ordering::Relaxed) - waited_us) as f64;
        let used_s = processor_s(coordinator.id()) - used_s;
        let own_s = processor_s(std::process::id()) - own_s;
        let wall_s = begun.elapsed().as_secs_f64();
        println!(
            "{workers} workers: {:.0} jobs/s, {:.2} ms of lease and report, {:.3} ms of \
             the coordinator's processor a job ({:.0} % of its core; workers {:.0} % of theirs, {:.3} ms a job), all registered within \
             {registered:.1?}",
            jobs / wall_s,
            waited_us / jobs / 1e3,
            used_s * 1e3 / jobs,
            100.0 * used_s / wall_s,
            100.0 * own_s / wall_s,
            own_s * 1e3 / jobs,
        );
    });
}

async fn register(calls: &mut Calls, number: usize, fingerprint: &str) -> u64 {
    let request = RegisterRequest {
        protocol: identity::PROTOCOL,
        build: identity::build(),
        fingerprint: fingerprint.to_owned(),
        name: format!("load-{number}"),
        slots: 1,
        held: vec![],
        machine: None,
    };
    let reply: io::Result<Option<RegisterReply>> = calls.call("Register", &request).await;
    reply.expect("the connection holds").expect("it is welcome").worker_id
}

/// A worker of one slot whose jobs take no time. One that was given up (a machine with other work to do may be too slow
/// for a thousand workers) registers again, as real ones do.
async fn work(url: String, number: usize, fingerprint: String, spec_digest: String, count: Arc<Count>) {
    let mut calls = Calls::connect(&url).await.expect("the coordinator listens");
    let mut id = register(&mut calls, number, &fingerprint).await;
    count.registered.fetch_add(1, Ordering::Relaxed);
    // The measurement is over when the connection ends.
    while jobs(&mut calls, id, &spec_digest, &count).await.is_ok() {
        id = register(&mut calls, number, &fingerprint).await;
    }
}

/// Jobs and heartbeats until a call is refused.
async fn jobs(calls: &mut Calls, id: u64, spec_digest: &str, count: &Count) -> io::Result<()> {
    let mut beat = Instant::now();
    loop {
        let begun = Instant::now();
        let request = LeaseRequest { worker_id: id, poll_s: 5.0 };
        let Some(reply) = calls.call::<LeaseReply>("Lease", &request).await? else { return Ok(()) };
        if let Some(lease) = reply.lease.filter(|_| reply.kind == Kind::Assigned as i32) {
            let report = ReportRequest {
                worker_id: id,
                attempt: lease.attempt,
                spec_digest: spec_digest.to_owned(),
                outcome: Some(stable(lease.index)),
                wall_s: 0.001,
            };
            let Some(_) = calls.call::<ReportReply>("Report", &report).await? else { return Ok(()) };
            count.jobs.fetch_add(1, Ordering::Relaxed);
            count.waited_us.fetch_add(begun.elapsed().as_micros() as u64, Ordering::Relaxed);
        }
        if beat.elapsed() > HEARTBEAT {
            beat = Instant::now();
            let request = HeartbeatRequest { worker_id: id, running: vec![] };
            let Some(_) = calls.call::<HeartbeatReply>("Heartbeat", &request).await? else { return Ok(()) };
        }
    }
}

fn stable(index: u64) -> Outcome {
    Outcome {
        index,
        kind: outcome::Kind::Stable as i32,
        reason: outcome::Reason::AtRest as i32,
        measures: Some(Measures::default()),
        energy: Some(Energy::default()),
        energy_drifted: false,
        simulated_s: 1.0,
        steps: 1000,
        points: 1000,
        profile: None,
        digest: format!("{index:032x}"),
    }
}

fn efficiency(workers: u64) {
    let jobs = workers * JOBS_PER_WORKER;
    let cluster = Cluster::new(&campaign(jobs));
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let job = [("SYNTHETIC_MS", JOB_MS.to_string())];
    let job = [(job[0].0, job[0].1.as_str())];
    let mut all: Vec<Process> =
        (0..workers).map(|_| cluster.worker(Path::new(SYNTHETIC), &url, &[], &job)).collect();
    // Starting the programs is no part of it.
    let out = cluster.path("out");
    runout_tests::wait_for("the first outcomes", || (recorded(&out) as u64 >= 2 * workers).then_some(()));
    let (begun, before) = (Instant::now(), recorded(&out) as u64);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    let wall_s = begun.elapsed().as_secs_f64();
    for worker in &mut all {
        worker.wait();
    }
    let (done, job_s) = ((jobs - before) as f64, JOB_MS as f64 / 1e3);
    println!(
        "{workers} workers: efficiency {:.1} %, {:.2} ms of overhead a realisation of {JOB_MS} ms",
        100.0 * done * job_s / (wall_s * workers as f64),
        1e3 * (wall_s * workers as f64 / done - job_s),
    );
}
