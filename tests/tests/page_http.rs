//! The live page, asked as a client asks, without a browser: content, events, limits, metrics, what is refused.
//!
//! The realisations are synthetic: see `faults.rs`.

use runout_tests::http::{Events, get, request};
use runout_tests::{COARSE, Cluster, Process, wait_for};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");

/// Stops at the maximum: 60 realisations, whatever the estimates.
fn to_the_maximum() -> String {
    COARSE.replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
}

/// The page's address in a run directory.
fn page(cluster: &Cluster, process: &mut Process) -> String {
    let file = cluster.path("out").join("page.addr");
    wait_for("the page's address", || {
        assert!(process.running(), "the coordinator ended: {}", process.errors());
        std::fs::read_to_string(&file).ok()
    })
}

#[test]
fn the_page_is_complete_and_tells_the_same_as_status() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let page = page(&cluster, &mut coordinator);
    assert!(
        coordinator.errors().contains(&format!("live page: {}", page.trim())),
        "{}",
        coordinator.errors()
    );
    let slow = [("SYNTHETIC_MS", "300")];
    let _worker = cluster.worker(Path::new(SYNTHETIC), &url, &["--name", "w<1>"], &slow);
    wait_for("slides", || (get(&page, "/api/status").json()["samples"].as_u64() > Some(4)).then_some(()));

    let answer = get(&page, "/");
    assert_eq!(answer.status, 200);
    assert!(answer.header("content-type").starts_with("text/html"));
    let html = &answer.body;
    for wanted in [
        "<html lang=\"en\"",
        "<main id=\"main\">",
        "<h1 id=\"name\">coarse</h1>",
        "Longest slides",
        "<th scope=\"row\">w&lt;1&gt;",
        "<svg viewBox=",
        "aria-label=\"Share of the slides",
        "role=\"status\" aria-live=\"polite\"",
        "worker w&lt;1&gt; registered with 1 slots",
        "runout replay out ",
    ] {
        assert!(html.contains(wanted), "{wanted} is missing: {html}");
    }
    assert!(!html.contains("<!--"), "every part is filled in: {html}");
    // Nothing that the policy would forbid, and nothing from elsewhere.
    assert!(!html.contains(" style=") && !html.contains("onclick") && !html.contains("https://"), "{html}");
    for (name, wanted) in [
        ("content-security-policy", "default-src 'none'; script-src 'self'"),
        ("x-content-type-options", "nosniff"),
        ("x-frame-options", "DENY"),
        ("referrer-policy", "no-referrer"),
        ("cache-control", "no-store"),
    ] {
        assert!(answer.header(name).starts_with(wanted), "{name}: {:?}", answer.headers);
    }
    assert!(get(&page, "/page.js").header("content-type").starts_with("text/javascript"));
    assert!(get(&page, "/page.css").body.contains("prefers-color-scheme"));

    let told = get(&page, "/api/status").json();
    let mut status = cluster.runout(&["status", "out", "--json"]);
    assert_eq!(status.exit_code(), 0, "{}", status.errors());
    let status: serde_json::Value = serde_json::from_str(&status.output()).expect("JSON");
    let names = |document: &serde_json::Value| {
        document.as_object().expect("an object").keys().cloned().collect::<Vec<_>>()
    };
    assert_eq!(names(&told), names(&status));
    assert_eq!((&told["digest"], &told["rule"]), (&status["digest"], &status["rule"]));
}

#[test]
fn only_its_own_name_and_only_reading() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, _) = cluster.serve("out", &[]);
    let page = page(&cluster, &mut coordinator);
    let ask = |method: &str, path: &str, host: &str| {
        request(&page, method, path, &[("host", host)], "").expect("an answer").status
    };
    assert_eq!(ask("GET", "/", "localhost:1"), 200);
    for host in ["evil.example", "127.0.0.1.evil.example", ""] {
        for path in ["/", "/api/status", "/metrics", "/events"] {
            assert_eq!(ask("GET", path, host), 421, "{host} {path}");
        }
    }
    assert_eq!(ask("POST", "/", "localhost"), 405);
    assert_eq!(ask("DELETE", "/api/status", "localhost"), 405);
    assert_eq!(ask("GET", "/../../etc/passwd", "localhost"), 404);
    assert_eq!(ask("GET", "/campaign.toml", "localhost"), 404);
}

