//! The command line, and what becomes of it.

use crate::address::{Address, Way};
use crate::client::ClientError;
use clap::Parser;
use runout_proto::logging::LogFormat;
use runout_proto::tls::{self, Credentials, Role};
use std::num::NonZeroU16;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

const AFTER_HELP: &str = "\
Exit codes: 0 left in order, 1 failed, 2 bad usage or cannot work for this coordinator, 143 ended by a second signal.
Environment: RUST_LOG sets what is logged (error, warn, info, debug), NO_COLOR turns colours off, RUNOUT_KERNEL forces \
a build of the solver's kernels (baseline, avx2, avx512).
`runout-worker completions SHELL` prints completions for a shell, `runout-worker man DIR` writes the manual page.";

/// Runs realisations for a Runout coordinator
#[derive(Debug, Clone, Parser)]
#[command(name = "runout-worker", version, after_help = AFTER_HELP)]
pub struct Options {
    /// The coordinator's address, for example http://127.0.0.1:7421 or https://host:7421
    #[arg(long, value_name = "URL", required_unless_present = "run_directory")]
    pub coordinator: Option<String>,
    /// Take the address from coordinator.addr in this run directory, wait for it, and follow it when it changes
    #[arg(long, value_name = "DIR", conflicts_with = "coordinator")]
    pub run_directory: Option<PathBuf>,
    /// Directory with certificates for https://, made by `runout tls init`; ca.pem, worker.pem and worker.key are needed
    #[arg(long, value_name = "DIR", env = tls::VARIABLE, hide_env_values = true)]
    pub tls: Option<PathBuf>,
    /// Realisations at a time, --threads threads each [default: the cores that affinity and cgroup leave to this process,
    /// shared out by --threads]
    #[arg(long, value_name = "N")]
    pub slots: Option<NonZeroU16>,
    /// Threads that share each realisation; they move no bits, and pay from some 50,000 points on, where cores are many
    /// and realisations few
    #[arg(long, value_name = "N", default_value = "1")]
    pub threads: NonZeroU16,
    /// Name to appear under [default: host and process number]
    #[arg(long)]
    pub name: Option<String>,
    /// Folder for outcomes that are not yet acknowledged [default: in the system's folder for temporary files]
    #[arg(long, value_name = "DIR")]
    pub spool: Option<PathBuf>,
    /// Time without any answer from the coordinator after which to give up
    #[arg(long, value_name = "SECONDS", default_value = "3600", value_parser = seconds)]
    pub give_up_after: Duration,
    /// When asked to leave, time for running realisations to finish before they are given back
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
    pub grace: Duration,
    /// Be gone after this time: take no realisation that would probably not be finished, let what runs finish within
    /// the last --grace of it, and give back the rest
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub leave_after: Option<Duration>,
    /// Leave when there has been nothing to do for this long
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub idle_leave: Option<Duration>,
    /// Time for a realisation to end once it is cancelled (it looks every step); then the worker gives up and ends
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds)]
    pub stuck_after: Duration,
    /// How logs are written to standard error: text, or json (an object a line)
    #[arg(long, value_name = "text|json", default_value = "text")]
    pub log_format: LogFormat,
    /// Leave at the end of standard input: for a worker whose parent holds the other end
    #[arg(long, hide = true)]
    pub leave_with_parent: bool,
}

impl Options {
    /// The way to the coordinator.
    ///
    /// # Errors
    /// Certificates that are missing or cannot be used.
    pub fn way(&self) -> Result<Way, ClientError> {
        // An empty variable means none.
        let folder = self.tls.as_ref().filter(|folder| !folder.as_os_str().is_empty());
        let credentials = folder.map(|folder| Credentials::load(folder, Role::Worker)).transpose()?;
        let address = match (&self.run_directory, &self.coordinator) {
            (Some(path), _) => Address::RunDirectory(path.clone()),
            (None, url) => Address::Fixed(url.clone().unwrap_or_default()),
        };
        Ok(Way { address, credentials: credentials.map(Arc::new) })
    }

    /// Number of slots.
    pub fn slots(&self) -> u32 {
        let cores = || std::thread::available_parallelism().map_or(1, |n| n.get().min(4096) as u32);
        let threads = u32::from(self.threads.get());
        self.slots.map_or_else(|| (cores() / threads).max(1), |n| u32::from(n.get()))
    }

    /// Threads that the slots' analyses share; 1 if each is computed by its slot alone.
    pub fn shared_threads(&self) -> usize {
        match usize::from(self.threads.get()) {
            1 => 1,
            threads => threads * self.slots() as usize,
        }
    }

    /// Name to appear under.
    pub fn name(&self) -> String {
        let default = || {
            let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
            let host = if host.trim().is_empty() { "worker" } else { host.trim() };
            format!("{host}-{}", std::process::id())
        };
        self.name.clone().unwrap_or_else(default)
    }

    /// Folder for outcomes that are not yet acknowledged.
    pub fn spool(&self) -> PathBuf {
        self.spool.clone().unwrap_or_else(|| std::env::temp_dir().join("runout-spool"))
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    const LONGEST_S: f64 = 30.0 * 86_400.0;
    match text.parse::<f64>() {
        Ok(value) if (0.0..=LONGEST_S).contains(&value) => Ok(Duration::from_secs_f64(value)),
        _ => Err(format!("it must be a number of seconds from 0 to {LONGEST_S}")),
    }
}
