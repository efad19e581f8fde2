//! The coordinator as a server: open the run directory, listen, and end in good order.
//!
//! Plain functions: `open` gives the campaign in progress, `serve` runs on a [`Listener`] until the campaign is over,
//! somebody interrupts or cancels, or the store fails.

use crate::engine::Engine;
use crate::events::What;
use crate::limits;
use crate::listen::{ListenError, Listener};
use crate::load::Loaded;
use crate::page::{Page, PageError};
use crate::progress;
use crate::queue::Settings;
use crate::run_directory::{Contents, RunDirectory, RunDirectoryError};
use crate::service::Service;
use crate::shared::Shared;
use crate::status::tally::{Keeper, Tally};
use crate::status::{State, Status, cache};
use crate::store::{Store, StoreError};
use crate::writer::Writer;
use runout_proto::MESSAGE_LIMIT_BYTES;
use runout_proto::identity::{self, KernelError};
use runout_proto::logging;
use runout_proto::v1::coordinator_server::CoordinatorServer;
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;
use thiserror::Error;
use tokio::sync::{oneshot, watch};
use tokio::time::{Instant, timeout};
use tonic::transport::Server;

/// Longest wait for open calls to end after the listener has closed: a client may not answer at all.
const HARD_DEADLINE: Duration = Duration::from_secs(5);

/// How to serve.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Time between a worker's heartbeats.
    pub heartbeat: Duration,
    /// After an interruption: longest time that running realisations get to finish.
    pub grace: Duration,
    /// Shortest time without a step after which a realisation counts as hung.
    pub hang: Duration,
}

