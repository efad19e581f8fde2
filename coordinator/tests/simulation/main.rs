//! Deterministic simulation of a campaign: the real engine and queue, a simulated disk, network and workers, and
//! thousands of random schedules of everything that can go wrong.
//!
//! Nothing here runs in real time, opens a socket or starts a thread: an event loop ([`world`]) draws every delay and
//! every fault from one seed. A schedule is a number; a failing one prints it, and
//! `SIMULATION_SEED=N cargo test --release -p runout --test simulation` runs it again (`SIMULATION_COUNT=N` runs more).
//!
//! What is checked in every schedule:
//!
//! * every index is recorded once, and what a worker was told is recorded is on the disk at any time after;
//! * attempts are unique over all sessions of the coordinator, and leases stay within the look-ahead;
//! * the prefix is contiguous and never shrinks within a session, and estimates are folded from it in index order;
//! * when the faults stop, the campaign ends within a bounded time: no lease is lost for ever, no dispute stays open;
//! * the results (stopping index, outcomes, estimates) are those of the undisturbed campaign, but for what is recorded
//!   as poison, also when one worker computes other bits and every outcome is audited.

mod coordinator;
mod random;
mod worker;
mod world;

use runout_core::campaign::Campaign;
use std::collections::BTreeMap;
use world::{Ended, World};

/// Schedules in a run of the tests.
const SCHEDULES: u64 = 3000;

const CAMPAIGN: &str = include_str!("../../../tests/campaigns/coarse.toml");

/// Converges at some index, or goes on to the maximum, after the schedule.
fn campaign(seed: u64, audit_fraction: f64) -> Campaign {
    let half_width = if seed.is_multiple_of(2) { "0.2" } else { "1e-6" };
    let text = CAMPAIGN
        .replace("seed = 20231", &format!("seed = {}", 20231 + seed))
        .replace("mean_half_width = 0.2", &format!("mean_half_width = {half_width}"))
        .replace("audit_fraction = 0.1", &format!("audit_fraction = {audit_fraction}"));
    runout_core::campaign::parse(&text).expect("the campaign is sound")
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok().and_then(|text| text.parse().ok())
}

#[test]
fn whatever_happens_the_results_are_those_of_the_undisturbed_campaign() {
    let seeds = match number("SIMULATION_SEED") {
        Some(seed) => seed..seed + 1,
        None => 0..number("SIMULATION_COUNT").unwrap_or(SCHEDULES),
    };
    let mut happened: BTreeMap<&str, u64> = BTreeMap::new();
    for seed in seeds {
        let ended = std::panic::catch_unwind(|| schedule(seed));
        match ended {
            Ok(ended) => {
                for (what, count) in ended.happened {
                    *happened.entry(what).or_default() += count;
                }
            }
            Err(panic) => {
                eprintln!("schedule {seed} failed; run it again with SIMULATION_SEED={seed}");
                std::panic::resume_unwind(panic);
            }
        }
    }
    if number("SIMULATION_SEED").is_none() {
        // A simulation in which nothing goes wrong shows nothing.
        for what in world::HAPPENINGS {
            assert!(
                happened.get(what).copied().unwrap_or(0) > 0,
                "it never happened that {what}: {happened:?}"
            );
        }
    }
    eprintln!("{happened:#?}");
}

fn schedule(seed: u64) -> Ended {
    World::new(seed, campaign).run()
}
