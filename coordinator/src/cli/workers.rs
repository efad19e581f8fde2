//! `runout workers`: what each worker did for a campaign, over all sessions.

use super::{Failure, print, print_json};
use crate::events;
use crate::history::{WorkerRecord, Workers};
use crate::machine::Machine;
use crate::run_directory;
use crate::status::duration;
use crate::store::LOG_FILE;
use crate::store::log::Record;
use crate::store::scan::{Line, Place, scan_file};
use crate::table::{Table, significant};
use clap::Args;
use std::path::PathBuf;

/// `runout workers DIR [--json]`
#[derive(Debug, Args)]
pub struct WorkersArguments {
    /// Run directory
    dir: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn workers(arguments: &WorkersArguments) -> Result<(), Failure> {
    let dir = &arguments.dir;
    run_directory::read_frame(dir).map_err(|e| Failure::Input(e.to_string()))?;
    let mut workers = Workers::default();
    let scan = scan_file(&dir.join(LOG_FILE), Place::default(), |line: Line<'_, Record>| {
        workers.entry(&line.entry);
        Ok(())
    });
    let scan = scan.map_err(|e| Failure::work(dir.join(LOG_FILE).display(), e))?;
    scan.into_damage().iter().for_each(|damage| tracing::warn!("{LOG_FILE}: {damage}"));
    let unreadable = events::read(dir, |noted| workers.event(&noted));
    let unreadable = unreadable.map_err(|e| Failure::work(dir.join(events::EVENTS_FILE).display(), e))?;
    if unreadable > 0 {
        tracing::warn!("{}: {unreadable} lines cannot be read and are left out", events::EVENTS_FILE);
    }
    let records = workers.finish();
    if arguments.json { print_json(&records) } else { print(&text(&records)) }
}

fn text(records: &[WorkerRecord]) -> String {
    if records.is_empty() {
        return "no worker has taken part yet\n".to_owned();
    }
    let mut table = Table::new([
        "worker",
        "slots",
        "realisations",
        "wall time",
        "point updates/s",
        "losses",
        "conflicts",
        "audits",
        "open",
        "first seen",
        "last seen",
        "machine",
    ]);
    let moment = |at: &Option<String>| at.as_deref().map_or("-".to_owned(), |at| at[..19].replace('T', " "));
    for of in records {
        table.row([
            of.worker.clone(),
            of.slots.map_or("-".to_owned(), |slots| slots.to_string()),
            of.realisations.to_string(),
            duration(of.wall_s),
            of.point_updates_per_s.map_or("-".to_owned(), |speed| significant(speed, 3)),
            of.losses.to_string(),
            of.conflicts.to_string(),
            of.audits.to_string(),
            of.open.to_string(),
            moment(&of.first_seen),
            moment(&of.last_seen),
            of.machine.as_ref().map_or("-".to_owned(), Machine::to_string),
        ]);
    }
    table.render() + "times are UTC; losses and times are known as far as events.log goes back\n"
}