#[test]
fn events_bring_what_is_new_until_the_end() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let page = page(&cluster, &mut coordinator);
    let mut events = Events::open(&page, "/events").expect("an answer");
    assert_eq!(events.take().map(|(name, _)| name).as_deref(), Some("hello"));
    let parts = |data: &str| -> BTreeMap<String, String> { serde_json::from_str(data).expect("parts") };
    let (name, data) = events.take().expect("the first state");
    assert_eq!(name, "parts");
    assert!(parts(&data)["progress"].contains(">0 of at most 60 realisations<"), "{data}");

    let mut worker = cluster.worker(Path::new(SYNTHETIC), &url, &[], &[("SYNTHETIC_MS", "80")]);
    let (mut progress, mut last) = (Vec::new(), BTreeMap::new());
    loop {
        match events.take() {
            Some((name, data)) if name == "parts" => {
                let news = parts(&data);
                progress.extend(news.get("progress").cloned());
                last.extend(news);
            }
            Some((name, data)) => {
                assert_eq!((name.as_str(), data.as_str()), ("end", "maximum"));
                break;
            }
            None => panic!("the stream ended without saying so"),
        }
    }
    assert!(progress.len() > 3, "{progress:?}");
    // Only what has changed is sent again: no two in a row are the same.
    assert!(progress.windows(2).all(|pair| pair[0] != pair[1]), "{progress:?}");
    assert!(last["progress"].contains("60 realisations"), "{}", last["progress"]);
    assert!(last["state"].contains("not converged") && last["title"].contains("maximum"), "{last:?}");
    assert_eq!(events.take(), None);
    assert_eq!((coordinator.exit_code(), worker.exit_code()), (3, 0));
}

#[test]
fn browsers_are_bounded_and_those_that_leave_make_room() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, _) = cluster.serve("out", &[]);
    let page = page(&cluster, &mut coordinator);
    let open = || Events::open(&page, "/events").expect("an answer");
    let mut streams: Vec<Events> = (0..32).map(|_| open()).collect();
    assert!(streams.iter().all(|s| s.status == 200));
    assert_eq!(open().status, 503);
    // The page itself is still there.
    assert_eq!(get(&page, "/").status, 200);
    streams.clear();
    wait_for("room", || (open().status == 200).then_some(()));
    // Idle connections without a request do not add up either.
    let host = page.trim().trim_start_matches("http://").trim_end_matches('/').to_owned();
    let _idle: Vec<_> = (0..80).filter_map(|_| std::net::TcpStream::connect(&host).ok()).collect();
    coordinator.terminate();
    assert_eq!(coordinator.exit_code(), 130, "{}", coordinator.errors());
}

#[test]
fn a_coordinator_that_is_killed_comes_back_at_the_same_address() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut first, _) = cluster.serve("out", &[]);
    let before = page(&cluster, &mut first);
    first.kill();
    let (mut second, _) = cluster.serve("out", &[]);
    assert_eq!(page(&cluster, &mut second), before);
    assert_eq!(get(&before, "/").status, 200);
    // A second campaign takes another port.
    let other = Cluster::new(&to_the_maximum());
    let (mut third, _) = other.serve("out", &[]);
    assert_ne!(page(&other, &mut third), before);
    // One that asks for the port that is taken is told what to do.
    let host = before.trim().trim_start_matches("http://").trim_end_matches('/');
    let more = ["serve", "campaign.toml", "--out", "more", "--listen", "127.0.0.1:0", "--page", host];
    let mut taken = other.runout(&more);
    assert_eq!(taken.exit_code(), 2);
    let said = taken.errors();
    assert!(said.contains(&format!("--page {host}")) && said.contains("take another port"), "{said}");
    assert!(!other.path("more").exists(), "nothing is half made");
}

#[test]
fn without_a_page_and_beyond_loopback() {
    let cluster = Cluster::new(&to_the_maximum());
    let (_coordinator, _) = cluster.serve("out", &["--no-page"]);
    assert!(!cluster.path("out/page.addr").exists());
    let open = ["serve", "campaign.toml", "--out", "open", "--listen", "127.0.0.1:0", "--page", "0.0.0.0:0"];
    let mut refused = cluster.runout(&open);
    assert_eq!(refused.exit_code(), 2);
    assert!(refused.errors().contains("it can be reached from other machines"), "{}", refused.errors());
    let mut run = cluster.runout(&["run", "campaign.toml", "--out", "run", "--page", "0.0.0.0:0"]);
    assert_eq!(run.exit_code(), 2);
    assert!(!cluster.path("open").exists() && !cluster.path("run").exists());
}

/// A sample of Prometheus' text format.
#[derive(Debug)]
struct Sample {
    name: String,
    labels: BTreeMap<String, String>,
    value: f64,
}

