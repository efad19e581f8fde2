//! The report: one self-contained page, and its figures as SVG and PNG.
//!
//! [`analysis`] makes the numbers from the outcomes ([`families`] the fitted tails, [`reach`] what is reached along the
//! ground), [`hazard`] those from profiles, [`deterministic`] and [`sensitivity`] those that need replays or fields
//! ([`picks`] says which),
//! [`figures`] draws, `page` and its parts say it in words. The same run directory gives the same page, byte for byte: it
//! bears no date.

pub mod analysis;
mod answer;
pub mod deterministic;
mod distances;
pub mod families;
pub mod figures;
mod gallery;
mod ground;
pub mod hazard;
pub mod html;
mod inputs;
mod page;
pub mod picks;
pub mod reach;
pub mod sensitivity;
mod slides;

use crate::machine::Machine;
use crate::picture::PictureError;
use crate::replays::Replay;
use analysis::{Analysis, Distance};
use figures::{Figure, Figures};
use hazard::Evidence;
use runout_core::campaign::Campaign;
use runout_core::estimate::Estimate;
use runout_core::fit::Fit;
use runout_core::outcome::Outcome;
use runout_core::profile::{Profile, Stations};
use runout_core::realisation::Prepared;
use runout_core::seed::Purpose;
use runout_core::site::SiteData;
use runout_core::spec::Spec;
use std::collections::BTreeMap;

/// What a report is made from.
#[derive(Debug, Clone, Copy)]
pub struct Material<'a> {
    /// The campaign.
    pub campaign: &'a Campaign,
    /// The campaign file as written.
    pub campaign_text: &'a str,
    /// The site table, if anything was measured.
    pub site: Option<&'a SiteData>,
    /// The fit.
    pub fit: &'a Fit,
    /// The frozen spec.
    pub spec: &'a Spec,
    /// The outcomes in index order.
    pub outcomes: &'a [Outcome],
    /// What the run directory has to say beside its outcomes, for example of two results that differ.
    pub notes: &'a [String],
    /// The spec laid out, for the fields behind the outcomes; without it there is no sensitivity and no picture.
    pub prepared: Option<&'a Prepared>,
    /// What was replayed.
    pub replays: &'a Replays,
    /// Who ran the realisations.
    pub work: &'a [Work],
}

/// Analyses run again for the report.
#[derive(Debug, Clone, Default)]
pub struct Replays {
    /// The slope with mean properties.
    pub mean_properties: Option<Replay>,
    /// Realisations by index.
    pub realisations: BTreeMap<u64, Replay>,
    /// Those of them that were chosen at random for the profile along the ground, where the campaign records none.
    pub profiled: Vec<u64>,
}

impl Replays {
    /// The samples to be profiled, at most `count`, chosen by the campaign's seed among `samples`.
    pub fn choose(samples: &[u64], count: usize, campaign_seed: u64) -> Vec<u64> {
        picks::chosen(samples, count, campaign_seed, Purpose::ReportReplays)
    }

    /// Replayed realisations whose outcome is not the recorded one.
    fn differing(&self, outcomes: &[Outcome]) -> Vec<u64> {
        let differs = |(index, replay): &(&u64, &Replay)| {
            usize::try_from(**index).ok().and_then(|i| outcomes.get(i)) != Some(&replay.outcome)
        };
        self.realisations.iter().filter(differs).map(|(index, _)| *index).collect()
    }
}

/// What one worker did.
#[derive(Debug, Clone, PartialEq)]
pub struct Work {
    /// Its name.
    pub worker: String,
    /// Realisations it ran.
    pub realisations: u64,
    /// Wall time of all of them, s.
    pub wall_s: f64,
    /// What it ran on, as far as that was noted; several if it came back from another machine.
    pub machines: Vec<Machine>,
}

/// A finished report.
#[derive(Debug, Clone)]
pub struct Report {
    /// The page.
    pub html: String,
    /// Its figures.
    pub figures: Vec<Figure>,
    /// The estimates it gives.
    pub estimate: Estimate,
    /// The distances of rare slides.
    pub distances: Vec<Distance>,
}

/// The numbers of the page.
struct Findings {
    analysis: Analysis,
    mean_run: Option<deterministic::Deterministic>,
    hazard: Option<hazard::Hazard>,
    sensitivity: sensitivity::Sensitivity,
    /// Replayed realisations that gave another outcome.
    differing: Vec<u64>,
}

/// Makes the report.
///
/// # Errors
/// A figure that cannot be drawn.
pub fn report(material: &Material<'_>) -> Result<Report, PictureError> {
    let found = find(material);
    let model = &material.spec.model;
    let mut figures = Figures(vec![figures::section(model)?]);
    figures::soil(&mut figures, material)?;
    figures::samples(&mut figures, &found.analysis, found.mean_run.as_ref())?;
    figures::hazard(&mut figures, model, &found.analysis, found.hazard.as_ref())?;
    figures::influences(&mut figures, &found.sensitivity)?;
    gallery::pictures(&mut figures, material, &found.analysis)?;
    let figures = figures.0;
    let html = page::page(material, &found, &figures);
    let Analysis { estimate, distances, .. } = found.analysis;
    Ok(Report { html, figures, estimate, distances })
}

fn find(material: &Material<'_>) -> Findings {
    let analysis = analysis::analyse(material.campaign, material.outcomes);
    let confidence = analysis.estimate.confidence;
    let model = &material.spec.model;
    let replays = material.replays;
    let mean_run = replays.mean_properties.as_ref().and_then(|replay| {
        deterministic::beside(
            &replay.outcome,
            &model.sample,
            &analysis.samples_m,
            analysis.estimate.stable,
            &analysis.families,
            confidence,
        )
    });
    let decided =
        &material.outcomes[..(analysis.estimate.realisations as usize).min(material.outcomes.len())];
    let (profiles, evidence) = profiles(material, decided, &analysis.indices);
    let stations = Stations::of(&model.slope, &model.mesh);
    Findings {
        hazard: hazard::hazard(&stations, &profiles, evidence, &analysis.reach, confidence),
        sensitivity: material
            .prepared
            .map(|prepared| sensitivity::sensitivity(prepared, decided, confidence))
            .unwrap_or_default(),
        differing: replays.differing(material.outcomes),
        mean_run,
        analysis,
    }
}

/// The profiles that the hazard rests on: those of all samples, or where one has none, of those replayed for it.
fn profiles<'a>(
    material: &Material<'a>,
    decided: &'a [Outcome],
    samples: &[u64],
) -> (Vec<&'a Profile>, Evidence) {
    let replays = material.replays;
    let replayed = || {
        let found = replays.profiled.iter().filter_map(|index| replays.realisations.get(index));
        (found.filter_map(|replay| replay.profile.as_ref()).collect(), Evidence::Replayed)
    };
    hazard::recorded(decided, samples).map_or_else(replayed, |all| (all, Evidence::Recorded))
}
