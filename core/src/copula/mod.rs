//! Copulas: the dependence between soil properties, one family a file.
//!
//! Two-property families are functions of (theta, u, v): log-density, distribution function, conditional distribution
//! h(v | u) = dC/du and its inverse in closed form. The elliptical families work in any dimension.

mod density;
mod frank;
mod gaussian;
mod matrix;
mod no16;
mod plackett;
mod sampler;
mod student_t;

pub use density::LogDensity;
pub(crate) use density::Scores;
pub use gaussian::{correlation_of_tau, tau_of_correlation};
pub(crate) use matrix::cholesky;
pub use sampler::Sampler;

use crate::numeric::root;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A copula family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// No dependence; the only one for a single property.
    Independent,
    /// Gaussian, two or more properties.
    Gaussian,
    /// Plackett, two properties.
    Plackett,
    /// Frank, two properties.
    Frank,
    /// Nelsen's 4.2.16, two properties.
    No16,
    /// Student t, two or more properties.
    StudentT,
}

impl Family {
    /// All families, in the order of the paper's Table 5.
    pub const ALL: [Family; 6] = [
        Family::Independent,
        Family::Gaussian,
        Family::Plackett,
        Family::Frank,
        Family::No16,
        Family::StudentT,
    ];

    /// The name used in files, tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Family::Independent => "independent",
            Family::Gaussian => "gaussian",
            Family::Plackett => "plackett",
            Family::Frank => "frank",
            Family::No16 => "no16",
            Family::StudentT => "student-t",
        }
    }

    /// The family of that name.
    pub fn from_name(name: &str) -> Option<Family> {
        Family::ALL.into_iter().find(|f| f.name() == name)
    }
}

/// A copula with its parameters. Dimensions follow the order of [`crate::site::Property::ALL`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "family", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Copula {
    /// No dependence.
    Independent {
        /// Number of properties.
        dimension: usize,
    },
    /// Gaussian (paper Eqs. 4-5).
    Gaussian {
        /// Correlation matrix of the normal scores, rows in property order.
        correlation: Vec<Vec<f64>>,
    },
    /// Plackett, theta > 0, theta = 1 being independence.
    Plackett {
        /// Parameter.
        theta: f64,
    },
    /// Frank, theta real, theta = 0 being independence.
    Frank {
        /// Parameter.
        theta: f64,
    },
    /// Nelsen 4.2.16, theta >= 0.
    No16 {
        /// Parameter.
        theta: f64,
    },
    /// Student t (paper Eqs. 7-8).
    StudentT {
        /// Correlation matrix, rows in property order.
        correlation: Vec<Vec<f64>>,
        /// Degrees of freedom, > 2.
        degrees_of_freedom: f64,
    },
}

/// Parameters that are no copula this program can work with.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CopulaError {
    /// Theta outside the family's range.
    #[error("{} copula: theta = {theta} is not in {allowed}", family.name())]
    Theta {
        /// Family.
        family: Family,
        /// The value.
        theta: f64,
        /// The range.
        allowed: &'static str,
    },
    /// Not a correlation matrix.
    #[error(
        "the correlation matrix must be square, symmetric and positive definite with ones on its diagonal, \
         for 2 to 8 properties"
    )]
    Correlation,
    /// Degrees of freedom outside the range.
    #[error("student-t copula: {0} degrees of freedom; more than 2 and at most 1e5 are allowed")]
    DegreesOfFreedom(f64),
    /// No properties.
    #[error("a copula needs at least one property")]
    Dimension,
}

/// Two-property families: beyond these Kendall's tau is within 0.006 of its limits, and numbers near overflow.
const FRANK_THETAS: std::ops::RangeInclusive<f64> = -600.0..=600.0;
const POSITIVE_THETAS: std::ops::RangeInclusive<f64> = 1e-12..=1e12;

/// Tau is within 1.4e-7 of its supremum, 1/3, and the copula does not change any more.
const NO16_LARGEST: f64 = 1e6;

/// Largest number of properties of an elliptical copula.
const MOST_PROPERTIES: usize = 8;

impl Copula {
    /// Number of properties.
    pub fn dimension(&self) -> usize {
        match self {
            Copula::Independent { dimension } => *dimension,
            Copula::Gaussian { correlation } | Copula::StudentT { correlation, .. } => correlation.len(),
            Copula::Plackett { .. } | Copula::Frank { .. } | Copula::No16 { .. } => 2,
        }
    }

