//! The report is made from any number of outcomes, and of few it says what cannot be given.

use runout::load::{self, Loaded};
use runout::machine::Machine;
use runout::replays::{Replay, Scene};
use runout::report::figures::Content;
use runout::report::{self, Material, Replays, Report, Work};
use runout_core::gimp::Kernel;
use runout_core::marginal::{Family, Marginal};
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use runout_core::profile::{Profile, Stations};
use runout_core::realisation::Prepared;
use runout_core::slope;
use std::path::Path;

fn loaded() -> Loaded {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../campaigns/elkhorn-river/campaign.toml");
    load::load(&path).expect("the example is sound")
}

/// Every fifth realisation is stable, every fiftieth failed; the others' runout are quantiles of the paper's Weibull
/// distribution with scale 6 m and shape 2.3.
fn outcomes(count: u64) -> Vec<Outcome> {
    let weibull = Marginal { family: Family::Weibull, p: 6.0, q: 2.3 };
    // Multiples of the golden ratio fill the unit interval evenly.
    let share = |index: u64| ((index as f64 + 0.5) * 0.618_033_988_749_895).fract();
    let of = |index: u64| {
        let kind = match index {
            i if i % 50 == 7 => OutcomeKind::Failed,
            i if i % 5 == 3 => OutcomeKind::Stable,
            _ => OutcomeKind::Runout,
        };
        let runout_m = if kind == OutcomeKind::Stable { 0.01 } else { 0.1 + weibull.quantile(share(index)) };
        let measures = Measures {
            max_displacement_m: runout_m,
            displacement_q999_m: runout_m,
            toe_advance_m: if kind == OutcomeKind::Stable { 0.0 } else { 0.8 * runout_m },
            crest_retreat_m: 0.3 * runout_m,
            moved_area_m2: 5.0 * runout_m,
            ..Measures::default()
        };
        let failed = kind == OutcomeKind::Failed;
        let reason = if failed { Reason::LeftGrid } else { Reason::AtRest };
        Outcome { simulated_s: 5.0, ..Outcome::bare(index, kind, reason, (!failed).then_some(measures)) }
    };
    (0..count).map(of).collect()
}

fn machines() -> Vec<Machine> {
    vec![Machine { processor: "Xeon <1>".to_owned(), kernel: "avx2".to_owned(), cores: 16 }]
}

fn of(loaded: &Loaded, outcomes: &[Outcome], notes: &[String]) -> Report {
    with(loaded, outcomes, notes, None, &Replays::default())
}

fn with(
    loaded: &Loaded,
    outcomes: &[Outcome],
    notes: &[String],
    prepared: Option<&Prepared>,
    replays: &Replays,
) -> Report {
    report::report(&Material {
        campaign: &loaded.campaign,
        campaign_text: &loaded.campaign_text,
        site: loaded.site.as_ref(),
        fit: &loaded.fit,
        spec: &loaded.spec,
        outcomes,
        notes,
        prepared,
        replays,
        work: &[Work { worker: "a<b".to_owned(), realisations: 3, wall_s: 12.0, machines: machines() }],
    })
    .expect("it can be drawn")
}

/// Text of the cells of the table with this caption, row by row.
fn cells(html: &str, caption: &str) -> Vec<Vec<String>> {
    let table = html.split("<table>").find(|t| t.contains(&format!("<caption>{caption}"))).expect(caption);
    let body = table.split("<tbody>").nth(1).and_then(|t| t.split("</tbody>").next()).expect("a body");
    let text =
        |cell: &str| cell.split('>').nth(1).and_then(|t| t.split('<').next()).unwrap_or_default().to_owned();
    body.split("<tr")
        .skip(1)
        .map(|row| {
            row.split("</t")
                .filter(|c| c.contains("<td") || c.contains("<th"))
                .map(|c| {
                    let start = c.rfind("<t").unwrap_or(0);
                    text(&c[start..])
                })
                .collect()
        })
        .collect()
}

#[test]
fn few_outcomes_are_no_panic_and_what_is_missing_is_said() {
    let loaded = loaded();
    let page = |count: u64| of(&loaded, &outcomes(count), &[]).html;
    assert!(page(0).contains("none yet: no realisation has been decided"));
    assert!(page(1).contains("With 1 samples there is no exceedance curve"));
    assert!(page(2).contains("No family is fitted: there are 2 samples"));
    for count in 3..12 {
        assert!(page(count).ends_with("</body></html>\n"));
    }
}

