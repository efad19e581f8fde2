use campaign::*;
use gimp::Kernel;
use realisation::*;
use runout_core::*;
use std::time::Instant;
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<&str> = s.rsplit(')').next().unwrap().split_whitespace().collect();
    (f[11].parse::<f64>().unwrap()) / 100.0
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let get = |k: &str| a.iter().find_map(|s| s.strip_prefix(&format!("{k}=")).map(|v| v.to_string()));
    let num = |k: &str, d: f64| get(k).map(|v| v.parse().unwrap()).unwrap_or(d);
    let text = std::fs::read_to_string("campaigns/elkhorn-river/campaign.toml").unwrap();
    let c = campaign::parse(&text).unwrap();
    let mut m = c.model;
    m.soil.cohesion_pa = Some(num("c", 11.41) * 1e3);
    m.soil.friction_angle_rad = Some(num("phi", 21.14).to_radians());
    m.soil.unit_weight_n_m3 = Some(num("gamma", 20.0) * 1e3);
    m.mesh.cell_size_m = num("h", 0.4);
    m.slope.runout_plain_m = num("plain", 20.0);
    m.soil.dilation_angle_rad = num("psi", 0.0).to_radians();
    m.analysis.formulation =
        if num("two", 0.0) > 0.0 { Formulation::TwoPhase } else { Formulation::OnePhase };
    m.analysis.volumetric_strain =
        if num("bbar", 0.0) > 0.0 { VolumetricStrain::CellAverage } else { VolumetricStrain::Point };
    m.analysis.local_damping = num("alpha", 0.0);
    m.analysis.pic_rate_per_s = num("pic", 0.0);
    m.analysis.pressure_relaxation_rate_per_s = num("relax", 300.0);
    m.analysis.courant_number = num("cfl", 0.8);
    m.analysis.duration_s = num("t", 10.0);
    m.analysis.gravity_stage_s = num("tg", 1.5);
    m.analysis.stop_at_rest = num("rest", 0.0) > 0.0;
    m.water.cavitation_suction_pa = num("cav", 1e9);
    m.water.bulk_modulus_pa = num("kw", 4e8);
    if num("hyd", 0.0) > 0.0 {
        m.water.initial_pore_pressure = InitialPorePressure::Hydrostatic(WaterTable::GroundSurface);
    }
    if num("closed", 0.0) > 0.0 {
        m.water.ground_surface = GroundSurface::Closed;
    }
    let spec = spec::Spec {
        format: 1,
        seed: 1,
        random: vec![],
        copula: copula::Copula::Independent { dimension: 0 },
        model: m,
    };
    let k = Kernel::from_name(&get("kernel").unwrap_or("avx512".into())).unwrap();
    let p = Prepared::new(spec, k).unwrap();
    let prog = Progress::default();
    let every = num("every", f64::INFINITY);
    let (t0, c0) = (Instant::now(), cpu());
    let o = p
        .analyse(
            Source::Deterministic,
            every,
            &mut |s| {
                let u = s.ux.iter().zip(s.uy).map(|(a, b)| a.hypot(*b)).fold(0.0, f64::max);
                let v = s.state.vx.iter().zip(&s.state.vy).map(|(a, b)| a.hypot(*b)).fold(0.0, f64::max);
                let pm = s.state.pressure.iter().cloned().fold(f64::MIN, f64::max);
                let pn = s.state.pressure.iter().cloned().fold(f64::MAX, f64::min);
                let syy = s.state.stress_yy.iter().cloned().fold(f64::MAX, f64::min);
                println!("t {:.3} umax {u:.4} vmax {v:.4} p {pn:.3e} {pm:.3e} syy {syy:.3e}", s.time_s);
            },
            &prog,
        )
        .unwrap();
    let c1 = cpu() - c0;
    println!("{:?} {:?} {:#?}", o.outcome, o.reason, o.measures);
    println!(
        "steps {} (with gravity {}) t {} dt {:.3e} wall {:.2} cpu {:.2} Mpu/s(cpu) {:.2} digest {}",
        o.steps,
        prog.steps(),
        o.simulated_s,
        o.simulated_s / o.steps as f64,
        t0.elapsed().as_secs_f64(),
        c1,
        prog.steps() as f64 * o.points as f64 / c1 / 1e6,
        o.digest
    );
}
