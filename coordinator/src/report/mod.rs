//! The report: one self-contained page, and its figures as SVG.
//!
//! [`analysis`] makes the numbers ([`families`] the fitted tails), [`figures`] the charts, `answer`, `page`
//! and `inputs` the text. The same run directory gives the same page, byte for byte: it bears no date.

pub mod analysis;
mod answer;
pub mod families;
pub mod figures;
pub mod html;
mod inputs;
mod page;

use crate::picture::PictureError;
use figures::Figure;
use runout_core::campaign::Campaign;
use runout_core::fit::Fit;
use runout_core::outcome::Outcome;
use runout_core::site::SiteData;
use runout_core::spec::Spec;

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
}

/// A finished report.
#[derive(Debug, Clone)]
pub struct Report {
    /// The page.
    pub html: String,
    /// Its figures.
    pub figures: Vec<Figure>,
}

/// Makes the report.
///
/// # Errors
/// A figure that cannot be drawn.
pub fn report(material: &Material<'_>) -> Result<Report, PictureError> {
    let analysis = analysis::analyse(material.campaign, material.outcomes);
    let mut figures = vec![figures::section(&material.spec.model)?];
    figures.extend(figures::figures(&analysis)?);
    let html = page::page(material, &analysis, &figures);
    Ok(Report { html, figures })
}
