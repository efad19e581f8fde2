//! Special functions on the way from (spec, index) to a field: the same bits on every host.
//!
//! Only `libm` and plain arithmetic are used. The normal and Student t functions are evaluated tens of thousands of
//! times a field; the others serve the fit.

use rand_chacha::rand_core::Rng;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Smallest uniform that is handed on, 2^-53; the largest is one minus this. Quantiles are finite between them.
pub const SMALLEST_UNIFORM: f64 = 1.110_223_024_625_156_5e-16;

/// Euler's constant.
pub const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// Logarithm of the square root of two pi.
const LN_SQRT_TWO_PI: f64 = 0.918_938_533_204_672_8;

/// Keeps a probability in the open interval, [2^-53, 1 - 2^-53].
#[inline]
pub fn clamp_uniform(u: f64) -> f64 {
    u.clamp(SMALLEST_UNIFORM, 1.0 - SMALLEST_UNIFORM)
}

/// A uniform number of the open interval (0, 1): the midpoints of 2^52 equal cells.
#[inline]
pub fn open_uniform(rng: &mut impl Rng) -> f64 {
    uniform_of_bits(rng.next_u64())
}

/// The uniform number of the open interval (0, 1) that a draw of 64 bits stands for.
#[inline]
pub fn uniform_of_bits(draw: u64) -> f64 {
    const CELL: f64 = 1.0 / (1_u64 << 52) as f64;
    // Through i64, from which every processor converts in one instruction.
    ((draw >> 12) as i64 as f64 + 0.5) * CELL
}

/// A standard normal number by inversion: one draw of 64 bits each, so that streams stay aligned.
#[inline]
pub fn standard_normal(rng: &mut impl Rng) -> f64 {
    normal_quantile(open_uniform(rng))
}

/// Standard normal distribution function, accurate in the lower tail to 1e-300.
#[inline]
pub fn normal_cdf(x: f64) -> f64 {
    0.5 * libm::erfc(-x * FRAC_1_SQRT_2)
}

/// Logarithm of the standard normal density.
#[inline]
pub fn normal_log_pdf(x: f64) -> f64 {
    -0.5 * x * x - LN_SQRT_TWO_PI
}

/// Standard normal quantile: Wichura (1988), Algorithm AS 241, PPND16, about 1e-16 relative.
///
/// `p` must lie in (0, 1); 0 and 1 give minus and plus infinity.
#[inline]
pub fn normal_quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180625 - q * q;
        return q * ratio(r, &CENTRE_TOP, &CENTRE_BOTTOM);
    }
    let r = libm::sqrt(-libm::log(if q < 0.0 { p } else { 1.0 - p }));
    let x = if r <= 5.0 {
        ratio(r - 1.6, &MIDDLE_TOP, &MIDDLE_BOTTOM)
    } else if r.is_finite() {
        ratio(r - 5.0, &TAIL_TOP, &TAIL_BOTTOM)
    } else {
        f64::INFINITY
    };
    if q < 0.0 { -x } else { x }
}

/// Inverse Mills ratio phi(a) / Phi(a): hazard of the normal distribution truncated at its mean minus `a` sd.
pub fn inverse_mills(a: f64) -> f64 {
    libm::exp(normal_log_pdf(a)) / normal_cdf(a)
}

#[inline]
fn ratio(x: f64, top: &[f64; 8], bottom: &[f64; 8]) -> f64 {
    horner(x, top) / horner(x, bottom)
}

