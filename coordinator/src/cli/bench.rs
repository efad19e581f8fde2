//! `runout bench`: the speed of fields and solver on one core of this machine.

use super::analysis::{kernel, prepare, watch};
use super::{Failure, print, print_json, seconds};
use crate::load;
use crate::table::{list, significant};
use clap::Args;
use runout_core::realisation::{Prepared, Source};
use serde::Serialize;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// `runout bench CAMPAIGN [--seconds S] [--json]`
#[derive(Debug, Args)]
pub struct BenchArguments {
    /// Campaign file
    campaign: PathBuf,
    /// Start whole realisations for this long, s; the one under way is finished, and at least two are timed
    #[arg(long, value_name = "S", default_value = "20", value_parser = seconds)]
    seconds: Duration,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// At least this many realisations: the first one computes the gravity stage that the others share.
const FEWEST_REALISATIONS: u64 = 2;
/// Fields are timed for this long.
const FIELD_TIME: Duration = Duration::from_millis(500);

/// The names of this document are a contract.
#[derive(Debug, Serialize)]
struct Document {
    points: usize,
    kernel: &'static str,
    realisations: u64,
    steps_per_s: f64,
    point_updates_per_s_per_core: f64,
    seconds_per_realisation: f64,
    field_ms: f64,
}

pub(super) fn bench(arguments: &BenchArguments) -> Result<(), Failure> {
    let loaded = load::load(&arguments.campaign)?;
    let prepared = prepare(&loaded.spec)?;
    let document = measure(&prepared, arguments.seconds)?;
    if arguments.json {
        print_json(&document)?;
    } else {
        let show = |v: f64| significant(v, 4);
        let rows = [
            ("kernel", document.kernel.to_owned()),
            ("points", document.points.to_string()),
            ("realisations timed", document.realisations.to_string()),
            ("steps per s, one core", show(document.steps_per_s)),
            ("point updates per s, one core", show(document.point_updates_per_s_per_core)),
            ("seconds per realisation", show(document.seconds_per_realisation)),
            ("field, ms", show(document.field_ms)),
        ];
        print(&list(&rows))?;
    }
    Ok(())
}

fn measure(prepared: &Prepared, solver_time: Duration) -> Result<Document, Failure> {
    let field_ms = field_ms(prepared);
    let begun = Instant::now();
    let (mut steps, mut wall_s, mut realisations) = (0, 0.0, 0);
    let mut later_wall_s = 0.0;
    while realisations < FEWEST_REALISATIONS || begun.elapsed() < solver_time {
        let watched = watch(prepared, Source::Index(realisations), f64::INFINITY, &mut |_| {})?;
        steps += watched.steps;
        wall_s += watched.wall_s;
        if realisations > 0 {
            later_wall_s += watched.wall_s;
        }
        realisations += 1;
    }
    let steps_per_s = steps as f64 / wall_s;
    Ok(Document {
        points: prepared.points(),
        kernel: kernel()?.name(),
        realisations,
        steps_per_s,
        point_updates_per_s_per_core: steps_per_s * prepared.points() as f64,
        seconds_per_realisation: later_wall_s / (realisations - 1) as f64,
        field_ms,
    })
}

/// Mean time of one realisation's properties at all points, ms.
fn field_ms(prepared: &Prepared) -> f64 {
    let begun = Instant::now();
    let mut fields = 0;
    while begun.elapsed() < FIELD_TIME || fields == 0 {
        std::hint::black_box(prepared.properties(Source::Index(fields)));
        fields += 1;
    }
    1e3 * begun.elapsed().as_secs_f64() / fields as f64
}
