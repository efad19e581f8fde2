//! Instructions of the parts of a realisation, held against a committed table: a guard against slow code that works on any
//! machine, busy or not. Needs valgrind (Debian: `apt-get install valgrind`) and a processor with AVX2 and FMA, for which
//! it counts: that is what valgrind 3.19 knows.
//!
//! * `cargo bench -p runout-core --bench instructions` counts and compares; the exit code is 1 if a count is more than
//!   3 % off.
//! * `cargo bench -p runout-core --bench instructions -- --renew` writes the table, `core/benches/instructions.toml`.
//!
//! This program runs itself under callgrind twice for every part, with fewer and with more units of the work; the
//! difference is the units' own, without start and set-up. No crate for this: those that exist need a second program of
//! the same version to be installed, and keep what they compare with under `target/`, where no reviewer sees it.

mod common;

use common::{CELL_M, flowing_slope, random_properties, spec};
use runout_core::campaign::Formulation;
use runout_core::copula::{Copula, Sampler};
use runout_core::field::{FieldPlan, FieldSample, Scratch};
use runout_core::gimp::{Body, Kernel};
use runout_core::marginal::{Family, Marginal, Quantile};
use runout_core::profile::{Recorder, Stations};
use runout_core::realisation::{Prepared, Progress, Source};
use runout_core::spec::Spec;
use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Largest change that counts as none.
const TOLERANCE: f64 = 0.03;
/// The kernel that is counted.
const KERNEL: Kernel = Kernel::Avx2;
/// The cells of the steps that are counted: 2,565 points.
const STEP_CELL_M: f64 = 2.0 * CELL_M;
/// Places at which copulas and marginals are counted.
const PLACES: usize = 2048;
const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/instructions.toml");
const RENEW: &str = "cargo bench -p runout-core --bench instructions -- --renew";

/// A part: its name, fewer and more rounds, and how many units a round has (the name says of what).
struct Part {
    name: String,
    rounds: [u32; 2],
    units: usize,
    work: Box<dyn Fn(u32) + Send + Sync>,
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--work", name, rounds] => {
            let part = parts().into_iter().find(|part| part.name == name).expect("a part's name");
            (part.work)(rounds.parse().expect("a number of rounds"));
            ExitCode::SUCCESS
        }
        ["--renew"] => count_all().map_or(ExitCode::FAILURE, |counts| renew(&counts)),
        [] => count_all().map_or(ExitCode::SUCCESS, |counts| compare(&counts)),
        _ => {
            eprintln!("expected no argument or --renew");
            ExitCode::from(2)
        }
    }
}

fn parts() -> Vec<Part> {
    let mut parts = vec![
        step_part(Formulation::OnePhase),
        step_part(Formulation::TwoPhase),
        field_part(),
        preparation_part(),
        realisation_part(),
        profile_part(),
    ];
    parts.extend(copula_parts());
    parts.extend(marginal_parts());
    parts
}

/// Developed flow. The rounds count steps: so many that the points are sorted several times, and one time more or less
/// changes the count by little; hence the large cells.
fn step_part(formulation: Formulation) -> Part {
    Part {
        name: format!("{} step, a point", common::name(formulation)),
        rounds: [20, 220],
        units: flowing_slope(formulation, STEP_CELL_M).points.len(),
        work: Box::new(move |steps| {
            let mut body = Body::new(flowing_slope(formulation, STEP_CELL_M), KERNEL).expect("a sound model");
            for _ in 0..steps {
                black_box(body.step(body.stable_step_s()));
            }
        }),
    }
}

/// Two properties with copula and marginals.
fn field_part() -> Part {
    let plan = || {
        let spec = random_spec();
        let layout = runout_core::points::fill(&spec.model.slope, &spec.model.mesh);
        FieldPlan::new(&spec.model.field, &spec.random, &spec.copula, layout.spacing_m, &layout.x, &layout.y)
            .expect("a sound plan")
    };
    Part {
        name: "field, a cell".to_owned(),
        rounds: [1, 6],
        units: plan().lattice().size(),
        work: Box::new(move |fields| {
            let plan = plan();
            let (mut scratch, mut sample) = (Scratch::default(), FieldSample::default());
            for index in 0..fields {
                plan.sample_into(1, u64::from(index), &mut scratch, black_box(&mut sample));
            }
        }),
    }
}

