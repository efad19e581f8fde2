//! The worker program: the analysis of `runout-core`, run for a coordinator.

use runout_core::gimp::Kernel;
use runout_core::realisation::Prepared;
use runout_core::spec::Spec;
use runout_worker::{Realise, process};
use std::process::ExitCode;

fn main() -> ExitCode {
    process::main(prepare)
}

fn prepare(spec: Spec) -> Result<Realise, String> {
    let prepared = Prepared::new(spec, kernel()?).map_err(|e| e.to_string())?;
    Ok(Box::new(move |index, progress| prepared.realise(index, progress)))
}

/// The kernel of RUNOUT_KERNEL, or the fastest this processor can run. All give the same bits.
fn kernel() -> Result<Kernel, String> {
    match std::env::var("RUNOUT_KERNEL").as_deref() {
        Err(_) => Ok(Kernel::best()),
        Ok("baseline") => Ok(Kernel::Baseline),
        Ok("avx2") => Ok(Kernel::Avx2),
        Ok("avx512") => Ok(Kernel::Avx512),
        Ok(other) => {
            Err(format!("RUNOUT_KERNEL = {other} is not allowed; it must be baseline, avx2 or avx512"))
        }
    }
}
