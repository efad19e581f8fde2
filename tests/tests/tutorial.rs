//! docs/tutorial.md does what it says: its commands run in their order, with the exit codes it gives; what it shows of
//! their answers is what they print; the files and the sections of the report that it sends the reader to are there.
//!
//! Read from the page: blocks of `sh`, run each as a script that ends at its first failure; the comment
//! `<!-- exits with N -->` before one; the block of `text` after one, in which `...` stands for any lines; between
//! backticks, paths below the folders that the commands make; between asterisks, sections of the report.

use runout_tests::{Cluster, wait_up_to};
use std::path::Path;
use std::time::Duration;

/// Far longer than the longest command of the page needs on a busy machine.
const PATIENCE: Duration = Duration::from_secs(900);

/// Folders that the page's commands make.
const MADE: [&str; 4] = ["my-slope/", "slide/", "run/", "reviewer/"];

#[derive(Debug)]
struct Step {
    script: String,
    exit_code: i32,
    shown: Option<String>,
}

/// The page's commands, with what it says of their ends and answers.
fn steps(page: &str) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    let mut exit_code = 0;
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let mut block = || {
            lines
                .by_ref()
                .take_while(|line| *line != "```")
                .fold(String::new(), |text, line| text + line + "\n")
        };
        match line {
            "```sh" => {
                steps.push(Step { script: block(), exit_code: std::mem::take(&mut exit_code), shown: None })
            }
            "```text" => {
                let shown = block();
                let before = steps.last_mut().expect("an answer follows its command");
                assert!(before.shown.replace(shown).is_none(), "two answers to {}", before.script);
            }
            _ => {
                let code = line.strip_prefix("<!-- exits with ").and_then(|rest| rest.strip_suffix(" -->"));
                if let Some(code) = code {
                    exit_code = code.parse().expect("an exit code");
                }
            }
        }
    }
    steps
}

/// The first line shown that is not printed where it should be; `...` stands for any lines.
fn missing<'a>(shown: &'a str, printed: &str) -> Option<&'a str> {
    let mut printed = printed.lines();
    let mut anywhere = false;
    for line in shown.lines() {
        if line == "..." {
            anywhere = true;
            continue;
        }
        let found = if anywhere { printed.any(|other| other == line) } else { printed.next() == Some(line) };
        if !found {
            return Some(line);
        }
        anywhere = false;
    }
    None
}

/// What stands between two of `mark` on a line, outside blocks of code.
fn between<'a>(page: &'a str, mark: &str) -> Vec<&'a str> {
    let prose = page.split("```").step_by(2);
    prose.flat_map(str::lines).flat_map(|line| line.split(mark).skip(1).step_by(2)).collect()
}

#[test]
fn the_tutorial_does_what_it_says() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/tutorial.md");
    let page = std::fs::read_to_string(page).expect("docs/tutorial.md");
    let steps = steps(&page);
    assert!(steps.len() > 15 && steps.iter().filter(|step| step.shown.is_some()).count() > 8, "{steps:?}");

    let folder = Cluster::new("");
    for step in &steps {
        let mut process = folder.shell(&format!("set -eu\n{}", step.script));
        wait_up_to(PATIENCE, &step.script, || (!process.running()).then_some(()));
        let printed = process.output() + &process.errors();
        assert_eq!(process.exit_code(), step.exit_code, "{}\nprinted:\n{printed}", step.script);
        let line = step.shown.as_deref().and_then(|shown| missing(shown, &printed));
        assert_eq!(
            line, None,
            "docs/tutorial.md shows this, but not so\n{}\nprints:\n{printed}",
            step.script
        );
    }

    let mut paths = between(&page, "`");
    paths.retain(|path| MADE.iter().any(|made| path.starts_with(made)));
    assert!(paths.len() > 7, "{paths:?}");
    for path in paths {
        assert!(folder.path(path).is_file(), "docs/tutorial.md names {path}, which is not there");
    }

    let report = std::fs::read_to_string(folder.path("run/report.html")).expect("a report");
    let page = page.replace("**", "");
    let mut sections = between(&page, "*");
    sections.retain(|name| name.starts_with(char::is_uppercase));
    assert!(sections.len() > 4, "{sections:?}");
    for name in sections {
        assert!(report.contains(&format!(">{name}</h2>")), "the report has no section {name}");
    }
}

#[test]
fn what_is_not_printed_as_shown_is_found() {
    assert_eq!(missing("a\n...\nc\n", "a\nb\nc\nd\n"), None);
    assert_eq!(missing("a\nc\n", "a\nb\nc\n"), Some("c"));
    assert_eq!(missing("...\nc\na\n", "a\nb\nc\n"), Some("a"));
}
