//! The two-phase GIMP solver.

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
        todo!("the solver branch")
    }
}
