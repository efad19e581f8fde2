//! The soil: rotation, linear elasticity, and the return to Mohr-Coulomb's pyramid and Rankine's cut-off in principal
//! stresses, tension positive, sigma_zz one of the three.
//!
//! Every return subtracts D n, D the elastic stiffness and n the flow of the planes that are active, so that they are met
//! exactly: one plane, two planes (an edge), or the apex.

use runout_core::gimp::Material;

/// Elastic constants.
#[derive(Debug, Clone, Copy)]
pub struct Elastic {
    bulk: f64,
    shear: f64,
}

/// Strength and dilation of a point.
#[derive(Debug, Clone, Copy)]
pub struct Strength {
    cohesion: f64,
    friction_angle: f64,
    sin_psi: f64,
    /// Largest tensile principal stress, Pa.
    tension: f64,
}

/// How a stress was returned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Return {
    Elastic,
    Plane,
    /// Edge of the two larger stresses.
    RightEdge,
    /// Edge of the two smaller stresses.
    LeftEdge,
    Apex,
    /// By the tension cut-off, whatever came before.
    Tension,
}

/// A returned stress.
pub struct Returned {
    pub stress: [f64; 4],
    pub plastic_strain: f64,
    pub kind: Return,
}

impl Strength {
    /// Strength of a point with these peak values of which `left`, from 1 to 0, is left over the residual ones; none of an
    /// elastic material, whose cohesion is infinite.
    pub fn new(material: &Material, cohesion: f64, friction_angle: f64, left: f64) -> Option<Strength> {
        let residual = material.softening.map_or([1.0; 3], |s| {
            [s.residual_cohesion, s.residual_friction_angle, s.residual_dilation_angle]
        });
        let peak = [cohesion, friction_angle, material.dilation_angle_rad];
        let [cohesion_now, friction_angle, dilation_angle] =
            [0, 1, 2].map(|i| residual[i] * peak[i] + (peak[i] - residual[i] * peak[i]) * left);
        let sin_psi = libm::sin(dilation_angle);
        let strength = Strength { cohesion: cohesion_now, friction_angle, sin_psi, tension: 0.0 };
        let tension = material.tension_cutoff_pa.unwrap_or(f64::INFINITY).min(strength.apex());
        cohesion.is_finite().then_some(Strength { tension, ..strength })
    }

    /// c cot phi, where all three stresses meet; there is no such place without friction.
    fn apex(&self) -> f64 {
        if self.friction_angle > 0.0 { self.cohesion / libm::tan(self.friction_angle) } else { f64::INFINITY }
    }

    /// f = (a - b) + (a + b) sin phi - 2 c cos phi of two principal stresses a >= b.
    fn excess(&self, a: f64, b: f64) -> f64 {
        let (sin, cos) = libm::sincos(self.friction_angle);
        (a - b) + (a + b) * sin - 2.0 * self.cohesion * cos
    }

    /// Derivative of f along a change of the principal stresses, for the plane of stresses i and j.
    fn slope(&self, (i, j): (usize, usize), change: [f64; 3]) -> f64 {
        let sin = libm::sin(self.friction_angle);
        (1.0 + sin) * change[i] - (1.0 - sin) * change[j]
    }
}

impl Elastic {
    pub fn new(material: &Material) -> Elastic {
        let (e, nu) = (material.youngs_modulus_pa, material.poissons_ratio);
        Elastic { bulk: e / (3.0 * (1.0 - 2.0 * nu)), shear: e / (2.0 * (1.0 + nu)) }
    }

    /// Stress after the step's rotation and its elastic strain. `volumetric` takes the place of the strain's own
    /// volumetric part.
    pub fn predict(&self, stress: [f64; 4], gradient: [[f64; 2]; 2], volumetric: f64) -> [f64; 4] {
        let [xx, yy, zz, xy] = rotate(stress, 0.5 * (gradient[1][0] - gradient[0][1]));
        let mean = (gradient[0][0] + gradient[1][1]) / 3.0;
        let pressure = self.bulk * volumetric;
        [
            xx + 2.0 * self.shear * (gradient[0][0] - mean) + pressure,
            yy + 2.0 * self.shear * (gradient[1][1] - mean) + pressure,
            zz - 2.0 * self.shear * mean + pressure,
            xy + self.shear * (gradient[0][1] + gradient[1][0]),
        ]
    }

    /// The admissible stress for an elastic one.
    pub fn return_to_surface(&self, strength: Option<&Strength>, trial: [f64; 4]) -> Returned {
        let elastic = Returned { stress: trial, plastic_strain: 0.0, kind: Return::Elastic };
        let Some(strength) = strength else { return elastic };
        let [xx, yy, zz, xy] = trial;
        // Principal stresses in the plane, and the direction of the larger one.
        let angle = 0.5 * libm::atan2(2.0 * xy, xx - yy);
        let (sin, cos) = libm::sincos(angle);
        let major = xx * cos * cos + yy * sin * sin + 2.0 * xy * sin * cos;
        let minor = xx * sin * sin + yy * cos * cos - 2.0 * xy * sin * cos;
        // Sorted from the largest; where each belongs is kept: 0 major, 1 minor, 2 zz.
        let mut sorted = [(major, 0), (minor, 1), (zz, 2)];
        sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
        let s = sorted.map(|(value, _)| value);
        if strength.excess(s[0], s[2]) <= 0.0 && s[0] <= strength.tension {
            return elastic;
        }
        let (t, mut kind) = self.mohr_coulomb(strength, s);
        let cut = self.rankine(strength.tension, t);
        if t[0] > strength.tension {
            kind = Return::Tension;
        }
        let mut new = [0.0; 3];
        for ((_, place), value) in sorted.into_iter().zip(cut) {
            new[place] = value;
        }
        let [major, minor, zz] = new;
        Returned {
            stress: [
                major * cos * cos + minor * sin * sin,
                major * sin * sin + minor * cos * cos,
                zz,
                (major - minor) * sin * cos,
            ],
            plastic_strain: self.plastic_strain(s, cut),
            kind,
        }
    }

