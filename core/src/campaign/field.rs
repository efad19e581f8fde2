//! Autocorrelation of the random fields.

use serde::{Deserialize, Serialize};

/// Autocorrelation family. All are separable: the product of a function of the lag in each direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Autocorrelation {
    /// exp(-2 d / delta): the paper's Eq. 16.
    SingleExponential,
    /// exp(-pi (d / delta)^2).
    SquaredExponential,
    /// (1 + 4 d / delta) exp(-4 d / delta).
    SecondOrderMarkov,
    /// exp(-d / delta) cos(d / delta).
    CosineExponential,
    /// 1 - d / delta for d < delta, else 0.
    BinaryNoise,
}

/// Autocorrelation of the random fields.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// Family.
    pub autocorrelation: Autocorrelation,
    /// Scale of fluctuation along the bedding, m.
    pub scale_horizontal_m: f64,
    /// Scale of fluctuation across the bedding, m.
    pub scale_vertical_m: f64,
    /// Dip of the bedding, rad.
    pub rotation_rad: f64,
}
