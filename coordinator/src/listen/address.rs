//! The address that others are told: the one listened on is none where it means "every interface".

use std::fs;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::str::FromStr;

/// A host, by name or IP address, and perhaps a port: HOST, HOST:PORT, `[IPV6]:PORT`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advertised {
    /// As it stands in a URL: an IPv6 address in brackets.
    pub host: String,
    /// The port, if it is another than the one listened on.
    pub port: Option<u16>,
}

impl FromStr for Advertised {
    type Err = String;

    fn from_str(text: &str) -> Result<Advertised, String> {
        let none = || "it must be HOST or HOST:PORT, with an IPv6 address in brackets".to_owned();
        if let Ok(ip) = text.parse::<IpAddr>() {
            return Ok(Advertised { host: in_url(ip), port: None });
        }
        let (host, port) = match text.rsplit_once(':') {
            Some((host, port)) if !text.ends_with(']') => (host, Some(port.parse().map_err(|_| none())?)),
            _ => (text, None),
        };
        let bracketed = host.strip_prefix('[').and_then(|h| h.strip_suffix(']'));
        let sound = match bracketed {
            Some(inner) => inner.parse::<Ipv6Addr>().is_ok(),
            None => !host.is_empty() && host.chars().all(|c| c.is_ascii_alphanumeric() || "-._".contains(c)),
        };
        if sound { Ok(Advertised { host: host.to_owned(), port }) } else { Err(none()) }
    }
}

/// Host and port for others: as advertised, or as listened on; this machine's name where that is every interface.
pub(crate) fn for_others(bound: SocketAddr, advertised: Option<&Advertised>) -> (String, u16) {
    let host = match advertised {
        Some(advertised) => advertised.host.clone(),
        None if bound.ip().is_unspecified() => host_name().unwrap_or_else(|| here(bound.ip())),
        None => in_url(bound.ip()),
    };
    (host, advertised.and_then(|a| a.port).unwrap_or(bound.port()))
}

/// Host and port for this machine.
pub(super) fn from_here(bound: SocketAddr) -> String {
    let host = if bound.ip().is_unspecified() { here(bound.ip()) } else { in_url(bound.ip()) };
    format!("{host}:{}", bound.port())
}

/// This machine's name, if it has one that can stand in a URL.
pub fn host_name() -> Option<String> {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").ok()?;
    let name = name.trim().to_ascii_lowercase();
    let sound = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-.".contains(c));
    (sound && name != "(none)").then_some(name)
}

fn here(ip: IpAddr) -> String {
    match ip {
        IpAddr::V4(_) => in_url(Ipv4Addr::LOCALHOST.into()),
        IpAddr::V6(_) => in_url(Ipv6Addr::LOCALHOST.into()),
    }
}

fn in_url(ip: IpAddr) -> String {
    match ip {
        IpAddr::V4(ip) => ip.to_string(),
        IpAddr::V6(ip) => format!("[{ip}]"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(bound: &str, advertised: Option<&str>) -> String {
        let advertised = advertised.map(|text| text.parse().unwrap());
        let (host, port) = for_others(bound.parse().unwrap(), advertised.as_ref());
        format!("{host}:{port}")
    }

    #[test]
    fn others_are_told_an_address_that_they_can_use() {
        assert_eq!(told("127.0.0.1:7421", None), "127.0.0.1:7421");
        assert_eq!(told("[::1]:7421", None), "[::1]:7421");
        assert_eq!(told("10.1.2.3:80", None), "10.1.2.3:80");
        let everywhere = told("0.0.0.0:7421", None);
        assert!(!everywhere.starts_with("0.0.0.0"), "{everywhere}");
        assert!(!told("[::]:7421", None).starts_with("[::]"));
        assert_eq!(told("0.0.0.0:7421", Some("node7")), "node7:7421");
        assert_eq!(told("0.0.0.0:7421", Some("node7.cluster:99")), "node7.cluster:99");
        assert_eq!(told("0.0.0.0:7421", Some("fd00::7")), "[fd00::7]:7421");
        assert_eq!(told("0.0.0.0:7421", Some("[fd00::7]:5")), "[fd00::7]:5");
        assert_eq!(from_here("0.0.0.0:7".parse().unwrap()), "127.0.0.1:7");
        assert_eq!(from_here("[::]:7".parse().unwrap()), "[::1]:7");
    }

    #[test]
    fn what_is_no_host_is_not_advertised() {
        for text in ["", ":80", "http://node", "node:port", "node:99999", "no de", "[node]:1", "a/b"] {
            assert!(text.parse::<Advertised>().is_err(), "{text}");
        }
    }
}
