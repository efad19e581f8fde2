//! What a copula does to autocorrelation: the effective scale of fluctuation of each property.
//!
//! The latent fields are Gaussian with the autocorrelation asked for. A property's normal score, the standard normal
//! number with the property's probability, is a function f of the latent values of the properties before it and of its
//! own. With f expanded in Hermite polynomials, f = sum of c_mn h_m(z1) h_n(z2), two cells whose latent fields correlate
//! by r have scores that correlate by the sum of c_mn^2 r^(m + n) (Mehler's formula): a power series in r with
//! non-negative coefficients that add up to one. A Gaussian copula has the term r alone and leaves the correlation as
//! it is. Every other one has higher terms in its second property, which is rougher than asked.
//!
//! The correlation of scores is that of the property itself but for its marginal, whose effect on the correlation is
//! smaller and is not counted here.

use super::autocorrelation::correlation;
use super::noise;
use crate::campaign::Autocorrelation;
use crate::copula::{Copula, CopulaError, Sampler};
use crate::special::{StudentT, clamp_uniform, normal_cdf, normal_quantile};

/// Highest power of the latent correlation that is worked out. What is left is put to the next one.
const HIGHEST_POWER: usize = 40;

/// Latent values are taken in [-8, 8]: the normal distribution has 1e-15 outside.
const RANGE: f64 = 8.0;

/// Step of the trapezoidal rule over latent values, whose error falls exponentially for smooth integrands.
const STEP: f64 = 0.05;

/// Correlation of a property's normal scores as a function of the latent fields' correlation.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreCorrelation {
    /// Coefficient of each power of the latent correlation, from the power 0; they add up to one.
    coefficients: Vec<f64>,
}

impl ScoreCorrelation {
    /// For property `j` of `copula`, counted in the copula's order. A Student t copula's mixing variable is one a
    /// realisation; its result is the correlation over realisations.
    ///
    /// # Errors
    /// A copula whose parameters cannot be used.
    pub fn new(copula: &Copula, j: usize) -> Result<ScoreCorrelation, CopulaError> {
        let sampler = Sampler::new(copula)?;
        let coefficients = match copula {
            Copula::Plackett { .. } | Copula::Frank { .. } | Copula::No16 { .. } if j > 0 => {
                two_property_coefficients(&sampler)
            }
            Copula::StudentT { degrees_of_freedom, .. } => student_t_coefficients(*degrees_of_freedom),
            _ => vec![0.0, 1.0],
        };
        Ok(ScoreCorrelation { coefficients })
    }

    /// Correlation of the scores at two cells whose latent fields correlate by `latent`.
    pub fn at(&self, latent: f64) -> f64 {
        self.coefficients.iter().rev().fold(0.0, |sum, c| sum * latent + c)
    }

    /// Effective scale of fluctuation, m, of a property whose latent field has the given one: the integral of the
    /// scores' correlation over all lags. Infinite if the latent scale is.
    pub fn effective_scale(&self, family: Autocorrelation, scale_m: f64) -> f64 {
        // Trapezoidal rule over [0, 20 delta] with 200 steps a delta: every family is below e^-20 beyond, and the error
        // is h^2 / 12 times the change of slope, 4 k / delta for the power k, 8e-6 k of delta.
        const STEPS_PER_SCALE: u32 = 200;
        const REACH: u32 = 20;
        if scale_m.is_infinite() {
            return scale_m;
        }
        let h = 1.0 / f64::from(STEPS_PER_SCALE);
        let at = |step: u32| self.at(correlation(family, f64::from(step) * h, 1.0));
        // The constant term does not decay: it is the realisations' own spread, not a fluctuation within a field.
        let constant = self.coefficients[0];
        let inner: f64 = (1..REACH * STEPS_PER_SCALE).map(|step| at(step) - constant).sum();
        2.0 * h * (0.5 * (1.0 - constant) + inner) * scale_m
    }
}

/// Nodes, and the weight of each: normal density times step, scaled to add up to one.
fn nodes() -> Vec<(f64, f64)> {
    let count = (2.0 * RANGE / STEP).round() as usize;
    let place = |i: usize| -RANGE + i as f64 * STEP;
    let density = |z: f64| libm::exp(-0.5 * z * z);
    let sum: f64 = (0..=count).map(|i| density(place(i))).sum();
    (0..=count).map(|i| (place(i), density(place(i)) / sum)).collect()
}

