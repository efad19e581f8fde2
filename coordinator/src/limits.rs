//! What a coordinator bears of its clients. docs/security.md shows the same table; sizes of messages and of their
//! fields are part of the contract (`runout_proto`).

use std::time::Duration;

/// Connections open at a time: a worker has two. Fewer where the process may not have as many files.
pub const CONNECTIONS: usize = 8192;
/// Open files left for everything but connections.
pub const FILES_FOR_OTHERS: usize = 64;
/// Connections that have not yet shown who they are.
pub const HANDSHAKES: usize = 512;
/// Longest time a connection may take for that.
pub use runout_proto::tls::HANDSHAKE_LIMIT;
/// Workers registered at a time.
pub const WORKERS: usize = 16_384;
/// Longest time any call may take: a lease call is held open for 20 s.
pub const CALL: Duration = Duration::from_secs(40);
/// Calls served at a time on one connection: a worker's slots are not more.
pub const CALLS_PER_CONNECTION: u32 = 4096;
/// Calls a second on one connection; those beyond wait.
pub const CALLS_PER_SECOND: u32 = 10_000;
/// Calls that may come at once before the rate counts.
pub const CALLS_AT_ONCE: u32 = 2 * CALLS_PER_CONNECTION;
/// Headers of a call, bytes.
pub const HEADER_BYTES: u32 = 16 << 10;
/// A connection that has died without saying so is noticed within the sum of these.
pub const KEEP_ALIVE_INTERVAL: Duration = Duration::from_secs(20);
/// Longest wait for an answer to a sign of life.
pub const KEEP_ALIVE_TIMEOUT: Duration = Duration::from_secs(20);
/// Lines a second that strangers can cause in the log.
pub const NOTES_PER_SECOND: u32 = 20;
