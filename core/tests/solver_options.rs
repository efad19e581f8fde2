//! What the solver can do besides the plain scheme, each against a closed form: decay of velocities, friction under pore
//! pressure, obstacles, free and held water, external forces, softening, stretched domains, XPIC, and the balance of
//! energy in all of them.

mod bodies;

use bodies::{filled, setup};
use runout_core::campaign::{Formulation, PointDomain, VelocityFilter, VolumetricStrain};
use runout_core::gimp::{Body, Grid, InitialPoints, Kernel, Obstacle, Setup, Softening, Support};

fn run_to(body: &mut Body, end_s: f64) {
    while body.time_s() < end_s {
        let dt = body.stable_step_s().min(end_s - body.time_s());
        body.step(dt);
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// A block of 4 by 4 cells on the bottom wall or above it, sides open.
fn block(h: f64, left: f64, bottom: f64, density: f64) -> Setup {
    let points = InitialPoints::at_rest(&filled(left, bottom, 4, 4, h), 0.25 * h * h, density);
    let mut setup = setup(Grid::enclosing(0.0, 0.0, [60, 12], h), 1e7, 0.0, points);
    setup.conditions.left = Support::Open;
    setup.conditions.bottom = Support::Open;
    setup
}

/// A flying block slows down as exp(-rate t), whatever the time step; what it loses is the energy the damping took.
#[test]
fn velocities_decay_at_the_rate_whatever_the_step() {
    for formulation in [Formulation::OnePhase, Formulation::TwoPhase] {
        for courant in [0.8, 0.1] {
            let mut setup = block(0.5, 2.0, 2.0, 2000.0);
            setup.points.velocity = vec![[3.0, 0.0]; setup.points.len()];
            setup.controls.formulation = formulation;
            setup.controls.courant_number = courant;
            setup.controls.damping_rate_per_s = 2.0;
            let mut body = Body::new(setup, Kernel::best()).unwrap();
            run_to(&mut body, 0.5);
            let state = body.state();
            let expected = 3.0 * libm::exp(-1.0);
            assert!(state.vx.iter().all(|v| (v / expected - 1.0).abs() < 1e-9), "{formulation:?} {courant}");
            let energy = body.energy();
            let lost = 0.5 * body.total_mass() * (9.0 - expected * expected);
            assert!((energy.damping_j / lost - 1.0).abs() < 1e-9, "{energy:?}");
            assert!(energy.drift().abs() < 1e-9, "{energy:?}");
        }
    }
}

/// A saturated block slides down a plane with pore pressure hydrostatic across it: friction sees the effective stress, so
/// a = g sin t - mu (rho_sat - rho_w) / rho_sat g cos t. Tolerance 1 % as for the dry block (B4).
#[test]
fn friction_sees_the_effective_stress() {
    let (angle, coefficient, h) = (30.0_f64.to_radians(), 0.3, 0.25);
    let density = 0.7 * 2650.0 + 0.3 * 1000.0;
    let mut setup = block(h, 1.0, 0.0, density);
    let (along, across) = (9.81 * libm::sin(angle), 9.81 * libm::cos(angle));
    setup.conditions.bottom = Support::Friction(coefficient);
    setup.conditions.gravity_m_s2 = [along, -across];
    setup.controls.formulation = Formulation::TwoPhase;
    // The pore pressure stays as it is: stiff skeleton, soft water, little flow. And the block does not ring.
    setup.materials[0].youngs_modulus_pa = 1e9;
    setup.fluid.bulk_modulus_pa = 2e6;
    setup.materials[0].permeability_m_s = 1e-7;
    setup.controls.pic_rate_per_s = 300.0;
    for i in 0..setup.points.len() {
        let depth = 4.0 * h - setup.points.y[i];
        setup.points.pressure[i] = 1000.0 * across * depth;
        // The free sides carry no total stress.
        let pressure = setup.points.pressure[i];
        setup.points.stress[i] = [pressure, -(density - 1000.0) * across * depth, 0.0, 0.0];
    }
    let mut body = Body::new(setup, Kernel::best()).unwrap();
    run_to(&mut body, 0.2);
    let early = mean(&body.state().vx);
    run_to(&mut body, 0.8);
    let found = (mean(&body.state().vx) - early) / 0.6;
    let expected = along - coefficient * across * (density - 1000.0) / density;
    assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    let energy = body.energy();
    assert!(energy.contact_j > 0.0 && energy.drift().abs() < 0.02, "{energy:?}");
}

/// A block that slides without friction hits a frictional wall: it stays in front of it, leaves no tension behind, and all
/// of its energy is accounted for.
#[test]
fn an_obstacle_stops_what_hits_it() {
    for support in [Support::Fixed, Support::Friction(0.3)] {
        let h = 0.25;
        let mut setup = block(h, 1.0, 0.0, 2000.0);
        setup.conditions.bottom = Support::Roller;
        setup.points.velocity = vec![[2.0, 0.0]; setup.points.len()];
        setup.obstacles = vec![Obstacle { x_m: [5.0, 6.0], y_m: [0.0, 2.0], support }];
        let mut body = Body::new(setup, Kernel::best()).unwrap();
        let mut furthest = 0.0_f64;
        while body.time_s() < 3.0 {
            let dt = body.stable_step_s();
            body.step(dt);
            furthest = body.positions().iter().map(|p| p[0]).fold(furthest, f64::max);
        }
        // Contact through the grid begins within one cell and the point's own half-length of the wall.
        assert!(furthest < 5.0 && furthest > 5.0 - 1.5 * h, "{support:?}: {furthest}");
        assert!(body.energy().drift().abs() < 0.05, "{support:?}: {:?}", body.energy());
        if support != Support::Fixed {
            assert!(mean(&body.state().vx) < 0.0, "a frictional wall cannot hold the block back");
        }
    }
}

/// A saturated column with a roller at every side but the top.
fn column(cells: usize, h: f64) -> Setup {
    let density = 0.7 * 2650.0 + 0.3 * 1000.0;
    let points = InitialPoints::at_rest(&filled(0.0, 0.0, 1, cells, h), 0.25 * h * h, density);
    let mut setup = setup(Grid::enclosing(0.0, 0.0, [1, cells + 4], h), 10e6, 0.0, points);
    setup.conditions.right = Support::Roller;
    setup.conditions.gravity_m_s2 = [0.0, -9.81];
    setup.controls.formulation = Formulation::TwoPhase;
    setup.controls.volumetric_strain = VolumetricStrain::CellAverage;
    setup.controls.pressure_relaxation_rate_per_s = 300.0;
    setup.controls.local_damping = 0.05;
    setup
}

fn largest_move(body: &Body) -> f64 {
    let start = &body.setup().points;
    let moves = body.positions().into_iter().enumerate();
    moves.map(|(i, p)| (p[0] - start.x[i]).abs().max((p[1] - start.y[i]).abs())).fold(0.0, f64::max)
}

/// Soil under standing water, in equilibrium with it, stays where it is: 1e-6 m in half a second, also with the surface
/// inside a row of points and with pressure relaxation. A level inside the soil leaves the part above to its full weight.
#[test]
fn soil_under_standing_water_rests() {
    let (cells, h) = (20, 0.1);
    for level in [2.0, 5.0, 1.23] {
        let mut setup = column(cells, h);
        setup.conditions.free_water_level_m = Some(level);
        let (density, half) = (setup.points.density[0], 0.25 * h);
        for i in 0..setup.points.len() {
            let y = setup.points.y[i];
            // Above the level the soil is held together by capillary water.
            setup.points.water_held[i] = y > level;
            // Pressure and weight above, averaged over the point that straddles the level.
            let depth = level - y;
            let wet = ((depth + half) / (2.0 * half)).clamp(0.0, 1.0);
            let mean_depth = if wet >= 1.0 { depth } else { wet * wet * half };
            let dry_above = (2.0 - level.max(y)).max(0.0) * density * 9.81;
            let wet_above = (level.min(2.0) - y).max(0.0) * (density - 1000.0) * 9.81;
            setup.points.pressure[i] = 9810.0 * mean_depth;
            setup.points.stress[i] = [0.0, -(dry_above + wet_above), 0.0, 0.0];
        }
        let mut body = Body::new(setup, Kernel::best()).unwrap();
        run_to(&mut body, 0.5);
        // Where the level cuts a row of points the stress of that row is a mean: a share of h^2 / 32 of the change of
        // slope, over the modulus, times the few cells it spreads over.
        let limit = if level < 2.0 { 2e-5 } else { 1e-6 };
        assert!(largest_move(&body) < limit, "level {level}: {}", largest_move(&body));
    }
}

/// Water that the skeleton holds does not sink: a column without pore pressure, held, stays at rest without any; the same
/// column with free water settles nothing either (the weight of the whole is the same), but its pressure rises.
#[test]
fn held_water_does_not_sink() {
    for held in [true, false] {
        let mut setup = column(20, 0.1);
        setup.points.water_held = vec![held; setup.points.len()];
        let density = setup.points.density[0];
        for i in 0..setup.points.len() {
            setup.points.stress[i] = [0.0, -density * 9.81 * (2.0 - setup.points.y[i]), 0.0, 0.0];
        }
        let mut body = Body::new(setup, Kernel::best()).unwrap();
        run_to(&mut body, 0.5);
        let highest = body.state().pressure.iter().copied().fold(0.0, f64::max);
        if held {
            assert!(largest_move(&body) < 1e-6 && highest < 20.0, "{highest} Pa {}", largest_move(&body));
        } else {
            assert!(highest > 2000.0, "{highest} Pa");
        }
    }
}

/// Two permeabilities and a mixture of held and free water take the point-by-point path: with equal values on both paths
/// the results agree to what round-off grows to.
#[test]
fn loads_of_points_agree_with_the_constants() {
    let run = |by_point: bool| {
        let mut setup = column(20, 0.1);
        for i in 0..setup.points.len() {
            setup.points.pressure[i] = 2155.0 * 9.81 * (2.0 - setup.points.y[i]);
        }
        if by_point {
            // A force that is nothing but not zero switches the path.
            setup.points.force[0] = [1e-300, 0.0];
        }
        let mut body = Body::new(setup, Kernel::best()).unwrap();
        run_to(&mut body, 0.1);
        body.state()
    };
    let (plain, loaded) = (run(false), run(true));
    for (a, b) in plain.pressure.iter().zip(&loaded.pressure) {
        assert!((a - b).abs() < 1e-6 * 40e3, "{a} {b}");
    }
}

/// An external force on the top row of an elastic column compresses what lies below it: q y / E at half its height.
#[test]
fn an_external_force_compresses_a_column() {
    let (cells, h, load) = (20, 0.1, 1e3);
    let points = InitialPoints::at_rest(&filled(0.0, 0.0, 1, cells, h), 0.25 * h * h, 2000.0);
    let mut setup = setup(Grid::enclosing(0.0, 0.0, [1, cells + 2], h), 10e6, 0.0, points);
    setup.conditions.right = Support::Roller;
    setup.controls.local_damping = 0.7;
    let count = setup.points.len();
    for i in count - 2..count {
        setup.points.force[i] = [0.0, -load * h / 2.0];
    }
    let start = setup.points.y.clone();
    let mut body = Body::new(setup, Kernel::best()).unwrap();
    body.set_load_share(0.5);
    run_to(&mut body, 1.0);
    body.set_load_share(1.0);
    run_to(&mut body, 3.0);
    let middle = count / 2;
    let settlement = start[middle] - body.state().y[middle];
    let expected = load / 10e6 * start[middle];
    assert!((settlement / expected - 1.0).abs() < 0.002, "{settlement} {expected}");
}

/// Strength of a sheared block decays with the shear displacement across it, d = gamma h for a band one cell high,
/// whatever the size of the cell. A block without friction is sheared between a fixed base and a moving top: its stress
/// is the cohesion, c = c_r + (c_p - c_r) exp(-d / d_c).
#[test]
fn softening_follows_the_displacement_across_a_band() {
    for h in [0.2, 0.4] {
        let points = InitialPoints::at_rest(&filled(2.0, 2.0, 4, 4, h), 0.25 * h * h, 2000.0);
        let mut setup = setup(Grid::enclosing(0.0, 0.0, [20, 20], h), 1e8, 0.3, points);
        (setup.conditions.left, setup.conditions.bottom) = (Support::Open, Support::Open);
        setup.materials[0].softening = Some(Softening {
            residual_cohesion: 0.2,
            residual_friction_angle: 1.0,
            residual_dilation_angle: 1.0,
            displacement_m: 0.02,
        });
        let rate = 50.0;
        for i in 0..setup.points.len() {
            setup.points.cohesion[i] = 10e3;
            // So heavy that the stresses do not change the motion: a homogeneous simple shear.
            setup.points.density[i] = 2e9;
            setup.points.velocity[i] = [rate * (setup.points.y[i] - 2.0), 0.0];
        }
        let mut body = Body::new(setup, Kernel::best()).unwrap();
        let end = 0.002;
        while body.time_s() < end {
            body.step(1e-6);
        }
        let state = body.state();
        let middle = (0..state.x.len())
            .filter(|&i| {
                let p = &body.setup().points;
                (p.x[i] - 2.0 - 2.0 * h).abs() < h && (p.y[i] - 2.0 - 2.0 * h).abs() < h
            })
            .collect::<Vec<_>>();
        // Plastic from gamma = c / G on; the engineering shear strain is the rate times the time.
        let shear = 1e8 / 2.6;
        let gamma = rate * end - 10e3 / shear;
        let expected = 2e3 + 8e3 * libm::exp(-gamma * h / 0.02);
        for i in middle {
            // Mohr's radius: simple shear turns the axes a little.
            let across = state.stress_xx[i] - state.stress_yy[i];
            let radius = (0.25 * across * across + state.stress_xy[i] * state.stress_xy[i]).sqrt();
            assert!((radius / expected - 1.0).abs() < 0.01, "h {h}: {radius} {expected}");
        }
    }
}

/// A bar that is pulled apart: with stretched domains neighbours keep in touch up to twice their spacing and the stress
/// stays smooth; with fixed domains gaps open on the grid.
#[test]
fn stretched_domains_put_off_numerical_fracture() {
    let scatter = |domain: PointDomain| {
        let h = 1.0;
        let points = InitialPoints::at_rest(&filled(0.0, 1.0, 10, 1, h), 0.25 * h * h, 1e3);
        let mut setup = setup(Grid::enclosing(0.0, 0.0, [60, 3], h), 1e3, 0.0, points);
        setup.conditions.bottom = Support::Open;
        setup.controls.point_domain = domain;
        for i in 0..setup.points.len() {
            setup.points.velocity[i] = [0.5 * setup.points.x[i], 0.0];
        }
        let mut body = Body::new(setup, Kernel::best()).unwrap();
        // To 3.5 times the length: 1.75 cells between points that were half a cell apart.
        run_to(&mut body, 5.0);
        let stress = body.state().stress_xx;
        let inner = &stress[6..stress.len() / 2 - 6];
        let mean = mean(inner);
        (inner.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / inner.len() as f64).sqrt() / mean
    };
    let (stretched, uniform) = (scatter(PointDomain::Stretched), scatter(PointDomain::Uniform));
    assert!(stretched < 0.05 && uniform > 0.1, "stretched {stretched} uniform {uniform}");
}

/// A bar in its first mode for two periods: amplitude left with PIC and with XPIC at the same rate.
#[test]
fn xpic_spares_smooth_motion() {
    let amplitude = |filter: VelocityFilter, rate: f64| {
        let (cells, length) = (25, 25.0);
        let points = InitialPoints::at_rest(&filled(0.0, 1.0, cells, 1, 1.0), 0.25, 1.0);
        let mut setup = setup(Grid::enclosing(0.0, 0.0, [cells + 4, 3], 1.0), 100.0, 0.0, points);
        setup.conditions.bottom = Support::Open;
        setup.controls.velocity_filter = filter;
        setup.controls.pic_rate_per_s = rate;
        let wave = std::f64::consts::PI / (2.0 * length);
        for i in 0..setup.points.len() {
            setup.points.velocity[i] = [0.1 * libm::sin(wave * setup.points.x[i]), 0.0];
        }
        let mut body = Body::new(setup, Kernel::best()).unwrap();
        run_to(&mut body, 20.0);
        let state = body.state();
        let energy = body.energy();
        assert!(energy.drift().abs() < 0.02, "{filter:?} {rate}: {energy:?}");
        let projection: f64 =
            state.vx.iter().zip(&body.setup().points.x).map(|(v, x)| v * libm::sin(wave * x)).sum();
        let whole: f64 =
            body.setup().points.x.iter().map(|x| libm::sin(wave * x) * libm::sin(wave * x)).sum();
        projection / whole / 0.1
    };
    let flip = amplitude(VelocityFilter::Pic, 0.0);
    let pic = amplitude(VelocityFilter::Pic, 5.0);
    let xpic = amplitude(VelocityFilter::Xpic, 5.0);
    assert!((flip - 1.0).abs() < 0.01, "FLIP {flip}");
    assert!(flip - xpic < 0.1 * (flip - pic), "PIC {pic} XPIC {xpic}");
}

/// With everything switched on at once, all kernels of this machine give the same bits.
#[test]
fn every_kernel_gives_the_same_bits_with_every_option() {
    let states: Vec<_> = Kernel::available()
        .into_iter()
        .map(|kernel| {
            let h = 0.25;
            let mut setup = block(h, 1.0, 0.0, 2155.0);
            setup.conditions.bottom = Support::Friction(0.3);
            setup.conditions.gravity_m_s2 = [0.0, -9.81];
            setup.conditions.free_water_level_m = Some(0.6);
            setup.controls.formulation = Formulation::TwoPhase;
            setup.controls.volumetric_strain = VolumetricStrain::CellAverage;
            setup.controls.pressure_relaxation_rate_per_s = 300.0;
            setup.controls.velocity_filter = VelocityFilter::Xpic;
            setup.controls.pic_rate_per_s = 10.0;
            setup.controls.point_domain = PointDomain::Stretched;
            setup.controls.damping_rate_per_s = 0.1;
            setup.fluid.bulk_modulus_pa = 2e7;
            setup.obstacles =
                vec![Obstacle { x_m: [3.0, 3.5], y_m: [0.0, 1.0], support: Support::Friction(0.5) }];
            setup.materials[0].softening = Some(Softening {
                residual_cohesion: 0.1,
                residual_friction_angle: 0.6,
                residual_dilation_angle: 0.0,
                displacement_m: 0.05,
            });
            setup.materials[0].dilation_angle_rad = 0.1;
            setup.materials.push(setup.materials[0]);
            setup.materials[1].permeability_m_s = 1e-5;
            for i in 0..setup.points.len() {
                setup.points.cohesion[i] = 1e3;
                setup.points.friction_angle[i] = 0.4;
                setup.points.velocity[i] = [3.0, 0.0];
                setup.points.material[i] = (i % 2) as u16;
                setup.points.water_held[i] = i % 3 == 0;
                setup.points.force[i] = [1.0, -2.0];
            }
            let mut body = Body::new(setup, kernel).unwrap();
            run_to(&mut body, 0.5);
            (body.state(), body.energy())
        })
        .collect();
    let strained = states[0].0.plastic_strain.iter().filter(|e| **e > 0.01).count();
    assert!(strained > 20, "{strained} points have yielded");
    assert!(states.iter().all(|s| *s == states[0]));
}
