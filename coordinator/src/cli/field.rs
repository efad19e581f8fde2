//! `runout field`: the random fields of one realisation as a table, a ParaView file or a picture.

use super::analysis::prepare;
use super::{Failure, index, print, print_json, write_asked};
use crate::gallery::{edge_units, fields};
use crate::load;
use crate::picture;
use crate::vtu::{PointArray, vtu};
use clap::Args;
use runout_core::points::Points;
use runout_core::realisation::{PointProperties, Source};
use runout_core::site::Property;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// `runout field CAMPAIGN --index I --out FILE [--json]`
#[derive(Debug, Args)]
pub struct FieldArguments {
    /// Campaign file
    campaign: PathBuf,
    /// Index of the realisation
    #[arg(long, value_name = "I", value_parser = index, allow_negative_numbers = true)]
    index: u64,
    /// File to write: .csv (x, y and the properties at every material point), .vtu (ParaView) or .png (picture)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print one JSON document: what was written, and the mean and range of each property
    #[arg(long)]
    json: bool,
}

/// The names of this document are a contract.
#[derive(Serialize)]
struct Document<'a> {
    file: &'a Path,
    index: u64,
    points: usize,
    properties: BTreeMap<&'static str, Summary>,
}

/// A property over the material points, in the units of its name.
#[derive(Serialize)]
struct Summary {
    mean: f64,
    smallest: f64,
    largest: f64,
}

impl Summary {
    fn of(values: &[f64]) -> Summary {
        Summary {
            mean: values.iter().sum::<f64>() / values.len() as f64,
            smallest: values.iter().copied().fold(f64::INFINITY, f64::min),
            largest: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

#[derive(Debug, Clone, Copy)]
enum Format {
    Csv,
    Vtu,
    Png,
}

pub(super) fn field(arguments: &FieldArguments) -> Result<(), Failure> {
    let FieldArguments { campaign, index, out, json } = arguments;
    let format = format(out)?;
    let loaded = load::load(campaign)?;
    let prepared = prepare(&loaded.spec)?;
    let properties = prepared.properties(Source::Index(*index));
    let points = prepared.layout();
    let random = &loaded.campaign.random;
    let bytes = match format {
        Format::Csv => csv(points, random, &properties)?,
        Format::Vtu => {
            let array = |p: &Property| PointArray {
                name: p.name(),
                components: 1,
                values: edge_units(*p, &properties),
            };
            let arrays: Vec<PointArray<'_>> = random.iter().map(array).collect();
            vtu(&points.x, &points.y, &arrays)
        }
        Format::Png => {
            let what = format!("{}, realisation {index}", loaded.campaign.name);
            let picture = fields(&loaded.spec.model, random, &what, &points.x, &points.y, &properties);
            picture::png(&picture).map_err(|e| Failure::Work(e.to_string()))?
        }
    };
    write_asked(out, &bytes)?;
    if *json {
        let summary = |p: &Property| (p.name(), Summary::of(&edge_units(*p, &properties)));
        let properties = random.iter().map(summary).collect();
        return print_json(&Document { file: out, index: *index, points: points.len(), properties });
    }
    print(&format!("wrote {} ({} points)\n", out.display(), points.len()))
}

fn format(out: &Path) -> Result<Format, Failure> {
    match out.extension().and_then(|e| e.to_str()) {
        Some("csv") => Ok(Format::Csv),
        Some("vtu") => Ok(Format::Vtu),
        Some("png") => Ok(Format::Png),
        _ => {
            Err(Failure::Input(format!("--out {}: its extension must be .csv, .vtu or .png", out.display())))
        }
    }
}

fn csv(points: &Points, random: &[Property], properties: &PointProperties) -> Result<Vec<u8>, Failure> {
    let fault = |e: csv::Error| Failure::work("CSV", e);
    let mut columns = vec![points.x.clone(), points.y.clone()];
    columns.extend(random.iter().map(|p| edge_units(*p, properties)));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(["x_m", "y_m"].into_iter().chain(random.iter().map(|p| p.name()))).map_err(fault)?;
    for i in 0..points.len() {
        let row: Vec<f64> = columns.iter().map(|c| c[i]).collect();
        writer.serialize(row).map_err(fault)?;
    }
    writer.into_inner().map_err(|e| Failure::work("CSV", e))
}
