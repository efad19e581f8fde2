//! An analysis under way: the points and the grid, and the steps that carry them.

use super::advance::{Arena, Step, advance};
use super::balance::Balance;
use super::block::Block;
use super::energy::{Energy, Ledger, Stored, stored};
use super::fill::{fill_blocks, fill_extras, point_loads_needed};
use super::kernel::{Build, Kernel};
use super::loads::Loads;
use super::nodes::Nodes;
use super::plan::Plan;
use super::rest::Stand;
use super::setup::{InitialPoints, Setup};
use super::sort::Sorter;
use super::strain::Averaging;
use super::threads::Threads;
use super::time_step::{fastest_wave, time_step};
use super::water::PoreWater;
use crate::campaign::{Formulation, PointDomain, VelocityFilter, VolumetricStrain};
use thiserror::Error;

/// Largest friction angle that can be analysed, rad (80 degrees: tan phi is 5.7, far above any soil's).
pub const LARGEST_FRICTION_ANGLE_RAD: f64 = 80.0 * std::f64::consts::PI / 180.0;

/// The nodes a point may touch leave room for moves of one cell between sorts; with some left for what moves faster than
/// the fastest point, as a mean of nodes may.
const REACH_CELLS: f64 = 0.75;

/// Points are sorted again once one may have moved this share of a cell.
const SORT_AFTER_CELLS: f64 = 0.25;

/// A material that cannot be analysed.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum MaterialError {
    /// Cohesion below zero or not a number, Pa.
    #[error("point {point}: cohesion {value} Pa is not 0 or greater")]
    Cohesion {
        /// Point.
        point: usize,
        /// Value, Pa.
        value: f64,
    },
    /// Friction angle outside [0, 80) degrees.
    #[error("point {point}: friction angle {value} rad is not in [0, {LARGEST_FRICTION_ANGLE_RAD:.3})")]
    FrictionAngle {
        /// Point.
        point: usize,
        /// Value, rad.
        value: f64,
    },
    /// Density not above that of the pore water (two phases) or zero (one phase).
    #[error("point {point}: density {value} kg/m3 is too small")]
    Density {
        /// Point.
        point: usize,
        /// Value, kg/m3.
        value: f64,
    },
}

/// What a step tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// Kinetic energy of everything, J per m of width.
    pub kinetic_energy_j: f64,
    /// Whether a point has left the grid, or moves more than half a cell in a step.
    pub left_grid: bool,
}

/// The points' state in their original order.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Position, m.
    pub x: Vec<f64>,
    /// Position, m.
    pub y: Vec<f64>,
    /// Velocity of the skeleton, m/s.
    pub vx: Vec<f64>,
    /// Velocity of the skeleton, m/s.
    pub vy: Vec<f64>,
    /// Velocity of the water, m/s.
    pub wx: Vec<f64>,
    /// Velocity of the water, m/s.
    pub wy: Vec<f64>,
    /// Effective stress xx, Pa (total, if there is one phase); tension positive.
    pub stress_xx: Vec<f64>,
    /// Effective stress yy, Pa.
    pub stress_yy: Vec<f64>,
    /// Effective stress zz, Pa.
    pub stress_zz: Vec<f64>,
    /// Effective stress xy, Pa.
    pub stress_xy: Vec<f64>,
    /// Pore pressure, Pa.
    pub pressure: Vec<f64>,
    /// Porosity.
    pub porosity: Vec<f64>,
    /// Volume, m2.
    pub volume: Vec<f64>,
    /// Equivalent deviatoric plastic strain.
    pub plastic_strain: Vec<f64>,
}

impl State {
    /// The points' motion, in their original order.
    pub fn motion(&self) -> impl Iterator<Item = PointMotion> + '_ {
        (0..self.x.len()).map(|i| PointMotion {
            x: self.x[i],
            y: self.y[i],
            vx: self.vx[i],
            vy: self.vy[i],
            volume: self.volume[i],
        })
    }
}

