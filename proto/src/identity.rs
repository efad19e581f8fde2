//! What coordinator and worker must have in common, so that an outcome is the same whoever computes it.

use rand::Rng;
use runout_core::gimp::Kernel;
use runout_core::realisation::probe;
use runout_core::seed::{Purpose, stream};
use runout_core::spec::SPEC_FORMAT;
use thiserror::Error;

/// Environment variable that forces a build of the solver's kernels.
pub const KERNEL_VARIABLE: &str = "RUNOUT_KERNEL";

/// Version of the wire contract: raised whenever a peer of the version before would misunderstand.
pub const PROTOCOL: u32 = 2;

/// The build's identity: package version, spec format and a digest of the sources of the analysis.
pub fn build() -> String {
    format!("{}+spec{}.core-{}", env!("CARGO_PKG_VERSION"), SPEC_FORMAT, env!("RUNOUT_CORE_DIGEST"))
}

/// [`KERNEL_VARIABLE`] names a kernel that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{KERNEL_VARIABLE} = {name} cannot be used; this processor runs {}", kernel_names())]
pub struct KernelError {
    name: String,
}

/// The kernel that [`KERNEL_VARIABLE`] names, or the fastest that this processor can run. All give the same bits.
///
/// # Errors
/// A name that is none, or a kernel that this processor cannot run.
pub fn kernel() -> Result<Kernel, KernelError> {
    let Some(name) = std::env::var_os(KERNEL_VARIABLE) else { return Ok(Kernel::best()) };
    let name = name.to_string_lossy().into_owned();
    let kernel = Kernel::from_name(&name).filter(|kernel| Kernel::available().contains(kernel));
    kernel.ok_or(KernelError { name })
}

fn kernel_names() -> String {
    let names: Vec<&str> = Kernel::available().into_iter().map(Kernel::name).collect();
    names.join(", ")
}

/// Digest (16 hexadecimal digits) of what this machine computes in some milliseconds: the operations that the
/// analysis is made of, and a tiny realisation with `kernel`.
///
/// A host whose compiler or processor rounds differently gives another digest. It is no proof that all outcomes
/// agree; the audit runs a share of them twice for that.
pub fn fingerprint(kernel: Kernel) -> String {
    let both = arithmetic() + &probe(kernel);
    blake3::hash(both.as_bytes()).to_hex()[..16].to_owned()
}

/// Digest of random streams, the `libm` functions, fused and separate multiply-adds, division and square roots.
fn arithmetic() -> String {
    /// Enough draws to meet every branch of the functions' range reductions.
    const DRAWS: usize = 4096;
    let mut random = stream(0, 0, Purpose::Audit);
    let mut hash = blake3::Hasher::new();
    let mut sum = 0.0_f64;
    for _ in 0..DRAWS {
        // 53 random bits make a double in [0, 1); scaled to the range of angles and exponents of the analysis.
        let x = (random.next_u64() >> 11) as f64 * 2.0_f64.powi(-53) * 40.0 - 20.0;
        let values = [
            libm::exp(x),
            libm::sin(x),
            libm::cos(x),
            libm::tan(x),
            libm::atan2(x, 3.0),
            libm::erfc(x * 0.25),
            libm::log(x * x + f64::MIN_POSITIVE),
            libm::pow(x * x + 0.1, 0.3),
            (x * x + 1.0).sqrt() / (x + 21.0),
            x.mul_add(x, -0.3 * x),
        ];
        for value in values {
            sum = value.mul_add(0.125, sum) / 1.0625;
            hash.update(&value.to_bits().to_le_bytes());
        }
    }
    hash.update(&sum.to_bits().to_le_bytes());
    hash.finalize().to_hex()[..16].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic_is_that_of_every_conforming_host() {
        // Recorded once on x86-64; IEEE 754 arithmetic and a software libm leave no freedom.
        assert_eq!(arithmetic(), "c4898e8cfbdd65f4");
    }

    #[test]
    fn the_fingerprint_does_not_depend_on_the_kernel() {
        let expected = fingerprint(Kernel::Baseline);
        assert!(Kernel::available().into_iter().all(|kernel| fingerprint(kernel) == expected));
    }
}
