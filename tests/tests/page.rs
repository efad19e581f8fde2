//! The live page in a real browser (Chromium without a window): what is seen, how it is renewed, how it survives a
//! coordinator that is killed, how it looks on a screen and on a phone, light and dark.
//!
//! Needs Debian's chromium and chromium-driver; without them it says so and tests nothing. With `RUNOUT_SCREENSHOTS` set
//! to a folder the pictures are kept there.

use runout_tests::browser::Browser;
use runout_tests::{COARSE, Cluster, Process, wait_for};
use std::path::{Path, PathBuf};

const SYNTHETIC: &str = env!("CARGO_BIN_EXE_synthetic-worker");

/// Long enough to be looked at.
fn long() -> String {
    let campaign = COARSE.replace("mean_half_width = 0.2", "mean_half_width = 1e-6");
    campaign.replace("maximum_realisations = 60", "maximum_realisations = 100000")
}

fn page(cluster: &Cluster) -> String {
    let file = cluster.path("out").join("page.addr");
    wait_for("the page's address", || std::fs::read_to_string(&file).ok()).trim().to_owned()
}

fn work(cluster: &Cluster, url: &str, name: &str) -> Process {
    let faults = [("SYNTHETIC_MS", "100"), ("SYNTHETIC_FAILS_AT", "3")];
    cluster.worker(Path::new(SYNTHETIC), url, &["--name", name], &faults)
}

/// The first number in what the page says of its progress.
fn done(browser: &Browser) -> u64 {
    browser.text("#progress label").split(' ').next().and_then(|n| n.parse().ok()).unwrap_or(0)
}

#[test]
fn it_is_renewed_without_being_loaded_again_and_survives_a_killed_coordinator() {
    let Some(browser) = Browser::start("content, renewal, reconnection") else { return };
    let cluster = Cluster::new(&long());
    let (mut coordinator, url) = cluster.serve("out", &[]);
    let address = page(&cluster);
    browser.open(&address);
    browser.wait_for_text("#connection", |text| text == "live");
    assert!(browser.text("#state").contains("waiting for workers"));
    assert!(browser.text("#workers").contains("No worker is connected"));
    // Gone if the page were loaded again.
    browser.run("window.mark = 7");

    let worker = work(&cluster, &url, "first");
    wait_for("progress", || (done(&browser) > 10).then_some(()));
    browser.wait_for_text("#state", |text| text == "running");
    browser.wait_for_text("#workers", |text| text.contains("first"));
    browser.wait_for_text("#failures", |text| text.contains("non-finite"));
    wait_for("a curve", || {
        browser.run("return !!document.querySelector('#exceedance svg')").as_bool().filter(|b| *b)
    });
    let title = browser.run("return document.title");
    assert!(title.as_str().is_some_and(|t| t.ends_with("% coarse")), "{title}");

    coordinator.kill();
    browser.wait_for_text("#connection", |text| text.starts_with("no connection since"));
    let before = done(&browser);
    let host = url.trim_start_matches("http://");
    let _again =
        cluster.runout(&["serve", "campaign.toml", "--out", "out", "--listen", host, "--heartbeat", "0.25"]);
    assert_eq!(page(&cluster), address);
    browser.wait_for_text("#connection", |text| text == "live");
    wait_for("more progress", || (done(&browser) > before + 10).then_some(()));
    assert_eq!(browser.run("return window.mark"), 7, "the page was loaded again");
    drop(worker);

    // Only what cannot be had while the coordinator is away is complained of.
    let complaints = browser.complaints();
    let away = |line: &String| line.contains("net::ERR_") && line.contains("/events");
    assert!(complaints.iter().all(away), "{complaints:?}");
}

