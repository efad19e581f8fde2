//! The return against an independent solution of the multi-surface problem.
//!
//! The independent solution (Koiter 1953) knows no branch of the update: in principal space there are six
//! Mohr-Coulomb planes, with their own flow, and three tension planes with associated flow; every set of up to
//! three of them is solved for its multipliers, s = s_trial - sum of multiplier times D m with f = 0 on the set,
//! and the admissible stress whose multipliers are all non-negative is the return.

use super::*;

/// Trial stresses a material.
const TRIALS: u64 = 10_000;
/// Round-off of a stress after a 3 x 3 solve whose matrix has a condition of up to 1e4 (phi 1 degree off the apex),
/// over the stresses' size.
const ROUND_OFF: f64 = 1e-10;

/// Deterministic numbers in [0, 1): SplitMix64 (Steele, Lea & Flood 2014).
pub(super) struct Numbers(pub(super) u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A plane of the yield surface: f = n . s - limit, flow direction m.
struct Plane {
    normal: [f64; 3],
    limit: f64,
    flow: [f64; 3],
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Plane {
    fn excess(&self, s: &[f64; 3]) -> f64 {
        dot(&self.normal, s) - self.limit
    }
}

/// The planes: six of Mohr-Coulomb, then up to three that limit tension.
fn planes(elastic: &Constants, soil: &Soil) -> Vec<Plane> {
    let mut all = Vec::new();
    for (a, b) in [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)] {
        let (mut normal, mut flow) = ([0.0; 3], [0.0; 3]);
        (normal[a], normal[b]) = (1.0 + soil.sin_phi, -(1.0 - soil.sin_phi));
        (flow[a], flow[b]) = (1.0 + elastic.sin_psi, -(1.0 - elastic.sin_psi));
        all.push(Plane { normal, limit: 2.0 * soil.cohesion * soil.cos_phi, flow });
    }
    if soil.tension.is_finite() {
        for a in 0..3 {
            let mut normal = [0.0; 3];
            normal[a] = 1.0;
            all.push(Plane { normal, limit: soil.tension, flow: normal });
        }
    }
    all
}

/// D m: Lame's constant times the trace, and twice the shear modulus.
fn stiff(elastic: &Constants, m: &[f64; 3]) -> [f64; 3] {
    let lame = elastic.bulk - 2.0 / 3.0 * elastic.shear;
    let trace = m[0] + m[1] + m[2];
    m.map(|c| lame * trace + 2.0 * elastic.shear * c)
}

/// Solves A x = b of size `n` by elimination with pivoting; none if A is singular.
fn solve(n: usize, mut a: [[f64; 3]; 3], mut b: [f64; 3]) -> Option<[f64; 3]> {
    let size = a.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()))?;
        if a[pivot][k].abs() < 1e-9 * size {
            return None;
        }
        (a[k], a[pivot]) = (a[pivot], a[k]);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            let row = a[k];
            a[i].iter_mut().zip(row).skip(k).take(n - k).for_each(|(below, above)| *below -= factor * above);
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    Some(b)
}

/// The return of principal stresses, and how many planes of Mohr-Coulomb and of tension are active.
fn koiter(elastic: &Constants, planes: &[Plane], s: [f64; 3], scale: f64) -> Option<([f64; 3], [usize; 2])> {
    let admissible = |t: &[f64; 3]| planes.iter().all(|p| p.excess(t) <= ROUND_OFF * scale);
    if admissible(&s) {
        return Some((s, [0, 0]));
    }
    for size in 1..=3_u32 {
        for mask in (1_usize..1 << planes.len()).filter(|m| m.count_ones() == size) {
            let set: Vec<usize> = (0..planes.len()).filter(|k| mask >> k & 1 == 1).collect();
            let flows: Vec<[f64; 3]> = set.iter().map(|&k| stiff(elastic, &planes[k].flow)).collect();
            let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
            for (i, &k) in set.iter().enumerate() {
                b[i] = planes[k].excess(&s);
                for (j, flow) in flows.iter().enumerate() {
                    a[i][j] = dot(&planes[k].normal, flow);
                }
            }
            let Some(multipliers) = solve(set.len(), a, b) else { continue };
            let smallest = -ROUND_OFF * scale / elastic.shear;
            if multipliers[..set.len()].iter().any(|m| *m < smallest) {
                continue;
            }
            let t = std::array::from_fn(|i| {
                s[i] - flows.iter().zip(&multipliers).map(|(f, m)| m * f[i]).sum::<f64>()
            });
            if admissible(&t) {
                let tension = set.iter().filter(|k| **k >= 6).count();
                return Some((t, [set.len() - tension, tension]));
            }
        }
    }
    None
}