/// Where a point is and how the skeleton moves there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMotion {
    /// Position, m.
    pub x: f64,
    /// Position, m.
    pub y: f64,
    /// Velocity of the skeleton, m/s.
    pub vx: f64,
    /// Velocity of the skeleton, m/s.
    pub vy: f64,
    /// Volume, m2.
    pub volume: f64,
}

/// An analysis under way.
#[derive(Debug, Clone)]
pub struct Body {
    setup: Setup,
    build: Build,
    threads: Threads,
    arena: Arena,
    sorter: Sorter,
    /// Original index of the point in each place.
    order: Vec<u32>,
    /// Whether points carry loads of their own.
    loads: bool,
    /// Whether some point's strength softens.
    soften: bool,
    /// Share of the external forces that acts.
    load_share: f64,
    start: Stored,
    ledger: Ledger,
    wave_m_s: f64,
    largest_density: f64,
    fastest_m_s: f64,
    /// How far a point may have moved since the last sort, m.
    travelled_m: f64,
    time_s: f64,
    steps: u64,
}

impl Body {
    /// Sets an analysis up.
    ///
    /// # Errors
    /// A point whose strength or density cannot be analysed.
    ///
    /// # Panics
    /// If the vectors in `setup.points` differ in length.
    pub fn new(setup: Setup, kernel: Kernel) -> Result<Body, MaterialError> {
        check(&setup)?;
        let points = &setup.points;
        let grid = setup.grid;
        let loads = point_loads_needed(&setup);
        let filter = setup.controls.velocity_filter == VelocityFilter::Xpic;
        // An elastic stage has no strength to lose.
        let soften = setup.materials.iter().any(|m| m.softening.is_some())
            && points.cohesion.iter().any(|c| c.is_finite());
        let two = setup.controls.formulation == Formulation::TwoPhase;
        let extra = loads || filter || soften || setup.controls.point_domain == PointDomain::Stretched;
        let arena = Arena {
            grid,
            blocks: fill_blocks(&setup),
            extras: if extra { fill_extras(&setup) } else { Vec::new() },
            live_in_last: points.len() - 8 * (points.len().div_ceil(8) - 1).min(points.len()),
            plan: Plan::with_room(&grid),
            nodes: Nodes::new(&grid, &setup.conditions, &setup.obstacles, loads, filter),
            scattered: false,
        };
        let mut body = Body {
            build: Build { kernel: kernel.or_best(), two, extra },
            threads: Threads::default(),
            sorter: Sorter::new(&arena, points.len()),
            start: stored(&arena, &setup.fluid, two),
            ledger: Ledger::default(),
            arena,
            order: (0..points.len() as u32).collect(),
            loads,
            soften,
            load_share: 1.0,
            wave_m_s: fastest_wave(&setup),
            largest_density: points.density.iter().copied().fold(0.0, f64::max),
            fastest_m_s: points
                .velocity
                .iter()
                .map(|v| (v[0] * v[0] + v[1] * v[1]).sqrt())
                .fold(0.0, f64::max),
            travelled_m: 0.0,
            time_s: 0.0,
            steps: 0,
            setup,
        };
        body.sorter.sort(&mut body.arena, &mut body.order, false);
        Ok(body)
    }

    /// What it was set up from.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Simulated time, s.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Steps taken.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Mass of everything at the start, kg per m of width.
    pub fn total_mass(&self) -> f64 {
        self.setup.points.density.iter().zip(&self.setup.points.volume).map(|(d, v)| d * v).sum()
    }

    /// Time step that the Courant number allows now, s.
    pub fn stable_step_s(&self) -> f64 {
        time_step(&self.setup.controls, self.setup.grid.cell_m, self.wave_m_s, self.fastest_m_s)
    }

    /// Lets these threads share the steps from now on; they move no bits.
    pub fn set_threads(&mut self, threads: Threads) {
        self.threads = threads;
    }

