//! A campaign as two Slurm jobs: the coordinator, and an array of workers.
//!
//! Two jobs and not one heterogeneous job, because the workers are independent of one another: each task of the array
//! starts as soon as a core is free, ends at its own limit and can be cancelled without harm to the rest, while a
//! heterogeneous job waits until all of it fits and ends as a whole. The array depends on the start of the coordinator
//! only, so that no worker waits in an allocation for one that is still in the queue.

mod sbatch;

use super::{SubmitError, shell_word};
use crate::tls::{self, Names, Validity};
use runout_proto::tls::{Credentials, Role};
use std::fs;
use std::path::{Path, PathBuf};

const COORDINATOR: &str = include_str!("coordinator.sh");
const WORKER: &str = include_str!("worker.sh");
const JOB: &str = include_str!("job.sh");
const SERVE: &str = include_str!("serve.sh");
const WORK: &str = include_str!("work.sh");

/// Folder in the run directory for scripts, logs and job numbers.
const FOLDER: &str = "slurm";
const COORDINATOR_SCRIPT: &str = "coordinator.sh";
const WORKER_SCRIPT: &str = "worker.sh";
const COORDINATOR_JOB: &str = "coordinator.job";
/// Read by the coordinator's script.
const WORKERS_JOB: &str = "workers.job";

/// Name in the coordinator's certificate: nobody knows yet on which node it will run.
const SERVER_NAME: &str = "coordinator.runout";
/// Validity of the certificates, days.
const CERTIFIED_DAYS: u32 = 365;

/// Flags that the scripts set, with what to do instead.
const OWN_FLAGS: [(&[&str], &str); 4] = [
    (&["--time", "-t"], "give the limit with --time before `--`: the workers must know it"),
    (&["--array", "-a"], "give the number of workers with --workers before `--`"),
    (&["--cpus-per-task", "-c"], "give the cores of a worker with --slots before `--`"),
    (
        &["--output", "-o", "--error", "-e", "--signal", "--wrap", "--dependency", "-d", "--parsable"],
        "the scripts set this themselves; change them in the run directory and `sbatch` them by hand",
    ),
];

/// What to submit.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Name of the campaign.
    pub name: String,
    /// Run directory, absolute.
    pub run_directory: PathBuf,
    /// The program `runout`, absolute, where the nodes find it.
    pub runout: PathBuf,
    /// The program `runout-worker`.
    pub worker: PathBuf,
    /// Tasks of the array.
    pub workers: u32,
    /// Realisations at a time in each.
    pub slots: u16,
    /// Time limit of every job as the user wrote it.
    pub time: String,
    /// The same, s.
    pub limit_s: u64,
    /// Flags for sbatch as the user wrote them.
    pub flags: Vec<String>,
}

/// The two scripts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scripts {
    /// Of the coordinator.
    pub coordinator: String,
    /// Of the workers' array.
    pub worker: String,
}

/// The numbers of the jobs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Jobs {
    /// Of the coordinator.
    pub coordinator: String,
    /// Of the workers' array.
    pub workers: String,
}

impl Plan {
    /// The scripts.
    ///
    /// # Errors
    /// A path that cannot stand in one, or a flag that would contradict one.
    pub fn scripts(&self) -> Result<Scripts, SubmitError> {
        self.check_flags()?;
        // The coordinator is told to stop this long before its limit, half of which running realisations get to finish.
        let lead_s = (self.limit_s / 4).min(120);
        let values = [
            ("NAME", job_name(&self.name)),
            ("LOGS", directive_path(&self.folder())?),
            ("RUNOUT", shell_word(&self.runout)),
            ("WORKER", shell_word(&self.worker)),
            ("RUN_DIRECTORY", shell_word(&self.run_directory)),
            ("WORKERS", self.workers.to_string()),
            ("SLOTS", self.slots.to_string()),
            ("TIME", self.time.clone()),
            ("LIMIT_S", self.limit_s.to_string()),
            ("LEAD_S", lead_s.to_string()),
            ("GRACE_S", (lead_s / 2).to_string()),
            // A worker is gone this long before its limit: nodes' clocks differ, and the last report takes a moment.
            ("RESERVE_S", (self.limit_s / 10).clamp(10, 30).to_string()),
        ];
        let script = |template: &str, place: &str, command: &str| {
            fill(&template.replace("{{JOB}}\n", JOB).replace(place, command), &values)
        };
        Ok(Scripts {
            coordinator: script(COORDINATOR, "{{LISTEN}}\n", SERVE),
            worker: script(WORKER, "{{WORK}}\n", WORK),
        })
    }

    /// Folder for scripts and logs.
    pub fn folder(&self) -> PathBuf {
        self.run_directory.join(FOLDER)
    }

