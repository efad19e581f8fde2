//! Files and texts that somebody may have damaged: whatever stands in an outcome log, a spec or a status, reading it
//! does not panic, and what is sound is read to the bit.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use runout::engine::Engine;
use runout::load::{self, Loaded};
use runout::queue::Settings;
use runout::status::{self, Status};
use runout::store::Contents;
use runout::store::log::{self, Entry, Record};
use runout::store::scan::{Line, Place, Scan, scan};
use runout_core::campaign::Campaign;
use runout_core::estimate::Estimator;
use runout_core::gimp::Energy;
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use runout_core::profile::Profile;
use runout_core::spec::Spec;
use std::path::Path;
use std::time::Duration;

/// Inputs of each property in the usual run, and in the long one.
const USUAL: u32 = 2_000;
const LONG: u32 = 350_000;

fn entry(n: u64) -> Entry {
    let number = n as f64 / 7.0;
    let failed = n.is_multiple_of(3);
    let measures = Measures {
        max_displacement_m: number,
        displacement_q999_m: number / 3.0,
        toe_advance_m: 0.1,
        crest_retreat_m: 0.2,
        moved_area_m2: 1e-300,
        deposit_height_at_toe_m: 1e300,
        time_to_rest_s: n.is_multiple_of(2).then_some(number),
    };
    let outcome = Outcome {
        index: n,
        outcome: if failed { OutcomeKind::Failed } else { OutcomeKind::Runout },
        reason: Reason::ALL[(n % Reason::ALL.len() as u64) as usize],
        measures: (!failed).then_some(measures),
        energy: (!failed).then_some(Energy { outer_work_j: -number, ..Energy::default() }),
        energy_drifted: n.is_multiple_of(5),
        simulated_s: number,
        steps: n,
        points: n / 2,
        profile: (!failed && n.is_multiple_of(2)).then(|| Profile {
            column_m: number + 0.1,
            depth_mm: (1..n % 65).map(|depth| depth as u32).collect(),
            speed_mm_s: vec![n as u32; (n % 3) as usize],
        }),
        digest: format!("{n:032x}"),
    };
    let worker = "tab\t quote\" line\n end".to_owned();
    let record = Record { outcome, attempt: n as u32, worker: worker.clone(), wall_s: number };
    match n % 4 {
        0 => Entry::Audit { index: n, worker },
        1 => Entry::Conflict(record),
        _ => Entry::Outcome(record),
    }
}

/// Bytes with some of them set, and cut at a place.
fn changed(mut bytes: Vec<u8>, sets: &[(u32, u8)], cut: Option<u32>) -> Vec<u8> {
    for (place, byte) in sets {
        let length = bytes.len();
        bytes[*place as usize % length] = *byte;
    }
    if let Some(cut) = cut {
        bytes.truncate(cut as usize % bytes.len());
    }
    bytes
}

fn sets() -> impl Strategy<Value = Vec<(u32, u8)>> {
    // Bytes that mean something to JSON are more telling than others.
    let telling =
        prop_oneof![any::<u8>(), proptest::sample::select(b"0123456789eE.+-\"{}[],:\n\t\0".to_vec())];
    vec((any::<u32>(), telling), 0..5)
}

fn run<S: Strategy>(cases: u32, inputs: &S, property: impl Fn(S::Value)) {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    let tested = TestRunner::new(config).run(inputs, |input| {
        property(input);
        Ok(())
    });
    if let Err(failure) = tested {
        panic!("{failure}");
    }
}

/// What is sound in a log, and how far it was.
fn read(log: &[u8]) -> (Vec<Entry>, Scan) {
    let mut entries = Vec::new();
    let scanned = scan(log, Place::default(), |line: Line<'_, Record>| {
        entries.push(line.entry);
        Ok(())
    });
    (entries, scanned.expect("memory can be read"))
}

fn logs(cases: u32) {
    let inputs =
        (vec(0_u64..1 << 53, 1..5), sets(), proptest::option::of(any::<u32>()), vec(any::<u8>(), 0..100));
    run(cases, &inputs, |(numbers, sets, cut, noise)| {
        read(&noise);
        let entries: Vec<Entry> = numbers.into_iter().map(entry).collect();
        let text: String = entries.iter().map(log::line).collect();
        let (whole, scanned) = read(text.as_bytes());
        assert_eq!((&whole, scanned.damage.len(), scanned.unfinished_bytes), (&entries, 0, 0));
        let (damaged, _) = read(&changed(text.into_bytes(), &sets, cut));
        // A line is what was written or nothing: no damage passes for another outcome.
        assert!(damaged.iter().all(|entry| entries.contains(entry)), "{damaged:?}");
    });
}

fn coarse() -> Loaded {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/campaigns/coarse.toml");
    load::load(&path).expect("a campaign")
}

fn specs(cases: u32) {
    let sound = coarse().spec.to_json();
    run(cases, &(sets(), proptest::option::weighted(0.1, any::<u32>())), |(sets, cut)| {
        let text = changed(sound.clone().into_bytes(), &sets, cut);
        let Ok(text) = String::from_utf8(text) else { return };
        let Ok(spec) = Spec::from_json(&text) else {
            assert_ne!(text, sound, "the unchanged spec is sound");
            return;
        };
        let again = Spec::from_json(&spec.to_json()).expect("what was written can be read");
        assert_eq!(again.to_json(), spec.to_json());
        assert_eq!(again.digest() == spec.digest(), again == spec);
    });
}

fn statuses(cases: u32) {
    let Campaign { seed, stop, model, run: rule, .. } = coarse().campaign;
    let settings = Settings::new(seed, rule.audit_fraction, stop.maximum_realisations);
    let estimator = Estimator::new(&stop, &model.sample, &rule);
    let mut engine = Engine::new(settings, estimator, &Contents::default(), 0);
    engine.register("worker", 1, &[], Duration::ZERO);
    let sound = status::of_engine(&coarse().campaign, "0", &engine, Duration::ZERO);
    let inputs = (vec(any::<char>(), 0..50), sets(), any::<bool>());
    run(cases, &inputs, |(text, sets, change)| {
        let text = String::from_iter(text);
        let mut status = sound.clone();
        status.campaign.clone_from(&text);
        status.workers[0].name.clone_from(&text);
        status.requirements[0].what.clone_from(&text);
        status.damage.push(text);
        let json = serde_json::to_string(&status).expect("a status is JSON").into_bytes();
        let json = if change { changed(json, &sets, None) } else { json };
        match Status::from_peer(&String::from_utf8_lossy(&json)) {
            // Nothing in it reaches a terminal but text.
            Ok(status) => assert!(!status.text().contains(|c: char| c.is_control() && c != '\n')),
            Err(_) => assert!(change, "the unchanged status is sound"),
        }
    });
}

#[test]
fn damaged_logs_do_no_harm() {
    logs(USUAL);
}

#[test]
fn damaged_specs_do_no_harm() {
    specs(USUAL);
}

#[test]
fn strange_statuses_do_no_harm() {
    statuses(USUAL);
}

/// More than a million inputs: `cargo test --release -p runout --test fuzz -- --ignored`.
#[test]
#[ignore = "takes minutes; the three tests above are its usual form"]
fn a_million_inputs_do_no_harm() {
    logs(LONG);
    specs(LONG);
    statuses(LONG);
}