#[test]
fn a_slope_that_never_failed_is_reported_as_that() {
    let loaded = loaded();
    let stable: Vec<Outcome> =
        outcomes(100).into_iter().filter(|o| o.outcome == OutcomeKind::Stable).collect();
    let stable: Vec<Outcome> = (0..).zip(stable).map(|(index, o)| Outcome { index, ..o }).collect();
    assert!(of(&loaded, &stable, &[]).html.contains("in none of 20 realisations did the slope fail"));
}

#[test]
fn equal_samples_have_no_spread_and_no_family() {
    let loaded = loaded();
    let mut equal = outcomes(20);
    for outcome in &mut equal {
        outcome.outcome = OutcomeKind::Runout;
        let one = Measures {
            max_displacement_m: 2.0,
            displacement_q999_m: 2.0,
            toe_advance_m: 2.0,
            ..Measures::default()
        };
        outcome.measures = Some(one);
    }
    assert!(of(&loaded, &equal, &[]).html.contains("No family is fitted"));
}

#[test]
fn a_full_report_is_self_contained_and_the_same_every_time() {
    let loaded = loaded();
    let outcomes = outcomes(300);
    let notes = ["realisation 9 gave <another> digest".to_owned()];
    let report = of(&loaded, &outcomes, &notes);
    let names: Vec<&str> = report.figures.iter().map(|f| f.name.as_str()).collect();
    let expected = [
        "section",
        "soil-cohesion-kpa",
        "soil-friction-angle-deg",
        "soil-pair-cohesion-kpa-friction-angle-deg",
        "outcomes",
        "convergence-mean",
        "convergence-variance",
        "convergence-cov",
        "convergence-failure",
        "histogram-likelihood",
        "histogram-moments",
        "cdf",
        "exceedance",
        "exceedance-log",
        "volume",
        "retreat",
        "hazard-profile",
        "hazard-crest",
    ];
    assert_eq!(names, expected);
    for word in
        [&loaded.spec.digest(), "weibull", "soil.permeability_m_s", "gave &lt;another&gt; digest", "0.1 %"]
    {
        assert!(report.html.contains(word), "{word} is missing");
    }
    // Nothing is fetched: the only address is the name of SVG's vocabulary.
    let addresses = report.html.matches("http").count();
    assert_eq!(addresses, report.html.matches("http://www.w3.org/2000/svg").count());
    assert_eq!(of(&loaded, &outcomes, &notes).html, report.html);
}

/// What the page says of the samples is what the outcomes hold.
#[test]
fn the_pages_numbers_are_those_of_the_outcomes() {
    let loaded = loaded();
    let outcomes = outcomes(300);
    let page = of(&loaded, &outcomes, &[]).html;
    let of_kind = |kind| outcomes.iter().filter(move |o| o.outcome == kind);
    let runouts: Vec<f64> =
        of_kind(OutcomeKind::Runout).map(|o| o.measures.unwrap().displacement_q999_m).collect();
    let mean = runouts.iter().sum::<f64>() / runouts.len() as f64;
    let longest = runouts.iter().copied().fold(0.0, f64::max);
    let card = |value: String, label: &str| format!("<div><b>{value}</b><span>{label}</span></div>");
    for card in [
        card(runouts.len().to_string(), "samples (slides)"),
        card(of_kind(OutcomeKind::Stable).count().to_string(), "stable"),
        card(of_kind(OutcomeKind::Failed).count().to_string(), "failed analyses"),
        card(format!("{mean:.2} m"), "mean runout"),
        card(format!("{longest:.2} m"), "longest"),
    ] {
        assert!(page.contains(&card), "{card}");
    }
    let rows = cells(&page, "Realisations by outcome");
    assert_eq!(rows[0][1], runouts.len().to_string());
    assert_eq!(rows[5][1], "300");
    let listed = of_kind(OutcomeKind::Failed).map(|o| o.index.to_string()).collect::<Vec<_>>().join(", ");
    assert!(page.contains(&format!("failed, left-grid: realisations {listed}.")));
    let moved = cells(&page, "In the samples");
    assert_eq!(moved[0][6], format!("{:.2}", 5.0 * longest));
}

/// The table at the top: order statistics of the samples, and of samples and stable realisations together.
#[test]
fn the_answers_distances_are_order_statistics() {
    let loaded = loaded();
    let outcomes = outcomes(300);
    let report = of(&loaded, &outcomes, &[]);
    let rows = cells(&report.html, "Runout that few slides exceed");
    let mut sorted: Vec<f64> = outcomes
        .iter()
        .filter(|o| o.outcome == OutcomeKind::Runout)
        .map(|o| o.measures.unwrap().displacement_q999_m)
        .collect();
    sorted.sort_by(f64::total_cmp);
    let one_in_ten = |sorted: &[f64]| sorted[(0.9 * sorted.len() as f64).ceil() as usize - 1];
    assert_eq!(rows[0][..2], ["10 %".to_owned(), format!("{:.2} m", one_in_ten(&sorted))]);
    assert_eq!(rows[0][3], format!("the {} samples themselves", sorted.len()));
    assert_eq!(report.distances[0].empirical.distance_m, Some(one_in_ten(&sorted)));
    let stable = outcomes.iter().filter(|o| o.outcome == OutcomeKind::Stable).count();
    let all: Vec<f64> = vec![0.0; stable].into_iter().chain(sorted.iter().copied()).collect();
    assert_eq!(rows[0][4], format!("{:.2} m", one_in_ten(&all)));
    // A thousand times as rare as the samples are many: only a family speaks of it.
    assert!(rows[2][3].starts_with("the fitted "), "{rows:?}");
}