#[inline]
fn horner(x: f64, coefficients: &[f64; 8]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

// Coefficients of AS 241 (Wichura 1988), lowest power first.
const CENTRE_TOP: [f64; 8] = [
    3.387_132_872_796_366_6,
    1.331_416_678_917_843_8e2,
    1.971_590_950_306_551_3e3,
    1.373_169_376_550_946e4,
    4.592_195_393_154_987e4,
    6.726_577_092_700_87e4,
    3.343_057_558_358_813e4,
    2.509_080_928_730_122_7e3,
];
const CENTRE_BOTTOM: [f64; 8] = [
    1.0,
    4.231_333_070_160_091e1,
    6.871_870_074_920_579e2,
    5.394_196_021_424_751e3,
    2.121_379_430_158_659_7e4,
    3.930_789_580_009_271e4,
    2.872_908_573_572_194_3e4,
    5.226_495_278_852_854e3,
];
const MIDDLE_TOP: [f64; 8] = [
    1.423_437_110_749_683_5,
    4.630_337_846_156_546,
    5.769_497_221_460_691,
    3.647_848_324_763_204_5,
    1.270_458_252_452_368_4,
    2.417_807_251_774_506e-1,
    2.272_384_498_926_918_4e-2,
    7.745_450_142_783_414e-4,
];
const MIDDLE_BOTTOM: [f64; 8] = [
    1.0,
    2.053_191_626_637_759,
    1.676_384_830_183_803_8,
    6.897_673_349_851e-1,
    1.481_039_764_274_800_8e-1,
    1.519_866_656_361_645_7e-2,
    5.475_938_084_995_345e-4,
    1.050_750_071_644_416_9e-9,
];
const TAIL_TOP: [f64; 8] = [
    6.657_904_643_501_103,
    5.463_784_911_164_114,
    1.784_826_539_917_291_3,
    2.965_605_718_285_048_7e-1,
    2.653_218_952_657_612_4e-2,
    1.242_660_947_388_078_4e-3,
    2.711_555_568_743_487_6e-5,
    2.010_334_399_292_288_1e-7,
];
const TAIL_BOTTOM: [f64; 8] = [
    1.0,
    5.998_322_065_558_88e-1,
    1.369_298_809_227_358e-1,
    1.487_536_129_085_061_5e-2,
    7.868_691_311_456_133e-4,
    1.846_318_317_510_054_8e-5,
    1.421_511_758_316_446e-7,
    2.044_263_103_389_939_8e-15,
];

/// The Student t distribution with its constants worked out once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StudentT {
    degrees_of_freedom: f64,
    /// Logarithm of 1 / B(nu / 2, 1 / 2).
    ln_inverse_beta: f64,
}

impl StudentT {
    /// `degrees_of_freedom` > 0.
    pub fn new(degrees_of_freedom: f64) -> StudentT {
        let half = 0.5 * degrees_of_freedom;
        let ln_inverse_beta = libm::lgamma(half + 0.5) - libm::lgamma(half) - 0.5 * libm::log(PI);
        StudentT { degrees_of_freedom, ln_inverse_beta }
    }

    /// Logarithm of the density.
    pub fn log_pdf(&self, x: f64) -> f64 {
        let nu = self.degrees_of_freedom;
        self.ln_inverse_beta - 0.5 * libm::log(nu) - 0.5 * (nu + 1.0) * libm::log1p(x * x / nu)
    }

    /// Distribution function: half the regularised incomplete beta function of nu / (nu + x^2)
    /// (Abramowitz and Stegun 26.7.1), by its continued fraction; relative accuracy about 1e-13.
    pub fn cdf(&self, x: f64) -> f64 {
        let half = 0.5 * self.degrees_of_freedom;
        let square = x * x;
        let below = square / (self.degrees_of_freedom + square);
        let above = self.degrees_of_freedom / (self.degrees_of_freedom + square);
        if square == 0.0 {
            return 0.5;
        }
        // x^a (1 - x)^b / B(a, b) is the same from both ends of the interval.
        let front = libm::exp(self.ln_inverse_beta + half * libm::log(above) + 0.5 * libm::log(below));
        // The fraction converges fast below (a + 1) / (a + b + 2).
        let tail = if above < (half + 1.0) / (half + 2.5) {
            0.5 * front * beta_fraction(half, 0.5, above) / half
        } else {
            0.5 - front * beta_fraction(0.5, half, below)
        };
        if x < 0.0 { tail } else { 1.0 - tail }
    }

    /// Quantile of `p` in (0, 1): Newton's method on the logarithm of the lower tail, from the normal quantile.
    pub fn quantile(&self, p: f64) -> f64 {
        if p > 0.5 {
            return -self.quantile(1.0 - p);
        }
        if p == 0.5 {
            return 0.0;
        }
        // Cornish-Fisher start (Abramowitz and Stegun 26.7.5, first term), then safeguarded steps; the tail's
        // logarithm is concave, so the steps cannot run away once they come from the left.
        let z = normal_quantile(p);
        let mut x = z + 0.25 * (z * z * z + z) / self.degrees_of_freedom;
        let ln_p = libm::log(p);
        for _ in 0..100 {
            let tail = self.cdf(x);
            let step = (libm::log(tail) - ln_p) * tail / libm::exp(self.log_pdf(x));
            let next = (x - step).min(0.5 * x);
            if (next - x).abs() <= 4.0 * f64::EPSILON * x.abs() {
                return next;
            }
            x = next;
        }
        x
    }
}

