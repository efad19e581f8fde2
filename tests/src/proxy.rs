//! A TCP proxy between workers and their coordinator: a slow network, or one that is cut.
//!
//! TCP hides lost segments from what runs on it and shows them as delay: the segment and everything behind it waits
//! for its repetition. So a loss is modelled as [`RETRANSMISSION`] of additional delay for one read in so many, in
//! order; a cut stops the bytes of both directions and new connections, and healing closes what was open then, as
//! keep-alives would after a while.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::Runtime;
use tokio::sync::{mpsc, watch};
use tokio::time::Instant;

/// Time until a lost segment has been sent again and has arrived: Linux's shortest retransmission timeout.
pub const RETRANSMISSION: Duration = Duration::from_millis(200);
/// Reads in flight per direction of a connection; further ones wait, as in a full socket buffer.
const IN_FLIGHT: usize = 1024;
/// What is read at a time: about one segment, so that losses hit segments.
const SEGMENT_BYTES: usize = 1460;

/// How the network behaves.
#[derive(Debug, Default)]
struct Weather {
    delay_us: AtomicU64,
    /// One read in this many is lost; 0 for none.
    loss_of: AtomicU32,
    reads: AtomicU64,
    lost: AtomicU64,
}

/// A running proxy; it ends when it goes out of scope.
#[derive(Debug)]
pub struct Proxy {
    url: String,
    weather: Arc<Weather>,
    cut: watch::Sender<bool>,
    _runtime: Runtime,
}

impl Proxy {
    /// A proxy to the coordinator at `url`, on a port of its own.
    ///
    /// # Panics
    /// The system refuses a socket or a thread, or `url` is none.
    pub fn to(url: &str) -> Proxy {
        let target = url.strip_prefix("http://").expect("a URL of a coordinator").to_owned();
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .expect("a runtime");
        let listener = runtime.block_on(TcpListener::bind("127.0.0.1:0")).expect("a port");
        let url = format!("http://{}", listener.local_addr().expect("it is bound"));
        let weather = Arc::new(Weather::default());
        let cut = watch::Sender::new(false);
        runtime.spawn(accept(listener, target, Arc::clone(&weather), cut.subscribe()));
        Proxy { url, weather, cut, _runtime: runtime }
    }

    /// Where workers connect.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Delays every byte by `delay` each way, and has one segment in `loss_of` lost (0: none).
    pub fn slow(&self, delay: Duration, loss_of: u32) {
        self.weather.delay_us.store(delay.as_micros() as u64, Ordering::Relaxed);
        self.weather.loss_of.store(loss_of, Ordering::Relaxed);
    }

    /// Segments lost so far.
    pub fn lost(&self) -> u64 {
        self.weather.lost.load(Ordering::Relaxed)
    }

    /// Cuts the network.
    pub fn cut(&self) {
        self.cut.send_replace(true);
    }

    /// Heals it.
    pub fn heal(&self) {
        self.cut.send_replace(false);
    }
}

async fn accept(listener: TcpListener, target: String, weather: Arc<Weather>, cut: watch::Receiver<bool>) {
    while let Ok((from, _)) = listener.accept().await {
        let (target, weather, mut cut) = (target.clone(), Arc::clone(&weather), cut.clone());
        tokio::spawn(async move {
            // A connection that is made while the network is cut gets no answer until it heals.
            let _ = cut.wait_for(|cut| !cut).await;
            // The coordinator may be down: then the connection is closed.
            if let Ok(to) = TcpStream::connect(&target).await {
                join(from, to, &weather, cut).await;
            }
        });
    }
}

/// Carries bytes both ways until one side closes, or the network heals after a cut.
async fn join(from: TcpStream, to: TcpStream, weather: &Arc<Weather>, cut: watch::Receiver<bool>) {
    let _ = (from.set_nodelay(true), to.set_nodelay(true));
    let ((from_read, from_write), (to_read, to_write)) = (from.into_split(), to.into_split());
    let mut watched = cut.clone();
    let healed = async {
        let _ = watched.wait_for(|cut| *cut).await;
        let _ = watched.wait_for(|cut| !cut).await;
    };
    tokio::select! {
        () = carry(from_read, to_write, weather, cut.clone()) => {}
        () = carry(to_read, from_write, weather, cut.clone()) => {}
        () = healed => {}
    }
}

/// Carries bytes one way, in order, each read after its delay.
async fn carry(
    mut from: OwnedReadHalf,
    mut to: OwnedWriteHalf,
    weather: &Arc<Weather>,
    mut cut: watch::Receiver<bool>,
) {
    let (sender, mut receiver) = mpsc::channel::<(Instant, Vec<u8>)>(IN_FLIGHT);
    let read = async {
        let mut buffer = vec![0; SEGMENT_BYTES];
        while let Ok(count @ 1..) = from.read(&mut buffer).await {
            let due = Instant::now() + weather.delay();
            if sender.send((due, buffer[..count].to_vec())).await.is_err() {
                break;
            }
        }
        drop(sender);
    };
    let write = async {
        while let Some((due, bytes)) = receiver.recv().await {
            tokio::time::sleep_until(due).await;
            let _ = cut.wait_for(|cut| !cut).await;
            if to.write_all(&bytes).await.is_err() {
                break;
            }
        }
    };
    tokio::join!(read, write);
}

impl Weather {
    /// Delay of the next read.
    fn delay(&self) -> Duration {
        let delay = Duration::from_micros(self.delay_us.load(Ordering::Relaxed));
        let number = self.reads.fetch_add(1, Ordering::Relaxed);
        match self.loss_of.load(Ordering::Relaxed) {
            // A multiplicative hash instead of chance, so that about as many are lost however few there are.
            of @ 1.. if (number.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 33).is_multiple_of(u64::from(of)) => {
                self.lost.fetch_add(1, Ordering::Relaxed);
                delay + RETRANSMISSION
            }
            _ => delay,
        }
    }
}
