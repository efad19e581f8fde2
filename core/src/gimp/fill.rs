//! From the points as set up to blocks.

use super::block::{Block, Extra};
use super::setup::{Material, Setup, Softening};
use super::time_step::bulk_and_shear;
use crate::campaign::Formulation;

/// Whether the points differ in what acts on them besides stress and weight, so that the step must add it up point by
/// point.
pub(super) fn point_loads_needed(setup: &Setup) -> bool {
    let Setup { points, materials, conditions, .. } = setup;
    let forces = points.force.iter().any(|f| *f != [0.0; 2]);
    let two = setup.controls.formulation == Formulation::TwoPhase;
    let drags = points.material.iter().map(|&m| materials[usize::from(m)].permeability_m_s);
    let differ = differ(drags) || differ(points.water_held.iter());
    forces || (two && (conditions.free_water_level_m.is_some() || differ))
}

fn differ<T: PartialEq>(mut values: impl Iterator<Item = T>) -> bool {
    values.next().is_some_and(|first| values.any(|value| value != first))
}

/// The points in blocks, in the given order.
pub(super) fn fill_blocks(setup: &Setup) -> Vec<Block> {
    let count = setup.points.len();
    let mut blocks = vec![Block::EMPTY; count.div_ceil(8)];
    for i in 0..count {
        let block = &mut blocks[i / 8];
        place(block, i % 8, setup, i);
        set_material(block, i % 8, setup, i);
    }
    blocks
}

/// As [`fill_blocks`], for what only some analyses need.
pub(super) fn fill_extras(setup: &Setup) -> Vec<Extra> {
    let count = setup.points.len();
    let mut extras = vec![Extra::EMPTY; count.div_ceil(8)];
    for i in 0..count {
        set_softening(&mut extras[i / 8], i % 8, setup, i);
        set_loads(&mut extras[i / 8], i % 8, setup, i);
    }
    extras
}

/// Place, motion, stress, masses and loads of point `i`.
fn place(block: &mut Block, lane: usize, setup: &Setup, i: usize) {
    let Setup { points, fluid, controls, .. } = setup;
    let material = setup.material_of(i);
    let two = controls.formulation == Formulation::TwoPhase;
    let grains = if two { (1.0 - material.porosity) * points.volume[i] } else { 0.0 };
    let water_mass = if two { material.porosity * fluid.density_kg_m3 * points.volume[i] } else { 0.0 };
    block.x.0[lane] = points.x[i];
    block.y.0[lane] = points.y[i];
    [block.vx.0[lane], block.vy.0[lane]] = points.velocity[i];
    [block.wx.0[lane], block.wy.0[lane]] = points.velocity[i];
    [block.sxx.0[lane], block.syy.0[lane], block.szz.0[lane], block.sxy.0[lane]] = points.stress[i];
    block.pressure.0[lane] = points.pressure[i];
    block.volume.0[lane] = points.volume[i];
    block.grains.0[lane] = grains;
    block.mass.0[lane] = points.density[i] * points.volume[i] - water_mass;
}

/// Stiffness and strength of point `i`.
fn set_material(block: &mut Block, lane: usize, setup: &Setup, i: usize) {
    let (cohesion, friction_angle) = (setup.points.cohesion[i], setup.points.friction_angle[i]);
    let material = setup.material_of(i);
    let (bulk, shear) = bulk_and_shear(material);
    block.bulk.0[lane] = bulk;
    block.shear.0[lane] = shear;
    block.sin_psi.0[lane] = libm::sin(material.dilation_angle_rad);
    let cutoff = cutoff(material, cohesion);
    [block.sin_phi.0[lane], block.two_c_cos_phi.0[lane], block.apex.0[lane], block.tension.0[lane]] =
        strength(cohesion, friction_angle, cutoff);
}

/// How the strength of point `i` softens.
fn set_softening(extra: &mut Extra, lane: usize, setup: &Setup, i: usize) {
    let (cohesion, friction_angle) = (setup.points.cohesion[i], setup.points.friction_angle[i]);
    let material = setup.material_of(i);
    let none = Softening {
        residual_cohesion: 1.0,
        residual_friction_angle: 1.0,
        residual_dilation_angle: 1.0,
        displacement_m: f64::INFINITY,
    };
    let softening = material.softening.unwrap_or(none);
    extra.cohesion.0[lane] = cohesion;
    extra.friction_angle.0[lane] = friction_angle;
    extra.dilation_angle.0[lane] = material.dilation_angle_rad;
    extra.tension_cutoff.0[lane] = cutoff(material, cohesion);
    extra.residual_cohesion.0[lane] = softening.residual_cohesion;
    extra.residual_friction_angle.0[lane] = softening.residual_friction_angle;
    extra.residual_dilation_angle.0[lane] = softening.residual_dilation_angle;
    extra.softening_rate.0[lane] = 3.0_f64.sqrt() * setup.grid.cell_m / softening.displacement_m;
    extra.peak_left.0[lane] = 1.0;
}

/// Domain and loads of point `i`.
fn set_loads(extra: &mut Extra, lane: usize, setup: &Setup, i: usize) {
    let Setup { points, fluid, .. } = setup;
    extra.half_x.0[lane] = 0.5 / f64::from(setup.points_per_cell_side);
    extra.half_y.0[lane] = extra.half_x.0[lane];
    extra.drag_rate.0[lane] = fluid.gravity_m_s2 / setup.material_of(i).permeability_m_s;
    extra.held.0[lane] = f64::from(u8::from(points.water_held[i]));
    [extra.force_x.0[lane], extra.force_y.0[lane]] = points.force[i];
}

/// Tension cut-off, Pa; infinite for none, and in an elastic material.
fn cutoff(material: &Material, cohesion: f64) -> f64 {
    material.tension_cutoff_pa.filter(|_| cohesion.is_finite()).unwrap_or(f64::INFINITY)
}

/// sin phi, 2 c cos phi, c cot phi and the tension cut-off of one point.
fn strength(cohesion: f64, friction_angle: f64, cutoff: f64) -> [f64; 4] {
    let (sin, cos) = libm::sincos(friction_angle);
    let apex = if sin > 0.0 { cohesion * cos / sin } else { f64::INFINITY };
    [sin, 2.0 * cohesion * cos, apex, cutoff.min(apex)]
}
