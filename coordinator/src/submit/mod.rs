//! Campaigns handed to a batch system: the scripts of its jobs, and its refusals in words.
//!
//! Nothing is computed here. [`slurm`] makes the scripts and submits them; [`time_limit`] reads what users write.

pub mod slurm;
pub mod time_limit;

use crate::tls::InitError;
use runout_proto::tls::TlsError;
use std::path::Path;
use thiserror::Error;

/// A campaign that cannot be submitted.
#[derive(Debug, Error)]
pub enum SubmitError {
    /// A path that the batch system's own language cannot carry.
    #[error(
        "{path}: Slurm cannot take a path with a quotation mark, a backslash or a line break; use another directory"
    )]
    Path {
        /// As given.
        path: String,
    },
    /// A flag that the scripts set themselves.
    #[error("{flag} after `--`: {instead}")]
    Flag {
        /// As given.
        flag: String,
        /// What to do instead.
        instead: &'static str,
    },
    /// An earlier submission has not ended.
    #[error(
        "{directory}: job {job} of an earlier submission is still in the queue; look with `squeue --job {job}`, or stop it \
         with `scancel {job}` and submit again"
    )]
    StillQueued {
        /// The run directory.
        directory: String,
        /// Its job.
        job: String,
    },
    /// The program of the batch system is not there.
    #[error(
        "{program} cannot be started ({why}): run this where jobs are submitted, or see the scripts with --dry-run"
    )]
    NoProgram {
        /// Its name.
        program: &'static str,
        /// What the system said.
        why: std::io::Error,
    },
    /// The batch system does not take the job.
    #[error(
        "sbatch refuses the {what} job ({code}): {said}\n\
         What your site wants (--account, --partition, --qos, --mem-per-cpu ...) goes after `--`; {after}"
    )]
    Refused {
        /// Which job.
        what: &'static str,
        /// How it ended.
        code: String,
        /// Its own words.
        said: String,
        /// What has become of what was submitted before.
        after: String,
    },
    /// The certificates of an earlier submission cannot be used.
    #[error("{error}; or remove {folder}, and submitting again makes new certificates")]
    Certificates {
        /// The TLS directory.
        folder: String,
        /// What is wrong with them.
        error: TlsError,
    },
    /// Certificates cannot be made.
    #[error(transparent)]
    Certify(#[from] InitError),
    /// A script cannot be written.
    #[error("{path}: {error}")]
    File {
        /// The file.
        path: String,
        /// What the system said.
        error: std::io::Error,
    },
}

impl SubmitError {
    /// The exit code: 2 if what was asked for cannot be, 1 if it went wrong on the way.
    pub fn exit_code(&self) -> u8 {
        match self {
            SubmitError::Path { .. } | SubmitError::Flag { .. } | SubmitError::NoProgram { .. } => 2,
            SubmitError::StillQueued { .. } | SubmitError::Certificates { .. } => 2,
            SubmitError::Refused { .. } | SubmitError::Certify(_) | SubmitError::File { .. } => 1,
        }
    }
}

/// A path as one word of a POSIX shell.
pub fn shell_word(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+,@:".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text;
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_a_path_back_as_it_is() {
        for path in ["/plain/a-b_1.toml", "", "/a b/c", "/it's", "/$HOME/`x`", "/a\"b\\c", "/new\nline"] {
            let script = format!("printf %s {}", shell_word(Path::new(path)));
            let output = std::process::Command::new("sh").args(["-c", &script]).output().unwrap();
            assert_eq!(String::from_utf8(output.stdout).unwrap(), path);
        }
    }
}