/// Why a coordinator cannot serve.
#[derive(Debug, Error)]
pub enum ServeError {
    /// The run directory cannot be used.
    #[error(transparent)]
    RunDirectory(#[from] RunDirectoryError),
    /// The store cannot be opened.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The store failed while the campaign ran.
    #[error(
        "cannot store outcomes: {0}; nothing acknowledged is lost, repair this and run the command again"
    )]
    StoreFailed(String),
    /// The kernel that the environment asks for cannot be used.
    #[error(transparent)]
    Kernel(#[from] KernelError),
    /// The address cannot be listened on.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// The system refused something else.
    #[error("{0}")]
    System(#[from] io::Error),
    /// The live page cannot be served where it was asked for.
    #[error(transparent)]
    Page(#[from] PageError),
    /// The server ended by itself.
    #[error("the server failed: {0}")]
    Transport(#[from] tonic::transport::Error),
}

impl ServeError {
    /// The exit code: 2 if what was asked for cannot be, 1 if it went wrong on the way.
    pub fn exit_code(&self) -> u8 {
        match self {
            ServeError::RunDirectory(_)
            | ServeError::Kernel(_)
            | ServeError::Listen(_)
            | ServeError::Page(_) => 2,
            _ => 1,
        }
    }
}

/// A campaign in progress, ready to be served.
#[derive(Debug)]
pub struct Coordinator {
    /// Its run directory, locked.
    pub directory: RunDirectory,
    /// What the service works on.
    pub shared: Arc<Shared>,
    /// Its live page, where it has one.
    pub page: Option<Page>,
    store: JoinHandle<()>,
}

impl Coordinator {
    /// Whether there is nothing to serve for: the campaign is over, and none of its results is contested.
    pub fn has_ended(&self) -> bool {
        let engine = self.shared.engine();
        let contested = engine.queue().contested();
        if engine.is_over() && contested > 0 {
            tracing::warn!(
                "the campaign is over, but {contested} of its results are contested: a worker decides that runs them \
                 under a name that has not done so yet"
            );
        }
        engine.is_over() && contested == 0
    }

    /// Lets go of everything without serving; the store is closed when this returns.
    pub fn close(self) {
        let Coordinator { directory, shared, page, store } = self;
        drop(page);
        drop(shared);
        // A thread that has panicked has closed the store as well.
        let _ = store.join();
        drop(directory);
    }
}

/// Opens or continues the campaign in the run directory `out`. Blocks while files are read.
///
/// # Errors
/// The directory or its store cannot be used.
pub fn open(loaded: &Loaded, out: &Path, options: &Options) -> Result<Coordinator, ServeError> {
    let contents = Contents {
        campaign_text: &loaded.campaign_text,
        site_text: loaded.site_text.as_deref(),
        profile_text: loaded.profile_text.as_deref(),
        spec: &loaded.spec,
    };
    let fingerprint = identity::fingerprint(identity::kernel()?);
    let directory = RunDirectory::open(out, contents)?;
    let (store, stored) = Store::open(directory.path())?;
    for note in &stored.notes {
        tracing::warn!("{note}");
    }
    let campaign = loaded.campaign.clone();
    logging::belongs_to(&campaign.name);
    let mut settings =
        Settings::new(campaign.seed, campaign.run.audit_fraction, campaign.stop.maximum_realisations);
    settings.heartbeat = options.heartbeat;
    settings.shortest_hang = options.hang;
    // Two coordinator processes must not give out the same worker ids; any unpredictable number will do.
    let session = RandomState::new().hash_one(std::process::id()) as u32;
    let tally = Tally::of(&campaign, &stored);
    let engine = Engine::new(settings, tally.estimator().clone(), &stored, session);
    let keeper = Keeper::new(tally, cache::key_of(&loaded.spec.digest(), &loaded.campaign_text));
    if directory.resumed() {
        tracing::info!("resuming with {} outcomes", stored.records.len());
    }
    let (writer, store) = Writer::start_keeping(store, Some(keeper))?;
    writer.note(What::Started { build: identity::build(), outcomes: stored.records.len() as u64 });
    let spec_json = loaded.spec.to_json();
    let digest = loaded.spec.digest();
    let shared = Shared::new(campaign, spec_json, digest, fingerprint, engine, writer, options.grace);
    stored.records.iter().for_each(|record| shared.seen().restored(record));
    Ok(Coordinator { directory, shared: Arc::new(shared), page: None, store })
}

/// Serves until the campaign is over, `interrupts` counts one (drain) or two (end at once), an operator cancels (which
/// counts as one), or the store fails; returns where the campaign stands then.
///
/// # Errors
/// The store or the server failed.
pub async fn serve(
    listener: Listener,
    coordinator: Coordinator,
    options: &Options,
    mut interrupts: watch::Receiver<u32>,
) -> Result<Status, ServeError> {
    let Coordinator { directory, shared, page, store } = coordinator;
    directory.announce(listener.url())?;
    let (stop, stopped) = oneshot::channel::<()>();
    let mut server = tokio::spawn(run_server(listener, Arc::clone(&shared), stopped));
    let progress = tokio::spawn(progress::show(Arc::downgrade(&shared)));

    let ended = tokio::select! {
        ended = until_end(&shared, options, &mut interrupts) => ended,
        server = &mut server => Err(match server {
            Ok(Err(error)) => error.into(),
            _ => ServeError::System(io::Error::other("the server ended by itself")),
        }),
    };
    // The receiver is gone only if the server is.
    let _ = stop.send(());
    if timeout(HARD_DEADLINE, &mut server).await.is_err() {
        server.abort();
    }
    progress.abort();
    // Its bar is gone when this returns; that it was aborted is no news.
    let _ = progress.await;
    let mut status = shared.status();
    if let (Ok(state), Some(page)) = (&ended, page) {
        page.end(&shared, *state).await;
    }
    drop(shared);
    // The store closes when the last call has let go of it; the lock is held until then.
    let closed = tokio::task::spawn_blocking(move || store.join());
    if timeout(HARD_DEADLINE, closed).await.is_err() {
        tracing::warn!("the store did not close in time; what was acknowledged is safe");
    }
    // Only now may another coordinator take the directory.
    drop(directory);
    status.state = ended?;
    Ok(status)
}

async fn run_server(
    listener: Listener,
    shared: Arc<Shared>,
    stopped: oneshot::Receiver<()>,
) -> Result<(), tonic::transport::Error> {
    let service = CoordinatorServer::new(Service::new(shared))
        .max_decoding_message_size(MESSAGE_LIMIT_BYTES)
        .max_encoding_message_size(MESSAGE_LIMIT_BYTES);
    Server::builder()
        .timeout(limits::CALL)
        .concurrency_limit_per_connection(limits::CALLS_PER_CONNECTION as usize)
        .max_concurrent_streams(limits::CALLS_PER_CONNECTION)
        .http2_max_header_list_size(limits::HEADER_BYTES)
        .http2_keepalive_interval(Some(limits::KEEP_ALIVE_INTERVAL))
        .http2_keepalive_timeout(Some(limits::KEEP_ALIVE_TIMEOUT))
        .add_service(service)
        .serve_with_incoming_shutdown(listener.incoming(), async {
            // A sender that is gone means the same as one that has sent.
            let _ = stopped.await;
        })
        .await
}

/// Keeps time until the campaign ends one way or another.
async fn until_end(
    shared: &Arc<Shared>,
    options: &Options,
    interrupts: &mut watch::Receiver<u32>,
) -> Result<State, ServeError> {
    let mut failure = shared.writer().failure();
    let mut tick = tokio::time::interval(options.heartbeat / 4);
    let mut drained_by: Option<Instant> = None;
    let mut audited_by: Option<(usize, Instant)> = None;
    let mut told_by: Option<Instant> = None;
    let mut told = false;
    loop {
        let changed = shared.changed().notified();
        tokio::select! {
            _ = changed => {}
            _ = tick.tick() => {
                let events = shared.engine().tick(shared.now());
                if !events.is_empty() {
                    shared.handle(events);
                }
            }
            Ok(()) = interrupts.changed() => {}
            Ok(()) = failure.changed() => {}
        }
        if let Some(message) = failure.borrow().clone() {
            return Err(ServeError::StoreFailed(message));
        }
        let now = Instant::now();
        let interrupts = *interrupts.borrow() + u32::from(shared.is_cancelled());
        let look = Look::at(shared);
        if look.over {
            if let Some(limit) = look.audit_limit {
                // What a worker set aside leaves to be run again takes time of its own.
                let (_, by) = *match &mut audited_by {
                    Some(set) if set.0 >= look.audits_due => set,
                    unset => unset.insert((look.audits_due, now + limit)),
                };
                if now < by && interrupts == 0 {
                    told_by = None;
                    continue;
                }
            }
            told = true;
            let told_by = *told_by.get_or_insert_with(|| {
                shared.engine().close();
                shared.changed().notify_waiters();
                now + look.lost_after
            });
            if look.told || now >= told_by || interrupts > 0 {
                return Ok(shared.status().state);
            }
            continue;
        }
        // It may have been over, and an outcome that it rested on was overruled.
        if told {
            tracing::warn!(
                "an outcome was overruled after the workers had been told to leave: run the command again"
            );
            return Ok(State::Interrupted);
        }
        audited_by = None;
        if interrupts > 0 {
            let by = *drained_by.get_or_insert_with(|| {
                tracing::info!("interrupted: waiting up to {:?} for running realisations", options.grace);
                shared.engine().drain();
                shared.changed().notify_waiters();
                now + options.grace
            });
            if look.idle || now >= by || interrupts > 1 {
                return Ok(State::Interrupted);
            }
        }
    }
}

/// What decides whether to go on serving.
struct Look {
    over: bool,
    idle: bool,
    told: bool,
    audits_due: usize,
    audit_limit: Option<Duration>,
    lost_after: Duration,
}

impl Look {
    fn at(shared: &Shared) -> Look {
        let engine = shared.engine();
        let queue = engine.queue();
        Look {
            over: engine.is_over(),
            idle: queue.leases().next().is_none(),
            told: queue.everyone_told(),
            audits_due: queue.audits_due(),
            audit_limit: queue.audit_limit(),
            lost_after: queue.settings().lost_after(),
        }
    }
}

/// Signals that come this soon after one another are one: `timeout` and batch systems signal a process and its group.
const ONE_SIGNAL: Duration = Duration::from_millis(500);

/// Counts interruptions (SIGINT, SIGTERM). The second one ends the process at once: everything
/// acknowledged is on the disk at any time.
///
/// # Errors
/// The system refuses signal handlers.
pub fn interruptions() -> io::Result<watch::Receiver<u32>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let (count, counted) = watch::channel(0);
    tokio::spawn(async move {
        let mut last: Option<Instant> = None;
        loop {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
            if last.is_some_and(|at| at.elapsed() < ONE_SIGNAL) {
                continue;
            }
            last = Some(Instant::now());
            count.send_modify(|n| *n += 1);
            if *count.borrow() > 1 {
                std::process::exit(i32::from(State::Interrupted.exit_code()));
            }
        }
    });
    Ok(counted)
}
