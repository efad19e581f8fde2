//! A campaign driven without workers, sockets and clocks: leases, made-up outcomes and commits go straight from the engine
//! to the store. Every outcome follows from its index, so that a campaign that was damaged and resumed can be compared
//! byte for byte with one that was not.

#![allow(dead_code, unreachable_pub, reason = "each test target uses a part of it")]

use runout::engine::{Engine, Step};
use runout::load::{self, Loaded};
use runout::queue::{LeaseAnswer, Settings, WorkerId};
use runout::run_directory::{self, Contents, RunDirectory};
use runout::status;
use runout::store::log::Entry;
use runout::store::{self, Store};
use runout_core::estimate::Estimator;
use runout_core::gimp::Energy;
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use runout_core::profile::Profile;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Realisations of the campaign: its rule never holds before.
pub(crate) const REALISATIONS: u64 = 60;
/// Leases that are committed together, as by several workers.
pub(crate) const GROUP: usize = 4;

/// The campaign.
pub(crate) fn campaign() -> Loaded {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/inputs/good/given.toml");
    let mut loaded = load::load(&fixture).expect("the fixture is sound");
    loaded.campaign.stop.minimum_realisations = REALISATIONS;
    loaded.campaign.stop.maximum_realisations = REALISATIONS;
    let lines = loaded.campaign_text.lines().map(|line| match line.split_once(" = ") {
        Some((key @ ("minimum_realisations" | "maximum_realisations"), _)) => {
            format!("{key} = {REALISATIONS}\n")
        }
        _ => format!("{line}\n"),
    });
    loaded.campaign_text = lines.collect();
    loaded
}

/// A number that follows from these two.
pub(crate) fn draw(what: &str, index: u64) -> u64 {
    let hash = blake3::hash(format!("{what} {index}").as_bytes());
    u64::from_le_bytes(hash.as_bytes()[..8].try_into().expect("a hash has more"))
}

/// The made-up outcome of an index: a fifth stand, one in eleven fails.
pub(crate) fn outcome(index: u64) -> Outcome {
    let unit = |what: &str| draw(what, index) as f64 / u64::MAX as f64;
    let kind = match index {
        i if i % 11 == 10 => OutcomeKind::Failed,
        i if i % 5 == 4 => OutcomeKind::Stable,
        _ => OutcomeKind::Runout,
    };
    let runout_m =
        if kind == OutcomeKind::Stable { 0.05 * unit("runout") } else { 0.2 + 9.0 * unit("runout") };
    let failed = kind == OutcomeKind::Failed;
    Outcome {
        index,
        outcome: kind,
        reason: if failed { Reason::NonFinite } else { Reason::AtRest },
        measures: (!failed).then(|| Measures {
            max_displacement_m: 1.1 * runout_m,
            displacement_q999_m: runout_m,
            toe_advance_m: unit("toe"),
            crest_retreat_m: unit("crest"),
            moved_area_m2: 10.0 * unit("area"),
            deposit_height_at_toe_m: unit("height"),
            time_to_rest_s: (index % 7 != 3).then(|| 5.0 * unit("rest")),
        }),
        energy: (!failed).then(|| Energy {
            outer_work_j: 1e5 * unit("work"),
            kinetic_j: 1e3 * unit("kinetic"),
            elastic_j: -1e3 * unit("elastic"),
            plastic_j: 1e5 * unit("plastic"),
            drift_j: 10.0 * unit("drift"),
            available_j: 2e5 * unit("available"),
            ..Energy::default()
        }),
        energy_drifted: false,
        simulated_s: 5.0 * unit("simulated"),
        steps: 1000 + index,
        points: 100,
        profile: (!failed).then(|| Profile {
            column_m: 0.5,
            depth_mm: vec![1500; (draw("columns", index) % 20) as usize],
            speed_mm_s: vec![1 + (draw("speed", index) % 9000) as u32; 3],
        }),
        digest: blake3::hash(&index.to_le_bytes()).to_hex()[..32].to_owned(),
    }
}

/// A run directory in a temporary folder.
#[derive(Debug)]
pub(crate) struct Ledger {
    folder: tempfile::TempDir,
}

impl Ledger {
    /// A new one without outcomes.
    pub(crate) fn new() -> Ledger {
        let ledger = Ledger { folder: tempfile::tempdir().expect("a temporary folder") };
        let loaded = campaign();
        let contents = Contents {
            campaign_text: &loaded.campaign_text,
            site_text: None,
            profile_text: None,
            spec: &loaded.spec,
        };
        RunDirectory::open(&ledger.dir(), contents).expect("the folder is new");
        ledger
    }