    /// Carries the points through one step of `dt_s`, s.
    pub fn step(&mut self, dt_s: f64) -> Report {
        if self.travelled_m > SORT_AFTER_CELLS * self.setup.grid.cell_m {
            let Body { arena, sorter, order, threads, .. } = self;
            threads.run(|side_by_side| sorter.sort(arena, order, side_by_side));
            self.travelled_m = 0.0;
        }
        let step = self.constants(dt_s);
        let Body { arena, build, threads, .. } = self;
        let report = threads.run(|side_by_side| advance(arena, *build, &step, side_by_side));
        self.ledger.enter(&report);
        self.fastest_m_s = report.fastest;
        self.travelled_m += report.fastest * dt_s;
        self.time_s += dt_s;
        self.steps += 1;
        // Beyond its reach a point's sums went to the wrong nodes; no soil moves that far in a step.
        let out_of_reach = self.travelled_m > REACH_CELLS * self.setup.grid.cell_m;
        Report { kinetic_energy_j: report.kinetic_energy, left_grid: report.left_grid || out_of_reach }
    }

    /// Lets this share of the external forces act from now on (1 at first).
    pub fn set_load_share(&mut self, share: f64) {
        self.load_share = share;
        self.arena.rescatter();
    }

    /// The balance of energy since the start.
    pub fn energy(&self) -> Energy {
        let two = self.setup.controls.formulation == Formulation::TwoPhase;
        self.ledger.balance(&self.start, &stored(&self.arena, &self.setup.fluid, two))
    }

    /// The points' positions in their original order, m.
    pub fn positions(&self) -> Vec<[f64; 2]> {
        let mut positions = vec![[0.0; 2]; self.order.len()];
        self.write_positions(&mut positions);
        positions
    }

    fn write_positions(&self, positions: &mut [[f64; 2]]) {
        for (place, &original) in self.order.iter().enumerate() {
            let block = &self.arena.blocks[place / 8];
            positions[original as usize] = [block.x.0[place % 8], block.y.0[place % 8]];
        }
    }

