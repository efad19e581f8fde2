//! One time step of the solver, written to be read: scalar, point by point and node by node, from the equations in
//! docs/solver.md. It is the oracle that the solver's kernels are held against.
//!
//! The stages stand in the order of the `gimp` module. Covered: one and two phases, the B-bar means over cells, relaxation
//! of pore pressure, cavitation, implicit drag, local damping, decay of velocities, both velocity filters, softening,
//! stretched domains, open, roller and fixed walls, a closed or drained ground surface, water that has weight or is held.
//! Not covered: loads of single points and free water, frictional walls, obstacles, several materials, the balance of
//! energy.

#![allow(unreachable_pub)]

mod momentum;
mod shape;
mod soil;

pub use soil::Return;

use runout_core::campaign::{Formulation, PointDomain, VelocityFilter, VolumetricStrain};
use runout_core::gimp::{Setup, State};
use shape::Near;
use soil::{Elastic, Strength};

/// Vector in the plane.
type Vector = [f64; 2];

/// Two by two tensor; of a displacement gradient the entry `[a][b]` is the derivative of component a along b.
type Tensor = [[f64; 2]; 2];

/// Half the side of a stretched point's domain stays between these, in cells.
const HALF_SIDE_CELLS: [f64; 2] = [0.025, 0.5];

/// A material point.
#[derive(Debug, Clone)]
struct Point {
    position: Vector,
    /// Velocity of the skeleton; of everything, if there is one phase.
    v: Vector,
    /// Velocity of the water.
    w: Vector,
    /// Effective stress (total, if there is one phase): xx, yy, zz, xy.
    stress: [f64; 4],
    /// Pore pressure before the limit of cavitation.
    pressure: f64,
    volume: f64,
    /// Volume of the grains; 0 if there is one phase.
    grains: f64,
    /// Mass of the skeleton; of everything, if there is one phase.
    mass: f64,
    plastic_strain: f64,
    /// Peak strength, and what is left of it over the residual one, from 1 to 0.
    cohesion: f64,
    friction_angle: f64,
    peak_left: f64,
    /// Half the sides of the point's domain, in cells.
    half: Vector,
    /// Displacement in this step, and its gradient.
    moved: Vector,
    gradient: Tensor,
    /// Divergence of the water's displacement in this step.
    water_divergence: f64,
}

/// A node of the grid during one step.
#[derive(Debug, Clone, Default)]
struct Node {
    mass: f64,
    water_mass: f64,
    volume: f64,
    momentum: Vector,
    water_momentum: Vector,
    /// Internal force on the mixture, and on the water without the factor of porosity.
    force: Vector,
    water_force: Vector,
    /// Change of the velocities in this step, walls included.
    change_v: Vector,
    change_w: Vector,
    /// Velocities at the end of the step; after the second scatter those of the moved points.
    v: Vector,
    w: Vector,
    /// Velocities before the step carried to the points and back: what the second filter takes for the true motion.
    filtered_v: Vector,
    filtered_w: Vector,
}

/// Sums over the points of a cell, then means: volumetric strain increments of skeleton and water, pore pressure in the
/// middle of the cell.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    volume: f64,
    skeleton: f64,
    water: f64,
    pressure: f64,
}

/// An analysis in its plain form.
#[derive(Debug, Clone)]
pub struct Reference {
    setup: Setup,
    elastic: Elastic,
    points: Vec<Point>,
    nodes: Vec<Node>,
    /// How often the stress was returned in each way.
    pub returns: [usize; 6],
    /// How often water cavitated at a point, and a node counted as one of a closed ground surface.
    pub cavitated: usize,
    pub closed: usize,
    /// Points that changed their cell.
    pub crossings: usize,
}

impl Reference {
    pub fn new(setup: Setup) -> Reference {
        assert_eq!(setup.materials.len(), 1, "the reference knows one material");
        let elastic = Elastic::new(&setup.materials[0]);
        let points = (0..setup.points.len()).map(|i| point(&setup, i)).collect();
        Reference {
            elastic,
            points,
            nodes: Vec::new(),
            returns: [0; 6],
            cavitated: 0,
            closed: 0,
            crossings: 0,
            setup,
        }
    }