    /// One with the first `count` outcomes or some more.
    pub(crate) fn with(count: u64) -> Ledger {
        let ledger = Ledger::new();
        ledger.drive(count, |_| {});
        ledger
    }

    /// The run directory.
    pub(crate) fn dir(&self) -> PathBuf {
        self.folder.path().join("run")
    }

    /// The outcome log.
    pub(crate) fn log(&self) -> PathBuf {
        self.dir().join(store::LOG_FILE)
    }

    /// The folder of sled.
    pub(crate) fn store(&self) -> PathBuf {
        self.dir().join(store::DATABASE_FOLDER)
    }

    /// Opens it and looks at what it holds; returns the indices recorded and the notes. Every record must be the one
    /// that its index has.
    pub(crate) fn look(&self) -> (Vec<u64>, Vec<String>) {
        let (_store, contents) = Store::open(&self.dir()).expect("it opens, whatever was done to it");
        for record in &contents.records {
            assert_eq!(record.digest_text(), outcome(record.index).digest);
        }
        (contents.records.iter().map(|record| record.index).collect(), contents.notes)
    }

    /// Continues the campaign until so many outcomes are recorded or it is over; `committed` is called after each commit.
    /// Returns what the store said when it was opened.
    pub(crate) fn drive(&self, until: u64, mut committed: impl FnMut(&Path)) -> Vec<String> {
        let loaded = campaign();
        let (mut store, contents) = Store::open(&self.dir()).expect("it opens, whatever was done to it");
        let campaign = &loaded.campaign;
        let estimator = Estimator::new(&campaign.stop, &campaign.model.sample, &campaign.run);
        let settings = Settings::new(campaign.seed, 0.0, campaign.stop.maximum_realisations);
        let mut engine = Engine::new(settings, estimator, &contents, 1);
        let now = Duration::ZERO;
        let worker = engine.register("maker", GROUP as u32, &[], now);
        let mut recorded = contents.records.len() as u64;
        while !engine.is_over() && recorded < until {
            let leases = lease(&mut engine, worker);
            let attempts: Vec<_> =
                leases.iter().map(|lease| (lease.index, engine.queue().attempts(lease.index))).collect();
            store.commit(&[], &attempts).expect("there is room");
            committed(&self.dir());
            let entries: Vec<Entry> = leases
                .iter()
                .filter_map(|lease| {
                    let outcome = outcome(lease.index);
                    match engine.report(worker, lease.attempt, outcome, 0.5, now).expect("it is registered") {
                        Step::Store(entry, _) => Some(*entry),
                        _ => None,
                    }
                })
                .collect();
            store.commit(&entries, &[]).expect("there is room");
            committed(&self.dir());
            entries.iter().for_each(|entry| drop(engine.stored(entry)));
            recorded += entries.len() as u64;
        }
        contents.notes
    }

    /// Continues the campaign to its end; what the results then are, byte for byte.
    pub(crate) fn finish(&self) -> String {
        self.drive(u64::MAX, |_| {});
        let view = run_directory::read(&self.dir()).expect("it is a run directory");
        assert_eq!(view.damage, Vec::<String>::new());
        let campaign = status::campaign_of(&view, &self.dir()).expect("the fixture is sound");
        let results = status::results(&campaign, &view);
        results
            .iter()
            .map(|record| serde_json::to_string(&record.outcome).expect("an outcome is JSON") + "\n")
            .collect()
    }

    /// Every file of the run directory, by its path.
    pub(crate) fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        collect(&self.dir(), &mut files);
        files
    }

    /// Puts these files in place of what is there.
    pub(crate) fn put(&self, files: &BTreeMap<PathBuf, Vec<u8>>) {
        fs::remove_dir_all(self.dir()).expect("it is there");
        for (path, bytes) in files {
            fs::create_dir_all(path.parent().expect("a file lies in a folder")).expect("there is room");
            fs::write(path, bytes).expect("there is room");
        }
        fs::create_dir_all(self.store()).expect("there is room");
    }
}

fn lease(engine: &mut Engine, worker: WorkerId) -> Vec<runout::queue::Lease> {
    let mut leases = Vec::new();
    while let LeaseAnswer::Assigned(lease) = engine.lease(worker, Duration::ZERO).expect("it is registered") {
        leases.push(lease);
    }
    leases
}

fn collect(folder: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, files);
        } else {
            files.insert(path.clone(), fs::read(&path).expect("a file"));
        }
    }
}

/// The results of the campaign when nothing goes wrong.
pub(crate) fn undisturbed() -> String {
    let results = Ledger::new().finish();
    assert_eq!(results.lines().count() as u64, REALISATIONS);
    results
}
