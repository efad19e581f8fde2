//! An analysis under way: the points and the grid, and the steps that carry them.

use super::advance::{Arena, Step};
use super::block::Block;
use super::kernel::{Kernel, dispatch};
use super::momentum::Balance;
use super::nodes::Nodes;
use super::rest::Stand;
use super::setup::{InitialPoints, Setup};
use super::sort;
use super::time_step::{bulk_and_shear, fastest_wave, time_step};
use super::water::PoreWater;
use crate::campaign::{Formulation, VolumetricStrain};
use thiserror::Error;

/// Largest friction angle that can be analysed, rad (80 degrees: tan phi is 5.7, far above any soil's).
pub const LARGEST_FRICTION_ANGLE_RAD: f64 = 80.0 * std::f64::consts::PI / 180.0;

/// Points are sorted again once one may have moved this share of a cell: the spans of nodes leave room for one.
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
    /// Whether a point has left the grid.
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

/// An analysis under way.
#[derive(Debug, Clone)]
pub struct Body {
    setup: Setup,
    kernel: Kernel,
    arena: Arena,
    /// Original index of the point in each place.
    order: Vec<u32>,
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
        let (blocks, live_in_last) = fill_blocks(&setup);
        let grid = setup.grid;
        let mut body = Body {
            kernel: kernel.or_best(),
            arena: Arena {
                grid,
                half_length: 0.5 / f64::from(setup.points_per_cell_side),
                blocks,
                live_in_last,
                nodes: Nodes::new(&grid, &setup.conditions),
                scattered: false,
            },
            order: (0..points.len() as u32).collect(),
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
        sort::sort(&mut body.arena, &mut body.order);
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

    /// Carries the points through one step of `dt_s`, s.
    pub fn step(&mut self, dt_s: f64) -> Report {
        if self.travelled_m > SORT_AFTER_CELLS * self.setup.grid.cell_m {
            sort::sort(&mut self.arena, &mut self.order);
            self.travelled_m = 0.0;
        }
        let two = self.setup.controls.formulation == Formulation::TwoPhase;
        let step = self.constants(dt_s);
        let report = dispatch(self.kernel, two, &mut self.arena, &step);
        self.fastest_m_s = report.fastest;
        self.travelled_m += report.fastest * dt_s;
        self.time_s += dt_s;
        self.steps += 1;
        Report { kinetic_energy_j: report.kinetic_energy, left_grid: report.left_grid }
    }

    /// The points' positions in their original order, m.
    pub fn positions(&self) -> Vec<[f64; 2]> {
        let mut positions = vec![[0.0; 2]; self.order.len()];
        for (place, &original) in self.order.iter().enumerate() {
            let block = &self.arena.blocks[place / 8];
            positions[original as usize] = [block.x.0[place % 8], block.y.0[place % 8]];
        }
        positions
    }

    /// What the rule for rest looks at.
    pub(super) fn stand(&self) -> Stand {
        let mut pressures = vec![0.0; self.order.len()];
        for (place, &original) in self.order.iter().enumerate() {
            pressures[original as usize] = self.arena.blocks[place / 8].pressure.0[place % 8];
        }
        Stand { positions: self.positions(), pressures }
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
            pressure: field(|b| &b.pressure),
            porosity,
            volume,
            plastic_strain: field(|b| &b.plastic_strain),
        }
    }

    fn constants(&self, dt: f64) -> Step {
        let Setup { materials, fluid, controls, conditions, grid, .. } = &self.setup;
        // A rate r becomes the share 1 - exp(-r dt) of one step, so that results do not hang on the step.
        let share = |rate: f64| -libm::expm1(-rate * dt);
        Step {
            dt,
            pic: share(controls.pic_rate_per_s),
            average_strain: controls.volumetric_strain == VolumetricStrain::CellAverage,
            balance: Balance {
                gravity: conditions.gravity_m_s2,
                damping: controls.local_damping,
                drag_rate: fluid.gravity_m_s2 / materials[0].permeability_m_s,
                water_density: fluid.density_kg_m3,
                cell_mass: self.largest_density * grid.cell_m * grid.cell_m,
                closed_surface: conditions.closed_surface,
            },
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

/// The points in blocks, in the given order, and how many of the last block are real.
fn fill_blocks(setup: &Setup) -> (Vec<Block>, usize) {
    let Setup { points, fluid, controls, .. } = setup;
    let two = controls.formulation == Formulation::TwoPhase;
    let count = points.len();
    let mut blocks = vec![Block::EMPTY; count.div_ceil(8)];
    for i in 0..count {
        let (block, lane, material) = (&mut blocks[i / 8], i % 8, setup.material_of(i));
        let (bulk, shear) = bulk_and_shear(material);
        block.bulk.0[lane] = bulk;
        block.shear.0[lane] = shear;
        block.sin_psi.0[lane] = libm::sin(material.dilation_angle_rad);
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
        let strength = strength(points.cohesion[i], points.friction_angle[i], material.tension_cutoff_pa);
        [block.sin_phi.0[lane], block.two_c_cos_phi.0[lane], block.apex.0[lane], block.tension.0[lane]] =
            strength;
    }
    (blocks, count - 8 * (count.div_ceil(8) - 1).min(count))
}

/// sin phi, 2 c cos phi, c cot phi and the tension cut-off of one point.
fn strength(cohesion: f64, friction_angle: f64, cutoff: Option<f64>) -> [f64; 4] {
    let (sin, cos) = libm::sincos(friction_angle);
    let apex = if sin > 0.0 { cohesion * cos / sin } else { f64::INFINITY };
    let tension = match cutoff {
        Some(limit) if cohesion.is_finite() => limit.min(apex),
        _ => apex,
    };
    [sin, 2.0 * cohesion * cos, apex, tension]
}