    /// Carries the points through one step of `dt` s; returns the kinetic energy, J per m.
    pub fn step(&mut self, dt: f64) -> f64 {
        let near: Vec<Vec<Near>> =
            self.points.iter().map(|p| shape::near(&self.setup.grid, p.half, p.position)).collect();
        self.scatter(&near);
        self.balance_momentum(dt);
        if self.setup.controls.velocity_filter == VelocityFilter::Xpic {
            self.filter(&near);
        }
        let kinetic_energy = self.gather(&near, dt);
        self.scatter_again(&near);
        self.strain(&near, dt);
        let cells = self.average_cells();
        self.update(&cells, dt);
        kinetic_energy
    }

    fn two(&self) -> bool {
        self.setup.controls.formulation == Formulation::TwoPhase
    }

    /// Part of `rate` that a step takes: an exponential decay, so that it does not hang on the step.
    fn share(rate: f64, dt: f64) -> f64 {
        1.0 - libm::exp(-rate * dt)
    }

    /// Share of the water's weight that acts on the water; the skeleton carries the rest.
    fn water_weight(&self) -> f64 {
        if self.setup.points.water_held[0] { 0.0 } else { 1.0 }
    }

    /// Masses, momenta and internal forces: the mixture feels -V (sigma' - p I) grad S, the water V p grad S.
    fn scatter(&mut self, near: &[Vec<Near>]) {
        let two = self.two();
        let density = self.setup.fluid.density_kg_m3;
        let suction = self.setup.fluid.cavitation_suction_pa;
        self.nodes = vec![Node::default(); self.setup.grid.node_count()];
        for (point, near) in self.points.iter().zip(near) {
            let pressure = if two { point.pressure.max(-suction) } else { 0.0 };
            let water_mass = if two { density * (point.volume - point.grains) } else { 0.0 };
            let [xx, yy, _, xy] = point.stress;
            let total = [[xx - pressure, xy], [xy, yy - pressure]];
            for &Near { node, s, gradient } in near {
                let node = &mut self.nodes[node];
                node.mass += s * point.mass;
                node.water_mass += s * water_mass;
                node.volume += s * point.volume;
                for a in 0..2 {
                    node.momentum[a] += s * point.mass * point.v[a];
                    node.water_momentum[a] += s * water_mass * point.w[a];
                    node.force[a] -= point.volume * (total[a][0] * gradient[0] + total[a][1] * gradient[1]);
                    node.water_force[a] += point.volume * pressure * gradient[a];
                }
            }
            self.cavitated += usize::from(two && point.pressure < -suction);
        }
    }

    /// Carries the nodes' velocities before the step to the points and back (XPIC(2); Hammerquist & Nairn 2017).
    fn filter(&mut self, near: &[Vec<Near>]) {
        let mut momenta = vec![([0.0; 2], [0.0; 2]); self.nodes.len()];
        for (point, near) in self.points.iter().zip(near) {
            let water_mass = self.setup.fluid.density_kg_m3 * (point.volume - point.grains);
            for a in 0..2 {
                let v: f64 = near
                    .iter()
                    .map(|n| n.s * (self.nodes[n.node].v[a] - self.nodes[n.node].change_v[a]))
                    .sum();
                let w: f64 = near
                    .iter()
                    .map(|n| n.s * (self.nodes[n.node].w[a] - self.nodes[n.node].change_w[a]))
                    .sum();
                for n in near {
                    momenta[n.node].0[a] += n.s * point.mass * v;
                    momenta[n.node].1[a] += n.s * water_mass * w;
                }
            }
        }
        for (k, (momentum, water_momentum)) in momenta.into_iter().enumerate() {
            (self.nodes[k].filtered_v, self.nodes[k].filtered_w) =
                self.velocities(k, momentum, water_momentum);
        }
    }

    /// Velocities of the points, and their moves; returns the kinetic energy. FLIP keeps a point's velocity and adds the
    /// grid's change; the filter takes a share of what of that motion the grid does not see.
    fn gather(&mut self, near: &[Vec<Near>], dt: f64) -> f64 {
        let pic = Self::share(self.setup.controls.pic_rate_per_s, dt);
        let twice = self.setup.controls.velocity_filter == VelocityFilter::Xpic;
        let two = self.two();
        let mut energy = 0.0;
        for (point, near) in self.points.iter_mut().zip(near) {
            let at_point = |value: fn(&Node) -> Vector, a: usize| -> f64 {
                near.iter().map(|n| n.s * value(&self.nodes[n.node])[a]).sum()
            };
            // With P the way to the grid and back: (I - P) of the new velocity, or (I - P)^2 of the old one.
            let unseen = |old: f64, change: f64, grid: f64, filtered: f64| -> f64 {
                if twice { old - 2.0 * (grid - change) + filtered } else { old + change - grid }
            };
            for a in 0..2 {
                let (change, grid) = (at_point(|n| n.change_v, a), at_point(|n| n.v, a));
                let noise = unseen(point.v[a], change, grid, at_point(|n| n.filtered_v, a));
                point.v[a] += change - pic * noise;
                point.moved[a] = dt * grid;
                energy += 0.5 * point.mass * point.v[a] * point.v[a];
                if two {
                    let (change, grid) = (at_point(|n| n.change_w, a), at_point(|n| n.w, a));
                    let noise = unseen(point.w[a], change, grid, at_point(|n| n.filtered_w, a));
                    point.w[a] += change - pic * noise;
                    let water_mass = self.setup.fluid.density_kg_m3 * (point.volume - point.grains);
                    energy += 0.5 * water_mass * point.w[a] * point.w[a];
                }
            }
        }
        energy
    }

