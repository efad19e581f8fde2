//! Every message of the contract, held against what `runout.proto` says of its fields. Both sides check what arrives
//! before they look at anything else in it.

use crate::convert::{DecodeError, bad, decode_outcome, hexadecimal, is_printable, non_negative, readable};
use crate::v1;

/// Most leases in one message: the slots of a worker are fewer.
pub const MOST_LEASES: usize = 8192;
/// Highest number of an attempt: nobody gets that far, and counting on from it does not overflow.
pub const HIGHEST_ATTEMPT: u32 = 1 << 30;
/// Most slots of a worker.
pub const MOST_SLOTS: u32 = 4096;
/// Most cores of a worker's machine.
pub const MOST_CORES: u32 = 65_536;
/// Most characters of a name or of an identity.
const LONGEST_NAME: usize = 128;
/// Longest time between heartbeats, s.
const LONGEST_HEARTBEAT_S: f64 = 86_400.0;
/// Digits of a spec's digest.
const SPEC_DIGITS: usize = 64;

/// A message that knows what it may hold.
pub trait Check {
    /// Holds the message against the contract.
    ///
    /// # Errors
    /// A field that is missing or holds what it must not; the error names it.
    fn check(&self) -> Result<(), DecodeError>;
}

impl Check for v1::RegisterRequest {
    fn check(&self) -> Result<(), DecodeError> {
        name("build", &self.build)?;
        name("fingerprint", &self.fingerprint)?;
        name("name", &self.name)?;
        if !(1..=MOST_SLOTS).contains(&self.slots) {
            return Err(bad("slots", self.slots, "it must be 1 to 4096"));
        }
        if let Some(machine) = &self.machine {
            name("machine.processor", &machine.processor)?;
            name("machine.kernel", &machine.kernel)?;
            if !(1..=MOST_CORES).contains(&machine.cores) {
                return Err(bad("machine.cores", machine.cores, "it must be 1 to 65536"));
            }
        }
        leases("held", &self.held)
    }
}

impl Check for v1::RegisterReply {
    fn check(&self) -> Result<(), DecodeError> {
        if self.spec_json.is_empty() {
            return Err(DecodeError::Missing { field: "spec_json" });
        }
        if !(self.heartbeat_s > 0.0 && self.heartbeat_s <= LONGEST_HEARTBEAT_S) {
            let allowed = "it must be greater than 0 and at most 86400";
            return Err(bad("heartbeat_s", self.heartbeat_s, allowed));
        }
        if !(self.lost_after_s.is_finite() && self.lost_after_s >= self.heartbeat_s) {
            return Err(bad("lost_after_s", self.lost_after_s, "it must be finite and at least heartbeat_s"));
        }
        Ok(())
    }
}

impl Check for v1::LeaseRequest {
    fn check(&self) -> Result<(), DecodeError> {
        non_negative("poll_s", self.poll_s).map(|_| ())
    }
}

impl Check for v1::LeaseReply {
    fn check(&self) -> Result<(), DecodeError> {
        use v1::lease_reply::Kind;
        match (self.kind(), self.lease) {
            (Kind::Unspecified, _) => Err(DecodeError::Missing { field: "kind" }),
            (Kind::Assigned, None) => Err(DecodeError::Missing { field: "lease" }),
            (Kind::Assigned, Some(given)) => lease("lease.attempt", &given),
            (_, None) => Ok(()),
            (_, Some(_)) => Err(bad("lease", "present", "only an answer of kind ASSIGNED has one")),
        }
    }
}

impl Check for v1::HeartbeatRequest {
    fn check(&self) -> Result<(), DecodeError> {
        few("running", self.running.len())?;
        self.running.iter().try_for_each(|progress| {
            let held = progress.lease.ok_or(DecodeError::Missing { field: "running.lease" })?;
            lease("running.lease.attempt", &held)?;
            non_negative("running.simulated_s", progress.simulated_s).map(|_| ())
        })
    }
}

impl Check for v1::HeartbeatReply {
    fn check(&self) -> Result<(), DecodeError> {
        if self.order() == v1::heartbeat_reply::Order::Unspecified {
            return Err(DecodeError::Missing { field: "order" });
        }
        leases("cancel", &self.cancel)
    }
}