    /// D n for a flow n along the principal stresses.
    fn stiffness(&self, n: [f64; 3]) -> [f64; 3] {
        let lame = self.bulk - 2.0 / 3.0 * self.shear;
        n.map(|component| lame * (n[0] + n[1] + n[2]) + 2.0 * self.shear * component)
    }

    /// Change of the principal stresses by the flow of the plane of stresses i and j.
    fn flow(&self, strength: &Strength, (i, j): (usize, usize)) -> [f64; 3] {
        let mut n = [0.0; 3];
        n[i] = 1.0 + strength.sin_psi;
        n[j] = -(1.0 - strength.sin_psi);
        self.stiffness(n)
    }

    /// The plane of the largest and the smallest stress; if the order of the stresses breaks, the edge between it and the
    /// plane on that side; if it breaks there as well, the apex.
    fn mohr_coulomb(&self, strength: &Strength, s: [f64; 3]) -> ([f64; 3], Return) {
        const MAIN: (usize, usize) = (0, 2);
        let main = strength.excess(s[0], s[2]);
        if main <= 0.0 {
            return (s, Return::Elastic);
        }
        let r = self.flow(strength, MAIN);
        let plane = less(s, main / strength.slope(MAIN, r), r);
        if plane[0] >= plane[1] && plane[1] >= plane[2] {
            return (plane, Return::Plane);
        }
        let (side, kind) =
            if plane[1] > plane[0] { ((1, 2), Return::RightEdge) } else { ((0, 1), Return::LeftEdge) };
        // Both planes are met: [f_main; f_side] = A [x; y] with A the slopes of both along both flows.
        let q = self.flow(strength, side);
        let a = [
            [strength.slope(MAIN, r), strength.slope(MAIN, q)],
            [strength.slope(side, r), strength.slope(side, q)],
        ];
        let f = [main, strength.excess(s[side.0], s[side.1])];
        let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
        let x = (f[0] * a[1][1] - f[1] * a[0][1]) / determinant;
        let y = (a[0][0] * f[1] - a[1][0] * f[0]) / determinant;
        let edge = less(less(s, x, r), y, q);
        if edge[0] >= edge[2] {
            return (edge, kind);
        }
        let mean = (s[0] + s[1] + s[2]) / 3.0;
        ([strength.apex().min(mean); 3], Return::Apex)
    }

    /// Associated return to the cut-off: flows (1, 0, 0), then (0, 1, 0) too, then all three stresses at the limit.
    fn rankine(&self, limit: f64, t: [f64; 3]) -> [f64; 3] {
        if t[0] <= limit {
            return t;
        }
        let first = self.stiffness([1.0, 0.0, 0.0]);
        let one = less(t, (t[0] - limit) / first[0], first);
        if one[1] <= limit {
            return one;
        }
        // By symmetry the two flows together: (f + g) of both planes over the sum of a row.
        let second = self.stiffness([0.0, 1.0, 0.0]);
        let both = (t[0] - limit + t[1] - limit) / (first[0] + first[1]);
        let two = t[2] - both * second[2];
        if two <= limit { [limit, limit, two] } else { [limit; 3] }
    }

    /// sqrt(2/3 e:e) of the plastic strain e, the deviatoric part of (s - t) over 2 G.
    fn plastic_strain(&self, s: [f64; 3], t: [f64; 3]) -> f64 {
        let mean = (s[0] - t[0] + s[1] - t[1] + s[2] - t[2]) / 3.0;
        let square: f64 = (0..3)
            .map(|i| {
                let e = (s[i] - t[i] - mean) / (2.0 * self.shear);
                e * e
            })
            .sum();
        (2.0 / 3.0 * square).sqrt()
    }
}

/// `s` less `x` times `r`.
fn less(s: [f64; 3], x: f64, r: [f64; 3]) -> [f64; 3] {
    [s[0] - x * r[0], s[1] - x * r[1], s[2] - x * r[2]]
}

/// R sigma R^T with the rotation R = (1 - W / 2)^-1 (1 + W / 2) of the spin W = [0, -w; w, 0] (Hughes & Winget 1980).
fn rotate([xx, yy, zz, xy]: [f64; 4], w: f64) -> [f64; 4] {
    let half = 0.5 * w;
    let (cos, sin) = ((1.0 - half * half) / (1.0 + half * half), 2.0 * half / (1.0 + half * half));
    [
        cos * cos * xx - 2.0 * sin * cos * xy + sin * sin * yy,
        sin * sin * xx + 2.0 * sin * cos * xy + cos * cos * yy,
        zz,
        sin * cos * (xx - yy) + (cos * cos - sin * sin) * xy,
    ]
}
