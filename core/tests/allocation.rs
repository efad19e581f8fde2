//! The time loop allocates nothing once it has warmed up: neither in the steps, nor where it sorts the points, nor where
//! the rule for rest looks at them, nor where the profile along the ground is recorded. Allocations cost time, and more of it the more threads there are.

mod bodies;

use runout_core::campaign::{Contact, Formulation, Mesh, Slope, Surface, VolumetricStrain};
use runout_core::gimp::{Body, End, Grid, InitialPoints, Kernel, Limits, RestRule, run};
use runout_core::profile::{Recorder, Stations};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ops::ControlFlow;

thread_local! {
    /// Allocations of this thread; the test harness has threads of its own.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, with a count.
struct Counting;

fn count() {
    // A thread that ends has no counter any more.
    let _ = ALLOCATIONS.try_with(|allocations| allocations.set(allocations.get() + 1));
}

// SAFETY: every call goes on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Until then buffers may grow to their size: the first time that points are sorted, and a window of the rule for rest.
const WARM_UP_S: f64 = 0.1;
const DURATION_S: f64 = 0.8;
/// Windows of the rule for rest: dozens in the duration.
const WINDOW_S: f64 = 0.02;

/// A bank of 288 points, 3 m high, that gives way at its right face.
fn falling_bank(formulation: Formulation) -> Body {
    let h = 0.5;
    let mut points = InitialPoints::at_rest(&bodies::filled(0.0, 0.0, 12, 6, h), 0.25 * h * h, 2000.0);
    points.cohesion = vec![1e3; points.len()];
    points.friction_angle = vec![0.3; points.len()];
    let mut setup = bodies::setup(Grid::enclosing(0.0, 0.0, [40, 10], h), 1e7, 0.3, points);
    setup.conditions.bottom = runout_core::gimp::Support::Fixed;
    setup.conditions.gravity_m_s2 = [0.0, -9.81];
    setup.controls.formulation = formulation;
    setup.controls.volumetric_strain = VolumetricStrain::CellAverage;
    setup.controls.pressure_relaxation_rate_per_s = 300.0;
    setup.controls.pic_rate_per_s = 10.0;
    Body::new(setup, Kernel::best()).unwrap()
}

/// Allocations of this thread in the time loop after the warm-up, and how many steps it took.
fn allocations(
    formulation: Formulation,
    rest: Option<RestRule>,
    mut recorder: Option<Recorder>,
) -> (u64, u64) {
    let mut body = falling_bank(formulation);
    let before = body.positions();
    let limits = Limits { duration_s: DURATION_S, maximum_steps: u64::MAX, rest };
    let (mut first, mut last) = (None, (0, 0));
    let end = run(&mut body, &limits, &mut |body| {
        last = (ALLOCATIONS.get(), body.steps());
        if body.time_s() >= WARM_UP_S {
            first.get_or_insert(last);
        }
        if let Some(recorder) = &mut recorder {
            recorder.look(body.motion());
        }
        ControlFlow::Continue(())
    });
    assert_eq!(end, End::Duration);
    let moved = before.iter().zip(body.positions()).map(|(a, b)| b[0] - a[0]).fold(0.0, f64::max);
    // A point that crosses cells has made the loop sort: that is done once per quarter of a cell.
    assert!(moved > 0.5, "the bank moves by {moved} m only");
    let reached = recorder.map(|recorder| recorder.finish().speed_mm_s.len());
    assert!(reached.is_none_or(|columns| columns > 0), "there is nothing in the profile");
    let first = first.expect("it takes longer than the warm-up");
    (last.0 - first.0, last.1 - first.1)
}

fn assert_none(rest: Option<RestRule>, recorder: impl Fn() -> Option<Recorder>) {
    for formulation in [Formulation::OnePhase, Formulation::TwoPhase] {
        let (allocations, steps) = allocations(formulation, rest, recorder());
        assert!(steps > 100, "{steps} steps");
        assert_eq!(allocations, 0, "{formulation:?}: allocations in {steps} steps");
    }
}

#[test]
fn steps_do_not_allocate() {
    assert_none(None, || None);
}

/// In front of the bank of 6 m, which begins at the recorder's toe: everything in it is in front.
#[test]
fn recording_the_profile_does_not_allocate() {
    let surface = Surface::Uniform { height_m: 3.0, angle_rad: 1.0, crest_width_m: 4.0 };
    let slope = Slope { surface, foundation_depth_m: 0.0, runout_plain_m: 20.0, base: Contact::Fixed };
    let mesh = Mesh { cell_size_m: 0.5, points_per_cell_side: 2 };
    assert_none(None, || Some(Recorder::new(Stations::of(&slope, &mesh))));
}

/// A rule that never holds, so that every window is looked at.
#[test]
fn the_rule_for_rest_does_not_allocate() {
    let rule = RestRule {
        kinetic_energy_share: 1e-12,
        velocity_m_s: 1e-12,
        hold_s: WINDOW_S,
        pressure_change_pa: 0.0,
    };
    assert_none(Some(rule), || None);
}
