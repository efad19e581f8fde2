//! Who is at the other end of a connection, what they may call, and how often.

use crate::limits;
use runout_proto::tls::Role;
use std::net::SocketAddr;
use std::sync::Mutex;
use std::time::Duration;
use tokio::time::Instant;

/// What a peer has shown of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Standing {
    /// The coordinator serves without TLS: whoever reaches it may do everything.
    Unprotected,
    /// Certified by the coordinator's authority, for these roles.
    Certified(Vec<Role>),
}

/// What a call needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Right {
    /// To take part: worker.
    Work,
    /// To see where the campaign stands: worker or operator.
    Look,
    /// To end the campaign: operator.
    Cancel,
}

impl Right {
    fn roles(self) -> &'static [Role] {
        match self {
            Right::Work => &[Role::Worker],
            Right::Look => &[Role::Worker, Role::Operator],
            Right::Cancel => &[Role::Operator],
        }
    }
}

/// The other end of a connection.
#[derive(Debug)]
pub struct Caller {
    peer: SocketAddr,
    standing: Standing,
    /// When the next call is due at the permitted rate.
    due: Mutex<Instant>,
}

impl Caller {
    /// A peer that has just connected.
    pub fn new(peer: SocketAddr, standing: Standing) -> Caller {
        Caller { peer, standing, due: Mutex::new(Instant::now()) }
    }

    /// Where it is.
    pub fn peer(&self) -> SocketAddr {
        self.peer
    }

    /// Whether it may make a call that needs this right.
    ///
    /// # Errors
    /// It may not; what it would need, in words.
    pub fn may(&self, right: Right) -> Result<(), String> {
        let Standing::Certified(has) = &self.standing else { return Ok(()) };
        if right.roles().iter().any(|role| has.contains(role)) {
            return Ok(());
        }
        let names = |roles: &[Role]| {
            let names: Vec<&str> = roles.iter().map(|role| role.name()).collect();
            names.join(" or ")
        };
        let (needs, has) =
            (names(right.roles()), if has.is_empty() { "none".to_owned() } else { names(has) });
        Err(format!(
            "this call needs a certificate of the role {needs}, and the caller's role is {has}: use the files of \
             that role from the directory made by `runout tls init`"
        ))
    }

    /// Waits until the next call of this connection is due: at once below the permitted rate.
    pub async fn pace(&self) {
        let now = Instant::now();
        let due = self.next(now);
        // No timer is set for what need not wait.
        if due > now {
            tokio::time::sleep_until(due).await;
        }
    }

    fn next(&self, now: Instant) -> Instant {
        let step = Duration::from_secs(1) / limits::CALLS_PER_SECOND;
        let mut due = self.due.lock().expect("nobody panics with it locked");
        // Time in which nobody called counts for later, up to a limit.
        let earliest = now.checked_sub(step * limits::CALLS_AT_ONCE).unwrap_or(now);
        *due = (*due).max(earliest) + step;
        *due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caller(standing: Standing) -> Caller {
        Caller::new("127.0.0.1:1".parse().unwrap(), standing)
    }

    #[test]
    fn a_role_opens_its_own_calls_only() {
        let may = |roles: &[Role]| {
            let caller = caller(Standing::Certified(roles.to_vec()));
            [Right::Work, Right::Look, Right::Cancel].map(|right| caller.may(right).is_ok())
        };
        assert_eq!(may(&[Role::Worker]), [true, true, false]);
        assert_eq!(may(&[Role::Operator]), [false, true, true]);
        assert_eq!(may(&[Role::Server]), [false, false, false]);
        assert_eq!(may(&[]), [false, false, false]);
        assert_eq!(may(&[Role::Worker, Role::Operator]), [true, true, true]);
        assert!(caller(Standing::Unprotected).may(Right::Cancel).is_ok());
        let why = caller(Standing::Certified(vec![Role::Operator])).may(Right::Work).unwrap_err();
        assert!(why.starts_with(
            "this call needs a certificate of the role worker, and the caller's role is operator"
        ));
    }

    #[test]
    fn calls_beyond_the_rate_wait() {
        let caller = caller(Standing::Unprotected);
        let now = Instant::now() + Duration::from_secs(60);
        let wait =
            |calls: u32| (0..calls).map(|_| caller.next(now)).last().unwrap().saturating_duration_since(now);
        assert_eq!(wait(limits::CALLS_AT_ONCE), Duration::ZERO);
        assert_eq!(wait(limits::CALLS_PER_SECOND), Duration::from_secs(1));
        // A second later the debt is paid.
        assert_eq!(caller.next(now + Duration::from_secs(2)).saturating_duration_since(now).as_secs(), 1);
    }
}
