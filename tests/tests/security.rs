//! Who is let in, and what they may do there: coordinators, workers and operators as real processes, with
//! certificates that are right, of another authority or role, run out, or not there; and clients that go round the
//! checks on their own side, so that those on the other side are seen too.

use runout::tls::{Authority, Pair, Validity};
use runout_proto::tls::{Credentials, Role, refusal};
use runout_proto::v1;
use runout_proto::v1::coordinator_client::CoordinatorClient;
use runout_tests::{COARSE, Cluster, Process, recorded, results, wait_for};
use rustls::crypto::ring;
use rustls::{ClientConfig, RootCertStore};
use std::fs;
use std::io::Read;
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_rustls::TlsConnector;
use tonic::transport::{Certificate, Channel, ClientTlsConfig, Endpoint, Identity};
use tonic::{Code, Status};

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");

/// Stops at the maximum: 60 realisations, whatever the estimates.
fn campaign() -> String {
    COARSE.replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
}

/// A TLS directory as the command makes it.
fn init(cluster: &Cluster, name: &str) {
    let mut made = cluster.runout(&["tls", "init", name]);
    assert_eq!(made.exit_code(), 0, "{}", made.errors());
}

/// A directory with an authority's certificate and, as the files of `role`, this pair.
fn directory(cluster: &Cluster, name: &str, authority: &Authority, role: Role, pair: &Pair) {
    let folder = cluster.path(name);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("ca.pem"), authority.certificate_pem()).unwrap();
    fs::write(folder.join(role.certificate_file()), &pair.certificate_pem).unwrap();
    fs::write(folder.join(role.key_file()), &pair.key_pem).unwrap();
}

/// An authority, its own server's directory `tls`, and a coordinator there.
fn guarded(cluster: &Cluster) -> (Authority, Process, String) {
    let month = Validity::days(30);
    let authority = Authority::new(month).unwrap();
    let server = authority.issue(Some(Role::Server), &["127.0.0.1".into()], month).unwrap();
    directory(cluster, "tls", &authority, Role::Server, &server);
    let (coordinator, url) = cluster.serve("out", &["--tls", "tls"]);
    assert!(url.starts_with("https://127.0.0.1:"), "{url}");
    (authority, coordinator, url)
}

/// A client without any check of its own.
fn client(url: &str, authority: &Authority, own: Option<&Pair>) -> CoordinatorClient<Channel> {
    let mut tls = ClientTlsConfig::new().ca_certificate(Certificate::from_pem(authority.certificate_pem()));
    if let Some(own) = own {
        tls = tls.identity(Identity::from_pem(&own.certificate_pem, &own.key_pem));
    }
    let endpoint = Endpoint::from_shared(url.to_owned()).unwrap().tls_config(tls).unwrap();
    CoordinatorClient::new(endpoint.timeout(Duration::from_secs(20)).connect_lazy())
}

fn block_on<T>(future: impl Future<Output = T>) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(future)
}

fn ask_status(url: &str, authority: &Authority, own: Option<&Pair>) -> Result<(), Status> {
    block_on(async { client(url, authority, own).status(v1::StatusRequest {}).await.map(|_| ()) })
}

/// A worker with these arguments ends at once, with code 2 and this message.
fn sent_away(cluster: &Cluster, url: &str, arguments: &[&str], message: &str) {
    let mut worker = cluster.worker(Path::new(SYNTHETIC), url, arguments, &[]);
    assert_eq!(worker.exit_code(), 2, "{}", worker.errors());
    assert!(worker.errors().contains(message), "{message} is not in: {}", worker.errors());
}

#[test]
fn a_campaign_over_mutual_tls_gives_the_same_bytes_as_a_plain_one() {
    let cluster = Cluster::new(&campaign());
    init(&cluster, "tls");
    let run = |out: &str, more: &[&str]| {
        let usual = ["run", "campaign.toml", "--out", out, "--workers", "2", "--worker-program", SYNTHETIC];
        let mut run = cluster.runout(&[&usual, more].concat());
        assert_eq!(run.exit_code(), 3, "{}", run.errors());
        results(&cluster.path(out))
    };
    let plain = run("plain", &[]);
    assert_eq!(plain.lines().count(), 60);
    assert_eq!(run("protected", &["--tls", "tls"]), plain);

    // Coordinator and workers apart, by the variable instead of the flag.
    let variable = [("RUNOUT_TLS", "tls")];
    let serve =
        ["serve", "campaign.toml", "--out", "apart", "--listen", "127.0.0.1:0", "--heartbeat", "0.25"];
    let mut coordinator = cluster.runout_with(&serve, &variable);
    let url = wait_for("the address", || fs::read_to_string(cluster.path("apart/coordinator.addr")).ok());
    assert!(url.starts_with("https://"), "{url}");
    let mut workers = [(); 2].map(|()| cluster.worker(Path::new(SYNTHETIC), url.trim(), &[], &variable));
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    for worker in &mut workers {
        assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
    }
    assert_eq!(results(&cluster.path("apart")), plain);
}