    /// MUSL: the nodes' velocities from the points' new ones, with the masses of the first scatter.
    fn scatter_again(&mut self, near: &[Vec<Near>]) {
        let mut momenta = vec![([0.0; 2], [0.0; 2]); self.nodes.len()];
        for (point, near) in self.points.iter().zip(near) {
            let water_mass = self.setup.fluid.density_kg_m3 * (point.volume - point.grains);
            for n in near {
                for a in 0..2 {
                    momenta[n.node].0[a] += n.s * point.mass * point.v[a];
                    momenta[n.node].1[a] += n.s * water_mass * point.w[a];
                }
            }
        }
        for (k, (momentum, water_momentum)) in momenta.into_iter().enumerate() {
            (self.nodes[k].v, self.nodes[k].w) = self.velocities(k, momentum, water_momentum);
        }
    }

    /// Velocities of skeleton and water at node `k` from their momenta; zero where walls hold them.
    fn velocities(&self, k: usize, momentum: Vector, water_momentum: Vector) -> (Vector, Vector) {
        let (node, held) = (&self.nodes[k], self.held(k));
        let (mut v, mut w) = ([0.0; 2], [0.0; 2]);
        for a in 0..2 {
            if self.counts(node) && !held[a] {
                v[a] = momentum[a] / node.mass;
                w[a] = if self.two() { water_momentum[a] / node.water_mass } else { 0.0 };
            }
        }
        (v, w)
    }

    /// Displacement gradients of this step at the points, from the velocities of the second scatter.
    fn strain(&mut self, near: &[Vec<Near>], dt: f64) {
        for (point, near) in self.points.iter_mut().zip(near) {
            point.gradient = [[0.0; 2]; 2];
            point.water_divergence = 0.0;
            for n in near {
                let node = &self.nodes[n.node];
                for a in 0..2 {
                    for b in 0..2 {
                        point.gradient[a][b] += dt * node.v[a] * n.gradient[b];
                    }
                    point.water_divergence += dt * node.w[a] * n.gradient[a];
                }
            }
        }
    }

    /// Means over the points of each cell, weighted with volume. That of the pore pressure is one in the middle of the cell:
    /// each point's, less what water at rest has more where the point lies.
    fn average_cells(&self) -> Vec<Cell> {
        let mut cells = vec![Cell::default(); self.nodes.len()];
        for point in &self.points {
            let cell = &mut cells[self.cell_of(point.position)];
            cell.volume += point.volume;
            cell.skeleton += point.volume * (point.gradient[0][0] + point.gradient[1][1]);
            cell.water += point.volume * point.water_divergence;
            cell.pressure += point.volume * (point.pressure - self.hydrostatic(point.position));
        }
        for cell in &mut cells {
            cell.skeleton /= cell.volume;
            cell.water /= cell.volume;
            cell.pressure /= cell.volume;
        }
        cells
    }

    /// Pore pressure of water at rest at `position` over that in the middle of its cell.
    fn hydrostatic(&self, position: Vector) -> f64 {
        let Setup { grid, conditions, fluid, .. } = &self.setup;
        (0..2)
            .map(|a| {
                let cell = ((position[a] - grid.origin_m[a]) / grid.cell_m).floor();
                let middle = grid.origin_m[a] + (cell + 0.5) * grid.cell_m;
                let density = self.water_weight() * fluid.density_kg_m3;
                density * conditions.gravity_m_s2[a] * (position[a] - middle)
            })
            .sum()
    }

