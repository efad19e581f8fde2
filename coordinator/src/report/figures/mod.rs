//! The report's figures: charts as vectors, states of slopes as pictures.

mod convergence;
mod ground;
mod runout;
mod soil;

use super::analysis::Analysis;
use super::deterministic::Deterministic;
use super::families::Method;
use super::hazard::{Evidence, Hazard};
use super::page::{interval, metres, optional_interval, percent};
use super::sensitivity::{Correlation, Sensitivity};
use super::{Material, inputs};
use crate::picture::axes::Axis;
use crate::picture::chart::SERIES;
use crate::picture::forest::{Forest, Row, Whisker};
use crate::picture::section::Section;
use crate::picture::{self, Draw, PictureError};
use plotters::style::RGBColor;
use runout_core::campaign::{InitialPorePressure, Model};
use runout_core::marginal::Family;

/// Abscissae of a smooth curve: more would show the rounding to whole pixels as a tremble.
const CURVE_POINTS: usize = 96;

/// A figure with the name of its files, its caption, and words for those who do not see it.
#[derive(Debug, Clone)]
pub struct Figure {
    /// File name without extension.
    pub name: String,
    /// Caption in plain words.
    pub caption: String,
    /// What is to be seen, with numbers.
    pub alt: String,
    /// The figure.
    pub content: Content,
}

/// The figure itself.
#[derive(Debug, Clone)]
pub enum Content {
    /// A chart: as SVG text for the page, and as a PNG file.
    Chart {
        /// SVG document.
        svg: String,
        /// PNG file.
        png: Vec<u8>,
    },
    /// A picture of many thousand points: as a PNG file, which is smaller than its vectors.
    Picture(Vec<u8>),
}

/// Gathers figures.
pub(super) struct Figures(pub(super) Vec<Figure>);

impl Figures {
    /// Draws a chart and adds it.
    fn chart(
        &mut self,
        name: impl Into<String>,
        caption: impl Into<String>,
        alt: impl Into<String>,
        chart: &impl Draw,
    ) -> Result<(), PictureError> {
        self.0.push(chart_figure(name, caption, alt, chart)?);
        Ok(())
    }

    /// Draws a picture and adds it.
    pub(super) fn picture(
        &mut self,
        name: impl Into<String>,
        caption: impl Into<String>,
        alt: impl Into<String>,
        picture: &impl Draw,
    ) -> Result<(), PictureError> {
        let content = Content::Picture(picture::png(picture)?);
        self.0.push(Figure { name: name.into(), caption: caption.into(), alt: alt.into(), content });
        Ok(())
    }
}

fn chart_figure(
    name: impl Into<String>,
    caption: impl Into<String>,
    alt: impl Into<String>,
    chart: &impl Draw,
) -> Result<Figure, PictureError> {
    let content = Content::Chart { svg: picture::svg(chart)?, png: picture::png(chart)? };
    Ok(Figure { name: name.into(), caption: caption.into(), alt: alt.into(), content })
}

/// The section as the campaign file gives it.
///
/// # Errors
/// A picture that cannot be drawn.
pub fn section(model: &Model) -> Result<Figure, PictureError> {
    let mut caption = "The section before failure, to scale".to_owned();
    if !model.layers.is_empty() {
        caption.push_str("; layers by their names");
    }
    if model.water.initial_pore_pressure != InitialPorePressure::None {
        caption.push_str("; dashed: water table at the start where it is below the ground");
    }
    if model.water.free_water_level_m.is_some() {
        caption.push_str("; blue: free water");
    }
    if !model.obstacles.is_empty() {
        caption.push_str("; dark: rigid obstacles, their sides on the grid");
    }
    chart_figure("section", caption + ".", inputs::section_in_words(model), &Section::of(model))
}

/// Site data and fits.
pub(super) fn soil(figures: &mut Figures, material: &Material<'_>) -> Result<(), PictureError> {
    let properties = &material.campaign.random;
    for property in properties {
        let fit = &material.fit.marginals[property.name()];
        let measured = material.site.and_then(|site| {
            let column = site.properties.iter().position(|p| p == property)?;
            Some(site.values[column].as_slice())
        });
        let (mean, sd) = fit.best.moments();
        figures.chart(
            format!("soil-{}", property.name().replace('_', "-")),
            format!(
                "Distribution function of the {}: the tests, and the families fitted to them.",
                short_name(*property)
            ),
            format!(
                "The chosen {} distribution has the mean {mean:.3} and the standard deviation {sd:.3}.",
                fit.best.family.name()
            ),
            &soil::marginal(*property, fit, measured),
        )?;
    }
    for (i, j) in crate::fit_tables::pairs(properties.len()) {
        let Some(chart) = soil::pair(material, i, j) else { continue };
        let (a, b) = (properties[i].name(), properties[j].name());
        figures.chart(
            format!("soil-pair-{}-{}", a.replace('_', "-"), b.replace('_', "-")),
            format!(
                "Pairs of {} and {}: the tests, and 600 draws from the chosen marginals and copula.",
                short_name(properties[i]),
                short_name(properties[j])
            ),
            format!(
                "The chosen {} copula has a Kendall's tau of {:.3} between the two.",
                material.spec.copula.family().name(),
                material.spec.copula.kendall_tau(i, j)
            ),
            &chart,
        )?;
    }
    Ok(())
}