/// What a worker does once for a spec.
fn preparation_part() -> Part {
    Part {
        name: "preparation of a spec, a point".to_owned(),
        rounds: [1, 3],
        units: points(),
        work: Box::new(|times| {
            for _ in 0..times {
                black_box(Prepared::new(random_spec(), KERNEL).expect("a sound model"));
            }
        }),
    }
}

/// What a realisation costs beside its field and its steps: state to and fro, sorting, measures, digest.
fn realisation_part() -> Part {
    Part {
        name: "realisation of one step without its field, a point".to_owned(),
        rounds: [1, 4],
        units: points(),
        work: Box::new(|times| {
            let mut spec = spec(Formulation::TwoPhase);
            spec.model.maximum_steps = 1;
            spec.model.analysis.gravity_stage_s = 1e-3;
            let prepared = Prepared::new(spec, KERNEL).expect("a sound model");
            for _ in 0..times {
                let quiet = &mut |_: &runout_core::realisation::Snapshot<'_>| {};
                let outcome =
                    prepared.analyse(Source::Deterministic, f64::INFINITY, quiet, &Progress::default());
                black_box(outcome.expect("nothing cancels it"));
            }
        }),
    }
}

/// A look at what passes in front of the toe: every 0.05 s, that is once in dozens of steps.
fn profile_part() -> Part {
    let model = spec(Formulation::TwoPhase).model;
    Part {
        name: "look at the profile along the ground, a point".to_owned(),
        rounds: [10, 110],
        units: flowing_slope(Formulation::TwoPhase, STEP_CELL_M).points.len(),
        work: Box::new(move |looks| {
            let body = Body::new(flowing_slope(Formulation::TwoPhase, STEP_CELL_M), KERNEL);
            let body = body.expect("a sound model");
            let mut recorder = Recorder::new(Stations::of(&model.slope, &model.mesh));
            for _ in 0..looks {
                black_box(&mut recorder).look(black_box(&body).motion());
            }
        }),
    }
}

fn copula_parts() -> Vec<Part> {
    let pair = vec![vec![1.0, -0.67], vec![-0.67, 1.0]];
    let copulas = [
        Copula::Gaussian { correlation: pair.clone() },
        Copula::StudentT { correlation: pair, degrees_of_freedom: 10.0 },
        Copula::Plackett { theta: 0.1 },
        Copula::Frank { theta: -5.5 },
        random_properties().1,
    ];
    let part = |copula: Copula| Part {
        name: format!("{} copula of two properties, a place", copula.family().name()),
        rounds: [1, 5],
        units: PLACES,
        work: Box::new(move |rounds| {
            let sampler = Sampler::new(&copula).expect("a sound copula");
            for _ in 0..rounds {
                let (mut a, mut b) = (spread(-3.0, 3.0, 0.618_034), spread(-3.0, 3.0, 0.754_878));
                sampler.uniforms(&mut [&mut a, &mut b], 1.0);
                black_box((a, b));
            }
        }),
    };
    copulas.into_iter().map(part).collect()
}

fn marginal_parts() -> Vec<Part> {
    let marginals = [
        (Family::TruncNormal, 11.412, 6.1915),
        (Family::Lognormal, 2.3, 0.5),
        (Family::TruncGumbel, 16.27, 0.8849),
        (Family::Weibull, 29.37, 5.75),
    ];
    let part = |(family, p, q): (Family, f64, f64)| Part {
        name: format!("{} quantile", family.name()),
        rounds: [1, 5],
        units: PLACES,
        work: Box::new(move |rounds| {
            let quantile = Quantile::new(&Marginal::new(family, p, q).expect("a sound marginal"));
            for _ in 0..rounds {
                let mut values = spread(0.0, 1.0, 0.618_034);
                quantile.apply(&mut values);
                black_box(values);
            }
        }),
    };
    marginals.into_iter().map(part).collect()
}

fn points() -> usize {
    let model = spec(Formulation::OnePhase).model;
    runout_core::points::fill(&model.slope, &model.mesh).len()
}

fn random_spec() -> Spec {
    let mut spec = spec(Formulation::OnePhase);
    (spec.random, spec.copula) = random_properties();
    spec.model.soil.cohesion_pa = None;
    spec.model.soil.friction_angle_rad = None;
    spec
}