/// Friction, dilation (degrees), cohesion, cut-off (Pa).
pub(super) const MATERIALS: [(f64, f64, f64, Option<f64>); 12] = [
    (25.0, 0.0, 10e3, None),
    (25.0, 10.0, 10e3, None),
    (30.0, 30.0, 5e3, None),
    (40.0, 0.0, 0.0, None),
    (35.0, 35.0, 0.0, None),
    (1.0, 0.0, 10e3, None),
    (0.0, 0.0, 20e3, None),
    (0.0, 0.0, 20e3, Some(5e3)),
    (25.0, 0.0, 10e3, Some(0.0)),
    (25.0, 10.0, 10e3, Some(5e3)),
    (30.0, 30.0, 10e3, Some(5e3)),
    (30.0, 0.0, 50e3, Some(20e3)),
];

/// A trial stress: anywhere, on an edge, or along the hydrostatic axis, from 1 to 1000 kPa.
fn trial(numbers: &mut Numbers, k: u64) -> [f64; 3] {
    let size = libm::pow(10.0, numbers.between(3.0, 6.0));
    let mut s = [0.0; 3].map(|_: f64| size * numbers.between(-1.0, 0.5));
    match k % 8 {
        0 => s[1] = s[0],
        1 => s[2] = s[1],
        2 => {
            let near = size * numbers.between(-0.1, 1.0);
            s = s.map(|v| near + 0.01 * v);
        }
        _ => {}
    }
    s
}

/// What one material's returns show.
#[derive(Debug, Default)]
struct Tally {
    elastic: u32,
    plane: u32,
    edge: u32,
    apex: u32,
    /// Planes that limit tension only.
    tension: u32,
    /// Both kinds of planes at once.
    corner: u32,
    /// Trials outside both a Mohr-Coulomb plane and a cut-off.
    outside_both: u32,
    /// Those of them that return elsewhere than the independent solution, and by how much at most, over the size
    /// of its correction and over that of the stresses.
    elsewhere: u32,
    of_correction: f64,
    of_size: f64,
}

impl Tally {
    fn count(&mut self, active: [usize; 2], has_cutoff: bool) {
        let kind = match (active, has_cutoff) {
            ([0, 0], _) => &mut self.elastic,
            ([1, 0], _) => &mut self.plane,
            ([2, 0], _) => &mut self.edge,
            // Without a cut-off of its own the tension planes meet at the apex.
            ([_, _], false) => &mut self.apex,
            ([0, _], true) => &mut self.tension,
            ([_, _], true) => &mut self.corner,
        };
        *kind += 1;
    }
}

fn size(v: [f64; 3]) -> f64 {
    dot(&v, &v).sqrt()
}