/// What the samples of runout allow.
pub(super) fn samples(
    figures: &mut Figures,
    analysis: &Analysis,
    mean_run: Option<&Deterministic>,
) -> Result<(), PictureError> {
    if analysis.samples_m.len() < 2 {
        return Ok(());
    }
    let estimate = &analysis.estimate;
    let percent_level = percent(estimate.confidence);
    let mean = estimate.mean_m.unwrap_or_default();
    let spread = format!(
        "{} samples from {} to {} m, mean {} m ({}), standard deviation {} m.",
        estimate.samples,
        metres(estimate.min_m.unwrap_or_default()),
        metres(estimate.max_m.unwrap_or_default()),
        metres(mean),
        optional_interval(estimate.mean_interval_m, metres),
        metres(estimate.sd_m.unwrap_or_default()),
    );
    figures.chart(
        "outcomes",
        format!(
            "Every sample by its realisation's index, with the running mean and its {percent_level} interval."
        ),
        spread.clone(),
        &convergence::outcomes(analysis),
    )?;
    figures.chart(
        "convergence-mean",
        format!("Mean runout after each sample, with its {percent_level} interval."),
        format!(
            "It ends at {} m, interval {}.",
            metres(mean),
            optional_interval(estimate.mean_interval_m, metres)
        ),
        &convergence::mean(analysis),
    )?;
    let variance = estimate.variance_m2.unwrap_or_default();
    figures.chart(
        "convergence-variance",
        format!("Variance of runout after each sample, with its {percent_level} interval."),
        format!("It ends at {variance:.3} m\u{b2}."),
        &convergence::variance(analysis),
    )?;
    figures.chart(
        "convergence-cov",
        "Coefficient of variation of runout after each sample.",
        format!("It ends at {:.3}.", estimate.cov.unwrap_or_default()),
        &convergence::cov(analysis),
    )?;
    figures.chart(
        "convergence-failure",
        format!("Probability of failure after each realisation, with its {percent_level} interval."),
        format!(
            "It ends at {}, interval {}.",
            percent(estimate.p_failure.unwrap_or_default()),
            optional_interval(estimate.p_failure_interval, percent)
        ),
        &convergence::failure(analysis),
    )?;
    figures.chart(
        "histogram-likelihood",
        "Histogram of the samples of runout with the four families fitted by maximum likelihood.",
        spread.clone(),
        &runout::histogram(analysis, Method::Likelihood, mean_run),
    )?;
    figures.chart(
        "histogram-moments",
        "The same histogram with the four families fitted by the method of moments, as the paper does.",
        spread.clone(),
        &runout::histogram(analysis, Method::Moments, mean_run),
    )?;
    figures.chart(
        "cdf",
        format!(
            "Distribution function of the samples with its pointwise {percent_level} interval, and of the families \
             fitted by maximum likelihood."
        ),
        spread,
        &runout::cdf(analysis, mean_run),
    )?;
    let distances = distances_in_words(analysis);
    figures.chart(
        "exceedance",
        format!(
            "Probability that the runout exceeds a distance: given failure (with pointwise {percent_level} interval){}.",
            if analysis.estimate.stable > 0 { ", and with the stable realisations included (dashed)" } else { "" }
        ),
        distances.clone(),
        &runout::exceedance(analysis, false, mean_run),
    )?;
    figures.chart(
        "exceedance-log",
        format!(
            "The same on a logarithmic scale, with the fitted families (maximum likelihood), which are all that \
             speaks beyond the largest sample. Pointwise {percent_level} interval."
        ),
        distances,
        &runout::exceedance(analysis, true, mean_run),
    )?;
    figures.chart(
        "volume",
        "Area of the section (volume per metre of width) that moved more than the threshold, in the samples.",
        range_in_words(&analysis.moved_areas_m2, "m\u{b2}"),
        &ground::amounts(&analysis.moved_areas_m2, "moved area (m\u{b2})"),
    )?;
    figures.chart(
        "retreat",
        "Distance behind the crest's edge to which the ground moved more than the threshold, in the samples.",
        range_in_words(&analysis.retreats_m, "m"),
        &ground::amounts(&analysis.retreats_m, "retreat of the crest (m)"),
    )
}

