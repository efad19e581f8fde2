//! Two messages of docs/errors.md that need processes which go on: another campaign in a run directory, and a worker
//! whose coordinator does not answer. The others are in coordinator/tests/mistakes.rs and disk.rs.

use runout_tests::{COARSE, Cluster, programs};
use std::fs;
use std::net::TcpListener;
use std::path::Path;

/// The page says this.
fn on_the_page(message: &str) -> &str {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/errors.md");
    let page = fs::read_to_string(page).expect("docs/errors.md");
    assert!(page.contains(message), "docs/errors.md does not say: {message}");
    message
}

#[test]
fn a_run_directory_takes_no_other_campaign() {
    let cluster = Cluster::new(COARSE);
    let (mut coordinator, _) = cluster.serve("out", &[]);
    coordinator.terminate();
    coordinator.wait();
    let before = fs::read(cluster.path("out/campaign.toml")).expect("the campaign as given");

    let other = COARSE.replace("height_m = 15.0", "height_m = 16.0");
    assert_ne!(other, COARSE);
    fs::write(cluster.path("campaign.toml"), other).expect("a file");
    let mut refused = cluster.runout(&["serve", "campaign.toml", "--out", "out", "--listen", "127.0.0.1:0"]);
    assert_eq!(refused.exit_code(), 2, "{}", refused.errors());
    let said = refused.errors();
    assert!(said.contains(on_the_page("this run directory holds another campaign")), "{said}");
    // What differs is listed, as the page says.
    assert!(said.contains("height_m"), "{said}");
    assert_eq!(fs::read(cluster.path("out/campaign.toml")).expect("a file"), before, "nothing was written");
}

#[test]
fn a_worker_that_hears_nothing_asks_for_the_address() {
    // A port that was free a moment ago: nobody listens there.
    let port = TcpListener::bind("127.0.0.1:0").and_then(|port| port.local_addr()).expect("a port").port();
    let cluster = Cluster::new(COARSE);
    let url = format!("http://127.0.0.1:{port}");
    let worker = cluster.worker(&programs().join("runout-worker"), &url, &["--give-up-after", "600"], &[]);
    worker.wait_until_said(on_the_page("is it running at that address?"));
}
