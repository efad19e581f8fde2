//! Good input files are taken; of bad ones the message says what stands beside the fault in the file, after `#!`.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn runout(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_runout")).args(arguments).output().expect("the binary starts")
}

fn files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/inputs").join(folder);
    let entries =
        std::fs::read_dir(folder).expect("the folder is there").map(|e| e.expect("it can be read").path());
    let mut files: Vec<PathBuf> = entries.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    files.sort();
    files
}

#[test]
fn bad_files_are_refused_with_the_message_beside_their_fault() {
    let files = files("bad");
    assert!(!files.is_empty());
    for file in files {
        let text = std::fs::read_to_string(&file).expect("it is text");
        let expected =
            text.split("#! ").nth(1).and_then(|t| t.lines().next()).expect("a message is expected");
        for command in ["check", "fit"] {
            let output = runout(&[command, file.to_str().expect("a path in UTF-8")]);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{}: {said}", file.display());
            // The faulty line may be quoted, and with it the expected message: it does not count.
            let said = said.lines().filter(|line| !line.contains("#!")).collect::<Vec<_>>().join("\n");
            assert!(said.contains(expected), "{}\nexpected: {expected}\nsaid: {said}", file.display());
            assert!(said.contains("tests/inputs/bad/"), "the file is not named: {said}");
            assert!(output.stdout.is_empty(), "{}: nothing belongs on standard output", file.display());
        }
    }
}

#[test]
fn good_files_are_fitted() {
    for file in files("good") {
        let path = file.to_str().expect("a path in UTF-8");
        let output = runout(&["fit", path, "--json"]);
        assert!(output.status.success(), "{}: {}", file.display(), String::from_utf8_lossy(&output.stderr));
        let document: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON document");
        assert!(document["marginals"]["cohesion_kpa"]["best"]["family"].is_string());
        assert!(document["copula"]["best"]["family"].is_string());
    }
}

#[test]
fn what_is_no_campaign_file_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("a path in UTF-8").to_owned();
    let said = |path: &str| {
        let output = runout(&["check", path]);
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    assert!(said(&at("missing.toml")).contains("missing.toml: there is no such file"));
    assert!(said(&at("")).contains("it is a directory, and a file is needed"));
    std::fs::write(at("latin1.toml"), b"name = \"x\"\n# M\xfcller\n").expect("it can be written");
    assert!(said(&at("latin1.toml")).contains("latin1.toml: line 2: it is not UTF-8 text"));
    std::fs::write(at("campaign.toml"), "").expect("it can be written");
    assert!(said(&at("")).contains("did you mean"));
}

#[test]
fn init_writes_an_example_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let into = folder.path().join("mine");
    let path = into.to_str().expect("a path in UTF-8");
    assert!(runout(&["init", path]).status.success());
    assert!(into.join("campaign.toml").is_file() && into.join("site.csv").is_file());
    let again = runout(&["init", path]);
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("init overwrites nothing"));
}
