//! Grid to points: velocities, moves, and the second scatter of MUSL (Sulsky, Zhou & Schreyer 1995).

use super::block::{Block, Extra};
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};
use super::shape::{self, Shape};
use super::transfer::{self, Values};
use super::window::Window;

/// What a pass over the points adds up, lane by lane.
#[derive(Clone, Copy)]
pub(super) struct Motion<S> {
    /// Twice the kinetic energy, kg m2/s2 per m of width.
    pub(super) double_energy: S,
    /// Twice the kinetic energy that the filter takes.
    pub(super) double_loss: S,
    /// Largest square of a speed, m2/s2.
    pub(super) fastest: S,
}

/// Constants of the velocity update.
#[derive(Clone, Copy)]
pub(super) struct Blend<S> {
    /// Time step, s.
    pub(super) dt: S,
    /// Share of the filtered part of the velocities that decays in the step.
    pub(super) pic: S,
    /// Whether the filter is applied twice (XPIC(2)).
    pub(super) twice: bool,
    /// Density of the water, kg/m3.
    pub(super) water_density: S,
}

/// Velocities of skeleton (2) and water (2) of eight points.
type Velocities<S> = [S; 4];

/// What the grid tells eight points of its motion.
struct GridMotion<S> {
    /// Changes of velocity in the step.
    change: Velocities<S>,
    /// Velocities at its end.
    end: Velocities<S>,
}

#[inline(always)]
fn grid_motion<S: Lanes, const TWO: bool>(shape: &Shape, stride: usize, rates: &[V8]) -> GridMotion<S> {
    if TWO {
        let [a, b, c, d, e, f, g, h] = transfer::collect::<S>(&Values(shape), stride, rates);
        GridMotion { change: [a, b, c, d], end: [e, f, g, h] }
    } else {
        let zero = S::splat(0.0);
        let [a, b, e, f] = transfer::collect_low::<S>(&Values(shape), stride, rates);
        GridMotion { change: [a, b, zero, zero], end: [e, f, zero, zero] }
    }
}

/// Adds the momenta that the points have with the grid's velocities before the step: the second pass of the filter.
#[inline(always)]
pub(super) fn scatter_filtered<S: Lanes, const TWO: bool>(
    grid: &GridLanes<S>,
    stride: usize,
    water_density: S,
    block: &Block,
    extra: Option<&Extra>,
    nodes: &mut Window<'_>,
) {
    let shape = shape::values::<S, true>(grid, block, extra);
    let grid = grid_motion::<S, TWO>(&shape, stride, nodes.rates);
    let mass = S::load(&block.mass);
    let water = if TWO { water_mass(block, water_density) } else { S::splat(0.0) };
    let momenta = [
        mass * (grid.end[0] - grid.change[0]),
        mass * (grid.end[1] - grid.change[1]),
        water * (grid.end[2] - grid.change[2]),
        water * (grid.end[3] - grid.change[3]),
    ];
    transfer::add_low::<S>(&transfer::low_rows(momenta), &Values(&shape), stride, nodes.filtered);
}

/// Updates the velocities of eight points, notes their moves, and adds their new momenta to the nodes.
#[inline(always)]
pub(super) fn gather_and_scatter_again<S: Lanes, const TWO: bool, const EXTRA: bool>(
    grid: &GridLanes<S>,
    stride: usize,
    blend: &Blend<S>,
    block: &mut Block,
    extra: Option<&Extra>,
    nodes: &mut Window<'_>,
    motion: &mut Motion<S>,
) {
    let shape = shape::values::<S, EXTRA>(grid, block, extra);
    let grid = grid_motion::<S, TWO>(&shape, stride, nodes.rates);
    let filtered = if EXTRA && blend.twice {
        Some(transfer::collect_low::<S>(&Values(&shape), stride, nodes.filtered))
    } else {
        None
    };
    let old = [S::load(&block.vx), S::load(&block.vy), S::load(&block.wx), S::load(&block.wy)];
    let (new, lost) = blend_velocities::<S, TWO>(blend, &old, &grid, filtered.as_ref());

    new[0].store(&mut block.vx);
    new[1].store(&mut block.vy);
    (grid.end[0] * blend.dt).store(&mut block.dx);
    (grid.end[1] * blend.dt).store(&mut block.dy);
    let mass = S::load(&block.mass);
    let square = new[0].mul_add(new[0], new[1] * new[1]);
    motion.double_energy = mass.mul_add(square, motion.double_energy);
    motion.double_loss = mass.mul_add(lost[0], motion.double_loss);
    motion.fastest = square.max(motion.fastest);
    let zero = S::splat(0.0);
    let mut momenta = [mass * new[0], mass * new[1], zero, zero];
    if TWO {
        new[2].store(&mut block.wx);
        new[3].store(&mut block.wy);
        let water = water_mass(block, blend.water_density);
        let square = new[2].mul_add(new[2], new[3] * new[3]);
        motion.double_energy = water.mul_add(square, motion.double_energy);
        motion.double_loss = water.mul_add(lost[1], motion.double_loss);
        motion.fastest = square.max(motion.fastest);
        momenta[2] = water * new[2];
        momenta[3] = water * new[3];
    }
    transfer::add_low::<S>(&transfer::low_rows(momenta), &Values(&shape), stride, nodes.velocities);
}

/// Mass of the water of eight points, kg/m.
#[inline(always)]
fn water_mass<S: Lanes>(block: &Block, water_density: S) -> S {
    (S::load(&block.volume) - S::load(&block.grains)) * water_density
}

/// New velocities, and by how much the filter lowers their squares (skeleton, water).
///
/// With P the way from points to grid and back, FLIP keeps v + change; the filter takes the share `pic` of (I - P) v
/// (PIC; Brackbill & Ruppel 1986) or of (I - P)^2 v = v - 2 P v + P P v (XPIC(2); Hammerquist & Nairn 2017, "A new method
/// for material point method particle updates that reduces noise and enhances stability", CMAME 318:724), with v the
/// velocities before the step in the second and after it in the first.
#[inline(always)]
fn blend_velocities<S: Lanes, const TWO: bool>(
    blend: &Blend<S>,
    old: &Velocities<S>,
    grid: &GridMotion<S>,
    filtered: Option<&Velocities<S>>,
) -> (Velocities<S>, [S; 2]) {
    let mut new = *old;
    let mut lost = [S::splat(0.0); 2];
    for i in 0..if TWO { 4 } else { 2 } {
        let flip = old[i] + grid.change[i];
        let noise = match filtered {
            None => flip - grid.end[i],
            Some(filtered) => {
                let before = grid.end[i] - grid.change[i];
                old[i] - (before + before) + filtered[i]
            }
        };
        new[i] = (-blend.pic).mul_add(noise, flip);
        lost[i / 2] = lost[i / 2] + (flip - new[i]) * (flip + new[i]);
    }
    (new, lost)
}
