//! The copulas of the paper at points computed with 40 digits, their inverses, limits and rank correlations, and the
//! fields' sampler: uniform marginals and the right tau.
//!
//! Tolerances: 1e-12 relative for the points (a few hundred operations of 1e-16 each), and what it costs that u = 0.999999
//! is no binary number; others are derived where they stand.

use proptest::prelude::*;
use runout_core::copula::{Copula, Family, LogDensity, Sampler};
use runout_core::marginal::{self, Marginal, Quantile};
use runout_core::seed::{Purpose, stream};
use runout_core::special::standard_normal;
use serde_json::Value;

const PAIRS: [Family; 4] = [Family::Gaussian, Family::Plackett, Family::Frank, Family::No16];

fn number(value: &Value) -> f64 {
    value.as_str().expect("numbers are kept as text").parse().expect("a number")
}

/// `u` is the conditioning coordinate: half an ulp of it changes 1 - u, and with it what follows, by this share.
fn assert_close(found: f64, wanted: f64, u: f64, what: &str) {
    let share = 1e-12 + 0.5 * f64::EPSILON / (1.0 - u);
    assert!((found - wanted).abs() <= share * wanted.abs(), "{what}: {found:e}, not {wanted:e}");
}

fn matrix(rho: f64) -> Vec<Vec<f64>> {
    vec![vec![1.0, rho], vec![rho, 1.0]]
}

#[test]
fn points_match_forty_digit_values() {
    let points: Value = serde_json::from_str(include_str!("data/copula_points.json")).unwrap();
    for family in PAIRS {
        let name = family.name();
        let entry = &points[name];
        let copula = Copula::with_theta(family, number(&entry["theta"])).unwrap();
        for point in entry["points"].as_array().unwrap() {
            let (u, v) = (number(&point["u"]), number(&point["v"]));
            assert_close(copula.cdf(u, v).unwrap(), number(&point["C"]), u, &format!("{name} C({u}, {v})"));
            assert_close(copula.density(&[u, v]), number(&point["c"]), u, &format!("{name} c({u}, {v})"));
            let h = copula.conditional(v, u).unwrap();
            assert_close(h, number(&point["h_v_given_u"]), u, &format!("{name} h({v} | {u})"));
        }
        for point in entry["hinv"].as_array().unwrap() {
            let (u, w) = (number(&point["u"]), number(&point["w"]));
            let v = copula.conditional_quantile(w, u).unwrap();
            assert_close(v, number(&point["v"]), u, &format!("{name} inverse of h({w} | {u})"));
        }
    }
}

