//! A Runout worker: pulls leases from a coordinator, runs realisations, reports outcomes.
//!
//! * [`client`] is the only gRPC here: registration, calls that are retried with back-off, reconnection.
//! * [`runner`] has the slots: lease, compute on a thread of its own; `delivery` spools and reports until acknowledged, while
//!   the slot goes on.
//! * [`heartbeat`] is a thread of its own, which computation cannot block.
//! * [`spool`] keeps outcomes on disk until the coordinator has acknowledged them.
//! * [`board`] is what slots and heartbeat share: leases held, their progress, and whether to go on.
//! * [`address`] says where the coordinator is, [`leave`] when the worker leaves by itself.
//! * [`options`] is the command line, `documents` its manual page and completions, [`process`] the process around it
//!   all.

pub mod address;
pub mod board;
pub mod client;
mod delivery;
mod documents;
pub mod heartbeat;
pub mod leave;
pub mod machine;
pub mod options;
pub mod process;
pub mod runner;
pub mod spool;

use runout_core::gimp::Kernel;
use runout_core::outcome::Outcome;
use runout_core::realisation::{Cancelled, Progress};
use runout_core::spec::Spec;

/// Runs one realisation by its index.
pub type Realise = Box<dyn Fn(u64, &Progress) -> Result<Outcome, Cancelled> + Send + Sync>;

/// Prepares a spec for realisations that run at the same time and share so many threads (1: each has its own only), or
/// says why that cannot be. The program passes the analysis; tests of everything around it pass something quicker.
pub type Prepare = fn(Spec, Kernel, usize) -> Result<Realise, String>;