#[test]
fn certificates_of_another_authority_are_refused_on_both_sides() {
    let cluster = Cluster::new(&campaign());
    let (authority, coordinator, url) = guarded(&cluster);
    init(&cluster, "other");
    sent_away(
        &cluster,
        &url,
        &["--tls", "other"],
        "signed by another authority than that of ca.pem in the TLS",
    );
    coordinator.wait_until_said("refused: it does not accept this coordinator's certificate");

    // Trusts the coordinator, and shows it a certificate of somebody else.
    let other = Authority::new(Validity::days(30)).unwrap();
    let foreign = other.issue(Some(Role::Worker), &[], Validity::days(30)).unwrap();
    let refused = ask_status(&url, &authority, Some(&foreign)).unwrap_err();
    let why = refusal::seen_by_client(&refused).unwrap_or_else(|| panic!("{refused:?}"));
    assert!(why.contains("signed by another authority than its own"), "{why}");
    coordinator.wait_until_said("refused: its certificate was signed by another authority");
    directory(&cluster, "mixed", &authority, Role::Worker, &foreign);
    sent_away(&cluster, &url, &["--tls", "mixed"], "not signed by the authority of ca.pem beside it");
}

#[test]
fn certificates_of_another_role_are_refused_on_both_sides() {
    let cluster = Cluster::new(&campaign());
    let (authority, coordinator, url) = guarded(&cluster);
    let issue = |role| authority.issue(role, &[], Validity::days(30)).unwrap();
    let (operator, nobody) = (issue(Some(Role::Operator)), issue(None));
    directory(&cluster, "mixed", &authority, Role::Worker, &operator);
    sent_away(&cluster, &url, &["--tls", "mixed"], "no certificate of the role \"worker\" (operator)");

    let lease = v1::LeaseRequest { worker_id: 1, poll_s: 0.0 };
    let refused =
        block_on(async { client(&url, &authority, Some(&operator)).lease(lease).await }).unwrap_err();
    assert_eq!(refused.code(), Code::PermissionDenied);
    assert!(refused.message().contains("role worker, and the caller's role is operator"), "{refused}");
    coordinator.wait_until_said("refused: this call needs a certificate of the role worker");
    assert!(ask_status(&url, &authority, Some(&operator)).is_ok());

    let refused = ask_status(&url, &authority, Some(&nobody)).unwrap_err();
    assert_eq!(refused.code(), Code::PermissionDenied);
    assert!(refused.message().contains("the caller's role is none"), "{refused}");

    // A coordinator's certificate makes nobody a client.
    let server = issue(Some(Role::Server));
    assert!(ask_status(&url, &authority, Some(&server)).is_err());
    coordinator.wait_until_said("refused: its certificate is none of a client's");
}

#[test]
fn certificates_that_have_run_out_are_refused_on_both_sides() {
    let cluster = Cluster::new(&campaign());
    let (authority, coordinator, url) = guarded(&cluster);
    let expired = authority.issue(Some(Role::Worker), &[], Validity::past()).unwrap();
    directory(&cluster, "expired", &authority, Role::Worker, &expired);
    sent_away(&cluster, &url, &["--tls", "expired"], "worker.pem: the certificate ran out on ");
    let refused = ask_status(&url, &authority, Some(&expired)).unwrap_err();
    let why = refusal::seen_by_client(&refused).unwrap_or_else(|| panic!("{refused:?}"));
    assert!(why.contains("by its clock this side's certificate has run out"), "{why}");
    coordinator.wait_until_said("refused: its certificate ran out on ");

    let server = authority.issue(Some(Role::Server), &["127.0.0.1".into()], Validity::past()).unwrap();
    directory(&cluster, "expired", &authority, Role::Server, &server);
    let mut second = cluster.runout(&[
        "serve",
        "campaign.toml",
        "--out",
        "two",
        "--listen",
        "127.0.0.1:0",
        "--tls",
        "expired",
    ]);
    assert_eq!(second.exit_code(), 2, "{}", second.errors());
    assert!(second.errors().contains("server.pem: the certificate ran out on "), "{}", second.errors());
}

