//! The phases of a time step, each for a part of the points or of the nodes; compiled once per kernel and formulation.

use super::advance::Step;
use super::gather::{self, Blend, Motion};
use super::grid::{Grid, GridLanes};
use super::lanes::{Lanes, numbers};
use super::momentum::{self, NodeWork};
use super::scatter::{self, PoreFluid};
use super::strain;
use super::update::{self, Moved};
use super::window::{Points, Window};
use std::ops::Range;

/// One pass over the points or over the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    /// Points to nodes: masses, momenta, internal forces.
    Scatter,
    /// At nodes: the momentum balance.
    Balance,
    /// Points to nodes: momenta with the velocities of the grid before the step (XPIC).
    Filter,
    /// At nodes: those momenta to velocities.
    FilteredVelocities,
    /// Nodes to points and back: velocities and moves, new momenta.
    Gather,
    /// At nodes: velocities of the second scatter.
    Velocities,
    /// Nodes to points: gradients, and sums over cells.
    Gradients,
    /// At nodes: means over cells.
    Means,
    /// At points: stress, pore pressure, moves; then `Scatter` for the next step.
    Update,
}

/// What the phases add up.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    /// Twice the kinetic energy of both phases, J per m of width.
    pub(super) double_energy: f64,
    /// Twice the kinetic energy that the velocity filter took.
    pub(super) double_loss: f64,
    /// Largest square of a speed, m2/s2.
    pub(super) fastest_squared: f64,
    /// Whether a point has left the grid.
    pub(super) outside: bool,
    /// Work of the effective stresses on the skeleton's strain, J per m.
    pub(super) stress_work: f64,
    /// Work that compressed the pore water, J per m.
    pub(super) water_work: f64,
    pub(super) nodes: NodeWork,
}

impl Tally {
    /// Both together.
    pub(super) fn and(self, other: Tally) -> Tally {
        let (a, b) = (self.nodes, other.nodes);
        Tally {
            double_energy: self.double_energy + other.double_energy,
            double_loss: self.double_loss + other.double_loss,
            fastest_squared: self.fastest_squared.max(other.fastest_squared),
            outside: self.outside || other.outside,
            stress_work: self.stress_work + other.stress_work,
            water_work: self.water_work + other.water_work,
            nodes: NodeWork {
                outer: a.outer + b.outer,
                drag: a.drag + b.drag,
                damping: a.damping + b.damping,
                contact: a.contact + b.contact,
            },
        }
    }
}

/// A phase over points that touch the window's rows of nodes only.
#[inline(always)]
pub(super) fn at_points<S: Lanes, const TWO: bool, const EXTRA: bool>(
    phase: Phase,
    grid: &Grid,
    step: &Step,
    rows: &Range<usize>,
    mut points: Points<'_>,
    nodes: &mut Window<'_>,
) -> Tally {
    let lanes = GridLanes::<S>::new(grid, rows, step.half_length, step.stretch);
    let stride = grid.nodes[0];
    let zero = S::splat(0.0);
    let mut tally = Tally::default();
    match phase {
        Phase::Scatter => scatter_all::<S, TWO, EXTRA>(&lanes, stride, step, &points, nodes),
        Phase::Filter => {
            let density = S::splat(step.balance.water_density);
            for (b, block) in points.blocks.iter().enumerate() {
                gather::scatter_filtered::<S, TWO>(
                    &lanes,
                    stride,
                    density,
                    block,
                    points.extras.get(b),
                    nodes,
                );
            }
        }
        Phase::Gather => {
            let blend = Blend {
                dt: S::splat(step.dt),
                pic: S::splat(step.pic),
                twice: EXTRA && step.filter_twice,
                water_density: S::splat(step.balance.water_density),
            };
            let mut motion = Motion { double_energy: zero, double_loss: zero, fastest: zero };
            for (b, block) in points.blocks.iter_mut().enumerate() {
                let extra = if EXTRA { points.extras.get(b) } else { None };
                gather::gather_and_scatter_again::<S, TWO, EXTRA>(
                    &lanes,
                    stride,
                    &blend,
                    block,
                    extra,
                    nodes,
                    &mut motion,
                );
            }
            tally.double_energy = sum(motion.double_energy);
            tally.double_loss = sum(motion.double_loss);
            tally.fastest_squared = numbers(motion.fastest).iter().fold(0.0_f64, |a, &b| a.max(b));
        }
        Phase::Gradients => {
            for (b, block) in points.blocks.iter_mut().enumerate() {
                let extra = if EXTRA { points.extras.get(b) } else { None };
                strain::gradients::<S, TWO, EXTRA>(
                    &lanes,
                    stride,
                    S::splat(step.dt),
                    step.average(TWO),
                    block,
                    extra,
                    nodes,
                );
            }
        }
        Phase::Update => tally = update_all::<S, TWO, EXTRA>(&lanes, stride, step, &mut points, nodes),
        Phase::Balance | Phase::FilteredVelocities | Phase::Velocities | Phase::Means => {}
    }
    tally
}