/// Hermite polynomials h_0 to h_HIGHEST_POWER at z, normalised to unit variance under the normal distribution:
/// sqrt(n + 1) h_(n+1) = z h_n - sqrt(n) h_(n-1).
fn hermite(z: f64) -> Vec<f64> {
    let mut h = vec![1.0, z];
    for n in 1..HIGHEST_POWER {
        let degree = n as f64;
        h.push((z * h[n] - degree.sqrt() * h[n - 1]) / (degree + 1.0).sqrt());
    }
    h
}

/// Puts what the powers above the highest lack of one to the power after it.
fn complete(mut coefficients: Vec<f64>) -> Vec<f64> {
    let rest = 1.0 - coefficients.iter().sum::<f64>();
    coefficients.push(rest.max(0.0));
    coefficients
}

/// The second property of a two-property copula, which the sampler conditions on the first.
fn two_property_coefficients(sampler: &Sampler) -> Vec<f64> {
    let nodes = nodes();
    let basis: Vec<Vec<f64>> = nodes.iter().map(|(z, _)| hermite(*z)).collect();
    let powers = HIGHEST_POWER + 1;
    let mut c = vec![0.0; powers * powers];
    let mut along = vec![0.0; powers];
    let uniforms: Vec<f64> = nodes.iter().map(|(z, _)| clamp_uniform(normal_cdf(*z))).collect();
    let score = noise::normal();
    for (((_, weight1), u), h1) in nodes.iter().zip(&uniforms).zip(&basis) {
        let mut second = uniforms.clone();
        sampler.condition(&vec![*u; nodes.len()], &mut second);
        along.fill(0.0);
        for ((v, (_, weight2)), h2) in second.iter().zip(&nodes).zip(&basis) {
            let weighted = weight2 * score.at(*v);
            along.iter_mut().zip(h2).for_each(|(sum, h)| *sum += weighted * h);
        }
        for (m, h) in h1.iter().enumerate() {
            for (sum, a) in c[m * powers..][..powers].iter_mut().zip(&along) {
                *sum += weight1 * h * a;
            }
        }
    }
    let mut coefficients = vec![0.0; powers];
    for m in 0..powers {
        for n in 0..powers - m {
            coefficients[m + n] += c[m * powers + n] * c[m * powers + n];
        }
    }
    complete(coefficients)
}

/// Any property of a Student t copula: given the mixing factor s its score is a function of one normal number, its own
/// latent value after correlation; the coefficients are averaged over the mixing variable w = nu / s^2.
fn student_t_coefficients(degrees_of_freedom: f64) -> Vec<f64> {
    let margin = StudentT::new(degrees_of_freedom);
    let nodes = nodes();
    let basis: Vec<Vec<f64>> = nodes.iter().map(|(z, _)| hermite(*z)).collect();
    let mut coefficients = vec![0.0; HIGHEST_POWER + 1];
    for (mixing, weight) in mixing_nodes(degrees_of_freedom) {
        let mut c = vec![0.0; HIGHEST_POWER + 1];
        for ((z, density), h) in nodes.iter().zip(&basis) {
            let weighted = density * normal_quantile(clamp_uniform(margin.cdf(z * mixing)));
            c.iter_mut().zip(h).for_each(|(sum, h)| *sum += weighted * h);
        }
        coefficients.iter_mut().zip(&c).for_each(|(sum, c)| *sum += weight * c * c);
    }
    complete(coefficients)
}