#[test]
fn who_shows_no_certificate_or_speaks_no_tls_is_told_what_to_do() {
    let cluster = Cluster::new(&campaign());
    let (authority, coordinator, url) = guarded(&cluster);
    sent_away(&cluster, &url, &[], "https:// needs certificates: give their directory");
    let refused = ask_status(&url, &authority, None).unwrap_err();
    let why = refusal::seen_by_client(&refused).unwrap_or_else(|| panic!("{refused:?}"));
    assert!(why.contains("it asks for a certificate and was shown none"), "{why}");
    coordinator.wait_until_said("refused: it shows no certificate");

    let plain_url = url.replace("https://", "http://");
    sent_away(&cluster, &plain_url, &[], "this coordinator speaks TLS only: use a URL with https://");
    coordinator.wait_until_said("refused: it does not speak TLS");
    let mut status = cluster.runout(&["status", &plain_url]);
    assert_eq!(status.exit_code(), 2, "{}", status.errors());
    assert!(status.errors().contains("speaks TLS only"), "{}", status.errors());

    init(&cluster, "any");
    sent_away(&cluster, &plain_url, &["--tls", "any"], "would go without: begin it with https://");
    let (_open, open_url) = cluster.serve("open", &[]);
    let wrong = open_url.replace("http://", "https://");
    sent_away(&cluster, &wrong, &["--tls", "any"], "the coordinator does not speak TLS");
    sent_away(&cluster, &open_url, &["--tls", "nowhere"], "nowhere/ca.pem");
}

#[test]
fn beyond_loopback_it_takes_tls_and_a_name_that_others_can_use() {
    let cluster = Cluster::new(&campaign());
    let mut bare = cluster.runout(&["serve", "campaign.toml", "--out", "bare", "--listen", "0.0.0.0:0"]);
    assert_eq!(bare.exit_code(), 2, "{}", bare.errors());
    assert!(bare.errors().contains("make certificates with `runout tls init`"), "{}", bare.errors());
    assert!(!cluster.path("bare/coordinator.addr").exists());

    init(&cluster, "tls");
    let (_coordinator, url) = cluster.serve_on("0.0.0.0:0", "out", &["--tls", "tls"]);
    let port = url.rsplit(':').next().unwrap();
    let host = url.trim_start_matches("https://").trim_end_matches(port).trim_end_matches(':');
    assert!(!host.is_empty() && host != "0.0.0.0", "{url}");
    // A host that the certificate is not for.
    let elsewhere = format!("https://127.0.0.2:{port}");
    sent_away(&cluster, &elsewhere, &["--tls", "tls"], "is not for the host \"127.0.0.2\"");

    let (_named, url) =
        cluster.serve_on("0.0.0.0:0", "named", &["--tls", "tls", "--advertise", "localhost:4711"]);
    assert_eq!(url, "https://localhost:4711");
    let unknown = ["serve", "campaign.toml", "--out", "unknown", "--tls", "tls", "--listen", "0.0.0.0:0"];
    let mut unknown = cluster.runout(&[&unknown[..], &["--advertise", "node7"]].concat());
    assert_eq!(unknown.exit_code(), 2, "{}", unknown.errors());
    assert!(unknown.errors().contains("server.pem is not for this host"), "{}", unknown.errors());
}

