//! The worker program: the analysis of `runout-core`, run for a coordinator.

use runout_core::gimp::Kernel;
use runout_core::realisation::Prepared;
use runout_core::spec::Spec;
use runout_proto::identity;
use runout_worker::{Realise, process};
use std::process::ExitCode;

fn main() -> ExitCode {
    process::main(prepare, identity::build())
}

fn prepare(spec: Spec, kernel: Kernel) -> Result<Realise, String> {
    let prepared = Prepared::new(spec, kernel).map_err(|e| e.to_string())?;
    Ok(Box::new(move |index, progress| prepared.realise(index, progress)))
}
