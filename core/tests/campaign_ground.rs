//! The ground in the campaign file: profile, layers, softening, base, obstacles, water, in-situ stresses. The example is
//! taken; every fault is refused with the key, the value and what is allowed.

use runout_core::campaign::{
    self, Campaign, Contact, InitialPorePressure, InitialStress, Model, Polyline, Softening, Surface,
    WaterTable, profile,
};
use runout_core::slope;

const EXAMPLE: &str = include_str!("../../campaigns/layered-slope/campaign.toml");
const UNIFORM: &str = include_str!("../../campaigns/quick/campaign.toml");

fn section() -> Polyline {
    profile::parse(include_str!("../../campaigns/layered-slope/profile.csv")).expect("the section is sound")
}

/// `text` with each `(from, to)` replaced once.
fn changed(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "the fixture lacks `{from}`");
        text.replacen(from, to, 1)
    })
}

fn example(changes: &[(&str, &str)]) -> Result<Campaign, String> {
    campaign::parse_with_profile(&changed(EXAMPLE, changes), Some(&section())).map_err(|e| e.to_string())
}

fn uniform(changes: &[(&str, &str)]) -> Result<Campaign, String> {
    campaign::parse(&changed(UNIFORM, changes)).map_err(|e| e.to_string())
}

fn model(parsed: Result<Campaign, String>) -> Model {
    parsed.expect("it is sound").model
}

#[test]
fn the_example_is_taken_and_counts_from_the_toe() {
    let model = model(example(&[]));
    assert_eq!(slope::height_m(&model.slope), 12.0);
    assert_eq!([slope::rear_x(&model.slope), slope::crest_edge_x(&model.slope)], [-45.0, -18.0]);
    assert_eq!(slope::ground_surface_y(&model.slope, 0.0), 0.0);
    let names: Vec<&str> = model.layers.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(names, ["colluvium", "weathered shale"]);
    assert_eq!(model.layers[0].bottom.as_ref().map(|line| line.y_at(-18.0)), Some(3.5));
    assert_eq!(model.layers[1].bottom, None);
    let [colluvium, shale] = [&model.layers[0].soil, &model.layers[1].soil];
    assert_eq!([colluvium.cohesion_pa, colluvium.unit_weight_n_m3], [None, Some(20e3)]);
    assert_eq!([shale.cohesion_pa, shale.unit_weight_n_m3], [Some(80e3), Some(22e3)]);
    // Shared where the layer is silent.
    assert_eq!([colluvium.youngs_modulus_pa, shale.youngs_modulus_pa], [50e6, 150e6]);
    assert_eq!([colluvium.poissons_ratio, shale.poissons_ratio], [0.35; 2]);
    assert_eq!(colluvium.softening.map(|s| s.residual_cohesion_ratio), Some(0.2));
    assert_eq!(shale.softening.map(|s| s.residual_cohesion_ratio), Some(1.0));
    assert_eq!(model.obstacles[0].x_m, [7.5, 10.0]);
    assert_eq!(model.obstacles[0].y_m, [-1.25, 2.5]);
    let InitialPorePressure::Hydrostatic(WaterTable::Polyline(table)) = &model.water.initial_pore_pressure
    else {
        panic!("{:?}", model.water)
    };
    assert_eq!(table.y_at(-18.0), 6.5);
}

/// The water table above the reservoir's level, cut off at the ground: see [`slope::water`].
#[test]
fn the_drawdown_is_taken() {
    let text = include_str!("../../campaigns/layered-slope/drawdown.toml");
    let model = campaign::parse_with_profile(text, Some(&section())).expect("it is sound").model;
    assert_eq!(model.water.free_water_level_m, Some(0.5));
    let level = |x| slope::water::pressure_level_m(&model.slope, &model.water, x).expect("there is water");
    // Behind the crest, at the ground of the face, and under the reservoir.
    assert_eq!([level(-30.0), level(-4.5), level(15.0)], [7.0, 3.0, 0.5]);
}