/// Copulas over the whole range of their parameters that a fit or a campaign file may ask for.
fn any_pair() -> impl Strategy<Value = Copula> {
    prop_oneof![
        (-0.99..0.99_f64).prop_map(|rho| Copula::Gaussian { correlation: matrix(rho) }),
        (-9.0..9.0_f64).prop_map(|x| Copula::Plackett { theta: libm::exp(x) }),
        (-80.0..80.0_f64).prop_map(|theta| Copula::Frank { theta }),
        (-12.0..6.0_f64).prop_map(|x| Copula::No16 { theta: libm::exp(x) }),
        (-0.95..0.95_f64, 2.1..60.0_f64).prop_map(|(rho, degrees_of_freedom)| Copula::StudentT {
            correlation: matrix(rho),
            degrees_of_freedom,
        }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// h's error is its own rounding plus the density times an ulp of v.
    #[test]
    fn the_inverse_undoes_the_conditional(copula in any_pair(), u in 1e-9..1.0_f64, w in 1e-9..1.0_f64) {
        let v = copula.conditional_quantile(w, u).unwrap();
        prop_assert!((0.0..=1.0).contains(&v), "{v}");
        let inside = v.clamp(1e-300, 1.0 - f64::EPSILON / 2.0);
        let density = copula.density(&[u, inside]);
        let back = copula.conditional(inside, u).unwrap();
        prop_assert!((back - w).abs() <= 1e-11 + 4.0 * f64::EPSILON * density, "{copula:?} {u} {w}: {v}, {back}");
    }

    /// The conditional is the distribution function's derivative: a central difference over 2e-5 is off by its third
    /// derivative times 1e-10 / 6, and by rounding 1e-16 / 1e-5.
    #[test]
    fn conditional_is_the_derivative_of_the_distribution(
        theta in 0.05..5.0_f64, family in 0_usize..4, u in 0.1..0.9_f64, v in 0.1..0.9_f64,
    ) {
        let theta = if family == 0 { theta / 5.1 - 0.5 } else { theta };
        let copula = Copula::with_theta(PAIRS[family], theta).unwrap();
        let slope = (copula.cdf(u + 1e-5, v).unwrap() - copula.cdf(u - 1e-5, v).unwrap()) / 2e-5;
        prop_assert!((slope - copula.conditional(v, u).unwrap()).abs() < 1e-6);
        let step = (copula.conditional(v + 1e-5, u).unwrap() - copula.conditional(v - 1e-5, u).unwrap()) / 2e-5;
        let density = copula.density(&[u, v]);
        prop_assert!((step - density).abs() < 1e-5 * density.max(1.0), "{copula:?} {u} {v}: {step} {density}");
    }

    /// Tau's inverse is as good as tau itself (1e-12) where the family reaches it.
    #[test]
    fn tau_is_inverted(tau in -0.95..0.95_f64) {
        for family in PAIRS {
            match Copula::of_kendall_tau(family, tau) {
                Some(copula) => prop_assert!((copula.kendall_tau(0, 1) - tau).abs() < 1e-11, "{copula:?}"),
                None => prop_assert!(family == Family::No16 && tau >= 0.333, "{} {tau}", family.name()),
            }
        }
    }
}

/// At the limits of their parameters the families are independent, and nothing cancels on the way there.
#[test]
fn limits_are_independence() {
    for (u, v) in [(0.3, 0.6), (1e-8, 0.9), (0.999, 1e-6)] {
        for step in [0.0, 1e-14, -1e-14, 1e-9, -1e-9] {
            for copula in [Copula::Plackett { theta: 1.0 + step }, Copula::Frank { theta: step }] {
                // To first order the copulas differ from independence by the step times at most one.
                assert!((copula.cdf(u, v).unwrap() - u * v).abs() < 2.0 * step.abs() + 1e-15);
                assert!((copula.conditional(v, u).unwrap() - v).abs() < 2.0 * step.abs() + 1e-15);
                assert!((copula.conditional_quantile(v, u).unwrap() - v).abs() < 2.0 * step.abs() + 1e-15);
                assert!(copula.log_density(&[u, v]).abs() < 4.0 * step.abs() + 1e-15);
            }
        }
    }
    // Tau's slope is 2/9 in ln theta for Plackett, 1/9 for Frank.
    assert!((Copula::Plackett { theta: 1.0 + 1e-6 }.kendall_tau(0, 1) - 2e-6 / 9.0).abs() < 1e-12);
    assert!((Copula::Frank { theta: 1e-6 }.kendall_tau(0, 1) - 1e-6 / 9.0).abs() < 1e-18);
}

/// Strong dependence, where naive forms overflow or cancel: everything stays a number in its range.
#[test]
fn strong_dependence_stays_finite() {
    let strong = [
        Copula::Frank { theta: -500.0 },
        Copula::Frank { theta: 500.0 },
        Copula::Plackett { theta: 1e-9 },
        Copula::Plackett { theta: 1e9 },
        Copula::No16 { theta: 1e-11 },
        Copula::No16 { theta: 0.0 },
        Copula::No16 { theta: 1e6 },
    ];
    let ends = [1.2e-16, 1e-9, 0.3, 0.7, 1.0 - 1e-9, 1.0 - 1.2e-16];
    for copula in &strong {
        for u in ends {
            for v in ends {
                assert!(!copula.log_density(&[u, v]).is_nan(), "{copula:?} {u} {v}");
                for value in [copula.cdf(u, v), copula.conditional(v, u), copula.conditional_quantile(v, u)] {
                    assert!((0.0..=1.0).contains(&value.unwrap()), "{copula:?} {u} {v}: {value:?}");
                }
            }
        }
    }
}

/// Nelsen's 4.2.16 has lower tail dependence 1/2 and none above, whatever its theta.
#[test]
fn no16_has_lower_tail_dependence_only() {
    for theta in [0.0174, 1.0, 30.0] {
        let copula = Copula::No16 { theta };
        assert_eq!(copula.tail_dependence(0, 1), (0.5, 0.0));
        // C(t, t) / t = 1/2 (1 + O(t / theta)).
        assert!((copula.cdf(1e-9, 1e-9).unwrap() / 1e-9 - 0.5).abs() < 1e-6);
        let t = 1.0 - 1e-7;
        let upper = (1.0 - 2.0 * t + copula.cdf(t, t).unwrap()) / 1e-7;
        assert!(upper.abs() < 1e-5, "{upper}");
    }
    // The supremum of tau is 1/3, approached as 2 / (15 theta).
    assert!((Copula::No16 { theta: 1e6 }.kendall_tau(0, 1) - (1.0 / 3.0 - 2e-6 / 15.0)).abs() < 1e-12);
    assert!(Copula::of_kendall_tau(Family::No16, 1.0 / 3.0).is_none());
    // Both sides of the switch between the two forms of tau.
    let (below, above) = (Copula::No16 { theta: 49.999999 }, Copula::No16 { theta: 50.000001 });
    // Tau's expansion is 1/3 - 2 / (15 theta) + 4 / (105 theta^2) - ...
    let slope = 2.0 / 15.0 / 2500.0 - 8.0 / 105.0 / 125_000.0;
    assert!((above.kendall_tau(0, 1) - below.kendall_tau(0, 1) - 2e-6 * slope).abs() < 1e-13);
}

/// With many degrees of freedom the t copula is Gaussian; the difference falls as 1 / nu.
#[test]
fn student_t_tends_to_gaussian() {
    let correlation = vec![vec![1.0, -0.33, -0.01], vec![-0.33, 1.0, -0.26], vec![-0.01, -0.26, 1.0]];
    let gaussian = Copula::Gaussian { correlation: correlation.clone() };
    let u = [0.1, 0.7, 0.95];
    let gap = |degrees_of_freedom: f64| {
        let t = Copula::StudentT { correlation: correlation.clone(), degrees_of_freedom };
        (t.log_density(&u) - gaussian.log_density(&u)).abs()
    };
    assert!(gap(1e3) < 5e-3 && gap(1e4) < 0.11 * gap(1e3), "{} {}", gap(1e3), gap(1e4));
    let pair = Copula::StudentT { correlation: matrix(-0.67), degrees_of_freedom: 1e4 };
    let normal = Copula::Gaussian { correlation: matrix(-0.67) };
    for (u, v) in [(0.3, 0.6), (0.05, 0.05), (0.9, 0.2)] {
        assert!((pair.cdf(u, v).unwrap() - normal.cdf(u, v).unwrap()).abs() < 1e-5);
        assert!((pair.conditional(v, u).unwrap() - normal.conditional(v, u).unwrap()).abs() < 1e-4);
    }
}

/// The bivariate t distribution at its centre is 1/4 + asin(rho) / (2 pi) for any degrees of freedom.
#[test]
fn student_t_quadrant_probability_is_exact() {
    for (rho, nu) in [(-0.67, 3.0), (0.0, 2.5), (0.9, 30.0)] {
        let copula = Copula::StudentT { correlation: matrix(rho), degrees_of_freedom: nu };
        let exact = 0.25 + libm::asin(rho) / std::f64::consts::TAU;
        assert!((copula.cdf(0.5, 0.5).unwrap() - exact).abs() < 1e-13);
    }
}

#[test]
fn parameters_out_of_range_are_refused() {
    let bad = [
        Copula::Independent { dimension: 0 },
        Copula::Plackett { theta: 0.0 },
        Copula::Frank { theta: f64::NAN },
        Copula::No16 { theta: -1.0 },
        Copula::Gaussian { correlation: matrix(1.0) },
        Copula::Gaussian { correlation: vec![vec![1.0, 0.2], vec![0.3, 1.0]] },
        Copula::StudentT { correlation: matrix(0.2), degrees_of_freedom: 2.0 },
    ];
    for copula in bad {
        assert!(copula.check().is_err() && Sampler::new(&copula).is_err(), "{copula:?}");
        assert!(LogDensity::new(&copula).is_err());
    }
}

/// Independent normals become uniforms whose Kolmogorov-Smirnov distance stays below 2.2 / sqrt(n) (chance 1e-4 a test)
/// and whose tau lies within 4.5 standard errors; the standard error of tau is at most sqrt(2 (1 - tau^2) / n)
/// (Gibbons 1993), here rounded up. For Student t every cell is a realisation of its own.
#[test]
fn sampled_uniforms_are_uniform_and_have_the_right_tau() {
    const N: usize = 4000;
    let copulas = [
        Copula::Gaussian { correlation: matrix(-0.67) },
        Copula::Plackett { theta: 0.1055 },
        Copula::Frank { theta: -5.17 },
        Copula::No16 { theta: 0.0174 },
        Copula::StudentT { correlation: matrix(-0.4), degrees_of_freedom: 4.0 },
        Copula::Independent { dimension: 2 },
    ];
    for copula in &copulas {
        let sampler = Sampler::new(copula).unwrap();
        let mut rng = stream(11, 0, Purpose::LatentField(0));
        let mut fields = [vec![0.0; N], vec![0.0; N]];
        for field in &mut fields {
            field.iter_mut().for_each(|z| *z = standard_normal(&mut rng));
        }
        let [first, second] = &mut fields;
        if copula.family() == Family::StudentT {
            for (a, b) in first.chunks_mut(1).zip(second.chunks_mut(1)) {
                let mixing = sampler.mixing(&mut rng);
                sampler.uniforms(&mut [a, b], mixing);
            }
        } else {
            sampler.uniforms(&mut [first, second], 1.0);
        }
        for field in &fields {
            assert!(distance_from_uniform(field) < 2.2 / (N as f64).sqrt(), "{copula:?}");
        }
        let tau = copula.kendall_tau(0, 1);
        let error = (2.0 * (1.0 - tau * tau) / N as f64).sqrt();
        assert!((sample_tau(&fields[0], &fields[1]) - tau).abs() < 4.5 * error, "{copula:?}");
    }
}

/// Three properties: the normal scores' correlations come back within 4.5 standard errors, (1 - rho^2) / sqrt(n).
#[test]
fn three_properties_are_correlated_as_asked() {
    const N: usize = 20_000;
    let correlation = vec![vec![1.0, -0.6, 0.2], vec![-0.6, 1.0, 0.3], vec![0.2, 0.3, 1.0]];
    let sampler = Sampler::new(&Copula::Gaussian { correlation: correlation.clone() }).unwrap();
    let mut rng = stream(12, 0, Purpose::LatentField(0));
    let mut fields: Vec<Vec<f64>> =
        (0..3).map(|_| (0..N).map(|_| standard_normal(&mut rng)).collect()).collect();
    let mut slices: Vec<&mut [f64]> = fields.iter_mut().map(Vec::as_mut_slice).collect();
    sampler.uniforms(&mut slices, 1.0);
    for field in &mut fields {
        field.iter_mut().for_each(|u| *u = runout_core::special::normal_quantile(*u));
    }
    for i in 0..3 {
        for j in 0..i {
            let found = fields[i].iter().zip(&fields[j]).map(|(a, b)| a * b).sum::<f64>() / N as f64;
            // The mean of products of standard normals has variance 1 + rho^2.
            let error = ((1.0 + correlation[i][j] * correlation[i][j]) / N as f64).sqrt();
            assert!((found - correlation[i][j]).abs() < 4.5 * error, "{i} {j}: {found}");
        }
    }
}

/// The same bits on every host and in every build: uniforms feed every realisation, so that a change here changes all
/// campaigns and needs another spec format.
#[test]
fn sampled_bits_never_change() {
    let copulas = [
        Copula::Gaussian { correlation: matrix(-0.67) },
        Copula::Plackett { theta: 0.1055 },
        Copula::Frank { theta: -5.17 },
        Copula::No16 { theta: 0.0174 },
        Copula::StudentT { correlation: matrix(-0.4), degrees_of_freedom: 4.0 },
    ];
    let hashes = copulas.map(|copula| {
        let sampler = Sampler::new(&copula).unwrap();
        let mut rng = stream(3, 1, Purpose::LatentField(0));
        let mixing = sampler.mixing(&mut rng);
        let mut fields = [[0.0; 700], [0.0; 700]];
        fields.iter_mut().flatten().for_each(|z| *z = standard_normal(&mut rng));
        let [first, second] = &mut fields;
        sampler.uniforms(&mut [first, second], mixing);
        bits_hash(fields.iter().flatten())
    });
    assert_eq!(
        hashes,
        [
            0xfd30_56a1_9c6a_0d4e,
            0x9d0f_9a85_bb0b_92a9,
            0xc2ed_68dc_78ff_78f5,
            0x713e_affb_8a61_28a9,
            0xd6c1_14ac_3959_2f16
        ],
        "{hashes:#018x?}"
    );
}

/// The same for the quantile functions that turn uniforms into properties.
#[test]
fn quantile_bits_never_change() {
    let marginals = [
        (marginal::Family::TruncNormal, 11.4, 6.2),
        (marginal::Family::Lognormal, 2.3, 0.5),
        (marginal::Family::TruncGumbel, 7.1, 0.15),
        (marginal::Family::Weibull, 29.0, 5.7),
    ];
    let hashes = marginals.map(|(family, p, q)| {
        let mut values: Vec<f64> = (1..1000).map(|k| f64::from(k) / 1000.0).collect();
        Quantile::new(&Marginal::new(family, p, q).unwrap()).apply(&mut values);
        bits_hash(values.iter())
    });
    assert_eq!(
        hashes,
        [0x9e8e_ba6e_c34c_fe36, 0x1636_01f5_50a4_3b7e, 0xac04_2abd_2d43_fb20, 0x5cf5_88b2_6a4d_c0fa],
        "{hashes:#018x?}"
    );
}

/// The hash of Fowler, Noll and Vo over the bits, one number at a time.
fn bits_hash<'a>(values: impl Iterator<Item = &'a f64>) -> u64 {
    values.fold(0xcbf2_9ce4_8422_2325, |hash, value| (hash ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3))
}

fn distance_from_uniform(sample: &[f64]) -> f64 {
    let mut sorted = sample.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let gap = |(i, u): (usize, &f64)| (u - i as f64 / n).abs().max(((i + 1) as f64 / n - u).abs());
    sorted.iter().enumerate().map(gap).fold(0.0, f64::max)
}

fn sample_tau(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len();
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..i {
            sum += (x[i] - x[j]).signum() * (y[i] - y[j]).signum();
        }
    }
    sum / (0.5 * (n * (n - 1)) as f64)
}
