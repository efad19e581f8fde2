//! Kinds of machines: what workers run on, as they tell it. For the record; no bit of an outcome depends on it.

use runout_proto::v1;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A kind of machine.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Machine {
    /// Model of the processor.
    pub processor: String,
    /// Kernel of the analysis that was used.
    pub kernel: String,
    /// Processor cores that the worker may use.
    pub cores: u32,
}

impl From<v1::Machine> for Machine {
    fn from(wire: v1::Machine) -> Machine {
        let v1::Machine { processor, kernel, cores } = wire;
        Machine { processor, kernel, cores }
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Machine { processor, kernel, cores } = self;
        write!(f, "{processor}, {kernel}, {cores} {}", if *cores == 1 { "core" } else { "cores" })
    }
}
