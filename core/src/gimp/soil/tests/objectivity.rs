//! The update does not depend on the axes, and a spin turns the stress.

use super::koiter::{MATERIALS, Numbers};
use super::*;

/// The tensor xx, yy, xy turned by an angle.
fn turned([xx, yy, xy]: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = libm::sincos(angle);
    [
        xx * cos * cos + yy * sin * sin - 2.0 * xy * sin * cos,
        xx * sin * sin + yy * cos * cos + 2.0 * xy * sin * cos,
        (xx - yy) * sin * cos + xy * (cos * cos - sin * sin),
    ]
}

/// One update with a displacement gradient xx, xy, yx, yy; returns xx, yy, zz, xy.
fn updated(elastic: &Constants, soil: &Soil, stress: [f64; 4], gradient: [f64; 4]) -> [f64; 4] {
    let s = Baseline::splat;
    let [xx, yy, zz, xy] = stress.map(s);
    let [l_xx, l_xy, l_yx, l_yy] = gradient;
    let increment =
        Increment { xx: s(l_xx), xy: s(l_xy), yx: s(l_yx), yy: s(l_yy), volumetric: s(l_xx + l_yy) };
    let (new, _) = update(&elastic.lanes(), &soil.lanes(), Stress { xx, yy, zz, xy }, &increment);
    [first(new.xx), first(new.yy), first(new.zz), first(new.xy)]
}

/// Turned axes: the stress that comes of a turned stress and a turned displacement gradient, spin included, is
/// the turned stress; to 1e-12 of the stresses' size.
#[test]
fn the_update_is_the_same_in_turned_axes() {
    let mut numbers = Numbers(7);
    for (phi, psi, cohesion, cutoff) in MATERIALS {
        let (elastic, soil) = (elastic(100e6, 0.35, psi), Soil::new(cohesion, phi, cutoff));
        for _ in 0..2000 {
            let mut number = |size: f64| size * numbers.between(-1.0, 1.0);
            let (xx, yy, zz, xy) = (number(2e5) - 1e5, number(2e5) - 1e5, number(2e5) - 1e5, number(1e5));
            // Strain (symmetric) and spin (skew) parts of the gradient.
            let (e_xx, e_yy, e_xy, spin) = (number(2e-3), number(2e-3), number(2e-3), number(1e-2));
            let angle = number(3.0);
            let gradient = |[a, b, c]: [f64; 3]| [a, c - spin, c + spin, b];
            let straight = updated(&elastic, &soil, [xx, yy, zz, xy], gradient([e_xx, e_yy, e_xy]));
            let [t_xx, t_yy, t_xy] = turned([xx, yy, xy], angle);
            let there =
                updated(&elastic, &soil, [t_xx, t_yy, zz, t_xy], gradient(turned([e_xx, e_yy, e_xy], angle)));
            let expected = turned([straight[0], straight[1], straight[3]], angle);
            let scale = 1e6;
            for (found, expected) in [there[0], there[1], there[3]].iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12 * scale, "{there:?} {expected:?}");
            }
            assert!((there[2] - straight[2]).abs() < 1e-12 * scale);
        }
    }
}

/// A spin alone turns an admissible stress by the Cayley angle, 2 atan(spin / 2), and leaves its principal values.
#[test]
fn a_spin_turns_the_stress() {
    let (elastic, soil) = (elastic(100e6, 0.35, 0.0), Soil::new(20e3, 30.0, None));
    let stress = [-100e3, -60e3, -70e3, 15e3];
    for spin in [1e-6, 1e-3, 0.1, 1.0] {
        let found = updated(&elastic, &soil, stress, [0.0, -spin, spin, 0.0]);
        let angle = 2.0 * libm::atan(0.5 * spin);
        let expected = turned([stress[0], stress[1], stress[3]], angle);
        for (found, expected) in [found[0], found[1], found[3]].iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12 * 100e3, "{found} {expected}");
        }
        assert_eq!(found[2], stress[2]);
    }
}
