//! The command line, and what becomes of it.

use crate::client::ClientError;
use clap::Parser;
use runout_proto::tls::{self, Credentials, Role};
use std::num::NonZeroU16;
use std::path::PathBuf;
use std::time::Duration;
use tonic::transport::Endpoint;

/// Runs realisations for a Runout coordinator
#[derive(Debug, Clone, Parser)]
#[command(name = "runout-worker", version)]
pub struct Options {
    /// The coordinator's address, for example http://127.0.0.1:7421 or https://host:7421
    #[arg(long, value_name = "URL")]
    pub coordinator: String,
    /// Directory with certificates for https://, made by `runout tls init`; ca.pem, worker.pem and worker.key are needed
    #[arg(long, value_name = "DIR", env = tls::VARIABLE, hide_env_values = true)]
    pub tls: Option<PathBuf>,
    /// Realisations at a time, one thread each [default: the number of cores]
    #[arg(long, value_name = "N")]
    pub slots: Option<NonZeroU16>,
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
    /// Leave at the end of standard input: for a worker whose parent holds the other end
    #[arg(long, hide = true)]
    pub leave_with_parent: bool,
}

impl Options {
    /// The way to the coordinator.
    ///
    /// # Errors
    /// Not a URL, or certificates that are missing or cannot be used.
    pub fn endpoint(&self) -> Result<Endpoint, ClientError> {
        // An empty variable means none.
        let folder = self.tls.as_ref().filter(|folder| !folder.as_os_str().is_empty());
        let credentials = folder.map(|folder| Credentials::load(folder, Role::Worker)).transpose()?;
        tls::endpoint(&self.coordinator, credentials.as_ref())
            .map_err(|error| ClientError::Url { url: self.coordinator.clone(), error })
    }

    /// Number of slots.
    pub fn slots(&self) -> u32 {
        let cores = || std::thread::available_parallelism().map_or(1, |n| n.get().min(4096) as u32);
        self.slots.map_or_else(cores, |n| u32::from(n.get()))
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