#[test]
fn it_can_be_read_on_a_screen_and_on_a_phone_light_and_dark() {
    let Some(browser) = Browser::start("looks") else { return };
    let cluster = Cluster::new(&long());
    let (_coordinator, url) = cluster.serve("out", &[]);
    let _workers =
        [work(&cluster, &url, "node-1.cluster.example"), work(&cluster, &url, "node-2.cluster.example")];
    browser.open(&page(&cluster));
    wait_for("progress", || (done(&browser) > 60).then_some(()));
    for (width, height) in [(1280, 900), (390, 844)] {
        for scheme in ["light", "dark"] {
            browser.look_as(width, height, scheme);
            let scheme_seen = browser.run("return matchMedia('(prefers-color-scheme: dark)').matches");
            assert_eq!(scheme_seen, scheme == "dark");
            let worst = browser.run(CONTRAST);
            let ratio = worst["ratio"].as_f64().expect("a ratio");
            assert!(ratio >= 4.5, "{width} px, {scheme}: {worst}");
            let beyond = browser.run("return document.documentElement.scrollWidth - innerWidth");
            assert!(beyond.as_i64().is_some_and(|px| px <= 0), "{width} px: {beyond} px too wide");
            if let Some(folder) = std::env::var_os("RUNOUT_SCREENSHOTS").map(PathBuf::from) {
                std::fs::create_dir_all(&folder).expect("a folder");
                browser.photograph(&folder.join(format!("page-{width}-{scheme}.png")));
            }
        }
    }
    let faults = browser.run(STRUCTURE);
    assert_eq!(faults, serde_json::json!([]), "what a screen reader would stumble over");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

/// The smallest contrast of a text to the colour behind it (WCAG 2.1: 4.5 for ordinary text), and where it is.
const CONTRAST: &str = r"
const channels = (colour) => colour.match(/[\d.]+/g).map(Number);
const luminance = ([r, g, b]) => {
  const linear = [r, g, b].map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
};
const behind = (element) => {
  for (let e = element; e; e = e.parentElement) {
    const colour = channels(getComputedStyle(e).backgroundColor);
    if (colour.length < 4 || colour[3] > 0) return colour;
  }
  return [255, 255, 255];
};
let worst = { ratio: 99 };
for (const element of document.querySelectorAll('body *')) {
  const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
  // What a progress bar holds is for browsers that know none.
  if (!own || element.closest('noscript, progress') || element.getClientRects().length === 0) continue;
  const svg = element.closest('svg');
  const style = getComputedStyle(element);
  const text = luminance(channels(svg ? style.fill : style.color));
  const page = luminance(behind(svg ?? element));
  const ratio = (Math.max(text, page) + 0.05) / (Math.min(text, page) + 0.05);
  if (ratio < worst.ratio) worst = { ratio, where: element.outerHTML.slice(0, 120) };
}
return worst;
";

/// What assistive technology needs and does not find.
const STRUCTURE: &str = r"
const faults = [];
const all = (selector) => [...document.querySelectorAll(selector)];
for (const landmark of ['header', 'main', 'footer']) if (all(landmark).length !== 1) faults.push(landmark);
if (all('h1').length !== 1) faults.push('h1');
const levels = all('h1, h2, h3').map((h) => Number(h.tagName[1]));
if (levels.some((level, i) => i > 0 && level > levels[i - 1] + 1)) faults.push('levels of headings');
for (const section of all('section')) {
  if (!document.getElementById(section.getAttribute('aria-labelledby'))) faults.push('section without a name');
}
for (const table of all('table')) {
  if (!table.caption) faults.push('table without a caption: ' + table.id);
  for (const row of table.tBodies[0]?.rows ?? []) {
    if (!row.querySelector('th[scope=row]')) faults.push('row without a header: ' + table.id);
  }
  for (const cell of table.tHead?.querySelectorAll('th') ?? []) if (cell.scope !== 'col') faults.push('scope: ' + table.id);
}
for (const figure of all('figure')) if (!figure.querySelector('svg[role=img][aria-label]')) faults.push('figure without a text');
for (const meter of all('progress')) if (!meter.labels.length) faults.push('progress without a label');
const ids = all('[id]').map((e) => e.id);
if (new Set(ids).size !== ids.length) faults.push('an id twice');
if (all('[aria-live=polite]').length !== 1) faults.push('live region');
return faults;
";
