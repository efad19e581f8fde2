//! The critical time step: the time the fastest wave takes through a cell.

use super::setup::{Controls, Fluid, Material, Setup};
use crate::campaign::Formulation;

/// Drag relaxation rate times the undrained travel time through a cell above which skeleton and water move as one
/// within a step, so that the undrained wave is the fastest. Below, the fast wave of the uncoupled pair counts. At
/// 10 the exact limit of the symplectic scheme with point-implicit drag lies within 1 % of the undrained one.
const DRAG_DOMINATED: f64 = 10.0;

/// Bulk and shear modulus, Pa.
pub(super) fn bulk_and_shear(material: &Material) -> (f64, f64) {
    let Material { youngs_modulus_pa: e, poissons_ratio: nu, .. } = *material;
    (e / (3.0 * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
}

/// Speed of the fastest wave through material of total density `density`, m/s.
///
/// One phase: sqrt(E_c / rho) with the constrained modulus E_c. Two phases: the undrained wave
/// sqrt((E_c + Q) / rho) with Q = K_w / n if drag dominates, else the square root of the largest eigenvalue of
/// M^-1 K with M = diag((1 - n) rho_s, n rho_w) and K = [E_c + (1 - n)^2 Q, n (1 - n) Q; n (1 - n) Q, n^2 Q]
/// (Zienkiewicz, Chan, Pastor, Schrefler & Shiomi 1999, "Computational geomechanics", chapter 2).
fn wave_speed(
    material: &Material,
    fluid: &Fluid,
    formulation: Formulation,
    density: f64,
    cell_m: f64,
) -> f64 {
    let (bulk, shear) = bulk_and_shear(material);
    let constrained = bulk + 4.0 / 3.0 * shear;
    if formulation == Formulation::OnePhase {
        return (constrained / density).sqrt();
    }
    let n = material.porosity;
    let storage = fluid.bulk_modulus_pa / n;
    let water = n * fluid.density_kg_m3;
    let skeleton = density - water;
    let undrained = ((constrained + storage) / density).sqrt();
    let drag_rate = n * fluid.gravity_m_s2 * density / (material.permeability_m_s * skeleton);
    if drag_rate * cell_m / undrained >= DRAG_DOMINATED {
        return undrained;
    }
    let k11 = (constrained + (1.0 - n) * (1.0 - n) * storage) / skeleton;
    let k22 = n * n * storage / water;
    let k12_squared = (n * (1.0 - n) * storage) * (n * (1.0 - n) * storage) / (skeleton * water);
    let half_difference = 0.5 * (k11 - k22);
    (0.5 * (k11 + k22) + (half_difference * half_difference + k12_squared).sqrt()).sqrt()
}

/// Speed of the fastest wave through any of the materials at the smallest density of its points, m/s.
pub(super) fn fastest_wave(setup: &Setup) -> f64 {
    let mut smallest = vec![f64::INFINITY; setup.materials.len()];
    for (&material, &density) in setup.points.material.iter().zip(&setup.points.density) {
        let smallest = &mut smallest[usize::from(material)];
        *smallest = smallest.min(density);
    }
    let speeds = setup.materials.iter().zip(smallest).filter(|(_, density)| density.is_finite()).map(
        |(material, density)| {
            wave_speed(material, &setup.fluid, setup.controls.formulation, density, setup.grid.cell_m)
        },
    );
    speeds.fold(0.0, f64::max)
}

/// Time step: Courant number times the cell over wave speed plus the largest speed of the material, s.
pub(super) fn time_step(controls: &Controls, cell_m: f64, wave_m_s: f64, fastest_m_s: f64) -> f64 {
    controls.courant_number * cell_m / (wave_m_s + fastest_m_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fast and undrained wave of the paper's first example, from an independent computation of the eigenvalues.
    #[test]
    fn wave_speeds_are_those_of_the_coupled_eigenproblem() {
        let mut material = Material {
            youngs_modulus_pa: 100e6,
            poissons_ratio: 0.35,
            dilation_angle_rad: 0.0,
            tension_cutoff_pa: None,
            softening: None,
            porosity: 0.3,
            permeability_m_s: 1.0,
        };
        let fluid = Fluid {
            density_kg_m3: 1000.0,
            bulk_modulus_pa: 6.146e9,
            cavitation_suction_pa: 0.0,
            gravity_m_s2: 9.81,
        };
        let density = 2038.735983690112;
        let fast = wave_speed(&material, &fluid, Formulation::TwoPhase, density, 0.2);
        assert!((fast / 3458.947267769102 - 1.0).abs() < 1e-12, "{fast}");
        material.permeability_m_s = 1e-8;
        let undrained = wave_speed(&material, &fluid, Formulation::TwoPhase, density, 0.2);
        assert!((undrained / 3182.3626792404134 - 1.0).abs() < 1e-12, "{undrained}");
    }
}