    /// Family.
    pub fn family(&self) -> Family {
        match self {
            Copula::Independent { .. } => Family::Independent,
            Copula::Gaussian { .. } => Family::Gaussian,
            Copula::Plackett { .. } => Family::Plackett,
            Copula::Frank { .. } => Family::Frank,
            Copula::No16 { .. } => Family::No16,
            Copula::StudentT { .. } => Family::StudentT,
        }
    }

    /// A two-property copula by its parameter; `None` for families without one.
    pub fn with_theta(family: Family, theta: f64) -> Option<Copula> {
        match family {
            Family::Plackett => Some(Copula::Plackett { theta }),
            Family::Frank => Some(Copula::Frank { theta }),
            Family::No16 => Some(Copula::No16 { theta }),
            Family::Gaussian => {
                Some(Copula::Gaussian { correlation: vec![vec![1.0, theta], vec![theta, 1.0]] })
            }
            Family::Independent | Family::StudentT => None,
        }
    }

    /// Parameter of a two-property copula: theta, or the correlation of a Gaussian or Student t one.
    pub fn theta(&self) -> Option<f64> {
        match self {
            Copula::Plackett { theta } | Copula::Frank { theta } | Copula::No16 { theta } => Some(*theta),
            Copula::Gaussian { correlation } | Copula::StudentT { correlation, .. }
                if correlation.len() == 2 =>
            {
                Some(correlation[0][1])
            }
            _ => None,
        }
    }

    /// Whether the parameters are in the family's range.
    ///
    /// # Errors
    /// Parameters outside it.
    pub fn check(&self) -> Result<(), CopulaError> {
        let within = |theta: f64, range: std::ops::RangeInclusive<f64>, allowed| {
            let refuse = CopulaError::Theta { family: self.family(), theta, allowed };
            if range.contains(&theta) { Ok(()) } else { Err(refuse) }
        };
        match self {
            Copula::Independent { dimension: 0 } => Err(CopulaError::Dimension),
            Copula::Independent { .. } => Ok(()),
            Copula::Plackett { theta } => within(*theta, POSITIVE_THETAS, "[1e-12, 1e12]"),
            // Zero is the limit of perfect negative dependence, which can be sampled but has no density.
            Copula::No16 { theta } => within(*theta, 0.0..=NO16_LARGEST, "[0, 1e6]"),
            Copula::Frank { theta } => within(*theta, FRANK_THETAS, "[-600, 600]"),
            Copula::Gaussian { correlation } => check_correlation(correlation),
            Copula::StudentT { correlation, degrees_of_freedom: nu } => {
                if !(*nu > 2.0 && *nu <= student_t::MOST_DEGREES_OF_FREEDOM) {
                    return Err(CopulaError::DegreesOfFreedom(*nu));
                }
                check_correlation(correlation)
            }
        }
    }

    /// Logarithm of the density at `u`, one coordinate in (0, 1) per property.
    ///
    /// For many places of one elliptical copula prepare a [`LogDensity`].
    pub fn log_density(&self, u: &[f64]) -> f64 {
        LogDensity::new(self).map_or(f64::NAN, |prepared| prepared.at(u))
    }

    /// Density at `u`, one coordinate in (0, 1) per property.
    pub fn density(&self, u: &[f64]) -> f64 {
        libm::exp(self.log_density(u))
    }

    /// Distribution function of a two-property copula; `None` in other dimensions.
    pub fn cdf(&self, u: f64, v: f64) -> Option<f64> {
        match self {
            Copula::Independent { dimension: 2 } => Some(u * v),
            Copula::Plackett { theta } => Some(plackett::cdf(*theta, u, v)),
            Copula::Frank { theta } => Some(frank::cdf(*theta, u, v)),
            Copula::No16 { theta } => Some(no16::cdf(*theta, u, v)),
            Copula::Gaussian { .. } => self.theta().map(|rho| gaussian::cdf(rho, u, v)),
            Copula::StudentT { degrees_of_freedom, .. } => {
                self.theta().map(|rho| student_t::cdf(rho, *degrees_of_freedom, u, v))
            }
            Copula::Independent { .. } => None,
        }
    }

