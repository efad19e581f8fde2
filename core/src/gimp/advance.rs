//! One time step of MUSL, for eight points at a time; compiled once per kernel and formulation.
//!
//! Order: (scatter) - momentum balance - (filter) - gather and second scatter - velocities - gradients - cell means -
//! stress, pore pressure, volume and move - scatter for the next step. The last two are one pass over the points.

use super::block::Block;
use super::gather::{self, Blend, Motion};
use super::grid::{Grid, GridLanes};
use super::lanes::{Lanes, V8};
use super::loads::Loads;
use super::momentum::{self, Balance, NodeWork};
use super::nodes::Nodes;
use super::scatter::{self, PoreFluid};
use super::strain::{self, Averaging};
use super::update::{self, Tally};
use super::water::PoreWater;

/// The points and grid of an analysis.
#[derive(Debug, Clone)]
pub(super) struct Arena {
    pub(super) grid: Grid,
    pub(super) blocks: Vec<Block>,
    /// Points in the last block that are real.
    pub(super) live_in_last: usize,
    pub(super) nodes: Nodes,
    /// Whether `nodes.sums` holds the scatter of the points' present state.
    pub(super) scattered: bool,
}

impl Arena {
    /// Forgets the scatter of the points' present state: what acts on them has changed.
    pub(super) fn rescatter(&mut self) {
        self.nodes.clear();
        self.scattered = false;
    }
}

/// Constants of one step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) dt: f64,
    /// Share of the filtered part of the velocities that decays.
    pub(super) pic: f64,
    /// Whether the filter is applied twice.
    pub(super) filter_twice: bool,
    /// Whether stresses see the cell's mean volumetric strain.
    pub(super) average_strain: bool,
    /// Half the side of a point's domain at the start, in cells.
    pub(super) half_length: f64,
    /// Whether the points' domains follow their stretch.
    pub(super) stretch: bool,
    /// Whether some point's strength softens.
    pub(super) soften: bool,
    pub(super) balance: Balance,
    pub(super) averaging: Averaging,
    pub(super) loads: Option<Loads>,
    pub(super) water: PoreWater,
}

impl Step {
    /// Whether the step needs more than the plain scheme: what is compiled into its second form only.
    pub(super) fn extras(&self) -> bool {
        self.filter_twice || self.stretch || self.soften || self.loads.is_some()
    }
}

/// What a step tells.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepReport {
    /// Kinetic energy of both phases, J per m of width.
    pub(super) kinetic_energy: f64,
    /// Largest speed of a point, m/s.
    pub(super) fastest: f64,
    /// Whether a point has left the grid.
    pub(super) left_grid: bool,
    /// Work at the nodes.
    pub(super) nodes: NodeWork,
    /// Kinetic energy that the velocity filter took, J per m.
    pub(super) filtered: f64,
    /// Work of the effective stresses on the skeleton's strain, J per m.
    pub(super) stress_work: f64,
    /// Work that compressed the pore water, J per m.
    pub(super) water_work: f64,
}

/// Carries the arena through one step.
#[inline(always)]
pub(super) fn advance<S: Lanes, const TWO: bool, const EXTRA: bool>(
    arena: &mut Arena,
    step: &Step,
) -> StepReport {
    let Arena { grid, blocks, live_in_last, nodes, scattered } = arena;
    let lanes = GridLanes::<S>::new(grid, step.half_length);
    let stride = grid.nodes[0];
    let water_density = S::splat(step.balance.water_density);
    let fluid = PoreFluid { density: water_density, lowest_pressure: S::splat(-step.water.cavitation) };
    let dt = S::splat(step.dt);
    let zero = S::splat(0.0);
    let loads = step.loads.as_ref().filter(|_| EXTRA);

    if !*scattered {
        for block in blocks.iter() {
            scatter::scatter::<S, TWO, EXTRA>(&lanes, stride, &fluid, loads, block, nodes);
        }
    }
    let node_work = momentum::accelerate::<TWO, EXTRA>(nodes, &step.balance, step.dt);

    let filter_twice = EXTRA && step.filter_twice;
    if filter_twice {
        for block in blocks.iter() {
            gather::scatter_filtered::<S, TWO>(&lanes, stride, water_density, block, nodes);
        }
        momentum::filtered_velocities::<TWO>(nodes, &step.balance);
    }
    let blend = Blend { dt, pic: S::splat(step.pic), twice: filter_twice, water_density };
    let mut motion = Motion { double_energy: zero, double_loss: zero, fastest: zero };
    for block in blocks.iter_mut() {
        gather::gather_and_scatter_again::<S, TWO, EXTRA>(&lanes, stride, &blend, block, nodes, &mut motion);
    }
    if let Some(last) = blocks.last_mut() {
        rest_padding(last, *live_in_last);
    }
    momentum::velocities::<TWO>(nodes, &step.balance);

    let average = (step.average_strain || (TWO && step.water.relaxation > 0.0)).then_some(&step.averaging);
    for block in blocks.iter_mut() {
        strain::gradients::<S, TWO, EXTRA>(&lanes, stride, dt, average, block, nodes);
    }
    if average.is_some() {
        strain::average_cells(nodes);
    }

    let mut tally = Tally { outside: zero, stress_work: zero, water_work: zero };
    for block in blocks.iter_mut() {
        update::update::<S, TWO, EXTRA>(&lanes, step, average, block, &nodes.cells, &mut tally);
        scatter::scatter::<S, TWO, EXTRA>(&lanes, stride, &fluid, loads, block, nodes);
    }
    *scattered = true;
    report(motion, tally, node_work)
}

fn report<S: Lanes>(motion: Motion<S>, tally: Tally<S>, nodes: NodeWork) -> StepReport {
    let lanes_of = |s: S| {
        let mut lanes = V8::ZERO;
        s.store(&mut lanes);
        lanes.0
    };
    let sum = |s: S| lanes_of(s).iter().sum::<f64>();
    StepReport {
        kinetic_energy: 0.5 * sum(motion.double_energy),
        fastest: lanes_of(motion.fastest).iter().fold(0.0_f64, |a, &b| a.max(b)).sqrt(),
        left_grid: lanes_of(tally.outside).iter().any(|&o| o > 0.0),
        nodes,
        filtered: 0.5 * sum(motion.double_loss),
        stress_work: sum(tally.stress_work),
        water_work: sum(tally.water_work),
    }
}

/// Keeps the points that only fill the last block where they are.
fn rest_padding(last: &mut Block, live: usize) {
    for lane in live..8 {
        for quantity in [&mut last.vx, &mut last.vy, &mut last.wx, &mut last.wy, &mut last.dx, &mut last.dy] {
            quantity.0[lane] = 0.0;
        }
    }
}