/// [`PLACES`] numbers that fill an interval evenly, in no order.
fn spread(low: f64, high: f64, step: f64) -> Vec<f64> {
    (0..PLACES).map(|i| low + (high - low) * ((i as f64 + 0.5) * step).fract()).collect()
}

/// Instructions a unit of every part; nothing, with the reason on standard error, where they cannot be counted.
fn count_all() -> Option<BTreeMap<String, f64>> {
    if !Kernel::available().contains(&KERNEL) {
        eprintln!("INSTRUCTIONS NOT COUNTED: this processor has no {}", KERNEL.name());
        return None;
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        eprintln!("INSTRUCTIONS NOT COUNTED: valgrind is not installed");
        return None;
    }
    // Counts know no clock: as many at a time as the machine has cores.
    let (parts, next, counts) = (parts(), AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(part) = parts.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let count = count_unit(part);
                    counts.lock().expect("no counter panics with it").insert(part.name.clone(), count);
                }
            });
        }
    });
    Some(counts.into_inner().expect("no counter panics with it"))
}

/// Instructions a unit of a part.
fn count_unit(part: &Part) -> f64 {
    let [fewer, more] = part.rounds.map(|rounds| count(&part.name, rounds) as f64);
    (more - fewer) / (f64::from(part.rounds[1] - part.rounds[0]) * part.units as f64)
}

/// Instructions of this program with so many rounds of a part.
fn count(part: &str, rounds: u32) -> u64 {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(std::env::current_exe().expect("the system tells where this program lies"))
        .args(["--work", part, &rounds.to_string()])
        .output()
        .expect("valgrind starts");
    let said = String::from_utf8_lossy(&output.stderr);
    let counted = said.lines().find_map(|line| line.split_once("Collected :")?.1.trim().parse().ok());
    counted.filter(|_| output.status.success()).unwrap_or_else(|| panic!("{part}: {said}"))
}

fn compare(counts: &BTreeMap<String, f64>) -> ExitCode {
    let table = std::fs::read_to_string(TABLE).expect("the table is there");
    let table: toml::Table = table.parse().expect("the table is TOML");
    let expected: BTreeMap<&str, f64> = table["instructions"]
        .as_table()
        .expect("counts by part")
        .iter()
        .map(|(part, count)| (part.as_str(), count.as_float().expect("a count is a float")))
        .collect();
    let mut sound = true;
    for part in expected.keys().filter(|part| !counts.contains_key(**part)) {
        println!("{part}: in the table, but not counted any more");
        sound = false;
    }
    for (part, &count) in counts {
        let change = expected.get(part.as_str()).map(|expected| count / expected - 1.0);
        let verdict = match change {
            None => "NOT IN THE TABLE",
            Some(change) if change > TOLERANCE => "TOO MANY",
            Some(change) if change < -TOLERANCE => "FEWER",
            Some(_) => "",
        };
        sound &= verdict.is_empty();
        let change = change.map_or("    new".to_owned(), |change| format!("{:+6.2}%", 100.0 * change));
        println!("{part:52} {count:10.2} {change} {verdict}");
    }
    if sound {
        return ExitCode::SUCCESS;
    }
    let (made_with, here) = (table["compiler"].as_str().unwrap_or_default(), compiler());
    if made_with != here {
        println!("The table was made with {made_with}; this is {here}.");
    }
    println!(
        "More than {} % off {}. If that is meant, renew it: {RENEW}",
        100.0 * TOLERANCE,
        Path::new(TABLE).display()
    );
    ExitCode::FAILURE
}

fn renew(counts: &BTreeMap<String, f64>) -> ExitCode {
    let mut text = format!(
        "# Instructions a unit with the {} kernel, counted by callgrind. Written by\n# {RENEW}\n\ncompiler = \"{}\"\n\n\
         [instructions]\n",
        KERNEL.name(),
        compiler()
    );
    for (part, count) in counts {
        println!("{part:52} {count:10.2}");
        text.push_str(&format!("\"{part}\" = {count:.2}\n"));
    }
    std::fs::write(TABLE, text).expect("the table can be written");
    ExitCode::SUCCESS
}

/// The compiler's version: another one gives other counts.
fn compiler() -> String {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("--version").output();
    output.map_or("unknown".to_owned(), |said| String::from_utf8_lossy(&said.stdout).trim().to_owned())
}
