//! Serves the page: HTTP/1.1, reading only, with a limit on everything a client could hold on to.

use super::address::Door;
use super::live::{Live, View};
use super::metrics;
use crate::listen::{self, Caller, Notes, Refused, Right};
use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::sse::{Event, Sse};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use runout_proto::identity;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};
use tokio_stream::wrappers::ReceiverStream;

const PAGE: &str = include_str!("assets/page.html");
const STYLE: &str = include_str!("assets/page.css");
const SCRIPT: &str = include_str!("assets/page.js");

/// Nothing but the page's own script, style and drawings; it is framed by nobody and sends nothing anywhere.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Time between two events to one browser.
const EVENT_PERIOD: Duration = Duration::from_secs(1);
/// An event without news, so that a browser and whatever stands between notice a dead connection.
const SILENCE: Duration = Duration::from_secs(15);
/// After this the browser asks for the events again, ms.
const RETRY: Duration = Duration::from_secs(2);
/// Wait after a failure to accept, which is for want of file descriptors.
const ACCEPT_AGAIN: Duration = Duration::from_millis(200);

static NOTES: Notes = Notes::new();

/// What clients may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Connections at a time; further ones are closed at once.
    connections: usize,
    /// Browsers that get events at a time; further ones are told to come later.
    streams: usize,
    /// Longest time for a request's head.
    head: Duration,
    /// Longest life of a connection; a browser opens another one by itself.
    life: Duration,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            connections: 64,
            streams: 32,
            head: Duration::from_secs(10),
            life: Duration::from_secs(3600),
        }
    }
}

#[derive(Clone)]
struct Site {
    live: Arc<Live>,
    streams: Arc<Semaphore>,
    ended: watch::Receiver<bool>,
    /// The address that is listened on, if that is loopback: then requests must be meant for it.
    loopback: Option<IpAddr>,
}

/// Serves until `ended` is set and what was begun is done.
pub(super) async fn run(door: Door, live: Arc<Live>, limits: Limits, mut ended: watch::Receiver<bool>) {
    let ip = door.socket.local_addr().map(|a: SocketAddr| a.ip()).ok();
    let streams = Arc::new(Semaphore::new(limits.streams));
    let loopback = ip.filter(IpAddr::is_loopback);
    let router = router(Site { live, streams, ended: ended.clone(), loopback });
    let mut connections = JoinSet::new();
    loop {
        let accepted = tokio::select! {
            accepted = door.socket.accept() => accepted,
            Some(_) = connections.join_next() => continue,
            _ = ended.wait_for(|ended| *ended) => break,
        };
        match accepted {
            Ok((stream, peer)) if connections.len() < limits.connections => {
                let (tls, router, ended) = (door.tls.clone(), router.clone(), ended.clone());
                connections.spawn(async move {
                    match listen::let_in(stream, peer, tls.as_ref(), goodbye).await {
                        Ok((bytes, caller)) => serve(bytes, for_caller(router, &caller), limits, ended).await,
                        Err(Refused::Because(why)) => {
                            NOTES.say(&format!("connection from {peer} to the page refused: {why}"));
                        }
                        Err(Refused::Silent) => {}
                    }
                });
            }
            Ok(_) => {}
            Err(error) => {
                tracing::debug!("the page cannot accept a connection: {error}");
                sleep(ACCEPT_AGAIN).await;
            }
        }
    }
    while connections.join_next().await.is_some() {}
}

/// The page, for who may look at the campaign; for others, why they may not.
fn for_caller(router: Router, caller: &Caller) -> Router {
    match caller.may(Right::Look) {
        Ok(()) => router,
        Err(why) => Router::new().fallback(async move || (StatusCode::FORBIDDEN, why + "\n")),
    }
}

/// The answer to who speaks no TLS where it is needed.
fn goodbye(_: &str) -> Vec<u8> {
    let words = "this page speaks TLS only: begin its address with https:// and show a certificate (docs/security.md)\n";
    format!(
        "HTTP/1.1 400 Bad Request\r\ncontent-type: text/plain\r\ncontent-length: {}\r\nconnection: close\r\n\r\n{words}",
        words.len()
    )
    .into_bytes()
}

async fn serve<S>(stream: S, router: Router, limits: Limits, mut ended: watch::Receiver<bool>)
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.head)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(router));
    tokio::pin!(connection);
    // How a browser ends a connection is its own business.
    let _ = timeout(limits.life, async {
        tokio::select! {
            done = &mut connection => return done,
            _ = ended.wait_for(|ended| *ended) => connection.as_mut().graceful_shutdown(),
        }
        connection.await
    })
    .await;
}

fn router(site: Site) -> Router {
    Router::new()
        .route("/", get(page))
        .route("/page.css", get(|| async { file("text/css; charset=utf-8", STYLE) }))
        .route("/page.js", get(|| async { file("text/javascript; charset=utf-8", SCRIPT) }))
        .route("/events", get(events))
        .route("/api/status", get(status))
        .route("/metrics", get(metrics_text))
        .layer(middleware::from_fn_with_state(site.clone(), guard))
        .with_state(site)
}