/// Mixing factors sqrt(nu / w) and their weights for w chi-square: trapezoidal rule in ln w, whose density is
/// proportional to w^(nu/2) e^(-w/2), over eight standard deviations to either side of its top at ln nu.
fn mixing_nodes(degrees_of_freedom: f64) -> Vec<(f64, f64)> {
    const NODES: i32 = 80;
    let half = 0.5 * degrees_of_freedom;
    let node = |i: i32| {
        // The curvature of the log-density at its top is nu / 2.
        let t = 8.0 * f64::from(i) / f64::from(NODES) / half.sqrt();
        (libm::exp(-0.5 * t), libm::exp(half * (t - libm::expm1(t))))
    };
    let all: Vec<(f64, f64)> = (-NODES..=NODES).map(node).collect();
    let sum: f64 = all.iter().map(|n| n.1).sum();
    all.into_iter().map(|(mixing, weight)| (mixing, weight / sum)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{self, Purpose};
    use crate::special::standard_normal;

    #[test]
    fn a_gaussian_copula_leaves_the_scale_as_it_is() {
        let copula = Copula::Gaussian { correlation: vec![vec![1.0, -0.6], vec![-0.6, 1.0]] };
        for j in 0..2 {
            let scores = ScoreCorrelation::new(&copula, j).unwrap();
            assert_eq!(scores.at(0.37), 0.37);
            let scale = scores.effective_scale(Autocorrelation::SingleExponential, 2.0);
            assert!((scale - 2.0).abs() < 2e-5, "{scale}");
        }
    }

    /// Correlations of scores for the fits to the paper's Table 2, against a simulation of pairs of cells. The square of a
    /// product of two scores has a mean of at most 3, the fourth moment of either (Cauchy-Schwarz): over 400,000 pairs
    /// the mean product's standard error is at most 2.74e-3, of which 4.5 are allowed.
    #[test]
    fn copulas_that_are_not_gaussian_roughen_the_second_property() {
        let copulas = [
            Copula::No16 { theta: 0.017_395_307_2 },
            Copula::Plackett { theta: 0.105_528_25 },
            Copula::Frank { theta: -5.170_310_443 },
        ];
        for copula in copulas {
            let scores = ScoreCorrelation::new(&copula, 1).unwrap();
            assert_eq!(ScoreCorrelation::new(&copula, 0).unwrap().at(0.5), 0.5);
            assert!((scores.at(1.0) - 1.0).abs() < 1e-12);
            for latent in [0.9, 0.5, 0.1] {
                let simulated = simulate(&Sampler::new(&copula).unwrap(), latent);
                let found = scores.at(latent);
                let allowed = 4.5 * 2.74e-3;
                assert!((found - simulated).abs() < allowed, "{copula:?} {latent}: {found}, {simulated}");
                assert!(found < latent);
            }
        }
    }

    /// Scores of No.16 at theta = .0173953 correlate by .8625, .628, .428, .246 and .079 in an independent simulation. Its
    /// own error is not recorded; 2e-3 is the standard error of half a million pairs.
    #[test]
    fn number_sixteen_roughens_as_much_as_is_known() {
        let scores = ScoreCorrelation::new(&Copula::No16 { theta: 0.017_395_307_2 }, 1).unwrap();
        for (latent, wanted) in [(0.9, 0.8625), (0.7, 0.628), (0.5, 0.428), (0.3, 0.246), (0.1, 0.079)] {
            assert!((scores.at(latent) - wanted).abs() < 2e-3, "{latent}: {}", scores.at(latent));
        }
        // The k-th power of exp(-2 d / delta) integrates to delta / k.
        let powers = scores.coefficients.iter().enumerate().skip(1);
        let exact = 2.0 * powers.map(|(k, c)| c / k as f64).sum::<f64>();
        let scale = scores.effective_scale(Autocorrelation::SingleExponential, 2.0);
        assert!((scale - exact).abs() < 1e-4, "{scale}, exactly {exact}");
        assert!((scale - 1.733).abs() < 1e-3, "{scale}");
    }

    fn simulate(sampler: &Sampler, latent: f64) -> f64 {
        const PAIRS: usize = 400_000;
        let mut fields = [vec![], vec![], vec![], vec![]];
        for (j, field) in fields.iter_mut().enumerate() {
            let mut stream = seed::stream(5, 0, Purpose::LatentField(j as u32));
            field.extend((0..PAIRS).map(|_| standard_normal(&mut stream)));
        }
        let fresh = (1.0 - latent * latent).sqrt();
        let [z1, z2, other1, other2] = &mut fields;
        for (z, other) in [(&*z1, other1), (&*z2, other2)] {
            other.iter_mut().zip(z).for_each(|(o, z)| *o = latent * z + fresh * *o);
        }
        let [z1, z2, other1, other2] = &mut fields;
        sampler.uniforms(&mut [z1, z2], 1.0);
        sampler.uniforms(&mut [other1, other2], 1.0);
        let product = |(a, b): (&f64, &f64)| normal_quantile(*a) * normal_quantile(*b);
        z2.iter().zip(other2.iter()).map(product).sum::<f64>() / PAIRS as f64
    }

    /// Towards many degrees of freedom the t copula becomes Gaussian; with few, the score's higher terms and the spread of
    /// the mixing variable both show. The scores' variance is one in any case.
    #[test]
    fn a_student_t_copula_becomes_gaussian_with_many_degrees_of_freedom() {
        let copula = |degrees_of_freedom| Copula::StudentT {
            correlation: vec![vec![1.0, 0.3], vec![0.3, 1.0]],
            degrees_of_freedom,
        };
        let scores = |nu| ScoreCorrelation::new(&copula(nu), 0).unwrap();
        assert!((scores(1e4).at(0.5) - 0.5).abs() < 1e-4);
        let few = scores(3.0);
        assert!((few.at(1.0) - 1.0).abs() < 1e-9);
        assert!(few.at(0.5) < 0.5 && few.at(0.5) > 0.4, "{}", few.at(0.5));
    }
}