/// Parses the text format strictly: every sample belongs to a metric that was announced, once and with a help text.
fn parse(text: &str) -> (Vec<Sample>, BTreeMap<String, String>) {
    let (mut samples, mut kinds, mut helps) = (Vec::new(), BTreeMap::new(), BTreeSet::new());
    assert!(text.ends_with('\n'));
    for line in text.lines() {
        if let Some(rest) = line.strip_prefix("# HELP ") {
            let (name, help) = rest.split_once(' ').expect("a help text");
            assert!(help.ends_with('.') && helps.insert(name.to_owned()), "{line}");
        } else if let Some(rest) = line.strip_prefix("# TYPE ") {
            let (name, kind) = rest.split_once(' ').expect("a type");
            assert!(helps.contains(name), "{line}");
            assert!(["counter", "gauge", "histogram"].contains(&kind), "{line}");
            assert_eq!(kind == "counter", name.ends_with("_total"), "{line}");
            assert!(kinds.insert(name.to_owned(), kind.to_owned()).is_none(), "{line}");
        } else {
            samples.push(sample(line));
        }
    }
    for sample in &samples {
        let end = ["_bucket", "_sum", "_count"].iter().find_map(|end| sample.name.strip_suffix(end));
        let of =
            end.filter(|name| kinds.get(*name).is_some_and(|k| k == "histogram")).unwrap_or(&sample.name);
        assert!(kinds.contains_key(of), "{sample:?} was not announced");
    }
    (samples, kinds)
}

fn sample(line: &str) -> Sample {
    let (series, value) = line.rsplit_once(' ').expect("a value");
    let (name, labels) = match series.split_once('{') {
        None => (series, ""),
        Some((name, rest)) => (name, rest.strip_suffix('}').expect("a closing brace")),
    };
    assert!(name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_'), "{line}");
    let pairs = labels.split("\",").filter(|pair| !pair.is_empty()).map(|pair| {
        let (key, value) = pair.split_once("=\"").expect("a label");
        (key.to_owned(), value.trim_end_matches('"').to_owned())
    });
    Sample { name: name.to_owned(), labels: pairs.collect(), value: value.parse().expect("a number") }
}

#[test]
fn metrics_are_prometheus_text_and_agree_with_the_results() {
    let cluster = Cluster::new(&to_the_maximum());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let page = page(&cluster, &mut coordinator);
    let answer = get(&page, "/metrics");
    assert_eq!(answer.header("content-type"), "text/plain; version=0.0.4; charset=utf-8");
    parse(&answer.body);
    // The last realisation hangs, so that the campaign stays where it can be looked at.
    let faults = [("SYNTHETIC_HANGS_AT", "59"), ("SYNTHETIC_MS", "1")];
    let _worker = cluster.worker(Path::new(SYNTHETIC), &url, &["--name", "one"], &faults);
    let text = wait_for("all but one", || {
        let done = get(&page, "/api/status").json()["realisations"] == 59;
        done.then(|| get(&page, "/metrics").body)
    });
    let (samples, _) = parse(&text);
    let value = |name: &str, label: Option<(&str, &str)>| {
        let found: Vec<f64> = samples
            .iter()
            .filter(|s| s.name == name && label.is_none_or(|(k, v)| s.labels.get(k).is_some_and(|l| l == v)))
            .map(|s| s.value)
            .collect();
        assert_eq!(found.len(), 1, "{name} {label:?}: {text}");
        found[0]
    };
    let status = get(&page, "/api/status").json();
    for (kind, key) in [("runout", "samples"), ("stable", "stable"), ("failed", "failed")] {
        let counted = value("runout_realisations_total", Some(("outcome", kind)));
        assert_eq!(Some(counted), status[key].as_f64(), "{kind}");
    }
    assert_eq!(Some(value("runout_runout_mean_metres", None)), status["mean_m"].as_f64());
    assert_eq!(value("runout_leases_out", None), 1.0);
    assert_eq!(value("runout_campaign_state", Some(("state", "running"))), 1.0);
    assert_eq!(value("runout_worker_realisations_total", Some(("worker", "one"))), 59.0);
    assert_eq!(value("runout_reports_total", Some(("answer", "recorded"))), 59.0);
    assert!(value("runout_report_latency_seconds_sum", None) > 0.0);
    let buckets: Vec<f64> = samples
        .iter()
        .filter(|s| s.name == "runout_report_latency_seconds_bucket")
        .map(|s| s.value)
        .collect();
    assert!(buckets.windows(2).all(|pair| pair[0] <= pair[1]), "{buckets:?}");
    let reports: f64 = samples.iter().filter(|s| s.name == "runout_reports_total").map(|s| s.value).sum();
    assert_eq!(buckets.last(), Some(&reports));
    assert_eq!(value("runout_report_latency_seconds_count", None), reports);
}