/// Continued fraction of the incomplete beta function (Abramowitz and Stegun 26.5.8) by Lentz's method.
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    // Well above the some 5 sqrt(max(a, b)) terms that are needed for degrees of freedom up to 1e5.
    const MOST_TERMS: usize = 2000;
    const TINY: f64 = 1e-300;
    let away = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / away(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    for m in 1..MOST_TERMS {
        let m = m as f64;
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / away(1.0 + even * d);
        c = away(1.0 + even / c);
        fraction *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / away(1.0 + odd * d);
        c = away(1.0 + odd / c);
        let change = d * c;
        fraction *= change;
        if (change - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    fraction
}

/// A chi-square number with `degrees_of_freedom` > 2: Marsaglia and Tsang (2000), by rejection.
pub fn chi_square(degrees_of_freedom: f64, rng: &mut impl Rng) -> f64 {
    let d = 0.5 * degrees_of_freedom - 1.0 / 3.0;
    let c = 1.0 / libm::sqrt(9.0 * d);
    loop {
        let x = standard_normal(rng);
        let u = open_uniform(rng);
        let base = 1.0 + c * x;
        let v = base * base * base;
        if v > 0.0 && libm::log(u) < 0.5 * x * x + d - d * v + d * libm::log(v) {
            return 2.0 * d * v;
        }
    }
}

/// Debye's first function, D1(x) = (1 / x) times the integral of t / (e^t - 1) from 0 to x, for x > 0.
pub fn debye1(x: f64) -> f64 {
    let integrand = |t: f64| if t == 0.0 { 1.0 } else { t / libm::expm1(t) };
    // The integrand is below 1e-20 beyond 50.
    crate::numeric::integrate(0.0, x.min(50.0), integrand) / x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a:e} is not {b:e}");
    }

    /// Quantiles as printed by Wichura (1988) and by R's `qnorm`.
    #[test]
    fn normal_quantiles_match_published_values() {
        close(normal_quantile(0.25), -0.674_489_750_196_081_7, 4e-16);
        close(normal_quantile(0.001), -3.090_232_306_167_813_7, 4e-16);
        close(normal_quantile(1e-20), -9.262_340_089_798_408, 4e-16);
        assert_eq!(normal_quantile(0.5), 0.0);
    }

    /// d(ln Phi)/dx is about |x| in the tail, so that half an ulp of x costs x^2 ulp of the probability.
    #[test]
    fn normal_cdf_and_quantile_are_inverse_to_rounding() {
        for k in 1..=1500 {
            let x = -0.025 * f64::from(k);
            let back = normal_quantile(normal_cdf(x));
            assert!((back - x).abs() <= 2e-15 * x.abs().max(1.0), "{x} came back as {back}");
        }
    }

    /// nu = 1 is Cauchy's distribution, nu = 2 has a closed form too; the quantile is the tables' 2.571 with R's
    /// digits.
    #[test]
    fn student_t_matches_closed_forms() {
        for x in [-1e6, -30.0, -2.0, -0.3, -1e-9, 0.0, 0.7, 5.0] {
            let cauchy = if x < -1.0 { libm::atan(-1.0 / x) / PI } else { 0.5 + libm::atan(x) / PI };
            close(StudentT::new(1.0).cdf(x), cauchy, 1e-13);
        }
        for x in [-40.0, -1.0, -0.2, 0.4] {
            let two = 0.5 + 0.5 * x / libm::sqrt(2.0 + x * x);
            // The closed form itself cancels in the tail: 1e-16 of 3e-4.
            close(StudentT::new(2.0).cdf(x), two, 1e-12);
        }
        close(StudentT::new(5.0).quantile(0.975), 2.570_581_835_636_314, 1e-13);
    }

    #[test]
    fn student_t_quantiles_invert_the_cdf() {
        for nu in [2.1, 5.0, 21.5, 300.0, 3000.0] {
            let t = StudentT::new(nu);
            for p in [SMALLEST_UNIFORM, 1e-9, 0.01, 0.3, 0.49999, 0.5, 0.8, 0.999] {
                close(t.cdf(t.quantile(p)), p, 1e-12);
            }
        }
    }

    /// D1(1) and D1(10) from Abramowitz and Stegun, Table 27.1.
    #[test]
    fn debye_matches_its_table() {
        close(debye1(1.0), 0.777_505, 1e-6);
        close(debye1(10.0), 0.164_443, 1e-5);
    }

    /// Mean nu and variance 2 nu; 40,000 draws put the mean within 5 standard errors, the variance within 6 %.
    #[test]
    fn chi_square_has_its_moments() {
        let mut rng = crate::seed::stream(7, 0, crate::seed::Purpose::CopulaMixing);
        let draws: Vec<f64> = (0..40_000).map(|_| chi_square(4.0, &mut rng)).collect();
        let mean = draws.iter().sum::<f64>() / 40_000.0;
        let variance = draws.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / 40_000.0;
        assert!((mean - 4.0).abs() < 5.0 * libm::sqrt(8.0 / 40_000.0), "{mean}");
        assert!((variance - 8.0).abs() < 0.06 * 8.0, "{variance}");
    }
}
