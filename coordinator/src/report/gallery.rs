//! The pictures of slides in the report: the typical realisation's fields and final state, and the tail's.

use super::Material;
use super::analysis::Analysis;
use super::figures::Figures;
use super::page::metres;
use crate::gallery::{displacement, fields, plastic_strain};
use crate::picture::PictureError;
use crate::picture::soil::SoilPicture;
use runout_core::realisation::Source;

/// Draws the picked slides that were replayed, and the slope with mean properties.
pub(super) fn pictures(
    figures: &mut Figures,
    material: &Material<'_>,
    analysis: &Analysis,
) -> Result<(), PictureError> {
    let Some(prepared) = material.prepared else { return Ok(()) };
    let (model, points) = (&material.spec.model, prepared.layout());
    for (place, pick) in analysis.picks.iter().enumerate() {
        let Some(replay) = material.replays.realisations.get(&pick.index) else { continue };
        let Some(scene) = &replay.scene else { continue };
        let what = format!("Realisation {}", pick.index);
        let alt = format!(
            "Section of the slope {:.1} s after failure, with a runout of {} m.",
            scene.time_s,
            metres(pick.runout_m)
        );
        if place == 0 && !material.campaign.random.is_empty() {
            let properties = prepared.properties(Source::Index(pick.index));
            let picture = fields(model, &material.campaign.random, &what, &points.x, &points.y, &properties);
            figures.picture(
                "typical-fields",
                format!("The random fields of the {} slide, realisation {}.", pick.label, pick.index),
                fields_in_words(&picture),
                &picture,
            )?;
            figures.picture(
                "typical-plastic-strain",
                "Its equivalent plastic strain at the end: where the soil has sheared.",
                &alt,
                &plastic_strain(model, &what, &replay.outcome, scene),
            )?;
        }
        let name = if place == 0 { "typical-displacement".to_owned() } else { format!("slide-{place}") };
        figures.picture(
            name,
            format!("The {} slide, realisation {}: {} m.", pick.label, pick.index, metres(pick.runout_m)),
            &alt,
            &displacement(model, &what, &replay.outcome, scene),
        )?;
    }
    if let Some((replay, scene)) =
        material.replays.mean_properties.as_ref().and_then(|r| Some((r, r.scene.as_ref()?)))
    {
        figures.picture(
            "mean-properties",
            "The slope with every random property at its distribution's mean.",
            format!("Section of that slope {:.1} s after failure.", scene.time_s),
            &displacement(model, "Mean properties", &replay.outcome, scene),
        )?;
    }
    Ok(())
}

fn fields_in_words(picture: &SoilPicture<'_>) -> String {
    let parts: Vec<String> = picture
        .panels
        .iter()
        .map(|panel| format!("{} from {:.2} to {:.2}", panel.label, panel.range.0, panel.range.1))
        .collect();
    format!("Fields at the material points: {}.", parts.join("; "))
}
