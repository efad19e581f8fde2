//! `runout tls`: certificates for coordinator, workers and operators.

use super::{Failure, print};
use crate::tls::{self, Names, Validity};
use clap::{Args, Subcommand};
use runout_proto::tls::{AUTHORITY_FILE, Credentials, Role, VARIABLE, read_certificate};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The TLS directory of a command that serves or asks.
#[derive(Debug, Clone, Default, Args)]
pub struct TlsArgument {
    /// Directory with certificates, made by `runout tls init`
    #[arg(long = "tls", value_name = "DIR", env = VARIABLE, hide_env_values = true)]
    folder: Option<PathBuf>,
}

impl TlsArgument {
    /// The directory; an empty variable means none.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref().filter(|folder| !folder.as_os_str().is_empty())
    }
}

/// What to do about certificates.
#[derive(Debug, Clone, Subcommand)]
pub enum TlsCommand {
    /// Make an authority, and certificates for coordinator, workers and operators, in a new directory
    Init(InitArgs),
    /// Show roles, host names and dates of the certificates in a directory
    Show(ShowArgs),
}

/// Arguments of `runout tls init`.
#[derive(Debug, Clone, Args)]
pub struct InitArgs {
    /// Directory to make; what is there is never overwritten
    pub dir: PathBuf,
    /// Name or IP address by which others reach the coordinator, besides this machine's name, localhost, 127.0.0.1
    /// and ::1
    #[arg(long = "host", value_name = "NAME-or-IP")]
    pub hosts: Vec<String>,
    /// Name that clients are to expect in the coordinator's certificate whatever host its URL names: for a coordinator
    /// whose machine is not known beforehand. It need not be a name of any machine.
    #[arg(long, value_name = "NAME")]
    pub server_name: Option<String>,
    /// Days until the certificates run out
    #[arg(long, value_name = "N", default_value = "365", value_parser = clap::value_parser!(u32).range(1..=3650))]
    pub days: u32,
}

/// Arguments of `runout tls show`.
#[derive(Debug, Clone, Args)]
pub struct ShowArgs {
    /// Directory made by `runout tls init`
    pub dir: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// What cannot be done.
pub fn main(command: &TlsCommand) -> Result<(), Failure> {
    match command {
        TlsCommand::Init(args) => init(args),
        TlsCommand::Show(args) => show(&args.dir),
    }
}

fn init(args: &InitArgs) -> Result<(), Failure> {
    let names = Names { hosts: args.hosts.clone(), server: args.server_name.clone() };
    let hosts =
        tls::init(&args.dir, &names, Validity::days(args.days)).map_err(|e| Failure::Input(e.to_string()))?;
    let dir = args.dir.display();
    print(&format!(
        "{dir}: certificates for {days} days; the coordinator's is for {hosts}\n\
         coordinator   runout serve ... --tls {dir}            needs ca.pem, server.pem, server.key\n\
         workers       runout-worker ... --tls {dir}           need ca.pem, worker.pem, worker.key\n\
         operators     runout status|cancel ... --tls {dir}    need ca.pem, operator.pem, operator.key\n\
         Keep the keys to yourself; {VARIABLE}={dir} does the same as --tls.\n",
        days = args.days,
        hosts = hosts.join(", "),
    ))
}

fn show(dir: &Path) -> Result<(), Failure> {
    let refused = |e: runout_proto::tls::TlsError| Failure::Input(e.to_string());
    let authority = read_certificate(&dir.join(AUTHORITY_FILE)).map_err(refused)?;
    let mut text = format!("{:<14} authority  until {}\n", AUTHORITY_FILE, authority.until());
    for role in Role::ALL {
        let file = role.certificate_file();
        if !dir.join(&file).exists() {
            continue;
        }
        let view = read_certificate(&dir.join(&file)).map_err(refused)?;
        let state = Credentials::load(dir, role).map_or_else(|e| e.to_string(), |_| "in order".to_owned());
        let roles: Vec<&str> = view.roles.iter().map(|role| role.name()).collect();
        let hosts =
            if view.hosts.is_empty() { String::new() } else { format!("  for {}", view.hosts.join(", ")) };
        // A string takes everything.
        let _ = writeln!(text, "{file:<14} {:<10} until {}  {state}{hosts}", roles.join("+"), view.until());
    }
    print(&text)
}
