//! Makes TLS directories: an authority of one's own, and a certificate for each role.
//!
//! The authority's key signs three certificates and is forgotten: nobody can make another one later, and there is
//! nothing to steal. New certificates are a new directory.

mod authority;

pub use authority::{Authority, IssueError, Pair, Validity};

use crate::listen;
use runout_proto::tls::{AUTHORITY_FILE, Role, SERVER_NAME_FILE};
use rustls::pki_types::ServerName;
use std::fs::{DirBuilder, File};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// TLS directory of a campaign's own, in its run directory: made where the campaign is submitted to a batch system, and
/// used by commands that look at the run directory and are given none.
pub const FOLDER: &str = "tls";

/// For the owner only: the directory, and the keys in it.
const DIRECTORY_MODE: u32 = 0o700;
const KEY_MODE: u32 = 0o600;
const CERTIFICATE_MODE: u32 = 0o644;

/// A directory that cannot be made.
#[derive(Debug, Error)]
pub enum InitError {
    /// Something is there.
    #[error("{}: it is there already, and certificates are never overwritten: take another directory", .0.display())]
    Exists(PathBuf),
    /// Not a name that a certificate can bear.
    #[error("--server-name {0}: it must be a host name, such as coordinator.runout")]
    ServerName(String),
    /// The system refuses.
    #[error("{}: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// A certificate cannot be made.
    #[error(transparent)]
    Issue(#[from] IssueError),
}

/// What the coordinator's certificate is for.
#[derive(Debug, Clone, Default)]
pub struct Names {
    /// Names and IP addresses of its machine beside this machine's name and loopback.
    pub hosts: Vec<String>,
    /// The one name that clients are to expect, whatever the machine.
    pub server: Option<String>,
}

/// Makes a TLS directory: `ca.pem`, certificate and key of every role, and `server.name` where clients are to expect one.
/// Returns the hosts that the coordinator's certificate is for.
///
/// # Errors
/// The directory holds any of its files already, it cannot be written, or a host is none.
pub fn init(folder: &Path, names: &Names, validity: Validity) -> Result<Vec<String>, InitError> {
    if let Some(name) = &names.server
        && !matches!(ServerName::try_from(name.as_str()), Ok(ServerName::DnsName(_)))
    {
        return Err(InitError::ServerName(name.clone()));
    }
    let hosts = with_this_machine(names);
    let authority = Authority::new(validity)?;
    let mut files = vec![(AUTHORITY_FILE.to_owned(), authority.certificate_pem(), CERTIFICATE_MODE)];
    for role in Role::ALL {
        let names: &[String] = if role == Role::Server { &hosts } else { &[] };
        let Pair { certificate_pem, key_pem } = authority.issue(Some(role), names, validity)?;
        files.push((role.certificate_file(), certificate_pem, CERTIFICATE_MODE));
        files.push((role.key_file(), key_pem, KEY_MODE));
    }
    if let Some(name) = &names.server {
        files.push((SERVER_NAME_FILE.to_owned(), format!("{name}\n"), CERTIFICATE_MODE));
    }
    let taken = files.iter().map(|(name, ..)| folder.join(name)).find(|path| path.exists());
    if let Some(path) = taken {
        return Err(InitError::Exists(path));
    }
    let failed = |path: &Path, error| InitError::File { path: path.to_owned(), error };
    let made = DirBuilder::new().recursive(true).mode(DIRECTORY_MODE).create(folder);
    made.and_then(|()| folder.metadata())
        .and_then(|metadata| {
            let mut permissions = metadata.permissions();
            permissions.set_mode(DIRECTORY_MODE);
            std::fs::set_permissions(folder, permissions)
        })
        .map_err(|error| failed(folder, error))?;
    for (name, text, mode) in files {
        let path = folder.join(name);
        write_new(&path, &text, mode).map_err(|error| failed(&path, error))?;
    }
    Ok(hosts)
}

fn write_new(path: &Path, text: &str, mode: u32) -> io::Result<()> {
    let mut file = File::options().write(true).create_new(true).mode(mode).open(path)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()
}

/// The names asked for, loopback and this machine's name, each once.
fn with_this_machine(names: &Names) -> Vec<String> {
    let usual = ["localhost", "127.0.0.1", "::1"].map(str::to_owned);
    let mut all: Vec<String> = Vec::new();
    let asked = names.server.iter().chain(&names.hosts).cloned();
    for host in asked.chain(usual).chain(listen::host_name()) {
        if !all.contains(&host) {
            all.push(host);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use runout_proto::tls::{Credentials, TlsError};

    fn mode(path: &Path) -> u32 {
        path.metadata().unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn a_directory_is_made_once_and_its_keys_are_private() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("tls");
        let names = Names { hosts: vec!["node7".into(), "10.0.0.7".into()], server: None };
        let hosts = init(&folder, &names, Validity::days(30)).unwrap();
        assert!(hosts.starts_with(&["node7".into(), "10.0.0.7".into(), "localhost".into()]), "{hosts:?}");
        assert_eq!(mode(&folder), 0o700);
        for role in Role::ALL {
            assert_eq!(mode(&folder.join(role.key_file())), 0o600);
            let own = Credentials::load(&folder, role).unwrap();
            assert_eq!(own.view.roles, [role]);
        }
        let server = Credentials::load(&folder, Role::Server).unwrap();
        for host in ["node7", "10.0.0.7", "localhost", "127.0.0.1", "[::1]"] {
            assert!(server.is_valid_for(host), "{host}");
        }
        assert!(!server.is_valid_for("node8") && !server.is_valid_for("10.0.0.8"));
        let again = init(&folder, &Names::default(), Validity::days(30)).unwrap_err().to_string();
        assert!(again.contains("never overwritten"), "{again}");
        assert!(!format!("{server:?}").contains("PRIVATE"));
    }

    #[test]
    fn a_name_can_stand_for_whatever_host() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path();
        let names = Names { hosts: Vec::new(), server: Some("coordinator.runout".into()) };
        init(folder, &names, Validity::days(30)).unwrap();
        let server = Credentials::load(folder, Role::Server).unwrap();
        assert_eq!(server.server_name.as_deref(), Some("coordinator.runout"));
        assert!(server.is_valid_for("node8") && server.is_valid_for("10.0.0.8"));
        std::fs::write(folder.join(SERVER_NAME_FILE), "other.runout\n").unwrap();
        assert!(!Credentials::load(folder, Role::Server).unwrap().is_valid_for("node8"));
        for none in ["", "10.0.0.8", "two names"] {
            std::fs::write(folder.join(SERVER_NAME_FILE), none).unwrap();
            let said = Credentials::load(folder, Role::Worker).unwrap_err().to_string();
            assert!(said.contains("server.name: it must hold one host name"), "{said}");
        }
    }

    #[test]
    fn what_is_wrong_with_credentials_is_said() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path();
        let good = Authority::new(Validity::days(30)).unwrap();
        let other = Authority::new(Validity::days(30)).unwrap();
        let put = |pair: &Pair| {
            std::fs::write(folder.join("worker.pem"), &pair.certificate_pem).unwrap();
            std::fs::write(folder.join("worker.key"), &pair.key_pem).unwrap();
        };
        let missing = Credentials::load(folder, Role::Worker).unwrap_err().to_string();
        assert!(missing.contains("ca.pem") && missing.contains("runout tls init"), "{missing}");
        std::fs::write(folder.join("ca.pem"), good.certificate_pem()).unwrap();
        let said = |pair: &Pair| {
            put(pair);
            Credentials::load(folder, Role::Worker).map(|_| ()).map_err(|e| e.to_string())
        };
        let worker = good.issue(Some(Role::Worker), &[], Validity::days(30)).unwrap();
        assert_eq!(said(&worker), Ok(()));
        let expired = good.issue(Some(Role::Worker), &[], Validity::past()).unwrap();
        assert!(said(&expired).unwrap_err().contains("the certificate ran out on "));
        let foreign = other.issue(Some(Role::Worker), &[], Validity::days(30)).unwrap();
        assert!(said(&foreign).unwrap_err().contains("not signed by the authority of ca.pem"));
        let operator = good.issue(Some(Role::Operator), &[], Validity::days(30)).unwrap();
        assert!(said(&operator).unwrap_err().contains("no certificate of the role \"worker\" (operator)"));
        let without = good.issue(None, &[], Validity::days(30)).unwrap();
        assert!(said(&without).unwrap_err().contains("(it bears no role)"));
        std::fs::write(folder.join("worker.pem"), "nothing").unwrap();
        let form = Credentials::load(folder, Role::Worker).unwrap_err();
        assert!(matches!(form, TlsError::Form { .. }), "{form}");
    }
}
