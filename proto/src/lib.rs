//! The wire contract between coordinator and workers, and its conversions.
//!
//! Only the edges of the two programs speak the generated types of [`v1`]; [`convert`] turns them into core's types
//! and back, checking every number on the way in; [`check`] holds every message against the contract before anything
//! else looks at it. [`identity`] is what both sides must have in common, [`tls`] how they come to trust each other,
//! [`logging`] how both write their logs.

pub mod check;
pub mod convert;
pub mod identity;
pub mod logging;
pub mod tls;

/// The generated types, client and server. Meaning, units and absence stand in `runout.proto`.
pub mod v1 {
    #![allow(missing_docs, reason = "generated; documented in runout.proto")]
    #![allow(unreachable_pub, reason = "generated")]
    tonic::include_proto!("runout.v1");
}

/// Largest message either side sends or accepts, bytes: a spec with its tables is a few kilobytes.
pub const MESSAGE_LIMIT_BYTES: usize = 1 << 20;

/// Longest time a lease call is held open, s.
pub const LONGEST_POLL_S: f64 = 20.0;