    /// The points' motion in the order in which they lie in memory, which follows from the analysis alone; allocates
    /// nothing.
    pub fn motion(&self) -> impl Iterator<Item = PointMotion> + '_ {
        (0..self.order.len()).map(|place| {
            let (block, lane) = (&self.arena.blocks[place / 8], place % 8);
            PointMotion {
                x: block.x.0[lane],
                y: block.y.0[lane],
                vx: block.vx.0[lane],
                vy: block.vy.0[lane],
                volume: block.volume.0[lane],
            }
        })
    }

    /// Writes down what the rule for rest looks at.
    pub(super) fn stand(&self, stand: &mut Stand) {
        stand.positions.resize(self.order.len(), [0.0; 2]);
        stand.pressures.resize(self.order.len(), 0.0);
        self.write_positions(&mut stand.positions);
        for (place, &original) in self.order.iter().enumerate() {
            let carried = self.arena.blocks[place / 8].pressure.0[place % 8];
            stand.pressures[original as usize] = carried.max(-self.setup.fluid.cavitation_suction_pa);
        }
    }

    /// The points' state in their original order.
    pub fn state(&self) -> State {
        let field = |get: fn(&Block) -> &super::lanes::V8| {
            let mut out = vec![0.0; self.order.len()];
            for (place, &original) in self.order.iter().enumerate() {
                out[original as usize] = get(&self.arena.blocks[place / 8]).0[place % 8];
            }
            out
        };
        let volume = field(|b| &b.volume);
        let grains = field(|b| &b.grains);
        let porosity = match self.setup.controls.formulation {
            Formulation::TwoPhase => grains.iter().zip(&volume).map(|(g, v)| 1.0 - g / v).collect(),
            Formulation::OnePhase => self
                .setup
                .points
                .material
                .iter()
                .map(|&m| self.setup.materials[usize::from(m)].porosity)
                .collect(),
        };
        State {
            x: field(|b| &b.x),
            y: field(|b| &b.y),
            vx: field(|b| &b.vx),
            vy: field(|b| &b.vy),
            wx: field(|b| &b.wx),
            wy: field(|b| &b.wy),
            stress_xx: field(|b| &b.sxx),
            stress_yy: field(|b| &b.syy),
            stress_zz: field(|b| &b.szz),
            stress_xy: field(|b| &b.sxy),
            pressure: field(|b| &b.pressure)
                .into_iter()
                .map(|carried| carried.max(-self.setup.fluid.cavitation_suction_pa))
                .collect(),
            porosity,
            volume,
            plastic_strain: field(|b| &b.plastic_strain),
        }
    }

    fn constants(&self, dt: f64) -> Step {
        let Setup { materials, fluid, controls, conditions, points, grid, .. } = &self.setup;
        // A rate r becomes the share 1 - exp(-r dt) of one step, so that results do not hang on the step.
        let share = |rate: f64| -libm::expm1(-rate * dt);
        // With loads each point's own share counts; without, all points are alike.
        let held = !self.loads && points.water_held.first().is_some_and(|&held| held);
        let water_weight = if held { 0.0 } else { 1.0 };
        let material = &materials[usize::from(points.material.first().copied().unwrap_or(0))];
        Step {
            dt,
            pic: share(controls.pic_rate_per_s),
            filter_twice: controls.velocity_filter == VelocityFilter::Xpic,
            average_strain: controls.volumetric_strain == VolumetricStrain::CellAverage,
            half_length: 0.5 / f64::from(self.setup.points_per_cell_side),
            stretch: controls.point_domain == PointDomain::Stretched,
            soften: self.soften,
            balance: Balance {
                gravity: conditions.gravity_m_s2,
                water_weight,
                damping: controls.local_damping,
                decay: share(controls.damping_rate_per_s),
                drag_rate: fluid.gravity_m_s2 / material.permeability_m_s,
                water_density: fluid.density_kg_m3,
                cell_mass: self.largest_density * grid.cell_m * grid.cell_m,
                closed_surface: conditions.closed_surface,
            },
            averaging: Averaging {
                water_weight: conditions.gravity_m_s2.map(|g| g * fluid.density_kg_m3 * water_weight),
                held_differs: self.loads,
            },
            loads: self.loads.then_some(Loads {
                share: self.load_share,
                gravity: conditions.gravity_m_s2,
                water_density: fluid.density_kg_m3,
                free_water_level: conditions.free_water_level_m.unwrap_or(f64::NEG_INFINITY),
            }),
            water: PoreWater {
                bulk: fluid.bulk_modulus_pa,
                relaxation: share(controls.pressure_relaxation_rate_per_s),
                cavitation: fluid.cavitation_suction_pa,
            },
        }
    }
}

fn check(setup: &Setup) -> Result<(), MaterialError> {
    let InitialPoints { density, cohesion, friction_angle, .. } = &setup.points;
    for (point, &value) in density.iter().enumerate() {
        let pore_water = match setup.controls.formulation {
            Formulation::TwoPhase => setup.material_of(point).porosity * setup.fluid.density_kg_m3,
            Formulation::OnePhase => 0.0,
        };
        if !value.is_finite() || value <= pore_water {
            return Err(MaterialError::Density { point, value });
        }
    }
    for (point, &value) in cohesion.iter().enumerate() {
        if value.is_nan() || value < 0.0 {
            return Err(MaterialError::Cohesion { point, value });
        }
    }
    for (point, &value) in friction_angle.iter().enumerate() {
        if !(0.0..LARGEST_FRICTION_ANGLE_RAD).contains(&value) {
            return Err(MaterialError::FrictionAngle { point, value });
        }
    }
    Ok(())
}
