//! Claims about the stopping rules, on runout distances from the paper's fitted Weibull distribution (shape 2.3, scale
//! 6.0 m: mean 5.315 m, standard deviation 2.451 m; its Section 3.1).
//!
//! Numbers of samples come from an independent simulation of the same rules. Tolerances: the median over R campaigns
//! has standard error 1.2533 IQR / (1.349 sqrt(R)); the reference, from at least as many campaigns, has the same, so
//! that a difference of 4.5 * sqrt(2) of it has a chance of 7e-6 (see `assert_median`).

use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use runout_core::campaign::{ExceedanceTarget, OnFailure, Run, RunoutMeasure, Sample, Stop, StopRule};
use runout_core::estimate::exceedance::{curve, empirical_distance};
use runout_core::estimate::moments::Moments;
use runout_core::estimate::rule::earliest_paper_stop;
use runout_core::estimate::{Decision, Estimator, OutOfOrder, interval};
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};

const SHAPE: f64 = 2.3;
const SCALE_M: f64 = 6.0;
const MEAN_M: f64 = 5.315_488;
const SD_M: f64 = 2.450_885;

fn outcome(index: u64, kind: OutcomeKind, runout_m: f64, reason: Reason) -> Outcome {
    let measures =
        Measures { max_displacement_m: runout_m, displacement_q999_m: runout_m, ..Measures::default() };
    Outcome::bare(index, kind, reason, (kind != OutcomeKind::Failed).then_some(measures))
}

fn sample(index: u64, runout_m: f64) -> Outcome {
    outcome(index, OutcomeKind::Runout, runout_m, Reason::AtRest)
}

fn estimator(rule: StopRule, minimum: u64, maximum: u64, on_failure: OnFailure) -> Estimator {
    let stop = Stop { rule, minimum_realisations: minimum, maximum_realisations: maximum };
    let sample = Sample { measure: RunoutMeasure::MaxDisplacement, threshold_m: 0.1, profile: false };
    Estimator::new(&stop, &sample, &Run { on_failure, audit_fraction: 0.0 })
}

fn paper(tolerance: f64, relative: bool, patience: u64) -> StopRule {
    StopRule::Paper { tolerance, relative, patience }
}

fn interval_of_mean(half_width: f64) -> StopRule {
    StopRule::Interval {
        confidence: 0.95,
        mean_half_width: Some(half_width),
        sd_half_width: None,
        exceedance: Vec::new(),
    }
}

/// Runout distances of campaign `seed`.
fn distances(seed: u64) -> impl Iterator<Item = f64> {
    let mut stream = ChaCha12Rng::seed_from_u64(seed);
    std::iter::repeat_with(move || {
        let uniform = ((stream.next_u64() >> 12) as f64 + 0.5) / (1_u64 << 52) as f64;
        SCALE_M * libm::pow(-libm::log(uniform), 1.0 / SHAPE)
    })
}

/// A campaign of samples only, run until its decision.
fn run_campaign(rule: &StopRule, seed: u64) -> Estimator {
    let mut estimator = estimator(rule.clone(), 2, 1_000_000, OnFailure::Exclude);
    for (index, runout_m) in distances(seed).enumerate() {
        estimator.push(&sample(index as u64, runout_m)).unwrap();
        if estimator.decision() != Decision::Continue {
            break;
        }
    }
    estimator
}

