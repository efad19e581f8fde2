//! Grid: the momentum balance at the nodes with its walls, and the velocities of the second scatter.

use super::balance::{self, Balance, Solved, Sums};
use super::contact::{Touching, hold_off, touch};
use super::lanes::{Lanes, V8};
use super::window::Window;
use std::ops::Range;

/// A node with less than this share of a cell's mass is left alone: its sums are round-off. Near the edge of a shape
/// function S falls with the square of the distance and its gradient with the distance, so that the force left out is
/// of the order of the square root of this share: 1e-13.
const SMALLEST_MASS_SHARE: f64 = 1e-26;

/// Work at the nodes in one step, J per m of width.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct NodeWork {
    /// Done by weight, buoyancy and external forces.
    pub(super) outer: f64,
    /// Taken by Darcy drag.
    pub(super) drag: f64,
    /// Taken by local damping and by the decay of velocities.
    pub(super) damping: f64,
    /// Taken by friction and impact at frictional walls.
    pub(super) contact: f64,
}

/// The work of eight nodes, lane by lane: outer, drag, damping.
#[derive(Clone, Copy)]
struct LaneWork<S> {
    outer: S,
    drag: S,
    damping: S,
}

/// Solves the balance at every node; leaves changes and new velocities in `rates`, and `velocities` zeroed.
#[inline(always)]
pub(super) fn accelerate<S: Lanes, const TWO: bool, const EXTRA: bool>(
    nodes: &mut Window<'_>,
    spans: &[Range<usize>],
    balance: &Balance,
    dt: f64,
) -> NodeWork {
    let zero = S::splat(0.0);
    let mut lanes = LaneWork { outer: zero, drag: zero, damping: zero };
    let mut contact = 0.0;
    for span in spans {
        let (start, end) = (span.start - nodes.first, span.end - nodes.first);
        for first in (start..end).step_by(8) {
            let group = first..end.min(first + 8);
            contact += accelerate_group::<S, TWO, EXTRA>(nodes, group, balance, S::splat(dt), &mut lanes);
        }
        nodes.velocities[start..end].fill(V8::ZERO);
        if TWO {
            nodes.forces[start..end].fill(V8::ZERO);
        }
        if EXTRA && !nodes.loads.is_empty() {
            nodes.loads[start..end].fill(V8::ZERO);
        }
    }
    NodeWork { outer: sum(lanes.outer), drag: sum(lanes.drag), damping: sum(lanes.damping), contact }
}

/// Up to eight nodes of a row; returns what contact with frictional walls takes.
#[inline(always)]
fn accelerate_group<S: Lanes, const TWO: bool, const EXTRA: bool>(
    nodes: &mut Window<'_>,
    group: Range<usize>,
    balance: &Balance,
    dt: S,
    work: &mut LaneWork<S>,
) -> f64 {
    let zero = S::splat(0.0);
    let sums = Sums {
        sums: load_group(&nodes.sums[group.clone()]),
        forces: if TWO { load_group(&nodes.forces[group.clone()]) } else { [zero; 8] },
        loads: if EXTRA && !nodes.loads.is_empty() {
            Some(load_group(&nodes.loads[group.clone()]))
        } else {
            None
        },
        full_volume: if TWO && balance.closed_surface {
            let mut volume = V8::ZERO;
            volume.0[..group.len()].copy_from_slice(&nodes.full_volume[group.clone()]);
            Some(volume)
        } else {
            None
        },
    };
    let mut solved =
        if TWO { balance::two_phases(&sums, balance, dt) } else { balance::one_phase(&sums, balance, dt) };
    let active = sums.sums[0].gt(S::splat(SMALLEST_MASS_SHARE * balance.cell_mass));
    for rate in &mut solved.rates {
        *rate = S::select(active, *rate, zero);
    }
    let mut taken = 0.0;
    if nodes.walls[group.clone()].iter().any(|&wall| wall) {
        taken = hold::<S, TWO>(nodes, group, &mut solved);
    } else {
        store_rates::<S, TWO>(&mut nodes.rates[group], &solved.rates);
    }
    add_work(&solved, active, work);
    taken
}

/// Holds nodes at walls and stores their rates; returns what contact with frictional walls takes.
#[inline(always)]
fn hold<S: Lanes, const TWO: bool>(
    nodes: &mut Window<'_>,
    group: Range<usize>,
    solved: &mut Solved<S>,
) -> f64 {
    let mut taken = 0.0;
    let mut rows = store_all(S::transpose(solved.rates));
    let [mass, push, answer] = [solved.mass, solved.push, solved.answer].map(store_pair);
    for (lane, k) in group.enumerate() {
        let row = &mut rows[lane].0;
        for (i, free) in nodes.free[k].into_iter().enumerate() {
            row[i] *= free;
            row[4 + i] *= free;
        }
        if let Some(contact) = nodes.contact[k] {
            let touching = Touching {
                mass: mass.map(|m| m.0[lane]),
                push: push[contact.axis].0[lane] * contact.inward,
                answer: answer.map(|a| a.0[lane]),
            };
            taken += touch(row, contact, &touching);
        }
        nodes.rates[k].0 = if TWO { *row } else { narrow(row) };
    }
    solved.rates = load_group(&rows);
    taken
}

/// One phase needs half a row: changes of velocity (2), new velocities (2); then the latter in their usual place.
#[inline(always)]
fn narrow(rates: &[f64; 8]) -> [f64; 8] {
    [rates[0], rates[1], rates[4], rates[5], rates[4], rates[5], 0.0, 0.0]
}