    /// Stress, pore pressure, volume and place at the end of the step.
    fn update(&mut self, cells: &[Cell], dt: f64) {
        let Setup { grid, materials, fluid, controls, .. } = self.setup.clone();
        let average = controls.volumetric_strain == VolumetricStrain::CellAverage;
        let relaxation = Self::share(controls.pressure_relaxation_rate_per_s, dt);
        for i in 0..self.points.len() {
            let mut point = self.points[i].clone();
            let cell_before = self.cell_of(point.position);
            let cell = &cells[cell_before];
            let own = point.gradient[0][0] + point.gradient[1][1];
            let volumetric = if average { cell.skeleton } else { own };
            let trial = self.elastic.predict(point.stress, point.gradient, volumetric);
            let strength =
                Strength::new(&materials[0], point.cohesion, point.friction_angle, point.peak_left);
            let returned = self.elastic.return_to_surface(strength.as_ref(), trial);
            point.stress = returned.stress;
            point.plastic_strain += returned.plastic_strain;
            if let Some(softening) = materials[0].softening {
                // The shear displacement of a band one cell wide.
                let slip = 3.0_f64.sqrt() * returned.plastic_strain * grid.cell_m;
                point.peak_left *= libm::exp(-slip / softening.displacement_m);
            }
            self.returns[returned.kind as usize] += 1;
            if self.two() {
                let n = 1.0 - point.grains / point.volume;
                let water = if average { cell.water } else { point.water_divergence };
                let inflow = (1.0 - n) * volumetric + n * water;
                let at_rest = cell.pressure + self.hydrostatic(point.position);
                point.pressure +=
                    relaxation * (at_rest - point.pressure) - fluid.bulk_modulus_pa / n * inflow;
            }
            point.volume *= 1.0 + volumetric;
            for a in 0..2 {
                point.position[a] += point.moved[a];
                if controls.point_domain == PointDomain::Stretched {
                    let half = point.half[a] * (1.0 + point.gradient[a][a]);
                    point.half[a] = half.clamp(HALF_SIDE_CELLS[0], HALF_SIDE_CELLS[1]);
                }
            }
            self.crossings += usize::from(self.cell_of(point.position) != cell_before);
            self.points[i] = point;
        }
    }

    /// The cell that holds `position`, by its lower left node.
    fn cell_of(&self, position: Vector) -> usize {
        let grid = &self.setup.grid;
        let [i, j] = [0, 1].map(|a| ((position[a] - grid.origin_m[a]) / grid.cell_m).floor() as usize);
        j * grid.nodes[0] + i
    }

    /// The points' state as the solver reports it.
    pub fn state(&self) -> State {
        let of = |value: &dyn Fn(&Point) -> f64| self.points.iter().map(value).collect::<Vec<f64>>();
        let two = self.two();
        let suction = self.setup.fluid.cavitation_suction_pa;
        let initial = self.setup.materials[0].porosity;
        State {
            x: of(&|p| p.position[0]),
            y: of(&|p| p.position[1]),
            vx: of(&|p| p.v[0]),
            vy: of(&|p| p.v[1]),
            wx: of(&|p| p.w[0]),
            wy: of(&|p| p.w[1]),
            stress_xx: of(&|p| p.stress[0]),
            stress_yy: of(&|p| p.stress[1]),
            stress_zz: of(&|p| p.stress[2]),
            stress_xy: of(&|p| p.stress[3]),
            pressure: of(&|p| p.pressure.max(-suction)),
            porosity: of(&|p| if two { 1.0 - p.grains / p.volume } else { initial }),
            volume: of(&|p| p.volume),
            plastic_strain: of(&|p| p.plastic_strain),
        }
    }
}

/// Point `i` at the start.
fn point(setup: &Setup, i: usize) -> Point {
    let Setup { points, fluid, materials, controls, .. } = setup;
    let two = controls.formulation == Formulation::TwoPhase;
    let porosity = materials[0].porosity;
    let water = if two { porosity * fluid.density_kg_m3 } else { 0.0 };
    Point {
        position: [points.x[i], points.y[i]],
        v: points.velocity[i],
        w: points.velocity[i],
        stress: points.stress[i],
        pressure: points.pressure[i],
        volume: points.volume[i],
        grains: if two { (1.0 - porosity) * points.volume[i] } else { 0.0 },
        mass: (points.density[i] - water) * points.volume[i],
        plastic_strain: 0.0,
        cohesion: points.cohesion[i],
        friction_angle: points.friction_angle[i],
        peak_left: 1.0,
        half: [0.5 / f64::from(setup.points_per_cell_side); 2],
        moved: [0.0; 2],
        gradient: [[0.0; 2]; 2],
        water_divergence: 0.0,
    }
}
