//! The two-phase GIMP solver: an explicit uGIMP-MUSL scheme for skeleton and pore water in plane strain.
//!
//! One step, as [`Body::step`] takes it:
//!
//! 1. `scatter`: masses, momenta and internal forces from the points to the nodes (`shape`, `transfer`).
//! 2. `momentum`, with `balance` and `contact`: accelerations with implicit drag, damping and boundary conditions.
//! 3. `gather`: velocities and moves of the points, and their momenta back to the nodes (MUSL).
//! 4. `strain`: velocity gradients from the second set of nodal velocities; means over cells.
//! 5. `update`, with `soil` and `water`: stress, strength and pore pressure; then the points move.
//!
//! `stage` is the time loop, `rest` the rules that end it, `time_step` the critical step. The points lie in blocks
//! of eight (`block`), sorted by the nearest node (`sort`). `advance` takes the step's phases (`phase`) over the parts
//! into which `plan` cuts points and nodes (`window`), one after the other or side by side in `threads`; the phases are compiled for
//! three kinds of processor (`kernel`, `lanes`), each without and with the options. Neither moves a bit.
//!
//! `loads` adds what acts on single points (free water, held water, external forces), `energy` keeps the balance of energy.
//!
//! A point's water never leaves it (single-point formulation): no water comes out of the ground, and free water is a level
//! that stands still.

mod advance;
mod balance;
mod block;
mod body;
mod contact;
mod energy;
mod fill;
mod gather;
mod grid;
mod kernel;
mod lanes;
mod loads;
mod momentum;
mod nodes;
mod phase;
mod plan;
mod rest;
mod scatter;
mod setup;
mod shape;
mod soil;
mod sort;
mod stage;
mod strain;
mod threads;
mod time_step;
mod transfer;
mod update;
mod water;
mod window;

pub use body::{Body, LARGEST_FRICTION_ANGLE_RAD, MaterialError, PointMotion, Report, State};
pub use energy::Energy;
pub use grid::Grid;
pub use kernel::Kernel;
pub use rest::{RestRule, net_velocity};
pub use setup::{Conditions, Controls, Fluid, InitialPoints, Material, Obstacle, Setup, Softening, Support};
pub use stage::{End, Limits, run};
pub use threads::Threads;
