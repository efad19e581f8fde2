//! A worker whose realisations take a set time and follow from (seed, index) alone: for tests of everything around
//! the analysis. Faults are asked for by environment variables.

use runout_core::gimp::Energy;
use runout_core::gimp::Kernel;
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use runout_core::realisation::{Cancelled, Progress};
use runout_core::spec::Spec;
use runout_proto::identity;
use runout_worker::{Realise, process};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

fn main() -> ExitCode {
    process::main(prepare, std::env::var("SYNTHETIC_BUILD").unwrap_or_else(|_| identity::build()))
}

fn prepare(spec: Spec, _: Kernel, _: usize) -> Result<Realise, String> {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let time = Duration::from_millis(number("SYNTHETIC_MS").unwrap_or(5));
    let panics_at = number("SYNTHETIC_PANICS_AT");
    let aborts_at = number("SYNTHETIC_ABORTS_AT");
    let fails_at = number("SYNTHETIC_FAILS_AT");
    let hangs_at = number("SYNTHETIC_HANGS_AT");
    let stuck_at = number("SYNTHETIC_STUCK_AT");
    let hung = AtomicBool::new(false);
    let other_bits = number("SYNTHETIC_OTHER_BITS").is_some();
    Ok(Box::new(move |index, progress| {
        assert_ne!(Some(index), panics_at, "asked to panic");
        if Some(index) == aborts_at {
            std::process::abort();
        }
        if Some(index) == stuck_at {
            // Never looks whether it was cancelled.
            loop {
                std::thread::park();
            }
        }
        // Once a process, so that what was cancelled can be run again.
        let hangs = Some(index) == hangs_at && !hung.swap(true, Ordering::Relaxed);
        take(if hangs { Duration::MAX } else { time }, progress)?;
        Ok(if Some(index) == fails_at { failed(index) } else { outcome(spec.seed, index, other_bits) })
    }))
}

/// Takes the time of a realisation, ready to be cancelled.
fn take(time: Duration, progress: &Progress) -> Result<(), Cancelled> {
    let started = Instant::now();
    while let Some(left) = time.checked_sub(started.elapsed()).filter(|left| !left.is_zero()) {
        if progress.is_cancelled() {
            return Err(Cancelled);
        }
        std::thread::sleep(left.min(Duration::from_millis(1)));
    }
    Ok(())
}

fn outcome(seed: u64, index: u64, other_bits: bool) -> Outcome {
    let hash = blake3::hash(format!("{seed} {index}").as_bytes());
    let byte = |place: usize| f64::from(hash.as_bytes()[place]);
    let stable = hash.as_bytes()[0] < 64;
    let runout_m = if stable { 0.01 } else { 2.0 + byte(1) / 64.0 + f64::from(u8::from(other_bits)) };
    let digest = if other_bits { "f".repeat(32) } else { hash.to_hex()[..32].to_owned() };
    Outcome {
        index,
        outcome: if stable { OutcomeKind::Stable } else { OutcomeKind::Runout },
        reason: Reason::AtRest,
        measures: Some(Measures {
            max_displacement_m: runout_m,
            displacement_q999_m: runout_m,
            toe_advance_m: byte(2) / 128.0,
            crest_retreat_m: byte(3) / 128.0,
            moved_area_m2: byte(4),
            deposit_height_at_toe_m: byte(5) / 256.0,
            time_to_rest_s: Some(byte(6) / 32.0),
        }),
        energy: Some(Energy { outer_work_j: byte(8), ..Energy::default() }),
        energy_drifted: false,
        simulated_s: byte(7) / 16.0,
        steps: index * 10,
        points: 100,
        profile: None,
        digest,
    }
}

/// An analysis that blew up.
fn failed(index: u64) -> Outcome {
    Outcome {
        outcome: OutcomeKind::Failed,
        reason: Reason::NonFinite,
        measures: None,
        energy: None,
        ..outcome(0, index, false)
    }
}