/// The profile along the ground.
pub(super) fn hazard(
    figures: &mut Figures,
    model: &Model,
    analysis: &Analysis,
    hazard: Option<&Hazard>,
) -> Result<(), PictureError> {
    let Some(at_toe) = analysis.reach.in_front(0.0) else { return Ok(()) };
    let decided = analysis.estimate.samples + analysis.estimate.stable;
    let level = percent(analysis.estimate.confidence);
    let mut caption = format!(
        "Probability that the ground in front of the toe is reached, over all {decided} realisations, with its pointwise {level} \
         interval"
    );
    if let Some(hazard) = hazard {
        let (deposits, samples) = match hazard.evidence {
            Evidence::Recorded => ("that of deposits of some depths; ", "all"),
            Evidence::Replayed => ("", "chosen at random and replayed"),
        };
        caption.push_str(&format!(
            "; below it {deposits}depth of the deposit and highest speed given failure, over {} samples ({samples}), with the \
             quantiles' pointwise intervals; constant over each column of {} m",
            hazard.profiles,
            metres(hazard.column_m)
        ));
    }
    figures.chart(
        "hazard-profile",
        caption + ".",
        format!(
            "The toe is passed in {} of the realisations; the farthest front lies {} m in front of it.",
            percent(at_toe.share),
            metres(analysis.reach.farthest_m()),
        ),
        &ground::profile(model, analysis, hazard),
    )?;
    figures.chart(
        "hazard-crest",
        format!(
            "Probability that the ground behind the crest's edge is lost, over all {decided} realisations, with its pointwise \
             {level} interval."
        ),
        format!("The crest retreats by up to {} m.", metres(analysis.reach.largest_retreat_m())),
        &ground::crest(model, analysis),
    )
}

/// Rank correlations with intervals.
pub(super) fn influences(figures: &mut Figures, sensitivity: &Sensitivity) -> Result<(), PictureError> {
    let whisker = |c: Option<Correlation>| c.map(|c| Whisker { value: c.rho, interval: c.interval });
    let rows: Vec<Row> = sensitivity
        .influences
        .iter()
        .map(|i| Row {
            label: format!("{}, {}", short_name(i.property), i.zone),
            whiskers: vec![whisker(i.of_all), whisker(i.of_samples)],
        })
        .collect();
    if rows.iter().all(|row| row.whiskers.iter().all(Option::is_none)) {
        return Ok(());
    }
    let strongest = sensitivity
        .influences
        .iter()
        .filter_map(|i| i.of_all.map(|c| (c, i)))
        .max_by(|a, b| a.0.rho.abs().total_cmp(&b.0.rho.abs()));
    let alt = strongest.map(|(c, i)| {
        format!(
            "Strongest over all realisations: {}, {}, with {:.2} ({}).",
            short_name(i.property),
            i.zone,
            c.rho,
            interval(c.interval, |v| format!("{v:.2}"))
        )
    });
    figures.chart(
        "sensitivity",
        "Rank correlation of the runout with the mean of a property over a zone, with 95 % intervals: to the left, stronger soil runs less far."
            .replace("95 %", &percent(sensitivity.confidence)),
        alt.unwrap_or_default(),
        &Forest {
            axis: Axis::linear("Spearman's rank correlation", -1.0, 1.0),
            series: vec![("all realisations".to_owned(), SERIES[0]), ("samples alone".to_owned(), SERIES[1])],
            rows,
        },
    )
}

/// A property's name without its unit.
pub(super) fn short_name(property: runout_core::site::Property) -> &'static str {
    use runout_core::site::Property;
    match property {
        Property::Cohesion => "cohesion",
        Property::FrictionAngle => "friction angle",
        Property::UnitWeight => "unit weight",
    }
}

fn distances_in_words(analysis: &Analysis) -> String {
    let parts = analysis.distances.iter().filter_map(|d| {
        let fitted = d.fitted.as_ref()?;
        Some(format!("{} m with {}", metres(fitted.best_m), percent(d.probability)))
    });
    let parts: Vec<String> = parts.collect();
    match parts.is_empty() {
        true => "The curve falls from 100 % at 0 m to 0 % at the longest sample.".to_owned(),
        false => format!("Given failure, the runout exceeds {} by the best family.", parts.join(", ")),
    }
}

fn range_in_words(values: &[f64], unit: &str) -> String {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted.get((share * sorted.len().saturating_sub(1) as f64).round() as usize);
    match (at(0.0), at(0.5), at(1.0)) {
        (Some(low), Some(middle), Some(high)) => {
            format!("From {low:.2} to {high:.2} {unit}, median {middle:.2} {unit}.")
        }
        _ => String::new(),
    }
}

/// A family has one colour in every chart.
fn family_colour(family: Family) -> RGBColor {
    match family {
        Family::TruncNormal => SERIES[2],
        Family::Lognormal => SERIES[4],
        Family::TruncGumbel => SERIES[3],
        Family::Weibull => SERIES[1],
    }
}

/// The legend's name of an interval.
fn percent_interval(analysis: &Analysis) -> String {
    format!("{:.0} % interval", analysis.estimate.confidence * 100.0)
}

fn curve(from: f64, to: f64, f: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    (0..=CURVE_POINTS)
        .map(|k| from + (to - from) * k as f64 / CURVE_POINTS as f64)
        .map(|x| (x, f(x)))
        .filter(|p| p.1.is_finite())
        .collect()
}