#[test]
fn a_profile_and_its_positions_belong_together() {
    for (changes, message) in [
        (&[("toe_x_m = 48.0\n", "")][..], "slope.toe_x_m = (absent) is not allowed; slope.profile needs it"),
        (
            &[("toe_x_m = 48.0", "toe_x_m = 3.0")],
            "slope.toe_x_m = 3 is not allowed; it must be greater than 3 and at most 74: the profile's ends",
        ),
        (
            &[("crest_x_m = 30.0", "crest_x_m = 50.0")],
            "slope.crest_x_m = 50 is not allowed; it must be greater than 3 (the profile's start) and at most the toe's 48",
        ),
        (
            &[("toe_x_m = 48.0", "toe_x_m = 30.0")],
            "slope.crest_x_m = 30 is not allowed; the crest's elevation there, 122 m, must be above the toe's, 122 m",
        ),
        (
            &[("crest_x_m = 30.0", "crest_x_m = 30.0\nheight_m = 12.0")],
            "slope.height_m = 12 is not allowed; slope.profile gives it: leave it out here",
        ),
        (
            &[("foundation_depth_m = 5.0", "foundation_depth_m = 2.0")],
            "slope.foundation_depth_m = 2 is not allowed; the profile falls 3 m below toe level: it must be at least that",
        ),
        (
            &[("cell_size_m = 1.25", "cell_size_m = 4.0")],
            "mesh.cell_size_m = 4 is not allowed; it must be at most a quarter of the height from toe to crest (3 m)",
        ),
    ] {
        assert_eq!(example(changes).unwrap_err(), message);
    }
    assert_eq!(
        campaign::parse(EXAMPLE).unwrap_err().to_string(),
        "slope.profile = \"profile.csv\" is not allowed; its text must come with that of the campaign"
    );
    assert_eq!(campaign::profile_file(EXAMPLE).as_deref(), Some("profile.csv"));
    assert_eq!(campaign::profile_file(UNIFORM), None);
    for (change, message) in [
        (
            ("height_m = 17.5\n", ""),
            "slope.height_m = (absent) is not allowed; without slope.profile it is needed",
        ),
        (
            ("height_m = 17.5", "height_m = 17.5\ntoe_x_m = 3.0"),
            "slope.toe_x_m = 3 is not allowed; it belongs to slope.profile",
        ),
    ] {
        assert_eq!(uniform(&[change]).unwrap_err(), message);
    }
}

#[test]
fn layers_say_where_they_end_and_what_they_are_made_of() {
    let last = ("name = \"weathered shale\"", "name = \"weathered shale\"\nbottom = 100.0");
    let bottom = "bottom = [[3.0, 117.0], [30.0, 113.5], [48.0, 107.5], [88.0, 106.0]]";
    for (change, message) in [
        (
            last,
            "layers.weathered shale.bottom = a value is not allowed; the last layer reaches to the base: leave it out",
        ),
        (
            (bottom, ""),
            "layers.colluvium.bottom = (absent) is not allowed; a layer above another needs an elevation or a line [[x, y], ...]",
        ),
        (
            (bottom, "bottom = [[3.0, 117.0], [1.0, 113.5]]"),
            "layers.colluvium.bottom = [1, 113.5] is not allowed; point 2: x must grow from left to right, or stay the same \
             once (a vertical step)",
        ),
        (
            (bottom, "bottom = []"),
            "layers.colluvium.bottom = [] is not allowed; a line has at least one point [x, y]",
        ),
        (
            ("name = \"weathered shale\"", "name = \"colluvium\""),
            "layers[2].name = \"colluvium\" is not allowed; each layer needs a name of its own",
        ),
        (
            ("random = true", "random = false"),
            "layers = (none is random) is not allowed; at least one layer must have random = true, or nothing is random",
        ),
        (
            ("random = true", "random = true\ncohesion_kpa = 5.0"),
            "layers.colluvium.cohesion_kpa = 5 is not allowed; it is a random property: leave it out here",
        ),
        (
            ("cohesion_kpa = 80.0\n", ""),
            "layers.weathered shale.cohesion_kpa = (absent) is not allowed; the layer is not random: give its value",
        ),
        (
            ("porosity = 0.25", "porosity = 1.5"),
            "layers.weathered shale.porosity = 1.5 is not allowed; it must be in (0, 1)",
        ),
        (
            ("unit_weight_kn_m3 = 22.0", "unit_weight_kn_m3 = 2.0"),
            "layers.weathered shale.unit_weight_kn_m3 = 2 is not allowed; it must exceed the weight of the pore water, \
             2.453 kN/m3",
        ),
    ] {
        assert_eq!(example(&[change]).unwrap_err(), message);
    }
    assert!(example(&[("random = true", "")]).unwrap_err().contains("missing field `random`"));
    assert!(
        example(&[(bottom, "bottom = \"low\"")])
            .unwrap_err()
            .contains("an elevation or a line [[x, y], ...]")
    );
    let level = model(example(&[(bottom, "bottom = 112")]));
    assert_eq!(level.layers[0].bottom, Some(Polyline::level(2.0)));
}

