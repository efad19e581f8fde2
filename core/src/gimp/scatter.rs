//! Points to grid: masses, momenta and internal forces.
//!
//! Zabala & Alonso (2011) and Bandara & Soga (2015) in the v-w form: the skeleton carries (1 - n) rho_s V, the
//! water n rho_w V; the mixture feels -V (sigma' - p I) grad S, the water V p grad S.

use super::block::{Block, Extra};
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};
use super::loads::Loads;
use super::shape;
use super::transfer::{self, Gradients, Values, ValuesAndGradients};
use super::window::Window;

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
    extra: Option<&Extra>,
    nodes: &mut Window<'_>,
) {
    let (shape, slopes) = shape::values_and_slopes::<S, EXTRA>(grid, block, extra);
    let loads = loads.zip(extra);
    if let Some((loads, extra)) = loads {
        loads.scatter::<S, TWO>(grid, stride, block, extra, &shape, nodes.loads);
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
        Some((loads, extra)) => {
            load(&block.pressure).max(fluid.lowest_pressure) - loads.free_water(grid, block, extra).0
        }
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
        transfer::add::<S>(&transfer::rows(rows), &Values(&shape), stride, nodes.sums);
        let push = volume * pressure;
        let rows = [force[0], force[1], push, zero, force[1], force[2], zero, push];
        transfer::add::<S>(&transfer::rows(rows), &Gradients(&shape, &slopes), stride, nodes.forces);
    } else {
        let rows = [mass, zero, momentum[0], momentum[1], force[0], force[1], force[1], force[2]];
        let pattern = ValuesAndGradients(&shape, &slopes);
        transfer::add::<S>(&transfer::rows(rows), &pattern, stride, nodes.sums);
    }
}