#[inline(always)]
fn store_rates<S: Lanes, const TWO: bool>(to: &mut [V8], rates: &[S; 8]) {
    let rows = if TWO {
        store_all(S::transpose(*rates))
    } else {
        let mut rows = [V8::ZERO; 8];
        S::store_low_rows([rates[0], rates[1], rates[4], rates[5]], &mut rows);
        rows
    };
    let count = to.len();
    to.copy_from_slice(&rows[..count]);
}

/// Adds the work of the impulses: each times the mean of the velocities before and after the step, walls included.
#[inline(always)]
fn add_work<S: Lanes>(solved: &Solved<S>, active: S::Mask, work: &mut LaneWork<S>) {
    let (zero, half, rates) = (S::splat(0.0), S::splat(0.5), &solved.rates);
    let (mut outer, mut drag, mut damping) = (zero, zero, zero);
    for axis in 0..2 {
        let impulses = &solved.impulses[axis];
        let v = rates[4 + axis] - half * rates[axis];
        let w = rates[6 + axis] - half * rates[2 + axis];
        outer = impulses.outer[0].mul_add(v, impulses.outer[1].mul_add(w, outer));
        drag = impulses.drag.mul_add(w - v, drag);
        damping = impulses.damping[0].mul_add(v, impulses.damping[1].mul_add(w, damping));
    }
    work.outer = work.outer + S::select(active, outer, zero);
    work.drag = work.drag + S::select(active, drag, zero);
    work.damping = work.damping + S::select(active, damping, zero);
}

/// Up to eight rows, lane by lane; zero where there are fewer.
#[inline(always)]
fn load_group<S: Lanes>(rows: &[V8]) -> [S; 8] {
    if let Ok(rows) = <&[V8; 8]>::try_from(rows) {
        return load_eight(rows);
    }
    let mut padded = [V8::ZERO; 8];
    padded[..rows.len()].copy_from_slice(rows);
    load_eight(&padded)
}

#[inline(always)]
fn load_eight<S: Lanes>(rows: &[V8; 8]) -> [S; 8] {
    let mut vectors = [S::splat(0.0); 8];
    for (vector, row) in vectors.iter_mut().zip(rows) {
        *vector = S::load(row);
    }
    S::transpose(vectors)
}

#[inline(always)]
fn store_all<S: Lanes>(vectors: [S; 8]) -> [V8; 8] {
    let mut rows = [V8::ZERO; 8];
    for (row, vector) in rows.iter_mut().zip(vectors) {
        vector.store(row);
    }
    rows
}

fn store_pair<S: Lanes>(pair: [S; 2]) -> [V8; 2] {
    let mut rows = [V8::ZERO; 2];
    pair[0].store(&mut rows[0]);
    pair[1].store(&mut rows[1]);
    rows
}

#[inline(always)]
fn sum<S: Lanes>(lanes: S) -> f64 {
    let mut row = V8::ZERO;
    lanes.store(&mut row);
    row.0.iter().sum()
}

/// Turns the momenta of the filter's scatter into velocities; the masses are those of the first scatter.
#[inline(always)]
pub(super) fn filtered_velocities<const TWO: bool>(
    nodes: &mut Window<'_>,
    spans: &[Range<usize>],
    balance: &Balance,
) {
    let smallest = SMALLEST_MASS_SHARE * balance.cell_mass;
    let Window { first, sums, filtered, free, .. } = nodes;
    for span in spans {
        for k in span.start - *first..span.end - *first {
            let [skeleton, water, ..] = sums[k].0;
            let inverse = if skeleton > smallest { 1.0 / skeleton } else { 0.0 };
            let inverse_water = if TWO && skeleton > smallest { 1.0 / water } else { 0.0 };
            for axis in 0..2 {
                filtered[k].0[axis] *= inverse * free[k][axis];
                filtered[k].0[2 + axis] *= inverse_water * free[k][2 + axis];
            }
        }
    }
}

/// Turns the momenta of the second scatter into velocities, twice in a row (in one phase those of the skeleton four times);
/// leaves `sums` zeroed.
#[inline(always)]
pub(super) fn velocities<const TWO: bool>(nodes: &mut Window<'_>, spans: &[Range<usize>], balance: &Balance) {
    let smallest = SMALLEST_MASS_SHARE * balance.cell_mass;
    let Window { first, sums, rates, velocities, cells, filtered, free, contact, .. } = nodes;
    for span in spans {
        let (start, end) = (span.start - *first, span.end - *first);
        for k in start..end {
            let [skeleton, water, ..] = sums[k].0;
            if skeleton <= smallest {
                velocities[k] = V8::ZERO;
                continue;
            }
            let inverse = 1.0 / skeleton;
            let inverse_water = if TWO { 1.0 / water } else { 0.0 };
            let (p, free) = (velocities[k].0, &free[k]);
            let mut v = [
                p[0] * inverse * free[0],
                p[1] * inverse * free[1],
                p[2] * inverse_water * free[2],
                p[3] * inverse_water * free[3],
            ];
            if let Some(contact) = contact[k] {
                hold_off(&mut v, &rates[k].0, contact);
            }
            if !TWO {
                [v[2], v[3]] = [v[0], v[1]];
            }
            velocities[k].0 = [v[0], v[1], v[2], v[3], v[0], v[1], v[2], v[3]];
        }
        cells[start..end].fill(V8::ZERO);
        sums[start..end].fill(V8::ZERO);
        if !filtered.is_empty() {
            filtered[start..end].fill(V8::ZERO);
        }
    }
}