impl Check for v1::ReportRequest {
    fn check(&self) -> Result<(), DecodeError> {
        attempt("attempt", self.attempt)?;
        hexadecimal("spec_digest", self.spec_digest.clone(), SPEC_DIGITS)?;
        non_negative("wall_s", self.wall_s)?;
        decode_outcome(self.outcome.clone()).map(|_| ())
    }
}

impl Check for v1::ReportReply {
    fn check(&self) -> Result<(), DecodeError> {
        match self.verdict() {
            v1::report_reply::Verdict::Unspecified => Err(DecodeError::Missing { field: "verdict" }),
            _ => Ok(()),
        }
    }
}

impl Check for v1::ReleaseRequest {
    fn check(&self) -> Result<(), DecodeError> {
        // `error` may be any text: leases are not kept because a message about them is long.
        leases("leases", &self.leases)
    }
}

impl Check for v1::ReleaseReply {
    fn check(&self) -> Result<(), DecodeError> {
        Ok(())
    }
}

impl Check for v1::StatusRequest {
    fn check(&self) -> Result<(), DecodeError> {
        Ok(())
    }
}

impl Check for v1::StatusReply {
    fn check(&self) -> Result<(), DecodeError> {
        name("state", &self.state)?;
        if self.json.is_empty() { Err(DecodeError::Missing { field: "json" }) } else { Ok(()) }
    }
}

impl Check for v1::CancelRequest {
    fn check(&self) -> Result<(), DecodeError> {
        let digest = self.spec_digest.clone();
        digest.map_or(Ok(()), |digest| hexadecimal("spec_digest", digest, SPEC_DIGITS).map(|_| ()))
    }
}

impl Check for v1::CancelReply {
    fn check(&self) -> Result<(), DecodeError> {
        name("state", &self.state)?;
        non_negative("grace_s", self.grace_s).map(|_| ())
    }
}

/// Checks a text that people see: 1 to 128 printable characters.
///
/// # Errors
/// It is not; the error names `field`.
pub fn name(field: &'static str, text: &str) -> Result<(), DecodeError> {
    let sound = (1..=LONGEST_NAME).contains(&text.chars().count()) && text.chars().all(is_printable);
    if sound {
        Ok(())
    } else {
        Err(bad(field, readable(text, 80), "it must be 1 to 128 printable characters"))
    }
}

fn few(field: &'static str, count: usize) -> Result<(), DecodeError> {
    if count <= MOST_LEASES { Ok(()) } else { Err(bad(field, count, "at most 8192 leases may stand there")) }
}

fn leases(field: &'static str, all: &[v1::LeaseRef]) -> Result<(), DecodeError> {
    few(field, all.len())?;
    all.iter().try_for_each(|one| lease(field, one))
}

fn lease(field: &'static str, one: &v1::LeaseRef) -> Result<(), DecodeError> {
    attempt(field, one.attempt)
}

