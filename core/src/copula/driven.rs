//! How a copula roughens a field: the autocorrelation of a property beside that of its driving normal fields.
//!
//! The first property keeps its driving field. The second is v(u, w), a function of two normals in each cell; between two
//! cells at driving correlation r the correlation of its normal scores follows from the function's expansion in Hermite
//! polynomials (Mehler 1866): sum over m of b_m r^m, where b_m is the share of the variance in polynomials of total degree m.
//! A Gaussian copula has b_1 = 1 and changes nothing; the others put some of the variance into higher degrees, so that
//! correlation falls off faster than asked.

use super::Copula;
use crate::special::{clamp_uniform, normal_cdf, normal_log_pdf, normal_quantile};

/// Highest total degree kept. What lies above it counts as uncorrelated between cells, which errs by less than its
/// share times r^49.
const HIGHEST_DEGREE: usize = 48;

/// Half-width and step of the trapezoidal rule over each normal, in standard deviations. For a smooth function the rule is
/// exact to rounding; the steep bend of a strongly dependent copula costs some 1e-4.
const REACH: f64 = 8.0;
const STEP: f64 = 0.05;

/// Autocorrelation of a property's normal scores as a function of that of the driving normal fields.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivenCorrelation {
    /// Share of the variance in each total degree, from degree 1.
    shares: Vec<f64>,
}

impl DrivenCorrelation {
    /// That of the property in place `property` (from 0).
    pub fn new(copula: &Copula, property: usize) -> DrivenCorrelation {
        let unchanged = DrivenCorrelation { shares: vec![1.0] };
        match copula {
            Copula::Plackett { .. } | Copula::Frank { .. } | Copula::No16 { .. } if property == 1 => {
                DrivenCorrelation { shares: second_property(copula) }
            }
            _ => unchanged,
        }
    }

    /// Correlation of the property's normal scores where the driving fields have correlation `driving`.
    pub fn at(&self, driving: f64) -> f64 {
        self.shares.iter().rev().fold(0.0, |sum, share| (sum + share) * driving)
    }

    /// Effective over requested scale of fluctuation for the single-exponential autocorrelation (the paper, Eq. 16): its
    /// m-th power has the scale delta / m.
    pub fn single_exponential_scale_ratio(&self) -> f64 {
        self.shares.iter().enumerate().map(|(k, share)| share / (k + 1) as f64).sum()
    }
}

fn second_property(copula: &Copula) -> Vec<f64> {
    let half = (REACH / STEP) as i32;
    let nodes: Vec<f64> = (-half..=half).map(|k| f64::from(k) * STEP).collect();
    let weighted: Vec<Vec<f64>> = nodes.iter().map(|&x| weighted_polynomials(x)).collect();
    let uniforms: Vec<f64> = nodes.iter().map(|&x| clamp_uniform(normal_cdf(x))).collect();
    let mut coefficients = vec![vec![0.0; HIGHEST_DEGREE + 1]; HIGHEST_DEGREE + 1];
    for (u, first) in uniforms.iter().zip(&weighted) {
        // Projection on the second normal's polynomials, then on the first's.
        let mut inner = [0.0; HIGHEST_DEGREE + 1];
        for (w, second) in uniforms.iter().zip(&weighted) {
            let v = copula.conditional_quantile(*w, *u).unwrap_or(*w);
            let score = normal_quantile(clamp_uniform(v));
            inner.iter_mut().zip(second).for_each(|(sum, h)| *sum += score * h);
        }
        for (row, h) in coefficients.iter_mut().zip(first) {
            row.iter_mut().zip(&inner).for_each(|(sum, value)| *sum += h * value);
        }
    }
    let share =
        |degree: usize| (0..=degree).map(|j| coefficients[j][degree - j] * coefficients[j][degree - j]).sum();
    (1..=HIGHEST_DEGREE).map(share).collect()
}

/// Orthonormal Hermite polynomials at `x` times the normal density and the step.
fn weighted_polynomials(x: f64) -> Vec<f64> {
    let mut values = vec![1.0, x];
    for k in 1..HIGHEST_DEGREE {
        let k_f = k as f64;
        values.push((x * values[k] - libm::sqrt(k_f) * values[k - 1]) / libm::sqrt(k_f + 1.0));
    }
    let weight = STEP * libm::exp(normal_log_pdf(x));
    values.iter_mut().for_each(|value| *value *= weight);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three million simulated pairs of cells with the paper's No.16 copula; the standard error of such a correlation is
    /// sqrt((1 + r^2) / 3e6), at most 8e-4, and the tolerance twice that.
    #[test]
    fn no16_roughens_the_second_property() {
        let copula = Copula::No16 { theta: 0.0174 };
        let driven = DrivenCorrelation::new(&copula, 1);
        let simulated = [(0.9, 0.8627), (0.7, 0.6282), (0.5, 0.4266), (0.3, 0.2463), (0.1, 0.0797)];
        for (driving, wanted) in simulated {
            let found = driven.at(driving);
            assert!((found - wanted).abs() < 1.6e-3, "{driving}: {found}, not {wanted}");
        }
        assert_eq!(DrivenCorrelation::new(&copula, 0).at(0.37), 0.37);
        let ratio = driven.single_exponential_scale_ratio();
        assert!((0.7..0.98).contains(&ratio), "{ratio}");
    }

    /// Independence leaves the field as it is, and every share of the variance is accounted for.
    #[test]
    fn shares_sum_to_one() {
        let independent = DrivenCorrelation::new(&Copula::Plackett { theta: 1.0 }, 1);
        assert!((independent.at(0.4) - 0.4).abs() < 1e-9, "{}", independent.at(0.4));
        for copula in [Copula::Frank { theta: -5.17 }, Copula::Plackett { theta: 0.1055 }] {
            let total = DrivenCorrelation::new(&copula, 1).at(1.0);
            assert!((total - 1.0).abs() < 1e-3, "{copula:?}: {total}");
        }
    }
}