fn compare(seed: u64, (phi, psi, cohesion, cutoff): (f64, f64, f64, Option<f64>)) -> Tally {
    let (elastic, soil) = (elastic(100e6, 0.35, psi), Soil::new(cohesion, phi, cutoff));
    let planes = planes(&elastic, &soil);
    let mut numbers = Numbers(seed);
    let mut tally = Tally::default();
    for k in 0..TRIALS {
        let s = trial(&mut numbers, k);
        let scale = s.iter().fold(cohesion, |a, b| a.max(b.abs()));
        let (found, _) = one(&elastic, &soil, [s[0], s[1], s[2], 0.0], [0.0; 3]);
        let found = [found[0], found[1], found[2]];
        let outside = planes.iter().map(|p| p.excess(&found)).fold(f64::MIN, f64::max);
        assert!(outside <= ROUND_OFF * scale, "{s:?} returns to {found:?}, {outside} Pa outside (phi {phi})");
        let Some((expected, active)) = koiter(&elastic, &planes, s, scale) else {
            panic!("no set of planes returns {s:?} (phi {phi}, psi {psi}, c {cohesion}, {cutoff:?})");
        };
        tally.count(active, cutoff.is_some());
        let difference = size(std::array::from_fn(|i| found[i] - expected[i]));
        let beyond = |some: &[Plane]| some.iter().any(|p| p.excess(&s) > 0.0);
        if cutoff.is_some() && beyond(&planes[..6]) && beyond(&planes[6..]) {
            let correction = size(std::array::from_fn(|i| s[i] - expected[i]));
            tally.outside_both += 1;
            tally.elsewhere += u32::from(difference > 10.0 * ROUND_OFF * scale);
            tally.of_correction = tally.of_correction.max(difference / correction);
            tally.of_size = tally.of_size.max(difference / scale);
        } else {
            assert!(
                difference <= 10.0 * ROUND_OFF * scale,
                "{s:?}: {found:?}, not {expected:?} {active:?} (phi {phi}, psi {psi}, c {cohesion}, {cutoff:?})"
            );
        }
    }
    tally
}

/// 120,000 returns, never outside the surface by more than 1e-10 of the stresses' size, and equal to the independent
/// solution, but for trials outside both Mohr-Coulomb and a cut-off of its own: there the update returns to Mohr-Coulomb
/// first and then cuts tension off, which ends on the surface, though elsewhere than the simultaneous return, by less
/// than that return's correction.
#[test]
fn returns_solve_the_multi_surface_problem() {
    for (k, material) in MATERIALS.into_iter().enumerate() {
        let tally = compare(k as u64, material);
        println!("{material:?}: {tally:?}");
        assert!(tally.elastic > 100 && tally.plane + tally.edge > 500, "{material:?}: {tally:?}");
        assert!(tally.of_correction < 1.0, "{material:?}: {tally:?}");
        assert!(
            material.3.is_none() || tally.tension.min(tally.outside_both) > 100,
            "{material:?}: {tally:?}"
        );
    }
}

/// Largest difference from the independent solution over a strain path along xx and yy in `steps` steps, over the
/// elastic stress of one step: both start without stress and take every increment as it comes.
fn along_a_path(material: (f64, f64, f64, Option<f64>), strain: [f64; 2], steps: u32) -> f64 {
    let (phi, psi, cohesion, cutoff) = material;
    let (elastic, soil) = (elastic(100e6, 0.35, psi), Soil::new(cohesion, phi, cutoff));
    let planes = planes(&elastic, &soil);
    let [xx, yy] = strain.map(|e| e / f64::from(steps));
    let predictor = stiff(&elastic, &[xx, yy, 0.0]);
    let (mut found, mut expected) = ([0.0; 4], [0.0; 3]);
    let mut largest = 0.0_f64;
    for _ in 0..steps {
        (found, _) = one(&elastic, &soil, found, [xx, yy, 0.0]);
        let trial: [f64; 3] = std::array::from_fn(|i| expected[i] + predictor[i]);
        let scale = trial.iter().fold(cohesion, |a, b| a.max(b.abs()));
        (expected, _) = koiter(&elastic, &planes, trial, scale).expect("some set returns it");
        let difference = size([found[0] - expected[0], found[1] - expected[1], found[2] - expected[2]]);
        largest = largest.max(difference / size(predictor));
    }
    largest
}

/// Return to Mohr-Coulomb, then cut-off, is a splitting: along a path that leads past the corner of both, its
/// difference from the simultaneous return stays below the elastic stress of one increment, however many there are,
/// so that it vanishes with the increment in the first order.
#[test]
fn the_cut_off_after_the_return_converges_with_the_increment() {
    let path = [2e-3, -2.2e-3];
    for material in [(25.0, 0.0, 10e3, Some(1e3)), (30.0, 10.0, 10e3, Some(5e3)), (0.0, 0.0, 20e3, Some(5e3))]
    {
        let differences = [10, 100, 1000, 10_000].map(|steps| along_a_path(material, path, steps));
        assert!(differences.iter().all(|d| *d < 1.0), "{material:?}: {differences:?}");
        assert!(differences[0] > 0.01, "the path does not meet the corner: {material:?}: {differences:?}");
    }
}