#[test]
fn an_operator_cancels_and_a_worker_may_not() {
    let cluster = Cluster::new(&campaign());
    init(&cluster, "tls");
    let worker_only = cluster.path("worker-only");
    fs::create_dir(&worker_only).unwrap();
    for name in ["ca.pem", "worker.pem", "worker.key"] {
        fs::copy(cluster.path("tls").join(name), worker_only.join(name)).unwrap();
    }
    let (mut coordinator, url) = cluster.serve("out", &["--tls", "tls"]);
    let tls = ["--tls", "worker-only"];
    let mut worker = cluster.worker(Path::new(SYNTHETIC), &url, &tls, &[("SYNTHETIC_MS", "100")]);
    wait_for("outcomes", || (recorded(&cluster.path("out")) >= 3).then_some(()));

    let mut refused = cluster.runout(&["cancel", "out", "--tls", "worker-only"]);
    assert_eq!(refused.exit_code(), 2, "{}", refused.errors());
    assert!(refused.errors().contains("needs a certificate of the role operator"), "{}", refused.errors());
    let mut without = cluster.runout(&["cancel", "out"]);
    assert_eq!(without.exit_code(), 2, "{}", without.errors());
    assert!(without.errors().contains("https:// needs certificates"), "{}", without.errors());
    let mut status = cluster.runout(&["status", "out", "--tls", "worker-only"]);
    assert_eq!(status.exit_code(), 0, "{}", status.errors());
    assert!(status.output().contains("running"), "{}", status.output());
    let mut status = cluster.runout(&["status", "out"]);
    assert_eq!(status.exit_code(), 2, "{}", status.output());
    assert!(coordinator.running(), "{}", coordinator.errors());

    let mut cancel = cluster.runout(&["cancel", "out", "--tls", "tls"]);
    assert_eq!(cancel.exit_code(), 0, "{}", cancel.errors());
    assert!(cancel.output().contains("no new realisations"), "{}", cancel.output());
    assert_eq!(coordinator.exit_code(), 130, "{}", coordinator.errors());
    assert!(coordinator.errors().contains("cancelled by an operator"), "{}", coordinator.errors());
    let before = recorded(&cluster.path("out"));
    assert!(before < 60, "the campaign was over before it could be cancelled");
    worker.terminate();
    worker.wait();

    let mut nobody = cluster.runout(&["cancel", "out", "--tls", "tls"]);
    assert_eq!(nobody.exit_code(), 1, "{}", nobody.output());
    assert!(nobody.errors().contains("nothing to cancel"), "{}", nobody.errors());

    // What was cancelled goes on where it stood, and ends as if nothing had been.
    let run = |out: &str| {
        let mut run = cluster.runout(&[
            "run",
            "campaign.toml",
            "--out",
            out,
            "--workers",
            "2",
            "--worker-program",
            SYNTHETIC,
        ]);
        assert_eq!(run.exit_code(), 3, "{}", run.errors());
        results(&cluster.path(out))
    };
    assert_eq!(run("out"), run("undisturbed"));
}

#[test]
fn a_stale_address_cancels_no_other_campaign() {
    let cluster = Cluster::new(&campaign());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let mut client = block_on_client(&url);
    let other = v1::CancelRequest { spec_digest: Some("0".repeat(64)) };
    let refused = client.call(|mut grpc| async move { grpc.cancel(other).await }).unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition);
    assert!(coordinator.running());
    // On loopback without TLS everybody may.
    let mut cancel = cluster.runout(&["cancel", &url]);
    assert_eq!(cancel.exit_code(), 0, "{}", cancel.errors());
    assert_eq!(coordinator.exit_code(), 130, "{}", coordinator.errors());
}

#[test]
fn messages_that_are_too_large_or_break_the_contract_are_refused() {
    let cluster = Cluster::new(&campaign());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let mut client = block_on_client(&url);
    let large = v1::ReleaseRequest { error: Some("x".repeat(2 << 20)), ..v1::ReleaseRequest::default() };
    let refused = client.call(|mut grpc| async move { grpc.release(large).await }).unwrap_err();
    assert_eq!(refused.code(), Code::OutOfRange, "{refused}");
    let unsound = v1::HeartbeatRequest { worker_id: 1, running: vec![v1::LeaseProgress::default()] };
    let refused = client.call(|mut grpc| async move { grpc.heartbeat(unsound).await }).unwrap_err();
    assert_eq!(refused.code(), Code::InvalidArgument, "{refused}");
    assert_eq!(refused.message(), "running.lease is missing");
    assert!(coordinator.running(), "{}", coordinator.errors());
}

#[test]
fn connections_beyond_the_bound_are_refused_and_the_others_served() {
    let cluster = Cluster::new(&campaign());
    // 64 files are kept for everything else: room for 16 connections.
    let line =
        "ulimit -n 80; exec runout serve campaign.toml --out out --listen 127.0.0.1:0 --heartbeat 0.25";
    let mut coordinator = cluster.shell(line);
    let url = wait_for("the address", || fs::read_to_string(cluster.path("out/coordinator.addr")).ok());
    let address = url.trim().trim_start_matches("http://").to_owned();
    let mut open: Vec<TcpStream> = (0..17).map(|_| TcpStream::connect(&address).unwrap()).collect();
    coordinator.wait_until_said("refused: 16 are open already");
    // The one that was refused is closed; with it and one more gone there is room for a worker.
    let mut refused = open.pop().unwrap();
    refused.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    assert!(refused.read(&mut [0; 64]).is_ok_and(|n| n == 0), "the connection is still open");
    drop(open);
    let mut worker = cluster.worker(Path::new(SYNTHETIC), url.trim(), &[], &[]);
    assert_eq!(coordinator.exit_code(), 3, "{}", coordinator.errors());
    assert_eq!(worker.exit_code(), 0, "{}", worker.errors());
}