fn stopping_numbers(rule: &StopRule, campaigns: u64) -> Vec<f64> {
    let mut numbers: Vec<f64> =
        (0..campaigns).map(|seed| run_campaign(rule, seed).samples_m().len() as f64).collect();
    numbers.sort_by(f64::total_cmp);
    numbers
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

fn assert_median(rule: &StopRule, campaigns: u64, wanted: f64) {
    let numbers = stopping_numbers(rule, campaigns);
    let iqr = quantile(&numbers, 0.75) - quantile(&numbers, 0.25);
    let error = 1.2533 * iqr / (1.349 * (campaigns as f64).sqrt());
    let median = quantile(&numbers, 0.5);
    let allowed = 4.5 * 2.0_f64.sqrt() * error;
    assert!((median - wanted).abs() < allowed, "{rule:?}: median {median}, wanted {wanted} +- {allowed:.1}");
}

#[test]
fn the_paper_rule_cannot_hold_before_two_thousand_samples() {
    assert_eq!(earliest_paper_stop(SD_M, 1e-3).ceil(), 2002.0);
    assert_eq!(earliest_paper_stop(0.860_584, 1e-3).ceil(), 496.0);
    let numbers = stopping_numbers(&paper(1e-3, false, 1), 1000);
    // The standard error of a 5 % or 95 % quantile over 1000 campaigns is sqrt(.05 * .95 / 1000) / density; with the
    // spread here (sd 55, normal density .103 / 55 there) 3.7, and 4.5 sqrt(2) of that is 23.
    assert!((quantile(&numbers, 0.05) - 1986.0).abs() < 23.0);
    assert!((quantile(&numbers, 0.95) - 2164.0).abs() < 23.0);
}

#[test]
fn patience_and_relative_tolerance_move_the_paper_rule_as_known() {
    for (patience, wanted) in [(1, 2071.0), (10, 5361.0), (100, 15_706.0)] {
        assert_median(&paper(1e-3, false, patience), 200, wanted);
    }
    for (patience, wanted) in [(1, 396.0), (10, 987.0), (30, 1383.0), (50, 2065.0), (100, 3268.0)] {
        assert_median(&paper(1e-3, true, patience), 400, wanted);
    }
}

#[test]
fn the_interval_rule_stops_where_its_width_says_and_covers_the_mean() {
    assert_median(&interval_of_mean(0.025), 200, 1306.0);
    assert_median(&interval_of_mean(0.01), 30, 8163.0);

    let campaigns = 2000;
    let mut covered = 0;
    let mut numbers = Vec::new();
    for seed in 0..campaigns {
        let estimator = run_campaign(&interval_of_mean(0.05), seed);
        let [low, high] = estimator.estimate().mean_interval_m.unwrap();
        covered += u32::from(low <= MEAN_M && MEAN_M <= high);
        numbers.push(estimator.samples_m().len() as f64);
    }
    // Coverage is known to be 94 to 95 %; 4.5 standard errors of a share over 2000 campaigns are 2.3 %.
    let coverage = f64::from(covered) / campaigns as f64;
    assert!((0.917..0.973).contains(&coverage), "{coverage}");
    numbers.sort_by(f64::total_cmp);
    assert!((quantile(&numbers, 0.5) - 327.0).abs() < 8.0, "{}", quantile(&numbers, 0.5));
}

#[test]
fn the_interval_of_the_standard_deviation_covers_it() {
    // At 300 samples the large-sample interval's own error is of order 1/300 times a small number: 1 % is allowed beside
    // 4.5 standard errors of a share over 2000 campaigns (2.2 %).
    let covers = |seed| {
        let samples: Vec<f64> = distances(seed).take(300).collect();
        let [low, high] = interval::sd(&Moments::of(&samples), 0.95).unwrap();
        u32::from(low <= SD_M && SD_M <= high)
    };
    let coverage = (0..2000).map(covers).sum::<u32>() as f64 / 2000.0;
    assert!((coverage - 0.95).abs() < 0.032, "{coverage}");
}

#[test]
fn the_stopping_index_is_the_same_everywhere() {
    // Golden: every host must stop the same campaign after the same realisation.
    let stops = |rule: &StopRule| run_campaign(rule, 3).decision();
    let at = |n| Decision::Converged { realisations: n, samples: n };
    assert_eq!(stops(&paper(1e-3, false, 1)), at(2115));
    assert_eq!(stops(&paper(1e-3, true, 30)), at(1168));
    assert_eq!(stops(&interval_of_mean(0.02)), at(2190));
}

#[test]
fn every_part_of_the_interval_rule_must_hold() {
    let target = ExceedanceTarget { distance_m: 5.52, half_width: 0.04 };
    let all = StopRule::Interval {
        confidence: 0.95,
        mean_half_width: Some(0.05),
        sd_half_width: Some(0.06),
        exceedance: vec![target],
    };
    let estimator = run_campaign(&all, 7);
    let estimate = estimator.estimate();
    let share = |interval: [f64; 2], of: f64| 0.5 * (interval[1] - interval[0]) / of;
    assert!(share(estimate.mean_interval_m.unwrap(), estimate.mean_m.unwrap()) <= 0.05);
    assert!(share(estimate.sd_interval_m.unwrap(), estimate.sd_m.unwrap()) <= 0.06);
    assert!(share(estimate.exceedance[0].interval, 1.0) <= 0.04);
    // The exceedance needs most here: about p (1 - p) (1.96 / .04)^2 = 591 samples, plus Clopper-Pearson's caution of
    // half a sample at either end; the share itself is known to 0.02 only, which moves the number by 1 %.
    let samples = estimate.samples as f64;
    assert!((590.0..640.0).contains(&samples), "{samples}");
    // P(X > 5.52 m) of that Weibull distribution is .4380; 4.5 standard errors at 600 samples are .091.
    assert!((estimate.exceedance[0].probability - 0.4380).abs() < 0.091);
}

#[test]
fn what_the_rule_still_needs_is_guessed_well_enough_for_a_progress_bar() {
    // Median guess over 200 campaigns, beside the known medians. The guesses follow the standard deviation, known to 4 % from
    // 300 samples and to 7 % from 100, and the median over 200 of them has 1.25 / sqrt(200) of that: below 0.7 %. The
    // rest of the 5 % is left to the guess's own approximations.
    let median_guess = |rule: &StopRule, after: usize| {
        let guess = |seed| {
            let mut estimator = estimator(rule.clone(), 2, 1_000_000, OnFailure::Exclude);
            for (index, runout_m) in distances(seed).take(after).enumerate() {
                estimator.push(&sample(index as u64, runout_m)).unwrap();
            }
            (estimator.realisations() + estimator.expected_remaining().unwrap()) as f64
        };
        let mut guesses: Vec<f64> = (0..200).map(guess).collect();
        guesses.sort_by(f64::total_cmp);
        quantile(&guesses, 0.5)
    };
    for (patience, wanted) in [(1, 2071.0), (10, 5361.0), (30, 6563.0), (100, 15_706.0)] {
        let guess = median_guess(&paper(1e-3, false, patience), 300);
        assert!((guess / wanted - 1.0).abs() < 0.05, "patience {patience}: {guess}, known {wanted}");
    }
    let guess = median_guess(&interval_of_mean(0.05), 100);
    assert!((guess / 327.0 - 1.0).abs() < 0.05, "{guess}");
}

#[test]
fn realisations_are_counted_by_kind_and_only_samples_make_estimates() {
    let mut estimator = estimator(interval_of_mean(0.01), 2, 100, OnFailure::Exclude);
    let outcomes = [
        sample(0, 1.0),
        outcome(1, OutcomeKind::Stable, 0.05, Reason::AtRest),
        outcome(2, OutcomeKind::Failed, 0.0, Reason::NonFinite),
        outcome(3, OutcomeKind::Runout, 3.0, Reason::StillMoving),
        outcome(4, OutcomeKind::Runout, f64::NAN, Reason::AtRest),
        sample(5, 2.0),
    ];
    outcomes.iter().for_each(|o| estimator.push(o).unwrap());
    let e = estimator.estimate();
    assert_eq!((e.realisations, e.samples, e.stable, e.failed, e.still_moving), (6, 3, 1, 2, 1));
    assert_eq!((e.mean_m, e.variance_m2, e.min_m, e.max_m), (Some(2.0), Some(1.0), Some(1.0), Some(3.0)));
    assert_eq!(e.p_failure, Some(0.75));
    assert_eq!(estimator.samples_m(), [1.0, 3.0, 2.0]);
    assert_eq!(estimator.history()[1].mean_m, 2.0);
    assert_eq!(estimator.history()[1].realisations, 4);
    assert_eq!(estimator.decision(), Decision::Continue);
    assert_eq!(estimator.expected_remaining(), None);
}

#[test]
fn an_empty_campaign_has_no_numbers_rather_than_wrong_ones() {
    let e = estimator(paper(1e-3, false, 1), 1, 10, OnFailure::Exclude).estimate();
    assert_eq!((e.mean_m, e.p_failure, e.mean_interval_m, e.sd_interval_m), (None, None, None, None));
}

#[test]
fn outcomes_are_taken_in_index_order_only() {
    let mut estimator = estimator(paper(1e-3, false, 1), 1, 10, OnFailure::Exclude);
    estimator.push(&sample(0, 1.0)).unwrap();
    let before = estimator.estimate();
    assert_eq!(estimator.push(&sample(2, 9.0)), Err(OutOfOrder { expected: 1, found: 2 }));
    assert_eq!(estimator.push(&sample(0, 9.0)), Err(OutOfOrder { expected: 1, found: 0 }));
    assert_eq!(estimator.estimate(), before);
}

#[test]
fn a_decision_is_taken_once_and_keeps_its_prefix() {
    // Four equal samples meet any tolerance three times; the minimum of 6 realisations delays the decision.
    let mut at_minimum = estimator(paper(1e-3, false, 3), 6, 100, OnFailure::Exclude);
    (0..4).for_each(|i| at_minimum.push(&sample(i, 2.0)).unwrap());
    assert_eq!(at_minimum.decision(), Decision::Continue);
    at_minimum.push(&outcome(4, OutcomeKind::Stable, 0.0, Reason::AtRest)).unwrap();
    at_minimum.push(&outcome(5, OutcomeKind::Stable, 0.0, Reason::AtRest)).unwrap();
    let decided = Decision::Converged { realisations: 6, samples: 4 };
    assert_eq!(at_minimum.decision(), decided);
    let estimate = at_minimum.estimate();
    at_minimum.push(&sample(6, 50.0)).unwrap();
    assert_eq!((at_minimum.decision(), at_minimum.estimate()), (decided, estimate));
    assert_eq!(at_minimum.expected_remaining(), Some(0));

    let mut at_maximum = estimator(paper(1e-12, false, 1), 1, 3, OnFailure::Exclude);
    (0..3).for_each(|i| at_maximum.push(&sample(i, i as f64)).unwrap());
    assert_eq!(at_maximum.decision(), Decision::Maximum);
}

#[test]
fn a_failed_analysis_aborts_only_where_asked() {
    for (on_failure, wanted) in [
        (OnFailure::Exclude, Decision::Continue),
        (OnFailure::Abort, Decision::Aborted { index: 1, reason: Reason::LeftGrid }),
    ] {
        let mut estimator = estimator(paper(1e-3, false, 1), 5, 100, on_failure);
        estimator.push(&sample(0, 1.0)).unwrap();
        estimator.push(&outcome(1, OutcomeKind::Failed, 0.0, Reason::LeftGrid)).unwrap();
        assert_eq!(estimator.decision(), wanted);
    }
}

#[test]
fn the_exceedance_curve_counts_samples_beyond_each_distance() {
    let points = curve(&[3.0, 1.0, 2.0, 2.0], 4, 0.95);
    let shares: Vec<_> = points.iter().map(|p| (p.distance_m, p.conditional, p.unconditional)).collect();
    assert_eq!(shares, [(1.0, 0.75, 0.375), (2.0, 0.25, 0.125), (3.0, 0.0, 0.0)]);
    assert!(points.iter().all(|p| p.conditional_interval[0] <= p.conditional));
    assert!(points.iter().all(|p| p.conditional_interval[1] >= p.conditional));
    assert!(curve(&[], 3, 0.95).is_empty());
}

#[test]
fn a_distribution_free_bound_of_the_thousandth_needs_2995_samples() {
    let few: Vec<f64> = distances(1).take(2994).collect();
    let enough: Vec<f64> = distances(1).take(2995).collect();
    let bound = |samples: &[f64]| empirical_distance(samples, 1e-3, 0.95);
    assert_eq!((bound(&few).samples_needed, bound(&few).upper_bound_m), (2995, None));
    assert_eq!(bound(&enough).upper_bound_m, enough.iter().copied().reduce(f64::max));
    assert_eq!(empirical_distance(&[1.0, 2.0], 1e-3, 0.95).distance_m, None);
}

#[test]
fn the_distribution_free_bound_covers_the_true_quantile() {
    // The 10 % distance is 6 (ln 10)^(1/2.3). With 200 samples the exact coverage is the least binomial probability at or
    // above 95 %, at most 96.9 %; 4.5 standard errors over 2000 campaigns are 2.2 %.
    let true_distance = SCALE_M * libm::pow(std::f64::consts::LN_10, 1.0 / SHAPE);
    let covers = |seed| {
        let samples: Vec<f64> = distances(seed).take(200).collect();
        u32::from(empirical_distance(&samples, 0.1, 0.95).upper_bound_m.unwrap() >= true_distance)
    };
    let coverage = (0..2000).map(covers).sum::<u32>() as f64 / 2000.0;
    assert!((0.928..0.991).contains(&coverage), "{coverage}");
}

/// A fold that was saved and taken up again goes on as if nothing had happened, under either rule and at any place.
#[test]
fn a_fold_is_taken_up_where_it_was_left() {
    let interval = StopRule::Interval {
        confidence: 0.9,
        mean_half_width: Some(0.05),
        sd_half_width: Some(0.1),
        exceedance: vec![ExceedanceTarget { distance_m: 8.0, half_width: 0.05 }],
    };
    for rule in [paper(0.05, true, 3), interval] {
        let all: Vec<f64> = distances(7).take(400).collect();
        for broken_at in [0, 1, 40, 399] {
            let mut whole = estimator(rule.clone(), 300, 400, OnFailure::Exclude);
            let mut parts = whole.clone();
            for (index, runout_m) in (0..).zip(&all) {
                if index == broken_at {
                    let saved = serde_json::to_string(&parts.save()).unwrap();
                    let stop =
                        Stop { rule: rule.clone(), minimum_realisations: 300, maximum_realisations: 400 };
                    let sample =
                        Sample { measure: RunoutMeasure::MaxDisplacement, threshold_m: 0.1, profile: false };
                    let run = Run { on_failure: OnFailure::Exclude, audit_fraction: 0.0 };
                    let saved: runout_core::estimate::saved::Saved = serde_json::from_str(&saved).unwrap();
                    let samples = parts.samples_m().to_vec();
                    let short = samples.get(1..).map(<[f64]>::to_vec);
                    if let Some(short) = short {
                        assert!(Estimator::restore(&stop, &sample, &run, saved.clone(), short).is_none());
                    }
                    parts = Estimator::restore(&stop, &sample, &run, saved, samples).unwrap();
                }
                let outcome = if index % 3 == 0 {
                    outcome(index, OutcomeKind::Stable, 0.0, Reason::AtRest)
                } else {
                    self::sample(index, *runout_m)
                };
                whole.push(&outcome).unwrap();
                parts.push(&outcome).unwrap();
                assert_eq!(parts.decision(), whole.decision());
            }
            assert_eq!(parts.estimate(), whole.estimate());
            assert_eq!(parts.requirements(), whole.requirements());
            assert_eq!(parts.expected_remaining(), whole.expected_remaining());
        }
    }
}
