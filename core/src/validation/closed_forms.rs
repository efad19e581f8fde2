//! Series solutions of one-dimensional consolidation (Terzaghi & Froehlich 1936; Taylor 1948).
//!
//! Depth Z is over the drainage path H, time Tv = c_v t / H^2; the base is impervious, the top drained.

use std::f64::consts::PI;

/// Terms of the series: the next one is below 1e-16 for Tv from 0.005.
const TERMS: u32 = 60;

/// M = (2 m + 1) pi / 2, with the sign of (-1)^m.
fn terms() -> impl Iterator<Item = (f64, f64)> {
    (0..TERMS).map(|m| (f64::from(2 * m + 1) * PI / 2.0, if m % 2 == 0 { 1.0 } else { -1.0 }))
}

/// Excess pore pressure over its uniform initial value: sum of 2 / M sin(M Z) exp(-M^2 Tv).
pub(super) fn uniform_excess(z: f64, time_factor: f64) -> f64 {
    terms().map(|(m, _)| 2.0 / m * libm::sin(m * z) * libm::exp(-m * m * time_factor)).sum()
}

/// Degree of consolidation after a uniform initial excess: 1 - sum of 2 / M^2 exp(-M^2 Tv).
pub(super) fn uniform_degree(time_factor: f64) -> f64 {
    1.0 - terms().map(|(m, _)| 2.0 / (m * m) * libm::exp(-m * m * time_factor)).sum::<f64>()
}

/// Excess pore pressure over gamma' H, from gamma' times the depth at the start:
/// sum of 2 (-1)^m / M^2 sin(M Z) exp(-M^2 Tv).
pub(super) fn triangular_excess(z: f64, time_factor: f64) -> f64 {
    terms().map(|(m, sign)| sign * 2.0 / (m * m) * libm::sin(m * z) * libm::exp(-m * m * time_factor)).sum()
}

/// Degree of consolidation under self-weight: 1 - sum of 4 (-1)^m / M^3 exp(-M^2 Tv).
pub(super) fn triangular_degree(time_factor: f64) -> f64 {
    1.0 - terms().map(|(m, sign)| sign * 4.0 / (m * m * m) * libm::exp(-m * m * time_factor)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    /// Against tables computed elsewhere (six digits).
    #[test]
    fn series_agree_with_the_tables() {
        let tables: Value = serde_json::from_str(include_str!("../../tests/data/physics.json")).unwrap();
        type Form = (&'static str, fn(f64, f64) -> f64, fn(f64) -> f64);
        let forms: [Form; 2] = [
            ("terzaghi", uniform_excess, uniform_degree),
            ("self_weight_consolidation", triangular_excess, triangular_degree),
        ];
        for (name, excess, degree) in forms {
            let table = &tables[name];
            let depths: Vec<f64> =
                table["Z"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
            for (time_factor, values) in table["isochrones"].as_object().unwrap() {
                let time_factor: f64 = time_factor.parse().unwrap();
                if time_factor < 0.005 {
                    continue;
                }
                for (z, value) in depths.iter().zip(values.as_array().unwrap()) {
                    assert!(
                        (excess(*z, time_factor) - value.as_f64().unwrap()).abs() < 1e-6,
                        "{name} {z} {time_factor}"
                    );
                }
            }
            for (time_factor, value) in table["U"].as_object().unwrap() {
                let found = degree(time_factor.parse().unwrap());
                assert!((found - value.as_f64().unwrap()).abs() < 1e-6, "{name} {time_factor}");
            }
        }
    }
}
