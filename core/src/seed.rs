//! Random streams, derived and never drawn: (campaign seed, index, purpose) names a stream.
//!
//! The three are hashed (BLAKE3) into the 256-bit key of a ChaCha12 generator, so that no stream depends on how
//! many numbers another one has used, nor on worker, attempt or order.

use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::SeedableRng;

/// What a stream is used for. The number is part of the stream's name: never reuse or renumber one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// White noise behind the latent field of the random property with this position.
    LatentField(u32),
    /// Chi-square mixing variable of a Student t copula.
    CopulaMixing,
    /// Parametric bootstrap of the goodness of fit.
    GoodnessOfFit,
    /// Bootstrap of estimates in the report.
    ReportBootstrap,
    /// Which realisations are audited on a second worker.
    Audit,
    /// Which samples the report replays.
    ReportReplays,
    /// Which realisations the report relates to their fields.
    ReportSensitivity,
    /// Draws from the fitted distributions in the report's figures.
    ReportScatter,
}

impl Purpose {
    fn code(self) -> u64 {
        match self {
            Purpose::LatentField(property) => 0x100 + u64::from(property),
            Purpose::CopulaMixing => 1,
            Purpose::GoodnessOfFit => 2,
            Purpose::ReportBootstrap => 3,
            Purpose::Audit => 4,
            Purpose::ReportReplays => 5,
            Purpose::ReportSensitivity => 6,
            Purpose::ReportScatter => 7,
        }
    }
}

/// The generator of stream (`campaign_seed`, `index`, `purpose`).
pub fn stream(campaign_seed: u64, index: u64, purpose: Purpose) -> ChaCha12Rng {
    let mut name = blake3::Hasher::new_derive_key("runout 2026 random stream v1");
    name.update(&campaign_seed.to_le_bytes());
    name.update(&index.to_le_bytes());
    name.update(&purpose.code().to_le_bytes());
    ChaCha12Rng::from_seed(*name.finalize().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::rand_core::Rng;

    #[test]
    fn streams_are_reproducible_and_distinct() {
        let first = |seed, index, purpose| stream(seed, index, purpose).next_u64();
        let a = first(1, 2, Purpose::LatentField(0));
        assert_eq!(a, first(1, 2, Purpose::LatentField(0)));
        assert_ne!(a, first(1, 2, Purpose::LatentField(1)));
        assert_ne!(a, first(1, 3, Purpose::LatentField(0)));
        assert_ne!(a, first(2, 2, Purpose::LatentField(0)));
        assert_ne!(first(1, 2, Purpose::CopulaMixing), first(1, 2, Purpose::Audit));
    }
}
