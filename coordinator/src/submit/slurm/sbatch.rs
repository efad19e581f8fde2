//! Slurm's own programs. Only what is made for programs is read of their output: `--parsable` and `--noheader`.

use super::super::SubmitError;
use std::io;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Submits a script; returns the job's number. `after` says what becomes of earlier jobs if it is refused.
pub(super) fn submit(
    what: &'static str,
    flags: &[String],
    more: &[&str],
    script: &Path,
    after: impl FnOnce() -> String,
) -> Result<String, SubmitError> {
    let mut command = Command::new("sbatch");
    command.arg("--parsable").args(flags).args(more).arg(script).stdin(Stdio::null());
    let output = command.output().map_err(|why| SubmitError::NoProgram { program: "sbatch", why })?;
    let refused = |said: String, after: String| {
        let code = output.status.code().map_or("ended by a signal".to_owned(), |c| format!("exit code {c}"));
        SubmitError::Refused { what, code, said, after }
    };
    if !output.status.success() {
        return Err(refused(words(&output.stderr), after()));
    }
    // A number, or a number and the cluster's name.
    let text = String::from_utf8_lossy(&output.stdout);
    let job = text.trim().split(';').next().unwrap_or_default();
    if job.is_empty() || !job.bytes().all(|b| b.is_ascii_digit()) {
        return Err(refused(format!("no job number in its answer: {}", text.trim()), after()));
    }
    Ok(job.to_owned())
}

/// Cancels a job.
pub(super) fn cancel(job: &str) -> Result<(), String> {
    match Command::new("scancel").arg(job).stdin(Stdio::null()).output() {
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => Err(words(&output.stderr)),
        Err(error) => Err(error.to_string()),
    }
}

/// Whether a job is in the queue. One that Slurm has forgotten, or that cannot be asked for, is not.
pub(super) fn is_queued(job: &str) -> bool {
    let asked: io::Result<Output> = Command::new("squeue")
        .args(["--noheader", "--format=%i", "--jobs", job])
        .stdin(Stdio::null())
        .output();
    asked.is_ok_and(|output| output.status.success() && !words(&output.stdout).is_empty())
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim().to_owned()
}
