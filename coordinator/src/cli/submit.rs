//! `runout submit`: hands a campaign to a batch system.

use super::{Failure, print, print_json};
use crate::run_directory::{Contents, RunDirectory};
use crate::serve::ServeError;
use crate::submit::slurm::{Jobs, Plan, Scripts};
use crate::submit::{shell_word, time_limit};
use crate::{load, local};
use clap::{Args, Subcommand};
use serde::Serialize;
use std::num::NonZeroU16;
use std::path::{Path, PathBuf};

/// Arguments of `runout submit`.
#[derive(Debug, Clone, Args)]
pub struct SubmitArgs {
    /// The batch system
    #[command(subcommand)]
    pub system: System,
}

/// A batch system.
#[derive(Debug, Clone, Subcommand)]
pub enum System {
    /// Submit a coordinator and an array of workers to Slurm, on a file system that its nodes share
    Slurm(SlurmArgs),
}

/// Arguments of `runout submit slurm`.
#[derive(Debug, Clone, Args)]
pub struct SlurmArgs {
    /// Campaign file
    pub campaign: PathBuf,
    /// Run directory: made anew, or continued if it holds this campaign
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Workers: tasks of a job array, each with a place in the queue of its own
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub workers: u32,
    /// Time limit of every job, as sbatch takes it (90, 12:00:00, 2-00:00:00); they are requeued until the campaign is
    /// over
    #[arg(long, value_name = "T")]
    pub time: String,
    /// Realisations at a time in each worker, one core each
    #[arg(long, value_name = "N", default_value = "1")]
    pub slots: NonZeroU16,
    /// Print the scripts; write and submit nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Print the jobs' numbers as JSON
    #[arg(long)]
    pub json: bool,
    /// Flags for sbatch, for both jobs (--account=A, --partition=P ...)
    #[arg(last = true, value_name = "SBATCH FLAGS")]
    pub flags: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Submitted {
    coordinator_job: String,
    workers_job: String,
    run_directory: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// What cannot be done.
pub(super) fn submit(args: &SubmitArgs) -> Result<(), Failure> {
    match &args.system {
        System::Slurm(args) => slurm(args),
    }
}

fn slurm(args: &SlurmArgs) -> Result<(), Failure> {
    let limit_s = time_limit::seconds(&args.time)
        .map_err(|why| Failure::Input(format!("--time {}: {why}", args.time)))?;
    let loaded = load::load(&args.campaign)?;
    let runout = std::env::current_exe().map_err(|e| Failure::work("where this program is", e))?;
    let plan = Plan {
        name: loaded.campaign.name.clone(),
        run_directory: std::path::absolute(&args.out)
            .map_err(|e| Failure::Input(format!("--out {}: {e}", args.out.display())))?,
        worker: local::worker_program(None)?,
        runout,
        workers: args.workers,
        slots: args.slots.get(),
        time: args.time.clone(),
        limit_s,
        flags: args.flags.clone(),
    };
    let scripts = plan.scripts()?;
    if args.dry_run {
        return print(&dry(&plan, &scripts));
    }
    freeze(&loaded, &args.out)?;
    let jobs = plan.submit(&scripts)?;
    if args.json {
        let Jobs { coordinator, workers } = jobs;
        let run_directory = plan.run_directory;
        return print_json(&Submitted { coordinator_job: coordinator, workers_job: workers, run_directory });
    }
    print(&submitted(&plan, &jobs, &args.out))
}

/// Makes the run directory now: what is submitted is what runs, whatever becomes of the campaign file meanwhile.
fn freeze(loaded: &load::Loaded, out: &Path) -> Result<(), Failure> {
    let contents = Contents {
        campaign_text: &loaded.campaign_text,
        site_text: loaded.site_text.as_deref(),
        profile_text: loaded.profile_text.as_deref(),
        spec: &loaded.spec,
    };
    RunDirectory::open(out, contents).map(drop).map_err(|e| ServeError::from(e).into())
}

fn dry(plan: &Plan, scripts: &Scripts) -> String {
    let flags: String = plan.flags.iter().map(|flag| format!(" {flag}")).collect();
    let folder = plan.folder();
    let Scripts { coordinator, worker } = scripts;
    format!(
        "### {0}/coordinator.sh, submitted with: sbatch --parsable{flags} coordinator.sh\n{coordinator}\n\
         ### {0}/worker.sh, submitted with: sbatch --parsable{flags} --dependency=after:COORDINATOR worker.sh\n{worker}",
        folder.display()
    )
}

fn submitted(plan: &Plan, jobs: &Jobs, out: &Path) -> String {
    let Jobs { coordinator, workers } = jobs;
    format!(
        "{}: submitted the coordinator as job {coordinator} and {} workers as job {workers}\n  \
         where it stands: runout status {}\n  \
         scripts and logs: {}\n  \
         to stop: runout cancel {}, or scancel {coordinator} {workers} (the same command again goes on)\n  \
         more workers: sbatch --array=1-10 {}\n",
        plan.name,
        plan.workers,
        shell_word(out),
        plan.folder().display(),
        shell_word(out),
        shell_word(&plan.worker_script())
    )
}