    /// Script of the workers, for more of them.
    pub fn worker_script(&self) -> PathBuf {
        self.folder().join(WORKER_SCRIPT)
    }

    /// Writes the scripts, and certificates where there are none, into the run directory, which must be there, and submits
    /// the jobs.
    ///
    /// # Errors
    /// An earlier submission has not ended or its certificates cannot be used any more, a script cannot be written, or
    /// Slurm refuses.
    pub fn submit(&self, scripts: &Scripts) -> Result<Jobs, SubmitError> {
        self.refuse_second_submission()?;
        fs::create_dir_all(self.folder()).map_err(|e| file_error(&self.folder(), e))?;
        self.certify()?;
        let coordinator_script = self.write(COORDINATOR_SCRIPT, &scripts.coordinator)?;
        let worker_script = self.write(WORKER_SCRIPT, &scripts.worker)?;
        let nothing = || "nothing was submitted".to_owned();
        let coordinator = sbatch::submit("coordinator", &self.flags, &[], &coordinator_script, nothing)?;
        self.write(COORDINATOR_JOB, &coordinator)?;
        let dependency = format!("--dependency=after:{coordinator}");
        let workers = sbatch::submit("worker", &self.flags, &[&dependency], &worker_script, || {
            match sbatch::cancel(&coordinator) {
                Ok(()) => format!("job {coordinator}, the coordinator, was cancelled again"),
                Err(why) => {
                    format!("job {coordinator}, the coordinator, could not be cancelled ({why}): scancel it")
                }
            }
        })?;
        self.write(WORKERS_JOB, &workers)?;
        Ok(Jobs { coordinator, workers })
    }

    /// Certificates of this campaign's own. They stay when it is submitted again, or workers that run on would be refused.
    fn certify(&self) -> Result<(), SubmitError> {
        let folder = self.run_directory.join(tls::FOLDER);
        if !folder.exists() {
            let names = Names { hosts: Vec::new(), server: Some(SERVER_NAME.to_owned()) };
            return Ok(tls::init(&folder, &names, Validity::days(CERTIFIED_DAYS)).map(drop)?);
        }
        let in_order = Role::ALL.iter().try_for_each(|role| Credentials::load(&folder, *role).map(drop));
        in_order.map_err(|error| SubmitError::Certificates { folder: folder.display().to_string(), error })
    }

    fn write(&self, name: &str, text: &str) -> Result<PathBuf, SubmitError> {
        let path = self.folder().join(name);
        fs::write(&path, text).map_err(|e| file_error(&path, e))?;
        Ok(path)
    }

    fn refuse_second_submission(&self) -> Result<(), SubmitError> {
        for name in [COORDINATOR_JOB, WORKERS_JOB] {
            let Ok(job) = fs::read_to_string(self.folder().join(name)) else { continue };
            if sbatch::is_queued(job.trim()) {
                let directory = self.run_directory.display().to_string();
                return Err(SubmitError::StillQueued { directory, job: job.trim().to_owned() });
            }
        }
        Ok(())
    }

    fn check_flags(&self) -> Result<(), SubmitError> {
        for flag in &self.flags {
            let name = flag.split('=').next().unwrap_or(flag);
            for (own, instead) in OWN_FLAGS {
                // A short flag may carry its value at once, as in -t10.
                let is_own = |o: &&str| {
                    name == *o || (o.len() == 2 && !name.starts_with("--") && name.starts_with(*o))
                };
                if own.iter().any(is_own) {
                    return Err(SubmitError::Flag { flag: flag.clone(), instead });
                }
            }
        }
        Ok(())
    }
}

fn file_error(path: &Path, error: std::io::Error) -> SubmitError {
    SubmitError::File { path: path.display().to_string(), error }
}

/// A template with its values.
fn fill(template: &str, values: &[(&str, String)]) -> String {
    // In one pass, so that no value is taken for a placeholder.
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (key, after) = after.split_once("}}").expect("a placeholder of the template ends");
        let value = values.iter().find(|(k, _)| *k == key).map(|(_, v)| v.as_str());
        text += before;
        text += value.unwrap_or_else(|| panic!("the template's {key} has a value"));
        rest = after;
    }
    text + rest
}

/// A campaign's name as part of a job's name: letters, digits and a few signs.
fn job_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    format!("runout-{}", name.chars().take(60).map(plain).collect::<String>())
}

/// A path inside the quotation marks of an #SBATCH line, where a per cent sign begins a pattern.
fn directive_path(path: &Path) -> Result<String, SubmitError> {
    let text = path.display().to_string();
    if text.contains(['"', '\\', '\n', '\r']) {
        return Err(SubmitError::Path { path: text });
    }
    Ok(text.replace('%', "%%"))
}

#[cfg(test)]
mod tests;