/// Refuses requests that are meant for another host, and forbids the browser what the page does not need.
async fn guard(State(site): State<Site>, request: Request, next: Next) -> Response {
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok());
    let meant = site.loopback.is_none_or(|ip| host.is_some_and(|host| is_meant_for(host, ip)));
    let mut response = if meant {
        next.run(request).await
    } else {
        // A foreign site that makes its name point here would read the page otherwise (DNS rebinding).
        (StatusCode::MISDIRECTED_REQUEST, "this page answers to localhost and its own address only\n")
            .into_response()
    };
    let headers = response.headers_mut();
    let set = [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    for (name, value) in set {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.insert("cross-origin-resource-policy", HeaderValue::from_static("same-origin"));
    response
}

/// Whether a `Host` header names loopback by itself, at whatever port (a forwarded one has another).
fn is_meant_for(host: &str, ip: IpAddr) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    };
    name.eq_ignore_ascii_case("localhost") || name.parse() == Ok(ip)
}

fn file(kind: &'static str, content: &'static str) -> Response {
    ([(header::CONTENT_TYPE, kind)], content).into_response()
}

fn gone() -> Response {
    (StatusCode::SERVICE_UNAVAILABLE, "the coordinator is ending\n").into_response()
}

async fn page(State(site): State<Site>) -> Response {
    let Some(view) = site.live.view().await else { return gone() };
    let mut html =
        PAGE.replace("<!--section-->", site.live.section()).replace("<!--build-->", &identity::build());
    for part in &view.parts {
        html = html.replace(&format!("<!--{}-->", part.name), &part.html);
    }
    Html(html).into_response()
}

async fn status(State(site): State<Site>) -> Response {
    let Some(view) = site.live.view().await else { return gone() };
    let json = serde_json::to_string_pretty(&view.snapshot.status).expect("a status is JSON") + "\n";
    ([(header::CONTENT_TYPE, "application/json")], json).into_response()
}

async fn metrics_text(State(site): State<Site>) -> Response {
    let Some(view) = site.live.view().await else { return gone() };
    ([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], metrics::text(&view.snapshot)).into_response()
}

/// The parts that change, as server-sent events: what a browser has not got yet, at most once a second. A browser that
/// is slow gets the state of then, not all states before it.
async fn events(State(site): State<Site>, request: Request<Body>) -> Response {
    let Ok(permit) = Arc::clone(&site.streams).try_acquire_owned() else {
        let headers = [(header::RETRY_AFTER, "5")];
        return (StatusCode::SERVICE_UNAVAILABLE, headers, "too many browsers look at this page\n")
            .into_response();
    };
    drop(request);
    let (sender, receiver) = mpsc::channel::<Result<Event, Infallible>>(1);
    tokio::spawn(async move {
        let _permit = permit;
        send_events(&site, &sender).await;
    });
    Sse::new(ReceiverStream::new(receiver)).into_response()
}

/// Sends until the campaign has ended or the browser has gone.
async fn send_events(site: &Site, sender: &mpsc::Sender<Result<Event, Infallible>>) {
    let mut ended = site.ended.clone();
    let hello = Event::default().event("hello").retry(RETRY).data(identity::build());
    if sender.send(Ok(hello)).await.is_err() {
        return;
    }
    let mut sent: Option<Arc<View>> = None;
    let mut silent = Duration::ZERO;
    loop {
        let last = *ended.borrow_and_update();
        let Some(view) = site.live.view().await else { return };
        let event = match news(&view, sent.as_deref()) {
            Some(event) => Some(event),
            None if silent >= SILENCE => Some(Event::default().comment("nothing new")),
            None => None,
        };
        silent += EVENT_PERIOD;
        if let Some(event) = event {
            silent = Duration::ZERO;
            if sender.send(Ok(event)).await.is_err() {
                return;
            }
        }
        sent = Some(view);
        if last {
            let state = sent.map(|view| view.snapshot.status.state.name()).unwrap_or_default();
            // The browser may have gone.
            let _ = sender.send(Ok(Event::default().event("end").data(state))).await;
            return;
        }
        tokio::select! {
            () = sleep(EVENT_PERIOD) => {}
            _ = ended.changed() => {}
            () = sender.closed() => return,
        }
    }
}

/// The parts of `view` that differ from those `sent` before; nothing if none does.
fn news(view: &View, sent: Option<&View>) -> Option<Event> {
    let known = |name: &str, html: &str| {
        sent.is_some_and(|sent| sent.parts.iter().any(|part| part.name == name && part.html == html))
    };
    let changed: BTreeMap<&str, &str> = view
        .parts
        .iter()
        .filter(|part| !known(part.name, &part.html))
        .map(|part| (part.name, part.html.as_str()))
        .collect();
    if changed.is_empty() {
        return None;
    }
    let json = serde_json::to_string(&changed).expect("names and texts are JSON");
    Some(Event::default().event("parts").data(json))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_that_name_loopback_are_taken_and_no_others() {
        let v4: IpAddr = "127.0.0.1".parse().expect("an address");
        let v6: IpAddr = "::1".parse().expect("an address");
        for host in ["localhost", "LOCALHOST:7422", "127.0.0.1", "127.0.0.1:80"] {
            assert!(is_meant_for(host, v4), "{host}");
        }
        assert!(is_meant_for("[::1]:80", v6) && is_meant_for("localhost:80", v6));
        for host in [
            "evil.example",
            "evil.example:80",
            "localhost.evil.example",
            "127.0.0.1.evil.example",
            "",
            "10.0.0.1",
        ] {
            assert!(!is_meant_for(host, v4), "{host}");
        }
    }
}
