//! Which build of the time step runs, chosen at run time.

use super::advance::Step;
use super::grid::Grid;
use super::lanes::Baseline;
#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};
use super::phase::{self, Phase, Tally};
use super::window::{Points, Window};
use std::ops::Range;

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

/// Which compiled form of the phases an analysis runs: each formulation is compiled without and with the step's extras, so
/// that what an analysis does not use costs it nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Build {
    /// Must come from [`Kernel::or_best`].
    pub(super) kernel: Kernel,
    /// Whether there are two phases.
    pub(super) two: bool,
    /// Whether the step needs more than the plain scheme.
    pub(super) extra: bool,
}

/// Calls `$of` of the module `$kernel` in the build's form.
macro_rules! form {
    ($build:expr, $kernel:ident, $of:ident, $arguments:tt) => {
        match ($build.two, $build.extra) {
            (false, false) => $kernel::$of::<false, false> $arguments,
            (false, true) => $kernel::$of::<false, true> $arguments,
            (true, false) => $kernel::$of::<true, false> $arguments,
            (true, true) => $kernel::$of::<true, true> $arguments,
        }
    };
}

/// Calls `$of` compiled for the build's kernel.
macro_rules! dispatch {
    ($build:expr, $of:ident, $arguments:tt) => {
        match $build.kernel {
            // SAFETY: `or_best` has checked that the processor has the features.
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx512 => unsafe { form!($build, avx512, $of, $arguments) },
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2 => unsafe { form!($build, avx2, $of, $arguments) },
            _ => form!($build, baseline, $of, $arguments),
        }
    };
}

impl Build {
    /// See [`phase::at_points`].
    pub(super) fn at_points(
        self,
        phase: Phase,
        grid: &Grid,
        step: &Step,
        rows: &Range<usize>,
        points: Points<'_>,
        nodes: &mut Window<'_>,
    ) -> Tally {
        dispatch!(self, at_points, (phase, grid, step, rows, points, nodes))
    }

    /// See [`phase::at_nodes`].
    pub(super) fn at_nodes(
        self,
        phase: Phase,
        step: &Step,
        spans: &[Range<usize>],
        nodes: &mut Window<'_>,
    ) -> Tally {
        dispatch!(self, at_nodes, (phase, step, spans, nodes))
    }
}

/// The phases compiled for processors with these features, if any.
macro_rules! compiled {
    ($name:ident, $lanes:ty $(, $features:literal)?) => {
        mod $name {
            use super::*;

            $(#[target_feature(enable = $features)])?
            pub(super) fn at_points<const TWO: bool, const EXTRA: bool>(
                phase: Phase,
                grid: &Grid,
                step: &Step,
                rows: &Range<usize>,
                points: Points<'_>,
                nodes: &mut Window<'_>,
            ) -> Tally {
                phase::at_points::<$lanes, TWO, EXTRA>(phase, grid, step, rows, points, nodes)
            }

            $(#[target_feature(enable = $features)])?
            pub(super) fn at_nodes<const TWO: bool, const EXTRA: bool>(
                phase: Phase,
                step: &Step,
                spans: &[Range<usize>],
                nodes: &mut Window<'_>,
            ) -> Tally {
                phase::at_nodes::<$lanes, TWO, EXTRA>(phase, step, spans, nodes)
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
compiled!(avx512, Avx512, "avx512f,avx512dq,avx512vl,avx2,fma,bmi2");
#[cfg(target_arch = "x86_64")]
compiled!(avx2, Avx2, "avx2,fma");
compiled!(baseline, Baseline);
