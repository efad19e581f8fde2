//! The worker program: the analysis of `runout-core`, run for a coordinator.

use runout_core::gimp::{Kernel, Threads};
use runout_core::realisation::Prepared;
use runout_core::spec::Spec;
use runout_proto::identity;
use runout_worker::{Realise, process};
use std::process::ExitCode;

fn main() -> ExitCode {
    process::main(prepare, identity::build())
}

fn prepare(spec: Spec, kernel: Kernel, threads: usize) -> Result<Realise, String> {
    let threads = Threads::new(threads).map_err(|e| format!("cannot start {threads} threads: {e}"))?;
    let prepared = Prepared::new(spec, kernel).map_err(|e| e.to_string())?.with_threads(threads);
    Ok(Box::new(move |index, progress| prepared.realise(index, progress)))
}