    /// Conditional distribution h(v | u) = P(V <= v | U = u) of a two-property copula; `None` in other dimensions.
    pub fn conditional(&self, v: f64, u: f64) -> Option<f64> {
        match self {
            Copula::Independent { dimension: 2 } => Some(v),
            Copula::Plackett { theta } => Some(plackett::conditional(*theta, u, v)),
            Copula::Frank { theta } => Some(frank::conditional(*theta, u, v)),
            Copula::No16 { theta } => Some(no16::conditional(*theta, u, v)),
            Copula::Gaussian { .. } => self.theta().map(|rho| gaussian::conditional(rho, u, v)),
            Copula::StudentT { degrees_of_freedom, .. } => {
                self.theta().map(|rho| student_t::conditional(rho, *degrees_of_freedom, u, v))
            }
            Copula::Independent { .. } => None,
        }
    }

    /// The v with h(v | u) = `w` of a two-property copula; `None` in other dimensions.
    pub fn conditional_quantile(&self, w: f64, u: f64) -> Option<f64> {
        match self {
            Copula::Independent { dimension: 2 } => Some(w),
            Copula::Plackett { theta } => Some(plackett::conditional_quantile(*theta, u, w)),
            Copula::Frank { theta } => Some(frank::conditional_quantile(*theta, u, w)),
            Copula::No16 { theta } => Some(no16::conditional_quantile(*theta, u, w)),
            Copula::Gaussian { .. } => self.theta().map(|rho| gaussian::conditional_quantile(rho, u, w)),
            Copula::StudentT { degrees_of_freedom, .. } => {
                self.theta().map(|rho| student_t::conditional_quantile(rho, *degrees_of_freedom, u, w))
            }
            Copula::Independent { .. } => None,
        }
    }

    /// Kendall's tau between the properties in places `i` and `j`.
    pub fn kendall_tau(&self, i: usize, j: usize) -> f64 {
        if i == j {
            return 1.0;
        }
        match self {
            Copula::Independent { .. } => 0.0,
            Copula::Plackett { theta } => plackett::kendall_tau(*theta),
            Copula::Frank { theta } => frank::kendall_tau(*theta),
            Copula::No16 { theta } => no16::kendall_tau(*theta),
            Copula::Gaussian { correlation } | Copula::StudentT { correlation, .. } => {
                tau_of_correlation(correlation[i][j])
            }
        }
    }

    /// Lower and upper tail dependence between the properties in places `i` and `j`.
    pub fn tail_dependence(&self, i: usize, j: usize) -> (f64, f64) {
        match self {
            // The limit of C(t, t) / t at zero; none at perfect negative dependence.
            Copula::No16 { theta } => (if *theta > 0.0 { 0.5 } else { 0.0 }, 0.0),
            Copula::StudentT { correlation, degrees_of_freedom } => {
                let tail = student_t::tail_dependence(correlation[i][j], *degrees_of_freedom);
                (tail, tail)
            }
            _ => (0.0, 0.0),
        }
    }

    /// The two-property copula of `family` with this Kendall's tau; `None` if the family cannot reach it.
    pub fn of_kendall_tau(family: Family, tau: f64) -> Option<Copula> {
        // In the logarithm of theta tau is nearly a straight line over each of these ranges.
        let positive = |lowest: f64, highest: f64, of: fn(f64) -> f64| {
            root(libm::log(lowest), libm::log(highest), |x| of(libm::exp(x)) - tau).map(libm::exp)
        };
        let theta = match family {
            Family::Gaussian => (tau.abs() < 1.0).then(|| correlation_of_tau(tau)),
            Family::Frank => {
                root(*FRANK_THETAS.start(), *FRANK_THETAS.end(), |t| frank::kendall_tau(t) - tau)
            }
            Family::Plackett => positive(1e-6, 1e6, plackett::kendall_tau),
            Family::No16 => positive(*POSITIVE_THETAS.start(), NO16_LARGEST, no16::kendall_tau),
            Family::Independent | Family::StudentT => None,
        };
        Copula::with_theta(family, theta?)
    }
}

fn check_correlation(correlation: &[Vec<f64>]) -> Result<(), CopulaError> {
    let n = correlation.len();
    let square = (2..=MOST_PROPERTIES).contains(&n) && correlation.iter().all(|row| row.len() == n);
    let unit = square && (0..n).all(|i| correlation[i][i] == 1.0);
    let symmetric = unit && (0..n).all(|i| (0..i).all(|j| correlation[i][j] == correlation[j][i]));
    if symmetric && matrix::cholesky(correlation).is_some() { Ok(()) } else { Err(CopulaError::Correlation) }
}