#[test]
fn softening_is_a_section_of_its_own() {
    assert_eq!(
        model(example(&[])).soil.softening,
        Some(Softening {
            residual_cohesion_ratio: 0.2,
            residual_friction_ratio: 0.85,
            residual_dilation_ratio: 0.0,
            displacement_m: 0.3
        })
    );
    assert_eq!(model(uniform(&[])).soil.softening, None);
    let ratio = ("residual_friction_ratio = 0.85", "residual_friction_ratio = 1.2");
    assert_eq!(
        example(&[ratio]).unwrap_err(),
        "soil.softening.residual_friction_ratio = 1.2 is not allowed; it must be from 0 to 1"
    );
    let length = ("displacement_m = 0.3", "displacement_m = 0.0");
    assert_eq!(
        example(&[length]).unwrap_err(),
        "soil.softening.displacement_m = 0 is not allowed; it must be greater than 0"
    );
}

#[test]
fn base_and_obstacles_are_fixed_or_rub() {
    let rubs = model(example(&[
        ("base = \"fixed\"", "base = { friction = 0.4 }"),
        ("contact = \"fixed\"", "contact = { friction = 0.3 }"),
    ]));
    assert_eq!(rubs.slope.base, Contact::Friction(0.4));
    assert_eq!(rubs.obstacles[0].contact, Contact::Friction(0.3));
    for (change, message) in [
        (
            ("base = \"fixed\"", "base = \"rough\""),
            "slope.base = \"rough\" is not allowed; it must be \"fixed\"",
        ),
        (
            ("base = \"fixed\"", "base = { friction = -0.1 }"),
            "slope.base.friction = -0.1 is not allowed; it must be from 0 to 10",
        ),
        (
            ("y_m = [108.75, 112.5]", "y_m = [112.5, 108.75]"),
            "obstacles[1].y_m = [112.5, 108.75] is not allowed; it must be [smallest, largest], at least a cell (1.25 m) \
             apart",
        ),
        (
            ("y_m = [108.75, 112.5]", "y_m = [108.0, 112.5]"),
            "obstacles[1].y_m = [108, 112.5] is not allowed; with its sides on the grid it starts at 107.5 m, inside the \
             ground, which reaches 108.75 m there: it must stand on the ground or above it",
        ),
        (
            ("x_m = [55.5, 58.0]", "x_m = [46.0, 58.0]"),
            "obstacles[1].y_m = [108.75, 112.5] is not allowed; with its sides on the grid it starts at 108.75 m, inside \
             the ground, which reaches 111.66666666666667 m there: it must stand on the ground or above it",
        ),
        (
            ("x_m = [55.5, 58.0]", "x_m = [85.5, 89.0]"),
            "obstacles[1].x_m = [85.5, 89] is not allowed; it must lie between the walls at 3 and 88 m",
        ),
    ] {
        assert_eq!(example(&[change]).unwrap_err(), message);
    }
    let wrong = ("base = \"fixed\"", "base = { friction = 0.4, cohesion = 2.0 }");
    assert!(example(&[wrong]).unwrap_err().contains("it must be \"fixed\" or { friction = coefficient }"));
    assert!(example(&[("base = \"fixed\"", "")]).unwrap_err().contains("missing field `base`"));
}