fn attempt(field: &'static str, value: u32) -> Result<(), DecodeError> {
    let sound = (1..=HIGHEST_ATTEMPT).contains(&value);
    if sound { Ok(()) } else { Err(bad(field, value, "the number of an attempt is 1 to 2^30")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(message: &impl Check) -> String {
        message.check().expect_err("it breaks the contract").to_string()
    }

    #[test]
    fn a_registration_is_checked_in_every_field() {
        let sound = v1::RegisterRequest {
            protocol: 7,
            build: "0.1.0+spec3".into(),
            fingerprint: "0123456789abcdef".into(),
            name: "knoten-ä 1".into(),
            slots: 4096,
            held: vec![v1::LeaseRef { index: u64::MAX, attempt: 1 }],
            machine: Some(v1::Machine { processor: "Xeon".into(), kernel: "avx2".into(), cores: 65_536 }),
        };
        assert_eq!(sound.check(), Ok(()));
        let with = |change: fn(&mut v1::RegisterRequest)| {
            let mut request = sound.clone();
            change(&mut request);
            said(&request)
        };
        assert!(with(|r| r.name = "a\u{1b}[2J".into()).starts_with("name = a\\u{1b}[2J is not allowed"));
        // Turns the direction of writing: it would let a name look like another.
        assert!(with(|r| r.name = "a\u{202e}b".into()).starts_with("name = a\\u{202e}b is not allowed"));
        assert!(with(|r| r.name = "n".repeat(129)).starts_with("name = nnn"));
        assert!(with(|r| r.name.clear()).starts_with("name ="));
        assert!(with(|r| r.build = "\n".into()).starts_with("build = \\n"));
        assert!(with(|r| r.fingerprint.clear()).starts_with("fingerprint ="));
        assert!(with(|r| r.slots = 0).starts_with("slots = 0"));
        assert!(with(|r| r.slots = 4097).starts_with("slots = 4097"));
        assert!(with(|r| r.held[0].attempt = 0).starts_with("held = 0"));
        assert!(with(|r| r.held[0].attempt = u32::MAX).starts_with("held = 4294967295"));
        assert!(with(|r| r.held = vec![r.held[0]; 8193]).starts_with("held = 8193"));
        assert_eq!(v1::RegisterRequest { machine: None, ..sound.clone() }.check(), Ok(()));
        let with = |change: fn(&mut v1::Machine)| {
            let mut request = sound.clone();
            change(request.machine.as_mut().unwrap());
            said(&request)
        };
        assert!(with(|m| m.processor = "\u{1b}".into()).starts_with("machine.processor = \\u{1b}"));
        assert!(with(|m| m.kernel.clear()).starts_with("machine.kernel ="));
        assert!(with(|m| m.cores = 0).starts_with("machine.cores = 0"));
        assert!(with(|m| m.cores = 65_537).starts_with("machine.cores = 65537"));
    }

    #[test]
    fn an_answer_that_says_nothing_is_no_answer() {
        assert_eq!(said(&v1::ReportReply::default()), "verdict is missing");
        assert_eq!(said(&v1::ReportReply { verdict: 99 }), "verdict is missing");
        assert_eq!(said(&v1::HeartbeatReply::default()), "order is missing");
        assert_eq!(said(&v1::LeaseReply::default()), "kind is missing");
        assert_eq!(said(&v1::LeaseReply { kind: 1, lease: None }), "lease is missing");
        let lease = Some(v1::LeaseRef { index: 0, attempt: 1 });
        assert_eq!(v1::LeaseReply { kind: 1, lease }.check(), Ok(()));
        assert!(said(&v1::LeaseReply { kind: 2, lease }).starts_with("lease = present"));
        let reply =
            v1::RegisterReply { spec_json: "{}".into(), heartbeat_s: 5.0, lost_after_s: 15.0, worker_id: 1 };
        assert_eq!(reply.check(), Ok(()));
        assert!(
            said(&v1::RegisterReply { heartbeat_s: f64::NAN, ..reply.clone() })
                .starts_with("heartbeat_s = NaN")
        );
        assert!(
            said(&v1::RegisterReply { heartbeat_s: 0.0, ..reply.clone() }).starts_with("heartbeat_s = 0")
        );
        assert!(
            said(&v1::RegisterReply { lost_after_s: 1.0, ..reply.clone() }).starts_with("lost_after_s = 1")
        );
        assert_eq!(said(&v1::RegisterReply { spec_json: String::new(), ..reply }), "spec_json is missing");
    }

    #[test]
    fn numbers_and_digests_of_requests_are_checked() {
        assert!(said(&v1::LeaseRequest { worker_id: 1, poll_s: -1.0 }).starts_with("poll_s = -1"));
        let progress = v1::LeaseProgress { simulated_s: f64::INFINITY, ..v1::LeaseProgress::default() };
        let beat = |running| v1::HeartbeatRequest { worker_id: 1, running };
        assert_eq!(said(&beat(vec![progress])), "running.lease is missing");
        let progress = v1::LeaseProgress { lease: Some(v1::LeaseRef { index: 0, attempt: 1 }), ..progress };
        assert!(said(&beat(vec![progress])).starts_with("running.simulated_s = inf"));
        let report =
            v1::ReportRequest { attempt: 1, spec_digest: "g".repeat(64), ..v1::ReportRequest::default() };
        assert!(said(&report).starts_with("spec_digest = ggg"));
        let report = v1::ReportRequest { spec_digest: "a".repeat(64), ..report };
        assert_eq!(said(&report), "outcome is missing");
        assert!(said(&v1::CancelRequest { spec_digest: Some("a".into()) }).starts_with("spec_digest = a"));
        assert_eq!(v1::CancelRequest { spec_digest: None }.check(), Ok(()));
        assert!(
            said(&v1::CancelReply { state: "running".into(), grace_s: -0.5 }).starts_with("grace_s = -0.5")
        );
    }
}
