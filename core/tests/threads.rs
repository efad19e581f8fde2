//! Threads that share an analysis move no bits.

mod bodies;

use bodies::{filled, setup};
use runout_core::campaign::{Formulation, VolumetricStrain};
use runout_core::gimp::{Body, Energy, Grid, InitialPoints, Kernel, Setup, State, Support, Threads};

/// A bank of 40 by 20 m that gives way: 41 rows of nodes are several chunks.
fn falling_bank(formulation: Formulation) -> Setup {
    let h = 1.0;
    let mut points = InitialPoints::at_rest(&filled(0.0, 0.0, 40, 38, h), 0.25 * h * h, 2000.0);
    points.cohesion = vec![2e3; points.len()];
    points.friction_angle = vec![0.2; points.len()];
    let mut setup = setup(Grid::enclosing(0.0, 0.0, [60, 42], h), 1e7, 0.3, points);
    setup.conditions.bottom = Support::Fixed;
    setup.conditions.gravity_m_s2 = [0.0, -9.81];
    setup.fluid.bulk_modulus_pa = 1e8;
    setup.controls.formulation = formulation;
    setup.controls.volumetric_strain = VolumetricStrain::CellAverage;
    setup.controls.pressure_relaxation_rate_per_s = 300.0;
    setup.controls.pic_rate_per_s = 10.0;
    setup
}

fn after(steps: u32, formulation: Formulation, threads: usize) -> (State, Energy) {
    let mut body = Body::new(falling_bank(formulation), Kernel::best()).unwrap();
    body.set_threads(Threads::new(threads).unwrap());
    for _ in 0..steps {
        let report = body.step(body.stable_step_s());
        assert!(report.kinetic_energy_j.is_finite() && !report.left_grid);
    }
    (body.state(), body.energy())
}

fn assert_same_bits(formulation: Formulation, steps: u32) {
    let alone = after(steps, formulation, 1);
    assert!(alone.0.x.iter().zip(&alone.0.vx).any(|(x, vx)| *x > 40.2 && *vx > 0.5), "nothing moves");
    for threads in [2, 3, 7] {
        let together = after(steps, formulation, threads);
        assert!(together == alone, "{threads} threads: other bits");
    }
}

#[test]
fn threads_move_no_bits_of_one_phase() {
    assert_same_bits(Formulation::OnePhase, 120);
}

#[test]
fn threads_move_no_bits_of_two_phases() {
    assert_same_bits(Formulation::TwoPhase, 400);
}
