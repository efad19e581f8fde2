//! `runout validate` as a user gives it, on its cheapest cases.

use runout::validation::{run, table};
use runout_core::validation::{Case, Check, Depth, Findings};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn validate(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_runout"));
    command.arg("validate").args(arguments).env_remove("RUST_LOG").output().expect("the binary starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("it is text")
}

#[test]
fn a_case_is_printed_as_a_table() {
    let output = validate(&["gravity-column"]);
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("settlement of the surface, 20 cells"), "{said}");
    assert!(said.contains("1 cases, ") && said.ends_with("all pass\n"), "{said}");
    assert!(!said.contains("FAIL"), "{said}");
    assert!(text(&output.stderr).contains("1 of 1: gravity-column\n"), "progress goes to standard error");
}

#[test]
fn the_document_holds_every_check() {
    let output = validate(&["hydrostatic-column", "gravity-column", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let document: Value = serde_json::from_slice(&output.stdout).expect("one JSON document and nothing else");
    assert_eq!(document["passes"], true);
    assert_eq!(document["full"], false);
    let cases = document["cases"].as_array().expect("a list");
    // The suite's order, whatever that of the arguments.
    let names: Vec<&str> = cases.iter().map(|c| c["name"].as_str().expect("text")).collect();
    assert_eq!(names, ["gravity-column", "hydrostatic-column"]);
    for check in cases.iter().flat_map(|c| c["checks"].as_array().expect("a list")) {
        assert!(check["found"].is_f64() && check["reference"].is_f64(), "{check}");
        assert!(["pass", "info"].contains(&check["verdict"].as_str().expect("text")), "{check}");
    }
}

#[test]
fn the_report_is_one_page_and_its_figures() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("new");
    let output = validate(&["gravity-column", "--out", out.to_str().expect("text")]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let page = std::fs::read_to_string(out.join("validation.html")).expect("the page is written");
    assert!(page.contains("Every check passes.") && page.contains("id=\"gravity-column\""));
    assert_eq!(page.matches("<svg").count(), 2);
    for attribute in ["src=", "href="] {
        assert!(!page.contains(attribute), "the page needs no other file");
    }
    for name in ["gravity-column-stress", "gravity-column-sudden-gravity"] {
        let read = |path: &Path| std::fs::read(path).expect("the figure is written");
        assert_eq!(read(&out.join(format!("{name}.png")))[..4], *b"\x89PNG");
        assert!(text(&read(&out.join(format!("{name}.svg")))).starts_with("<svg"));
    }
}

#[test]
fn an_unknown_case_is_refused_with_a_suggestion() {
    let output = validate(&["gravity-colum"]);
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stderr);
    assert!(said.contains("no case 'gravity-colum'; did you mean 'gravity-column'?"), "{said}");
    assert!(said.contains("hydrostatic-column"), "the list is there: {said}");
}

/// A case that blows up, and one that misses its reference, are failures with a row and a message, not the command's end.
#[test]
fn a_panic_and_a_miss_are_findings() {
    let blows_up = Case { name: "a", title: "A", about: "", run: |_| panic!("ended at 3 s") };
    let ran = run(blows_up, Depth::Quick);
    assert!(!ran.passes() && ran.failures() == 1);
    assert_eq!(ran.findings, Err("ended at 3 s".to_owned()));

    let misses = |_| Findings {
        checks: vec![Check::relative("x", "m", 1.0, 1.2, 0.1), Check::absolute("y", "", 0.0, f64::NAN, 1.0)],
        ..Findings::default()
    };
    let ran = run(Case { name: "b", title: "B", about: "", run: misses }, Depth::Quick);
    assert!(!ran.passes() && ran.failures() == 2);
    let shown = table(ran.checks()).render();
    assert_eq!(shown.matches("FAIL").count(), 2, "{shown}");
    assert!(shown.contains("20 %") && shown.contains("\u{b1}10 %"), "{shown}");
}
