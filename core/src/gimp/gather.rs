//! Grid to points: velocities, moves, and the second scatter of MUSL (Sulsky, Zhou & Schreyer 1995).

use super::block::Block;
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};
use super::nodes::Nodes;
use super::scatter::add_values;
use super::shape::{self, Shape};

/// What a pass over the points adds up, lane by lane.
#[derive(Clone, Copy)]
pub(super) struct Motion<S> {
    /// Twice the kinetic energy, kg m2/s2 per m of width.
    pub(super) double_energy: S,
    /// Largest square of a speed, m2/s2.
    pub(super) fastest: S,
}

/// Constants of the velocity update.
#[derive(Clone, Copy)]
pub(super) struct Blend<S> {
    /// Time step, s.
    pub(super) dt: S,
    /// Share of the grid's velocity in the point's (PIC).
    pub(super) pic: S,
    /// Density of the water, kg/m3.
    pub(super) water_density: S,
}

/// Updates the velocities of eight points, notes their moves, and adds their new momenta to the nodes.
#[inline(always)]
pub(super) fn gather_and_scatter_again<S: Lanes, const TWO: bool>(
    grid: &GridLanes<S>,
    stride: usize,
    blend: &Blend<S>,
    block: &mut Block,
    nodes: &mut Nodes,
    motion: &mut Motion<S>,
) {
    let mut shape = Shape::empty();
    shape::values(grid, &block.x, &block.y, &mut shape);
    let rows = collect(&shape, stride, &nodes.rates);
    let [change_vx, change_vy, change_wx, change_wy, grid_vx, grid_vy, grid_wx, grid_wy] = S::transpose(rows);
    let zero = S::splat(0.0);

    let vx = mix(S::load(&block.vx), change_vx, grid_vx, blend.pic);
    let vy = mix(S::load(&block.vy), change_vy, grid_vy, blend.pic);
    vx.store(&mut block.vx);
    vy.store(&mut block.vy);
    (grid_vx * blend.dt).store(&mut block.dx);
    (grid_vy * blend.dt).store(&mut block.dy);
    let mass = S::load(&block.mass);
    let square = vx.mul_add(vx, vy * vy);
    motion.double_energy = mass.mul_add(square, motion.double_energy);
    motion.fastest = square.max(motion.fastest);
    let mut momenta = [mass * vx, mass * vy, zero, zero, zero, zero, zero, zero];
    if TWO {
        let wx = mix(S::load(&block.wx), change_wx, grid_wx, blend.pic);
        let wy = mix(S::load(&block.wy), change_wy, grid_wy, blend.pic);
        wx.store(&mut block.wx);
        wy.store(&mut block.wy);
        let water = (S::load(&block.volume) - S::load(&block.grains)) * blend.water_density;
        let square = wx.mul_add(wx, wy * wy);
        motion.double_energy = water.mul_add(square, motion.double_energy);
        motion.fastest = square.max(motion.fastest);
        momenta[2] = water * wx;
        momenta[3] = water * wy;
    }
    add_values(&S::transpose(momenta), &shape, stride, &mut nodes.velocities);
}

/// FLIP with a share of PIC.
#[inline(always)]
fn mix<S: Lanes>(velocity: S, change: S, grid: S, pic: S) -> S {
    let flip = velocity + change;
    pic.mul_add(grid - flip, flip)
}

/// Per point, the sum of S times the nodes' rows.
#[inline(always)]
fn collect<S: Lanes>(shape: &Shape, stride: usize, nodes: &[V8]) -> [S; 8] {
    let mut rows = [S::splat(0.0); 8];
    for (q, row) in rows.iter_mut().enumerate() {
        let mut sum = S::splat(0.0);
        for j in 0..3 {
            let base = shape.base[q] + j * stride;
            for (i, node) in nodes[base..base + 3].iter().enumerate() {
                sum = S::splat(shape.value[3 * j + i].0[q]).mul_add(S::load(node), sum);
            }
        }
        *row = sum;
    }
    rows
}

/// Per point, the sum of dS/dx times the first half and dS/dy times the second half of the nodes' rows.
#[inline(always)]
pub(super) fn collect_gradients<S: Lanes>(shape: &Shape, stride: usize, nodes: &[V8]) -> [S; 8] {
    let mut rows = [S::splat(0.0); 8];
    for (q, row) in rows.iter_mut().enumerate() {
        let mut sum = S::splat(0.0);
        for j in 0..3 {
            let base = shape.base[q] + j * stride;
            for (i, node) in nodes[base..base + 3].iter().enumerate() {
                let k = 3 * j + i;
                let weight = S::halves(shape.gradient[0][k].0[q], shape.gradient[1][k].0[q]);
                sum = weight.mul_add(S::load(node), sum);
            }
        }
        *row = sum;
    }
    rows
}
