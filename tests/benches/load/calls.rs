//! gRPC calls at next to no cost: what a thousand workers on a thousand machines cost their own machines must not be what
//! limits a measurement of their coordinator on one.
//!
//! One call at a time on a connection, with headers that are written once (RFC 9113, and RFC 7541 without compression). Of
//! an answer's headers nothing is decoded: a call that failed has no message. On the wire it is what any client sends.

use prost::Message;
use std::io::{self, ErrorKind};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
const FRAME_HEADER: usize = 9;
/// Types of frames, and their flags.
const DATA: u8 = 0;
const HEADERS: u8 = 1;
const RESET: u8 = 3;
const SETTINGS: u8 = 4;
const PING: u8 = 6;
const GO_AWAY: u8 = 7;
const WINDOW_UPDATE: u8 = 8;
const ACK: u8 = 1;
const END_STREAM: u8 = 1;
const END_HEADERS: u8 = 4;
/// Room for answers: more than a measurement brings.
const WINDOW: u32 = 1 << 30;
/// Room for what has been received and not looked at, bytes.
const BUFFER: usize = 16 << 10;
/// Bytes in front of a gRPC message: whether it is compressed, and its length.
const MESSAGE_HEADER: usize = 5;

/// A connection to a coordinator.
pub(crate) struct Calls {
    stream: TcpStream,
    authority: String,
    next_stream: u32,
    received: Vec<u8>,
}

impl Calls {
    /// Connects to `http://HOST:PORT`.
    pub(crate) async fn connect(url: &str) -> io::Result<Calls> {
        let authority = url.trim().trim_start_matches("http://").to_owned();
        let mut stream = TcpStream::connect(&authority).await?;
        stream.set_nodelay(true)?;
        let mut begin = PREFACE.to_vec();
        frame(&mut begin, SETTINGS, 0, 0, &[]);
        frame(&mut begin, WINDOW_UPDATE, 0, 0, &WINDOW.to_be_bytes());
        stream.write_all(&begin).await?;
        Ok(Calls { stream, authority, next_stream: 1, received: Vec::with_capacity(BUFFER) })
    }

    /// Calls a method of the coordinator; none if it answers with an error.
    pub(crate) async fn call<R: Message + Default>(
        &mut self,
        method: &str,
        request: &impl Message,
    ) -> io::Result<Option<R>> {
        let id = self.next_stream;
        self.next_stream += 2;
        let mut bytes = Vec::with_capacity(512);
        frame(&mut bytes, HEADERS, END_HEADERS, id, &headers(&self.authority, method));
        let mut message = vec![0];
        message.extend((request.encoded_len() as u32).to_be_bytes());
        request.encode(&mut message).expect("a vector grows");
        frame(&mut bytes, DATA, END_STREAM, id, &message);
        self.stream.write_all(&bytes).await?;
        let answer = self.answer(id).await?;
        match answer.get(MESSAGE_HEADER..) {
            None => Ok(None),
            Some(message) => R::decode(message).map(Some).map_err(io::Error::other),
        }
    }

    /// The data of a stream up to its end.
    async fn answer(&mut self, id: u32) -> io::Result<Vec<u8>> {
        let mut answer = Vec::new();
        loop {
            let Some((kind, flags, of, length)) = self.frame_received() else {
                if self.stream.read_buf(&mut self.received).await? == 0 {
                    return Err(ErrorKind::UnexpectedEof.into());
                }
                continue;
            };
            let mut frame: Vec<u8> = self.received.drain(..FRAME_HEADER + length).collect();
            match kind {
                SETTINGS | PING if flags & ACK == 0 => {
                    let mut reply = Vec::new();
                    let payload = if kind == PING { frame.split_off(FRAME_HEADER) } else { Vec::new() };
                    self::frame(&mut reply, kind, ACK, 0, &payload);
                    self.stream.write_all(&reply).await?;
                }
                GO_AWAY => return Err(ErrorKind::ConnectionAborted.into()),
                RESET if of == id => return Ok(Vec::new()),
                DATA if of == id => answer.extend(&frame[FRAME_HEADER..]),
                _ => {}
            }
            if of == id && matches!(kind, DATA | HEADERS) && flags & END_STREAM != 0 {
                return Ok(answer);
            }
        }
    }

    /// Kind, flags, stream and length of the first frame received, if all of it is there.
    fn frame_received(&self) -> Option<(u8, u8, u32, usize)> {
        let header = self.received.get(..FRAME_HEADER)?;
        let length = u32::from_be_bytes([0, header[0], header[1], header[2]]) as usize;
        let stream = u32::from_be_bytes(header[5..].try_into().expect("four bytes"));
        (self.received.len() >= FRAME_HEADER + length).then_some((header[3], header[4], stream, length))
    }
}

fn frame(bytes: &mut Vec<u8>, kind: u8, flags: u8, stream: u32, payload: &[u8]) {
    let length = u32::try_from(payload.len()).expect("a small frame");
    bytes.extend(&length.to_be_bytes()[1..]);
    bytes.extend([kind, flags]);
    bytes.extend(stream.to_be_bytes());
    bytes.extend(payload);
}

/// Headers of a call; numbers name entries of the static table.
fn headers(authority: &str, method: &str) -> Vec<u8> {
    const METHOD_POST: u8 = 0x83;
    const SCHEME_HTTP: u8 = 0x86;
    const AUTHORITY: u8 = 1;
    const PATH: u8 = 4;
    /// `content-type` is 31, of which a prefix of four bits holds 15.
    const CONTENT_TYPE: [u8; 2] = [15, 31 - 15];
    let path = format!("/runout.v1.Coordinator/{method}");
    let mut bytes = vec![METHOD_POST, SCHEME_HTTP];
    let mut field = |name: &[u8], value: &str| {
        bytes.extend(name);
        bytes.push(u8::try_from(value.len()).ok().filter(|length| *length < 127).expect("a short text"));
        bytes.extend(value.as_bytes());
    };
    field(&[PATH], &path);
    field(&[AUTHORITY], authority);
    field(&CONTENT_TYPE, "application/grpc");
    field(b"\x00\x02te", "trailers");
    bytes
}
