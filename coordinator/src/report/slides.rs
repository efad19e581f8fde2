//! The page's part on slides as they look, and on the slope with mean properties.

use super::Findings;
use super::figures::Figure;
use super::html::paragraph;
use super::page::{find, interval, metres, percent};

/// The deterministic run beside the samples.
pub(super) fn mean_properties(found: &Findings, figures: &[Figure]) -> String {
    let Some(run) = &found.mean_run else {
        return paragraph(
            "It was not run, its analysis failed, or there is no sample to set it beside: \
             <code>runout simulate campaign.toml --deterministic</code> runs it.",
        );
    };
    let fitted = run.fitted_share.map_or_else(String::new, |share| {
        format!(", and {} by the best fitted distribution", percent(share))
    });
    let mut html = paragraph(format!(
        "With every random property at its distribution's mean the slope {} {} m{}. <strong>{}</strong> of the {} samples go \
         farther, {}{}{fitted}; of all realisations, stable ones included, {}.",
        if run.failed { "runs" } else { "is stable: it moves" },
        metres(run.runout_m),
        if run.still_moving { " and still moves when its analysis ends" } else { "" },
        run.beyond,
        found.analysis.samples_m.len(),
        percent(run.share),
        run.share_interval.map_or_else(String::new, |i| format!(" ({})", interval(i, percent))),
        percent(run.share_of_all),
    ));
    html.push_str(&paragraph(
        "One analysis with means says nothing of how likely its result is: soil is weakest where it matters most, and a slope \
         fails along its weak parts, so that the mean of the runouts is not the runout of the means.",
    ));
    html + &find(figures, "mean-properties")
}

/// The typical slide, and those of the tail.
pub(super) fn gallery(found: &Findings, figures: &[Figure]) -> String {
    let shown: Vec<String> = found
        .analysis
        .picks
        .iter()
        .map(|pick| format!("{} {} m (realisation {})", pick.label, metres(pick.runout_m), pick.index))
        .collect();
    if shown.is_empty() {
        return paragraph("No realisation has failed yet.");
    }
    let mut html = paragraph(format!("Order statistics of the samples: {}.", shown.join(", ")));
    let displacement = find(figures, "typical-displacement");
    if displacement.is_empty() {
        html.push_str(&paragraph(
            "Pictures need replays: <code>runout report DIR</code> without <code>--no-gallery</code>, or \
             <code>runout replay DIR INDEX --out FOLDER</code> for one with an animation and a ParaView series.",
        ));
        return html;
    }
    html.push_str("<h3>The median slide</h3>\n");
    html.push_str(&displacement);
    html.push_str(&find(figures, "typical-plastic-strain"));
    html.push_str(&find(figures, "typical-fields"));
    let tail: Vec<&str> =
        figures.iter().map(|f| f.name.as_str()).filter(|name| name.starts_with("slide-")).collect();
    if !tail.is_empty() {
        html.push_str("<h3>The tail</h3>\n");
        tail.iter().for_each(|name| html.push_str(&find(figures, name)));
    }
    html.push_str(&paragraph(
        "Axes to scale; the dashed line is the ground before failure. Each picture was drawn from a replay whose outcome was compared \
         with the recorded one.",
    ));
    html
}
