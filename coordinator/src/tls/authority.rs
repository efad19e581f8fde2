//! A certificate authority that lives as long as this value.

use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer,
    KeyPair, KeyUsagePurpose, SanType,
};
use runout_proto::tls::Role;
use std::net::IpAddr;
use thiserror::Error;
use time::{Duration, OffsetDateTime};

/// Clocks of machines may differ by this: a certificate is valid a little before it is made.
const CLOCKS_DIFFER: Duration = Duration::hours(1);

/// A certificate that cannot be made.
#[derive(Debug, Error)]
pub enum IssueError {
    /// Not a host.
    #[error("--host {0}: it must be a host name or an IP address")]
    Host(String),
    /// The library refuses.
    #[error("the certificate cannot be made: {0}")]
    Make(#[from] rcgen::Error),
}

/// From when until when a certificate is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Validity {
    from: OffsetDateTime,
    until: OffsetDateTime,
}

impl Validity {
    /// From now on for so many days.
    pub fn days(days: u32) -> Validity {
        let now = OffsetDateTime::now_utc();
        Validity { from: now - CLOCKS_DIFFER, until: now + Duration::days(i64::from(days)) }
    }

    /// A validity that ended yesterday: for those who want to see what happens then.
    pub fn past() -> Validity {
        let now = OffsetDateTime::now_utc();
        Validity { from: now - Duration::days(3), until: now - Duration::days(1) }
    }
}

/// A certificate and its key.
#[derive(Clone)]
pub struct Pair {
    /// The certificate.
    pub certificate_pem: String,
    /// The private key.
    pub key_pem: String,
}

/// A certificate authority. Its key is nowhere but in this value.
pub struct Authority {
    issuer: Issuer<'static, KeyPair>,
    certificate_pem: String,
}

impl Authority {
    /// A new one.
    ///
    /// # Errors
    /// The library refuses.
    pub fn new(validity: Validity) -> Result<Authority, IssueError> {
        let key = KeyPair::generate()?;
        let mut params = params(validity);
        // A name of its own, so that a certificate of another authority is told from a forged one.
        let mark = blake3::hash(key.public_key_raw()).to_hex();
        params.distinguished_name.push(DnType::CommonName, format!("runout authority {}", &mark[..12]));
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        let certificate_pem = params.self_signed(&key)?.pem();
        Ok(Authority { issuer: Issuer::new(params, key), certificate_pem })
    }

    /// Its certificate.
    pub fn certificate_pem(&self) -> String {
        self.certificate_pem.clone()
    }

    /// Certifies a new key for a role (or none), valid for these hosts.
    ///
    /// # Errors
    /// A host that is none, or the library refuses.
    pub fn issue(
        &self,
        role: Option<Role>,
        hosts: &[String],
        validity: Validity,
    ) -> Result<Pair, IssueError> {
        let mut params = params(validity);
        let name = role.map_or("nobody", Role::name);
        params.distinguished_name.push(DnType::CommonName, format!("runout {name}"));
        params.use_authority_key_identifier_extension = true;
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![match role {
            Some(Role::Server) => ExtendedKeyUsagePurpose::ServerAuth,
            Some(Role::Worker | Role::Operator) | None => ExtendedKeyUsagePurpose::ClientAuth,
        }];
        for host in hosts {
            params.subject_alt_names.push(host_name(host)?);
        }
        if let Some(role) = role {
            params.subject_alt_names.push(SanType::URI(role.uri().try_into()?));
        }
        let key = KeyPair::generate()?;
        let certificate_pem = params.signed_by(&key, &self.issuer)?.pem();
        Ok(Pair { certificate_pem, key_pem: key.serialize_pem() })
    }
}

fn params(validity: Validity) -> CertificateParams {
    let mut params = CertificateParams::default();
    params.distinguished_name = DistinguishedName::new();
    (params.not_before, params.not_after) = (validity.from, validity.until);
    params
}

fn host_name(host: &str) -> Result<SanType, IssueError> {
    if let Ok(ip) = host.parse::<IpAddr>() {
        return Ok(SanType::IpAddress(ip));
    }
    let label = |label: &str| {
        !label.is_empty()
            && label.len() <= 63
            && label.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c))
    };
    if host.len() > 253 || !host.split('.').all(label) {
        return Err(IssueError::Host(host.to_owned()));
    }
    Ok(SanType::DnsName(host.try_into()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_host_is_not_certified() {
        let authority = Authority::new(Validity::days(1)).unwrap();
        for host in ["", "a b", "*.example.org", "http://node", "node:80", "nöde", ".a", "a..b"] {
            let refused = authority.issue(Some(Role::Server), &[host.to_owned()], Validity::days(1));
            assert!(matches!(refused, Err(IssueError::Host(_))), "{host}");
        }
        assert!(authority.issue(Some(Role::Server), &["node-7.cluster".into()], Validity::days(1)).is_ok());
    }
}
