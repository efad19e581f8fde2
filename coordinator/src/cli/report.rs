//! `runout report`: one self-contained page and its figures, in the run directory.

use super::{Failure, print, run_records::RunRecords};
use crate::report::{self, Material};
use clap::Args;
use runout_core::outcome::Outcome;
use std::path::{Path, PathBuf};

/// `runout report DIR`
#[derive(Debug, Args)]
pub struct ReportArguments {
    /// Run directory; report.html and figures/ are written into it
    dir: PathBuf,
}

pub(super) fn report(arguments: &ReportArguments) -> Result<(), Failure> {
    let dir = &arguments.dir;
    let run = RunRecords::read(dir)?;
    run.warn();
    let outcomes: Vec<Outcome> = run.decided().iter().map(|r| r.outcome.clone()).collect();
    let notes = run.notes();
    let report = report::report(&Material {
        campaign: &run.loaded.campaign,
        campaign_text: &run.view.campaign_text,
        site: run.loaded.site.as_ref(),
        fit: &run.loaded.fit,
        spec: &run.view.spec,
        outcomes: &outcomes,
        notes: &notes,
    })
    .map_err(|e| Failure::work(dir.display(), e))?;
    let figures = dir.join("figures");
    std::fs::create_dir_all(&figures).map_err(|e| Failure::work(figures.display(), e))?;
    let page = dir.join("report.html");
    write(&page, report.html.as_bytes())?;
    let mut said = format!("wrote {}\n", page.display());
    for figure in &report.figures {
        let path = figures.join(format!("{}.svg", figure.name));
        write(&path, figure.svg.as_bytes())?;
        said.push_str(&format!("wrote {}\n", path.display()));
    }
    print(&said)?;
    Ok(())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    std::fs::write(path, bytes).map_err(|e| Failure::work(path.display(), e))
}
