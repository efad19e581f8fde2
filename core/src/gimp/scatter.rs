//! Points to grid: masses, momenta and internal forces.
//!
//! Zabala & Alonso (2011) and Bandara & Soga (2015) in the v-w form: the skeleton carries (1 - n) rho_s V, the
//! water n rho_w V; the mixture feels -V (sigma' - p I) grad S, the water V p grad S.

use super::block::Block;
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};
use super::loads::Loads;
use super::nodes::Nodes;
use super::shape::{self, Shape};

/// What the scatter needs to know of the pore water.
#[derive(Clone, Copy)]
pub(super) struct PoreFluid<S> {
    /// Density, kg/m3.
    pub(super) density: S,
    /// Pore pressure below which water cavitates, Pa.
    pub(super) lowest_pressure: S,
}

/// Adds the masses, momenta and internal forces of eight points to their nodes.
#[inline(always)]
pub(super) fn scatter<S: Lanes, const TWO: bool, const EXTRA: bool>(
    grid: &GridLanes<S>,
    stride: usize,
    fluid: &PoreFluid<S>,
    loads: Option<&Loads>,
    block: &Block,
    nodes: &mut Nodes,
) {
    let mut shape = Shape::empty();
    shape::values_and_gradients::<S, EXTRA>(grid, block, &mut shape);
    if let Some(loads) = loads {
        loads.scatter::<S, TWO>(grid, stride, block, &shape, nodes);
    }
    let load = |v: &V8| S::load(v);
    let zero = S::splat(0.0);
    let volume = load(&block.volume);
    let mass = load(&block.mass);
    let momentum = [mass * load(&block.vx), mass * load(&block.vy)];
    let pressure = match loads {
        _ if !TWO => zero,
        None => load(&block.pressure).max(fluid.lowest_pressure),
        // Free water carries part of the pressure on both sides of every surface: only the excess pushes.
        Some(loads) => load(&block.pressure).max(fluid.lowest_pressure) - loads.free_water(grid, block).0,
    };
    let force = [
        -(volume * (load(&block.sxx) - pressure)),
        -(volume * load(&block.sxy)),
        -(volume * (load(&block.syy) - pressure)),
    ];
    if TWO {
        let water = (volume - load(&block.grains)) * fluid.density;
        let flow = [water * load(&block.wx), water * load(&block.wy)];
        let rows = [mass, water, momentum[0], momentum[1], flow[0], flow[1], volume, zero];
        add_values(&S::transpose(rows), &shape, stride, &mut nodes.sums);
        let push = volume * pressure;
        let rows = [force[0], force[1], push, zero, force[1], force[2], zero, push];
        add_forces(&S::transpose(rows), &shape, stride, &mut nodes.forces);
    } else {
        let rows = [mass, zero, momentum[0], momentum[1], force[0], force[1], force[1], force[2]];
        add_values_and_forces(&S::transpose(rows), &shape, stride, &mut nodes.sums);
    }
}

/// Adds S times a row of eight numbers a point to the nodes.
#[inline(always)]
pub(super) fn add_values<S: Lanes>(rows: &[S; 8], shape: &Shape, stride: usize, nodes: &mut [V8]) {
    for (q, &row) in rows.iter().enumerate() {
        for j in 0..3 {
            let base = shape.base[q] + j * stride;
            for (i, node) in nodes[base..base + 3].iter_mut().enumerate() {
                let weight = S::splat(shape.value[3 * j + i].0[q]);
                weight.mul_add(row, S::load(node)).store(node);
            }
        }
    }
}

/// Adds dS/dx times the first four numbers and dS/dy times the last four.
#[inline(always)]
fn add_forces<S: Lanes>(rows: &[S; 8], shape: &Shape, stride: usize, nodes: &mut [V8]) {
    for (q, &row) in rows.iter().enumerate() {
        for j in 0..3 {
            let base = shape.base[q] + j * stride;
            for (i, node) in nodes[base..base + 3].iter_mut().enumerate() {
                let k = 3 * j + i;
                let weight = S::halves(shape.gradient[0][k].0[q], shape.gradient[1][k].0[q]);
                weight.mul_add(row, S::load(node)).store(node);
            }
        }
    }
}

/// Adds S times the first four numbers, dS/dx times the next two, dS/dy times the last two.
#[inline(always)]
fn add_values_and_forces<S: Lanes>(rows: &[S; 8], shape: &Shape, stride: usize, nodes: &mut [V8]) {
    for (q, &row) in rows.iter().enumerate() {
        for j in 0..3 {
            let base = shape.base[q] + j * stride;
            for (i, node) in nodes[base..base + 3].iter_mut().enumerate() {
                let k = 3 * j + i;
                let [gx, gy] = [&shape.gradient[0][k], &shape.gradient[1][k]];
                let weight = S::quarters(shape.value[k].0[q], gx.0[q], gy.0[q]);
                weight.mul_add(row, S::load(node)).store(node);
            }
        }
    }
}
