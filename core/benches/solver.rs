//! Point updates per second of the solver on one core.
//!
//! * `cargo bench -p runout-core --bench solver -- [one-phase|two-phase] [KERNEL]`: the headline figure. The paper's slope at
//!   0.2 m points (10,125 of them), failing for three seconds, so that points are out of their initial order and yield;
//!   both formulations and every kernel that this processor has but the slow baseline, unless named.
//! * The same with `sizes`: the slope in developed flow with cells that give about 2,500 to 1,000,000 points; each size in
//!   a process of its own, so that its memory is its own.
//! * The same with `threads`: the largest two of these slopes by one thread, two, and so on to the number of cores, by the wall
//!   clock.
//!
//! Timed is the thread's own processor time where the system tells it (Linux), so that a busy machine does not matter;
//! else the wall clock.

mod common;

use common::{CELL_M, flowing_slope, seconds, spec};
use runout_core::campaign::Formulation;
use runout_core::gimp::{Body, Kernel, Threads};
use runout_core::realisation::{Prepared, Progress};
use std::hint::black_box;
use std::process::Command;
use std::time::Instant;

/// Cells (m) of the scaling table; 0.4 m is the headline's.
const CELLS_M: [f64; 5] = [0.8, CELL_M, 0.2, 0.1, 15.0 / 373.0];
/// Steps before the clock starts: with these the points have crossed cells and have been sorted again.
const STEPS_BEFORE: u32 = 40;
/// Timed steps in a row: both formulations sort at least twice in them.
const STEPS: u32 = 120;
/// Least point updates between two looks at the clock, which Linux moves on by 4 ms at a time; small sizes repeat the
/// same steps.
const UPDATES: usize = 10_000_000;
/// Most times that is done, the fastest of which counts; large sizes do as many as fit into so many times the updates.
const REPETITIONS: usize = 4;

fn main() {
    let mut formulations = vec![Formulation::OnePhase, Formulation::TwoPhase];
    let mut kernels: Vec<Kernel> =
        Kernel::available().into_iter().filter(|&k| k != Kernel::Baseline).collect();
    let (mut sizes, mut threads, mut one_size) = (false, false, None);
    for word in std::env::args().skip(1) {
        if let Some(formulation) = common::formulation(&word) {
            formulations = vec![formulation];
        } else if let Some(kernel) = Kernel::from_name(&word) {
            kernels = vec![kernel];
        } else if let Some(cell) = word.strip_prefix("cell=") {
            one_size = cell.parse().ok();
        } else if word == "sizes" {
            sizes = true;
        } else if word == "threads" {
            threads = true;
        } else if word != "--bench" {
            eprintln!("{word}: expected one-phase, two-phase, sizes, threads, baseline, avx2 or avx512");
            std::process::exit(2);
        }
    }
    if let Some(kernel) = kernels.iter().find(|kernel| !Kernel::available().contains(kernel)) {
        eprintln!("{}: this processor cannot run it", kernel.name());
        std::process::exit(2);
    }
    if kernels.is_empty() {
        kernels.push(Kernel::best());
    }
    for &formulation in &formulations {
        for &kernel in &kernels {
            match one_size {
                Some(cell_m) => time_size(formulation, kernel, cell_m),
                None if sizes => each_size(formulation, kernel),
                None if threads => time_threads(formulation, kernel),
                None => time_slide(formulation, kernel),
            }
        }
    }
}

/// The headline: a whole failure stage.
fn time_slide(formulation: Formulation, kernel: Kernel) {
    let prepared = Prepared::new(spec(formulation), kernel).expect("a sound model");
    // The first call computes and keeps the gravity stage.
    let outcome = prepared.deterministic(&Progress::default()).expect("nothing cancels it");
    let (again, seconds) =
        seconds(|| prepared.deterministic(&Progress::default()).expect("nothing cancels it"));
    assert_eq!(again, outcome);
    println!(
        "{} {:<8} {:6} points {:6} steps {:6.2} s {:6.2} million point updates/s",
        common::name(formulation),
        kernel.name(),
        outcome.points,
        outcome.steps,
        seconds,
        outcome.points as f64 * outcome.steps as f64 / seconds / 1e6
    );
}

fn each_size(formulation: Formulation, kernel: Kernel) {
    let program = std::env::current_exe().expect("the system tells where this program lies");
    for cell_m in CELLS_M {
        let child = Command::new(&program)
            .args([common::name(formulation), kernel.name(), &format!("cell={cell_m}")])
            .status();
        assert!(child.expect("this program starts again").success(), "cells of {cell_m} m");
    }
}

fn time_size(formulation: Formulation, kernel: Kernel, cell_m: f64) {
    let resident_before = peak_resident_bytes();
    let mut body = Body::new(flowing_slope(formulation, cell_m), kernel).expect("a sound model");
    let points = body.setup().points.len();
    steps(&mut body, STEPS_BEFORE);
    let resident = peak_resident_bytes().zip(resident_before).map(|(after, before)| after - before);
    let copies = UPDATES.div_ceil(points * STEPS as usize);
    let repetitions = REPETITIONS * UPDATES / (points * STEPS as usize * copies);
    let fastest_s = (0..repetitions.max(1))
        .map(|_| {
            let mut again = vec![body.clone(); copies];
            let ((), seconds) = seconds(|| again.iter_mut().for_each(|body| steps(black_box(body), STEPS)));
            seconds
        })
        .fold(f64::INFINITY, f64::min);
    let ns = fastest_s * 1e9 / (points as f64 * f64::from(STEPS) * copies as f64);
    println!(
        "{} {:<8} {points:8} points {:6.2} million point updates/s {ns:7.2} ns a point and step {:>6} bytes a point",
        common::name(formulation),
        kernel.name(),
        1e3 / ns,
        resident.map_or("?".to_owned(), |bytes| format!("{:.0}", bytes / points as f64)),
    );
}

/// Large bodies shared by threads.
fn time_threads(formulation: Formulation, kernel: Kernel) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for cell_m in &CELLS_M[CELLS_M.len() - 2..] {
        let mut body = Body::new(flowing_slope(formulation, *cell_m), kernel).expect("a sound model");
        let points = body.setup().points.len();
        steps(&mut body, STEPS_BEFORE);
        let mut alone_s = f64::NAN;
        for threads in 1..=cores {
            let mut body = body.clone();
            body.set_threads(Threads::new(threads).expect("threads start"));
            let begun = Instant::now();
            steps(black_box(&mut body), STEPS);
            let wall_s = begun.elapsed().as_secs_f64();
            if threads == 1 {
                alone_s = wall_s;
            }
            println!(
                "{} {:<8} {points:8} points {threads:3} threads {wall_s:6.2} s {:6.2} times as fast as one",
                common::name(formulation),
                kernel.name(),
                alone_s / wall_s
            );
        }
    }
}

fn steps(body: &mut Body, count: u32) {
    for _ in 0..count {
        let report = body.step(body.stable_step_s());
        assert!(report.kinetic_energy_j.is_finite() && !report.left_grid);
    }
}

/// Most memory that this process has had resident so far, bytes, where the system tells it (Linux).
fn peak_resident_bytes() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()? * 1024.0)
}