#[inline(always)]
fn scatter_all<S: Lanes, const TWO: bool, const EXTRA: bool>(
    lanes: &GridLanes<S>,
    stride: usize,
    step: &Step,
    points: &Points<'_>,
    nodes: &mut Window<'_>,
) {
    let fluid = pore_fluid(step);
    let loads = step.loads.as_ref().filter(|_| EXTRA);
    for (b, block) in points.blocks.iter().enumerate() {
        let extra = if EXTRA { points.extras.get(b) } else { None };
        scatter::scatter::<S, TWO, EXTRA>(lanes, stride, &fluid, loads, block, extra, nodes);
    }
}

#[inline(always)]
fn update_all<S: Lanes, const TWO: bool, const EXTRA: bool>(
    lanes: &GridLanes<S>,
    stride: usize,
    step: &Step,
    points: &mut Points<'_>,
    nodes: &mut Window<'_>,
) -> Tally {
    let zero = S::splat(0.0);
    let fluid = pore_fluid(step);
    let loads = step.loads.as_ref().filter(|_| EXTRA);
    let average = step.average(TWO);
    let mut moved = Moved { outside: zero, stress_work: zero, water_work: zero };
    for (b, block) in points.blocks.iter_mut().enumerate() {
        let extra = if EXTRA { points.extras.get_mut(b) } else { None };
        update::update::<S, TWO, EXTRA>(lanes, step, average, block, extra, nodes.cells, &mut moved);
        let extra = if EXTRA { points.extras.get(b) } else { None };
        scatter::scatter::<S, TWO, EXTRA>(lanes, stride, &fluid, loads, block, extra, nodes);
    }
    Tally {
        outside: numbers(moved.outside).iter().any(|&o| o > 0.0),
        stress_work: sum(moved.stress_work),
        water_work: sum(moved.water_work),
        ..Tally::default()
    }
}

#[inline(always)]
fn pore_fluid<S: Lanes>(step: &Step) -> PoreFluid<S> {
    PoreFluid {
        density: S::splat(step.balance.water_density),
        lowest_pressure: S::splat(-step.water.cavitation),
    }
}

/// A phase over nodes; `spans` are those in use, row by row, counted among all.
#[inline(always)]
pub(super) fn at_nodes<S: Lanes, const TWO: bool, const EXTRA: bool>(
    phase: Phase,
    step: &Step,
    spans: &[Range<usize>],
    nodes: &mut Window<'_>,
) -> Tally {
    let mut tally = Tally::default();
    match phase {
        Phase::Balance => {
            tally.nodes = momentum::accelerate::<S, TWO, EXTRA>(nodes, spans, &step.balance, step.dt);
        }
        Phase::FilteredVelocities => momentum::filtered_velocities::<TWO>(nodes, spans, &step.balance),
        Phase::Velocities => momentum::velocities::<TWO>(nodes, spans, &step.balance),
        Phase::Means => strain::average_cells(nodes, spans),
        _ => {}
    }
    tally
}

#[inline(always)]
fn sum<S: Lanes>(lanes: S) -> f64 {
    numbers(lanes).iter().sum()
}
