//! A run directory with a million outcomes: how large it is, how long `runout status` and a resume take, and how much
//! memory they need. Run with `cargo bench -p runout --bench size [-- OUTCOMES [DIR]]`; wall time, one figure a line.
//!
//! The outcomes are made up and written through the store, in large groups. `status` is the command from start to exit;
//! the resume is everything that `runout serve` does before it listens. Both run in processes of their own, so that
//! their largest memory is theirs alone. With DIR the directory is kept, and used again if it is there.

use runout::load::{self, Loaded};
use runout::run_directory::{Contents, RunDirectory};
use runout::serve::{self, Options};
use runout::status::cache::CACHE_FILE;
use runout::store::log::{Entry, Record};
use runout::store::{DATABASE_FOLDER, LOG_FILE, Store};
use runout_core::gimp::Energy;
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const OUTCOMES: u64 = 1_000_000;
const GROUP: u64 = 10_000;
const ROUNDS: usize = 10;

fn main() {
    // Cargo adds arguments of its own.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    if let [resume, dir, count] = arguments.as_slice()
        && resume == "resume"
    {
        return resume_here(Path::new(dir), count.parse().expect("a number"));
    }
    let count: u64 = arguments.first().map_or(OUTCOMES, |count| count.parse().expect("a number of outcomes"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let dir = arguments.get(1).map_or(folder.path().join("run"), PathBuf::from);
    if !dir.join(LOG_FILE).exists() {
        let begun = Instant::now();
        make(&dir, count);
        println!("made {count} outcomes in {:.1} s", begun.elapsed().as_secs_f64());
    }
    println!("outcome log: {} MiB", bytes(&dir.join(LOG_FILE)) >> 20);
    println!("sled: {} MiB", folder_bytes(&dir.join(DATABASE_FOLDER)) >> 20);
    // The first one finds no cached estimates, and leaves some.
    let _ = fs::remove_file(dir.join(CACHE_FILE));
    println!("status without cached estimates: {:.0} ms", 1e3 * status(&dir).as_secs_f64());
    println!("resume: {}", resume(&dir, count));
    println!("resume again: {}", resume(&dir, count));
    println!("cached estimates: {} KiB", bytes(&dir.join(CACHE_FILE)) >> 10);
    let mut taken: Vec<Duration> = (0..ROUNDS).map(|_| status(&dir)).collect();
    taken.sort();
    let ms = |time: Duration| 1e3 * time.as_secs_f64();
    println!(
        "status: {:.0} ms at best, {:.0} ms in the middle, {:.0} ms at worst of {ROUNDS}",
        ms(taken[0]),
        ms(taken[ROUNDS / 2]),
        ms(taken[ROUNDS - 1])
    );
}

/// The quick campaign with a rule that does not hold for so long.
fn campaign(count: u64) -> Loaded {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../campaigns/quick/campaign.toml");
    let mut loaded = load::load(&file).expect("the example is sound");
    let lines =
        loaded.campaign_text.lines().map(|line| match line.split_once('=').map(|(key, _)| key.trim()) {
            Some("maximum_realisations") => format!("maximum_realisations = {}\n", 2 * count),
            Some("minimum_realisations") => format!("minimum_realisations = {}\n", 2 * count),
            _ => format!("{line}\n"),
        });
    loaded.campaign_text = lines.collect();
    loaded.campaign.stop.maximum_realisations = 2 * count;
    loaded.campaign.stop.minimum_realisations = 2 * count;
    loaded
}

fn make(dir: &Path, count: u64) {
    let loaded = campaign(count);
    let contents = Contents {
        campaign_text: &loaded.campaign_text,
        site_text: loaded.site_text.as_deref(),
        profile_text: loaded.profile_text.as_deref(),
        spec: &loaded.spec,
    };
    let directory = RunDirectory::open(dir, contents).expect("the folder is new");
    let (mut store, _) = Store::open(directory.path()).expect("a new store");
    for from in (0..count).step_by(GROUP as usize) {
        let entries: Vec<Entry> = (from..(from + GROUP).min(count)).map(entry).collect();
        store.commit(&entries, &[]).expect("the disk works");
    }
}

fn entry(index: u64) -> Entry {
    // Full mantissas, as computed numbers have.
    let distance_m = 1.0 + 9.0 * (index as f64 * 0.618_033_988_749_895).fract();
    let of = |factor: f64| distance_m * factor / 3.0;
    let outcome = Outcome {
        index,
        outcome: OutcomeKind::Runout,
        reason: Reason::AtRest,
        measures: Some(Measures {
            max_displacement_m: of(3.1),
            displacement_q999_m: of(2.9),
            toe_advance_m: of(2.0),
            crest_retreat_m: of(0.7),
            moved_area_m2: of(13.0),
            deposit_height_at_toe_m: of(0.3),
            time_to_rest_s: Some(of(1.3)),
        }),
        energy: Some(Energy {
            outer_work_j: of(3e5),
            kinetic_j: of(2e2),
            elastic_j: of(-3e3),
            pore_water_j: of(5e2),
            plastic_j: of(2e5),
            drag_j: of(4e3),
            contact_j: of(1e3),
            damping_j: of(7e2),
            drift_j: of(-9e2),
            available_j: of(4e5),
        }),
        energy_drifted: false,
        simulated_s: of(1.7),
        steps: 10_000 + index % 5000,
        points: 10_125,
        profile: None,
        digest: blake3::hash(&index.to_le_bytes()).to_hex()[..32].to_owned(),
    };
    Entry::Outcome(Record { outcome, attempt: 1, worker: format!("bench-{}", index % 64), wall_s: of(2.2) })
}

/// From start to exit, as a user waits for it.
fn status(dir: &Path) -> Duration {
    let begun = Instant::now();
    let status =
        Command::new(env!("CARGO_BIN_EXE_runout")).arg("status").arg(dir).stdout(Stdio::null()).status();
    assert!(status.expect("the command starts").success());
    begun.elapsed()
}

/// Opens the campaign in a process of its own; what that one says.
fn resume(dir: &Path, count: u64) -> String {
    let this = std::env::current_exe().expect("a bench knows its path");
    let output = Command::new(this).arg("resume").arg(dir).arg(count.to_string()).output();
    String::from_utf8(output.expect("it starts").stdout).expect("it is text").trim().to_owned()
}

fn resume_here(dir: &Path, count: u64) {
    let loaded = campaign(count);
    let second = Duration::from_secs(1);
    let options = Options { heartbeat: second, grace: second, hang: second };
    let (begun, before_s) = (Instant::now(), processor_s());
    let coordinator = serve::open(&loaded, dir, &options).expect("it can be continued");
    let taken = begun.elapsed();
    let folded = coordinator.shared.engine().estimator().realisations();
    let now = memory("VmRSS") >> 20;
    println!(
        "{folded} realisations in {:.2} s ({:.2} s of processor), {} MiB at most, {now} MiB then",
        taken.as_secs_f64(),
        processor_s() - before_s,
        memory("VmHWM") >> 20
    );
    // The store's thread caches the estimates when the last handle has gone.
    coordinator.close();
}

/// A line of /proc/self/status, bytes; 0 where there is none.
fn memory(key: &str) -> u64 {
    let text = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
    line.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) << 10
}

/// Processor time of this process so far, s; 0 where the system does not say. On a busy machine it tells more than a clock.
fn processor_s() -> f64 {
    let text = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Fields 14 and 15, in hundredths of a second; the second field, in brackets, may hold spaces.
    let behind_name = text.rsplit_once(')').map_or("", |(_, rest)| rest);
    behind_name.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>()
        / 100.0
}

fn bytes(path: &Path) -> u64 {
    fs::metadata(path).map_or(0, |metadata| metadata.len())
}

fn folder_bytes(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|e| if e.path().is_dir() { folder_bytes(&e.path()) } else { bytes(&e.path()) }).sum()
}
