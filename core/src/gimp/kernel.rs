//! Which build of the time step runs, chosen at run time.

use super::advance::{Arena, Step, StepReport, advance};
use super::lanes::Baseline;
#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};

/// Which build of the time step's kernels runs. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// What every processor of the architecture has; fused multiply-adds may be slow.
    Baseline,
    /// AVX2 and FMA (x86-64-v3).
    Avx2,
    /// AVX-512 (x86-64-v4).
    Avx512,
}

impl Kernel {
    /// The fastest kernel this processor can run.
    pub fn best() -> Kernel {
        Kernel::available()[0]
    }

    /// The kernels this processor can run, fastest first.
    pub fn available() -> Vec<Kernel> {
        [Kernel::Avx512, Kernel::Avx2, Kernel::Baseline].into_iter().filter(|k| k.runs_here()).collect()
    }

    /// The name used in messages and in `RUNOUT_KERNEL`.
    pub fn name(self) -> &'static str {
        match self {
            Kernel::Baseline => "baseline",
            Kernel::Avx2 => "avx2",
            Kernel::Avx512 => "avx512",
        }
    }

    /// The kernel of that name, whether this processor can run it or not.
    pub fn from_name(name: &str) -> Option<Kernel> {
        [Kernel::Baseline, Kernel::Avx2, Kernel::Avx512].into_iter().find(|k| k.name() == name)
    }

    /// This kernel where the processor can run it, else the fastest that it can: the bits are the same.
    pub(super) fn or_best(self) -> Kernel {
        if self.runs_here() { self } else { Kernel::best() }
    }

    #[cfg(target_arch = "x86_64")]
    fn runs_here(self) -> bool {
        match self {
            Kernel::Baseline => true,
            Kernel::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            Kernel::Avx512 => {
                Kernel::Avx2.runs_here()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("bmi2")
            }
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn runs_here(self) -> bool {
        self == Kernel::Baseline
    }
}

/// Carries the arena through one step with `kernel`, which must come from [`Kernel::or_best`]. Each formulation is compiled
/// without and with the step's extras, so that what an analysis does not use costs it nothing.
pub(super) fn dispatch(kernel: Kernel, two: bool, arena: &mut Arena, step: &Step) -> StepReport {
    match (two, step.extras()) {
        (false, false) => dispatch_to::<false, false>(kernel, arena, step),
        (false, true) => dispatch_to::<false, true>(kernel, arena, step),
        (true, false) => dispatch_to::<true, false>(kernel, arena, step),
        (true, true) => dispatch_to::<true, true>(kernel, arena, step),
    }
}

fn dispatch_to<const TWO: bool, const EXTRA: bool>(
    kernel: Kernel,
    arena: &mut Arena,
    step: &Step,
) -> StepReport {
    match kernel {
        // SAFETY: `or_best` has checked that the processor has the features.
        #[cfg(target_arch = "x86_64")]
        Kernel::Avx512 => unsafe { avx512::<TWO, EXTRA>(arena, step) },
        #[cfg(target_arch = "x86_64")]
        Kernel::Avx2 => unsafe { avx2::<TWO, EXTRA>(arena, step) },
        _ => advance::<Baseline, TWO, EXTRA>(arena, step),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma,bmi2")]
fn avx512<const TWO: bool, const EXTRA: bool>(arena: &mut Arena, step: &Step) -> StepReport {
    advance::<Avx512, TWO, EXTRA>(arena, step)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2<const TWO: bool, const EXTRA: bool>(arena: &mut Arena, step: &Step) -> StepReport {
    advance::<Avx2, TWO, EXTRA>(arena, step)
}