/// Slides that took all the ground behind the crest are counted, and the others are not.
#[test]
fn slides_that_reach_the_rear_wall_are_said() {
    let loaded = loaded();
    let model = &loaded.spec.model;
    let room_m = slope::crest_edge_x(&model.slope) - slope::rear_x(&model.slope);
    let mut outcomes = outcomes(60);
    let said = |outcomes: &[Outcome]| of(&loaded, outcomes, &[]).html.contains("moved back to the rear wall");
    assert!(!said(&outcomes));
    let retreat = |outcome: &mut Outcome, retreat_m: f64| {
        outcome.measures.as_mut().expect("measures").crest_retreat_m = retreat_m;
    };
    let place = outcomes.iter().position(|o| o.outcome == OutcomeKind::Runout).expect("a slide");
    retreat(&mut outcomes[place], room_m - 1.01 * model.mesh.cell_size_m);
    assert!(!said(&outcomes));
    retreat(&mut outcomes[place], room_m);
    assert!(said(&outcomes));
}

/// Counted again here: the front is 0.8 of the runout, and stable slopes reach nothing.
#[test]
fn the_profile_along_the_ground_falls_and_is_the_count_of_the_fronts() {
    let loaded = loaded();
    let outcomes = outcomes(300);
    let page = of(&loaded, &outcomes, &[]).html;
    let rows = cells(&page, "Along the ground in front of the toe");
    assert!(rows.len() > 4, "{rows:?}");
    let decided: Vec<&Measures> = outcomes
        .iter()
        .filter(|o| o.outcome != OutcomeKind::Failed)
        .filter_map(|o| o.measures.as_ref())
        .collect();
    let mut before = u64::MAX;
    for row in &rows {
        let distance_m: f64 = row[0].parse().expect("a distance");
        let hits = decided.iter().filter(|m| m.toe_advance_m > distance_m).count() as u64;
        assert_eq!(row[1], hits.to_string(), "{row:?}");
        assert!(hits <= before);
        before = hits;
    }
    assert_eq!(rows[0][1], "234");
}

/// The same depth everywhere, and twice as many metres a second.
fn profile(loaded: &Loaded, depth_m: f64) -> Profile {
    let stations = Stations::of(&loaded.spec.model.slope, &loaded.spec.model.mesh);
    let depth_mm = (1000.0 * depth_m).round() as u32;
    let all = |value: u32| vec![value; if value > 0 { stations.count } else { 0 }];
    Profile { column_m: stations.width_m, depth_mm: all(depth_mm), speed_mm_s: all(2 * depth_mm) }
}

fn replay(loaded: &Loaded, outcome: &Outcome, depth_m: f64) -> Replay {
    let scene = Scene {
        x0: vec![-1.0, -2.0],
        y0: vec![0.5, 0.5],
        x: vec![1.0, -2.0],
        y: vec![0.2, 0.5],
        plastic_strain: vec![0.3, 0.0],
        time_s: 4.0,
    };
    Replay { outcome: outcome.clone(), profile: Some(profile(loaded, depth_m)), scene: Some(scene) }
}

