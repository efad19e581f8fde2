//! The loop that accepts connections, within bounds, and has each show who it is before anything else reads from it.

use super::connection::Bytes;
use super::{Caller, Connection, Notes, Standing};
use crate::limits;
use runout_proto::tls::refusal::{self, TLS_ONLY};
use runout_proto::tls::{CertificateView, Role};
use std::fs;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc};
use tokio::time::{sleep, timeout};
use tokio_rustls::TlsAcceptor;
use tokio_stream::wrappers::ReceiverStream;

/// Connections let in that the server has not yet taken over.
const READY: usize = 64;
/// Wait before another connection is accepted after the system has refused one (too many files, say).
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// First byte of everything that TLS can begin with.
const TLS_HANDSHAKE: u8 = 0x16;
/// How long a refused peer may take to read why, and the most that is read from it meanwhile, bytes.
const LAST_WORDS: Duration = Duration::from_secs(1);
const LAST_BYTES: usize = 64 << 10;

static NOTES: Notes = Notes::new();

/// Why a connection was not let in.
pub(crate) enum Refused {
    /// It went away without a word: somebody looks whether the port is open.
    Silent,
    /// In words.
    Because(String),
}

/// Starts the loop; it ends when the stream is dropped.
pub(super) fn start(socket: TcpListener, tls: Option<TlsAcceptor>) -> ReceiverStream<io::Result<Connection>> {
    let (ready, stream) = mpsc::channel(READY);
    tokio::spawn(accept(socket, tls, ready));
    ReceiverStream::new(stream)
}

async fn accept(socket: TcpListener, tls: Option<TlsAcceptor>, ready: mpsc::Sender<io::Result<Connection>>) {
    let most = most_connections();
    let places = Arc::new(Semaphore::new(most));
    let turns = Arc::new(Semaphore::new(limits::HANDSHAKES));
    loop {
        // Whoever comes when too many have not yet shown who they are waits with the system, for a limited time each: of a
        // thousand workers that start together none is sent away.
        let turn = tokio::select! {
            turn = Arc::clone(&turns).acquire_owned() => turn,
            () = ready.closed() => return,
        };
        let accepted = tokio::select! {
            accepted = socket.accept() => accepted,
            () = ready.closed() => return,
        };
        let (stream, peer) = match accepted {
            Ok(accepted) => accepted,
            Err(error) => {
                NOTES.say(&format!("no connection can be accepted: {error}"));
                sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            NOTES.say(&format!("connection from {peer} refused: {most} are open already"));
            continue;
        };
        let (tls, ready) = (tls.clone(), ready.clone());
        tokio::spawn(async move {
            let shown = let_in(stream, peer, tls.as_ref(), goodbye).await;
            drop(turn);
            match shown {
                Ok((bytes, caller)) => {
                    // The server is gone if nobody takes it.
                    let _ = ready.send(Ok(Connection::new(bytes, caller, place))).await;
                }
                Err(Refused::Silent) => tracing::debug!("{peer} has connected and gone"),
                Err(Refused::Because(why)) => NOTES.say(&format!("connection from {peer} refused: {why}")),
            }
        });
    }
}

/// Has the peer show its certificate, if there is TLS; one that does not speak TLS is told so, in the bytes that `goodbye`
/// makes of the words.
pub(crate) async fn let_in(
    stream: TcpStream,
    peer: SocketAddr,
    tls: Option<&TlsAcceptor>,
    goodbye: fn(&str) -> Vec<u8>,
) -> Result<(Bytes, Caller), Refused> {
    // Small messages shall not wait for others; if that cannot be had, it is slower.
    let _ = stream.set_nodelay(true);
    let Some(tls) = tls else {
        return Ok((Bytes::Left(stream), Caller::new(peer, Standing::Unprotected)));
    };
    let limit = limits::HANDSHAKE_LIMIT;
    let late = |_| Refused::Because(format!("it has not shown who it is within {limit:?}"));
    timeout(limit, shake_hands(stream, peer, tls, goodbye)).await.map_err(late)?
}

async fn shake_hands(
    mut stream: TcpStream,
    peer: SocketAddr,
    tls: &TlsAcceptor,
    goodbye: fn(&str) -> Vec<u8>,
) -> Result<(Bytes, Caller), Refused> {
    let mut first = [0];
    match stream.peek(&mut first).await {
        Err(_) | Ok(0) => return Err(Refused::Silent),
        Ok(_) if first[0] != TLS_HANDSHAKE => {
            // It is gone already if this cannot be sent.
            let _ = stream.write_all(&goodbye(TLS_ONLY)).await;
            end(stream).await;
            return Err(Refused::Because("it does not speak TLS".to_owned()));
        }
        Ok(_) => {}
    }
    match tls.accept(stream).into_fallible().await {
        Ok(stream) => {
            let roles = roles_of(&stream);
            Ok((Bytes::Right(Box::new(stream)), Caller::new(peer, Standing::Certified(roles))))
        }
        Err((error, stream)) => {
            end(stream).await;
            Err(Refused::Because(refusal::seen_by_coordinator(&error)))
        }
    }
}

fn roles_of(stream: &tokio_rustls::server::TlsStream<TcpStream>) -> Vec<Role> {
    let certificate = stream.get_ref().1.peer_certificates().and_then(|chain| chain.first());
    // Verified by now; without a certificate there is no role.
    certificate.and_then(|der| CertificateView::of(der).ok()).map(|view| view.roles).unwrap_or_default()
}

/// Closes a connection such that the peer can read what was sent last: what it has sent itself is read first, or the
/// system would tear the connection down.
async fn end(mut stream: TcpStream) {
    let read_out = async {
        stream.shutdown().await?;
        let mut ignored = [0; 4096];
        let mut total = 0;
        while total < LAST_BYTES {
            match stream.read(&mut ignored).await? {
                0 => break,
                read => total += read,
            }
        }
        Ok::<(), io::Error>(())
    };
    // Whatever goes wrong, the connection ends here.
    let _ = timeout(LAST_WORDS, read_out).await;
}

/// HTTP/2 for "go away, the security is inadequate", with a reason in words: two frames that need no conversation.
fn goodbye(words: &str) -> Vec<u8> {
    /// RFC 9113, sections 6.5, 6.8 and 7.
    const SETTINGS: [u8; 9] = [0, 0, 0, 4, 0, 0, 0, 0, 0];
    const GOAWAY: u8 = 7;
    const INADEQUATE_SECURITY: u32 = 0xc;
    let length = u32::try_from(8 + words.len()).expect("a sentence");
    let mut bytes = SETTINGS.to_vec();
    bytes.extend(&length.to_be_bytes()[1..]);
    bytes.extend([GOAWAY, 0]);
    // Frame of the whole connection; no stream was looked at.
    bytes.extend([0; 8]);
    bytes.extend(INADEQUATE_SECURITY.to_be_bytes());
    bytes.extend(words.as_bytes());
    bytes
}

/// Connections that may be open: fewer than the limit where this process may not have as many files.
fn most_connections() -> usize {
    let limits = fs::read_to_string("/proc/self/limits").unwrap_or_default();
    let files = limits
        .lines()
        .find_map(|line| line.strip_prefix("Max open files"))
        .and_then(|rest| rest.split_whitespace().next())
        .and_then(|number| number.parse::<usize>().ok());
    let most = files.map_or(limits::CONNECTIONS, |files| {
        files.saturating_sub(limits::FILES_FOR_OTHERS).clamp(1, limits::CONNECTIONS)
    });
    if most < limits::CONNECTIONS {
        tracing::debug!("at most {most} connections: this process may not open more files (ulimit -n)");
    }
    most
}
