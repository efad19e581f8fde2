//! A real browser without a window: Chromium, driven through chromedriver's JSON (W3C WebDriver).

use crate::http;
use crate::wait_for;
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;

/// A browser, closed when it goes out of scope.
#[derive(Debug)]
pub struct Browser {
    driver: Child,
    url: String,
    session: String,
    _folder: TempDir,
}

impl Browser {
    /// Starts one; nothing, and said loudly, where chromedriver is not installed.
    ///
    /// # Panics
    /// It is installed and does not start.
    pub fn start(test: &str) -> Option<Browser> {
        let found = Command::new("chromedriver").arg("--version").stdout(Stdio::null()).status();
        if !found.is_ok_and(|status| status.success()) {
            let text = format!(
                "\nNOT TESTED IN A BROWSER ({test}): chromedriver is not installed (Debian: chromium-driver)\n"
            );
            // Not by a macro: what those print is shown of failing tests only.
            let _ = std::io::stderr().write_all(text.as_bytes());
            return None;
        }
        let folder = tempfile::tempdir().expect("a temporary folder");
        let said = folder.path().join("said");
        let driver = Command::new("chromedriver")
            .arg("--port=0")
            .env("HOME", folder.path())
            .stdin(Stdio::null())
            .stdout(File::create(&said).expect("a file"))
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        let port = wait_for("chromedriver's port", || {
            let text = fs::read_to_string(&said).ok()?;
            let rest = text.split("successfully on port ").nth(1)?;
            Some(rest.split('.').next()?.trim().to_owned())
        });
        let mut browser = Browser {
            driver,
            url: format!("http://127.0.0.1:{port}"),
            session: String::new(),
            _folder: folder,
        };
        // The sandbox needs rights that containers and CI do not give; the pages are our own.
        let options = json!({ "args": [
            "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=1280,900",
            format!("--user-data-dir={}", browser._folder.path().join("profile").display()),
        ] });
        let wanted = json!({ "capabilities": { "alwaysMatch": {
            "browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": { "browser": "ALL" },
        } } });
        let session = browser.post("/session", &wanted);
        browser.session = session["sessionId"].as_str().expect("a session").to_owned();
        Some(browser)
    }

    fn post(&self, path: &str, body: &Value) -> Value {
        let path = match path {
            "/session" => path.to_owned(),
            _ => format!("/session/{}{path}", self.session),
        };
        let headers = [("content-type", "application/json")];
        let answer = http::request(&self.url, "POST", &path, &headers, &body.to_string()).expect("an answer");
        let mut document = answer.json();
        assert_eq!(answer.status, 200, "{path}: {document}");
        document["value"].take()
    }

    /// Opens a page.
    pub fn open(&self, url: &str) {
        self.post("/url", &json!({ "url": url }));
    }

    /// Runs a script in the page and gives what it returns.
    pub fn run(&self, script: &str) -> Value {
        self.post("/execute/sync", &json!({ "script": script, "args": [] }))
    }

    /// The text of the first element that `selector` finds, as a reader sees it; empty without one.
    pub fn text(&self, selector: &str) -> String {
        let script = format!("return document.querySelector({})?.innerText ?? ''", json!(selector));
        self.run(&script).as_str().unwrap_or_default().to_owned()
    }

    /// Waits until the text of an element is as wanted.
    ///
    /// # Panics
    /// It is not within the limit.
    pub fn wait_for_text(&self, selector: &str, wanted: impl Fn(&str) -> bool) -> String {
        wait_for(&format!("the text of {selector}"), || Some(self.text(selector)).filter(|text| wanted(text)))
    }

    /// Shows pages as on a screen of this size, in a light or a dark colour scheme.
    pub fn look_as(&self, width: u32, height: u32, scheme: &str) {
        let metrics =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.developer("Emulation.setDeviceMetricsOverride", metrics);
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.developer("Emulation.setEmulatedMedia", json!({ "features": features }));
    }

    /// Writes a picture of the whole page, PNG.
    ///
    /// # Panics
    /// The file cannot be written.
    pub fn photograph(&self, file: &Path) {
        let shot = self.developer("Page.captureScreenshot", json!({ "captureBeyondViewport": true }));
        let text = shot["data"].as_str().expect("a picture");
        fs::write(file, from_base64(text)).expect("it can be written");
    }

    /// What the page has complained of: errors of scripts, what its policy forbade, what could not be loaded.
    pub fn complaints(&self) -> Vec<String> {
        let log = self.post("/se/log", &json!({ "type": "browser" }));
        let lines = log.as_array().cloned().unwrap_or_default();
        lines.iter().map(|line| line["message"].as_str().unwrap_or_default().to_owned()).collect()
    }

    fn developer(&self, command: &str, parameters: Value) -> Value {
        self.post("/goog/cdp/execute", &json!({ "cmd": command, "params": parameters }))
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        if !self.session.is_empty() {
            // It may be gone already; the driver ends in any case, and with it the browser.
            let path = format!("/session/{}", self.session);
            let _ = http::request(&self.url, "DELETE", &path, &[], "");
        }
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

fn from_base64(text: &str) -> Vec<u8> {
    const ALPHABET: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bytes, mut bits, mut held) = (Vec::new(), 0_u32, 0);
    for letter in text.bytes() {
        let Some(value) = ALPHABET.iter().position(|known| *known == letter) else { continue };
        bits = bits << 6 | value as u32;
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    bytes
}