#[test]
fn replays_give_depths_pictures_and_a_word_on_what_differs() {
    let loaded = loaded();
    let outcomes = outcomes(60);
    let prepared = Prepared::new(loaded.spec.clone(), Kernel::best()).expect("the example is sound");
    let samples: Vec<u64> =
        outcomes.iter().filter(|o| o.outcome == OutcomeKind::Runout).map(|o| o.index).collect();
    let mut replays = Replays { profiled: samples.clone(), ..Replays::default() };
    for (place, index) in samples.iter().enumerate() {
        replays.realisations.insert(*index, replay(&loaded, &outcomes[*index as usize], place as f64));
    }
    replays.mean_properties = Some(replay(&loaded, &outcomes[0], 1.0));
    let report = with(&loaded, &outcomes, &[], Some(&prepared), &replays);
    let rows = cells(&report.html, "Depths and speeds along the ground");
    let n = samples.len();
    assert_eq!(rows[0][1], format!("{:.2}", n.div_ceil(2) as f64 - 1.0));
    assert_eq!(rows[0][7], format!("{:.2}", 2.0 * ((0.9 * n as f64).ceil() - 1.0)));
    assert!(report.html.contains("chosen at random by the campaign's seed and replayed"));
    assert_eq!(cells(&report.html, "Along the ground in front of the toe")[0].len(), 4);
    let pictures: Vec<&str> = report
        .figures
        .iter()
        .filter(|f| matches!(f.content, Content::Picture(_)))
        .map(|f| f.name.as_str())
        .collect();
    assert_eq!(
        pictures[..4],
        ["typical-fields", "typical-plastic-strain", "typical-displacement", "slide-1"]
    );
    assert!(pictures.contains(&"mean-properties") && report.figures.iter().any(|f| f.name == "sensitivity"));
    assert!(report.html.contains("every one gave the recorded outcome bit for bit"));
    let mean_m = outcomes[0].measures.unwrap().displacement_q999_m;
    let beyond = samples
        .iter()
        .filter(|i| outcomes[**i as usize].measures.unwrap().displacement_q999_m > mean_m)
        .count();
    assert!(report.html.contains(&format!("<strong>{beyond}</strong> of the {n} samples go")));

    replays.realisations.get_mut(&samples[3]).expect("it was replayed").outcome.digest = "0".repeat(32);
    let page = with(&loaded, &outcomes, &[], Some(&prepared), &replays).html;
    assert!(page.contains(&format!("gave another outcome than the recorded one: {}.", samples[3])));
}

/// Where every sample has recorded its profile, the page rests on all of them, and says so; replayed ones do not count.
#[test]
fn recorded_profiles_come_before_replayed_ones() {
    let loaded = loaded();
    let mut outcomes = outcomes(60);
    let mut replays = Replays::default();
    let mut n = 0.0;
    for outcome in outcomes.iter_mut().filter(|o| o.outcome == OutcomeKind::Runout) {
        outcome.profile = Some(profile(&loaded, n / 10.0));
        replays.realisations.insert(outcome.index, replay(&loaded, outcome, 99.0));
        replays.profiled.push(outcome.index);
        n += 1.0;
    }
    let page = with(&loaded, &outcomes, &[], None, &replays).html;
    let rows = cells(&page, "Depths and speeds along the ground");
    assert_eq!(rows[0][1], format!("{:.2}", ((n / 2.0_f64).ceil() - 1.0) / 10.0));
    assert!(page.contains(&format!("all {n} samples, each of which recorded its own")));
    // Depths of 0, 0.1 ... m: six of them are not above half a metre, eleven not above one.
    let decided = outcomes.iter().filter(|o| o.outcome != OutcomeKind::Failed).count() as f64;
    let deeper = &cells(&page, "Along the ground in front of the toe")[0];
    // Shown to three digits.
    let is = |cell: &str, beyond: f64| {
        let shown: f64 = cell.trim_end_matches(" %").parse().expect("a share");
        (shown - 100.0 * beyond / decided).abs() <= 0.05
    };
    assert!(is(&deeper[4], n - 6.0) && is(&deeper[6], n - 11.0), "{deeper:?}");

    let machine = &cells(&page, "On what machines")[0];
    assert_eq!(machine[..5], ["Xeon &lt;1&gt;", "avx2", "16", "1", "3"]);
}

/// Every chart is well-formed, and everybody can tell what a figure shows: it has words, and its name stands in the page.
#[test]
fn figures_are_well_formed_and_have_words() {
    let loaded = loaded();
    let report = of(&loaded, &outcomes(300), &[]);
    for figure in &report.figures {
        let Content::Chart { svg, png } = &figure.content else { continue };
        let document = roxmltree::Document::parse(svg).unwrap_or_else(|e| panic!("{}: {e}", figure.name));
        assert_eq!(document.root_element().tag_name().name(), "svg");
        assert!(png.starts_with(b"\x89PNG"));
        assert!(!figure.alt.is_empty() && figure.caption.ends_with('.'), "{}", figure.name);
    }
    let count = report.html.matches("<figure").count();
    assert_eq!(count, report.figures.len());
    assert_eq!(report.html.matches("role=\"img\" aria-label=\"").count(), count);
    for table in report.html.split("<table>").skip(1) {
        assert!(table.contains("<th scope=\"col\"") && table.contains("<th scope=\"row\""), "{table}");
    }
    for target in report.html.split("<a href=\"#").skip(1).filter_map(|t| t.split('"').next()) {
        assert!(report.html.contains(&format!("id=\"{target}\"")), "{target}");
    }
}