#[test]
fn water_tables_and_free_water_go_together() {
    const NONE: &str = "initial_pore_pressure = \"none\"";
    let set = |to: &str| uniform(&[(NONE, to)]);
    let submerged = model(set("initial_pore_pressure = \"submerged\"\nfree_water_level_m = 4.0"));
    assert_eq!(submerged.water.free_water_level_m, Some(4.0));
    assert_eq!(
        submerged.water.initial_pore_pressure,
        InitialPorePressure::Hydrostatic(WaterTable::ElevationM(4.0))
    );
    let drawdown =
        model(set("initial_pore_pressure = \"hydrostatic\"\nwater_table = 10.0\nfree_water_level_m = 2.0"));
    assert_eq!(drawdown.water.free_water_level_m, Some(2.0));
    for (to, message) in [
        (
            "initial_pore_pressure = \"submerged\"",
            "water.free_water_level_m = (absent) is not allowed; \"submerged\" needs the level of the free water, m",
        ),
        (
            "initial_pore_pressure = \"submerged\"\nwater_table = 4.0\nfree_water_level_m = 4.0",
            "water.water_table = a value is not allowed; it belongs to \"hydrostatic\"",
        ),
        (
            "initial_pore_pressure = \"none\"\nfree_water_level_m = 4.0",
            "water.free_water_level_m = 4 is not allowed; free water needs initial_pore_pressure \"hydrostatic\" or \
             \"submerged\"",
        ),
        (
            "initial_pore_pressure = \"submerged\"\nfree_water_level_m = 0.0",
            "water.free_water_level_m = 0 is not allowed; it must be above the lowest ground, 0 m",
        ),
        (
            "initial_pore_pressure = \"hydrostatic\"\nwater_table = 18.0",
            "water.water_table = 18 is not allowed; it must be from 0 (the base) to 17.5 (the highest ground)",
        ),
        (
            "initial_pore_pressure = \"wet\"",
            "water.initial_pore_pressure = \"wet\" is not allowed; it must be \"none\" or \"hydrostatic\" or \"submerged\"",
        ),
    ] {
        assert_eq!(set(to).unwrap_err(), message);
    }
    let one_phase = [
        ("formulation = \"two-phase\"", "formulation = \"one-phase\""),
        (NONE, "initial_pore_pressure = \"submerged\"\nfree_water_level_m = 4.0"),
    ];
    assert_eq!(
        uniform(&one_phase).unwrap_err(),
        "water.initial_pore_pressure = \"submerged\" is not allowed; analysis.formulation = \"one-phase\" knows no water: \
         it must be \"none\""
    );
    // What weighs less than water would float.
    let light = [
        ("unit_weight_kn_m3 = 20.0", "unit_weight_kn_m3 = 9.0"),
        (NONE, "initial_pore_pressure = \"submerged\"\nfree_water_level_m = 4.0"),
    ];
    assert_eq!(
        uniform(&light).unwrap_err(),
        "soil.unit_weight_kn_m3 = 9 is not allowed; it must exceed the weight of the free water, 9.810 kN/m3"
    );
}

#[test]
fn in_situ_stresses_come_from_gravity_or_k0() {
    let set = |to: &str| uniform(&[("initial_stress = \"gravity\"", to)]);
    assert_eq!(model(uniform(&[])).analysis.initial_stress, InitialStress::Gravity);
    assert_eq!(model(set("initial_stress = { k0 = 0.5 }")).analysis.initial_stress, InitialStress::K0(0.5));
    assert_eq!(
        set("initial_stress = { k0 = 9.0 }").unwrap_err(),
        "analysis.initial_stress.k0 = 9 is not allowed; it must be from 0 to 5"
    );
    assert!(set("initial_stress = { ko = 0.5 }").unwrap_err().contains("\"gravity\" or { k0 = value }"));
    assert!(set("").unwrap_err().contains("missing field `initial_stress`"));
}

#[test]
fn a_surface_of_one_angle_stays_what_it_was() {
    let Surface::Uniform { height_m, crest_width_m, .. } = model(uniform(&[])).slope.surface else {
        panic!("the quick campaign has no profile")
    };
    assert_eq!([height_m, crest_width_m], [17.5, 20.0]);
}