#[test]
fn who_does_not_say_who_it_is_is_dropped() {
    let cluster = Cluster::new(&campaign());
    let (_authority, coordinator, url) = guarded(&cluster);
    let mut silent = TcpStream::connect(url.trim_start_matches("https://")).unwrap();
    silent.set_read_timeout(Some(Duration::from_secs(40))).unwrap();
    assert!(silent.read(&mut [0; 64]).is_ok_and(|n| n == 0), "the connection is still open");
    coordinator.wait_until_said("it has not shown who it is within 10s");
}

/// A plain client with its runtime.
struct Plain {
    runtime: tokio::runtime::Runtime,
    grpc: CoordinatorClient<Channel>,
}

fn block_on_client(url: &str) -> Plain {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let endpoint = Endpoint::from_shared(url.to_owned()).unwrap();
    let grpc = CoordinatorClient::new(runtime.block_on(async { endpoint.connect_lazy() }));
    Plain { runtime, grpc }
}

impl Plain {
    fn call<T, F: Future<Output = T>>(&mut self, call: impl FnOnce(CoordinatorClient<Channel>) -> F) -> T {
        self.runtime.block_on(call(self.grpc.clone()))
    }
}

fn port(url: &str) -> &str {
    url.trim().trim_end_matches('/').rsplit(':').next().unwrap()
}

/// What the page at `url` answers to a browser that trusts the authority in `tls` and shows this role's certificate, if any.
fn browse(url: &str, tls: &Path, role: Option<Role>) -> std::io::Result<String> {
    let shown = |role| Credentials::load(tls, role).unwrap();
    let mut authorities = RootCertStore::empty();
    authorities.add(shown(Role::Operator).authority).unwrap();
    let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_protocol_versions(&[&rustls::version::TLS13])
        .unwrap()
        .with_root_certificates(authorities);
    let config = match role.map(shown) {
        Some(own) => config.with_client_auth_cert(own.chain, own.key).unwrap(),
        None => config.with_no_client_auth(),
    };
    block_on(async {
        let stream = tokio::net::TcpStream::connect(format!("127.0.0.1:{}", port(url))).await?;
        let host = "127.0.0.1".try_into().unwrap();
        let mut stream = TlsConnector::from(Arc::new(config)).connect(host, stream).await?;
        stream.write_all(b"GET / HTTP/1.1\r\nhost: page\r\nconnection: close\r\n\r\n").await?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await?;
        Ok(answer)
    })
}

#[test]
fn beyond_loopback_the_page_is_for_who_may_look() {
    let cluster = Cluster::new(&campaign());
    init(&cluster, "tls");
    let mut refused = cluster.runout(&["serve", "campaign.toml", "--out", "out", "--page", "0.0.0.0:0"]);
    assert_eq!(refused.exit_code(), 2);
    assert!(refused.errors().contains("--page 0.0.0.0:0: it can be reached from other machines"));

    let (coordinator, _) = cluster.serve("out", &["--tls", "tls", "--page", "0.0.0.0:0"]);
    let url = wait_for("the page", || fs::read_to_string(cluster.path("out/page.addr")).ok());
    assert!(url.starts_with("https://"), "{url}");
    let tls = cluster.path("tls");
    for role in [Role::Operator, Role::Worker] {
        let seen = browse(&url, &tls, Some(role)).unwrap();
        assert!(seen.starts_with("HTTP/1.1 200 ") && seen.contains("<h1 id=\"name\">coarse</h1>"), "{seen}");
    }
    let error = browse(&url, &tls, None).unwrap_err();
    assert!(error.to_string().contains("CertificateRequired"), "{error}");
    coordinator.wait_until_said("to the page refused: it shows no certificate");
    init(&cluster, "other");
    let error = browse(&url, &cluster.path("other"), Some(Role::Operator)).unwrap_err();
    assert!(error.to_string().contains("invalid peer certificate"), "{error}");

    let plain = runout_tests::http::get(&format!("http://127.0.0.1:{}", port(&url)), "/");
    assert_eq!(plain.status, 400);
    assert!(plain.body.contains("this page speaks TLS only"), "{}", plain.body);
    drop(coordinator);
}
