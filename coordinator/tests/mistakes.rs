//! The most likely mistakes of a new user: each is answered by what docs/errors.md says, with exit code 2.

use std::collections::BTreeSet;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

struct Desk(TempDir);

impl Desk {
    fn runout(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_runout"));
        command.args(arguments).current_dir(self.0.path()).output().expect("the binary starts")
    }

    /// A campaign file made from the example by a change.
    fn changed(&self, name: &str, from: &str, to: &str) {
        let text = std::fs::read_to_string(self.0.path().join("mine/campaign.toml")).expect("the example");
        assert!(text.contains(from), "{from}");
        self.put(name, &text.replacen(from, to, 1));
    }

    fn put(&self, name: &str, text: &str) {
        std::fs::write(self.0.path().join("mine").join(name), text).expect("it can be written");
    }
}

#[test]
fn the_answers_are_those_of_the_page_on_errors() {
    let desk = Desk(tempfile::tempdir().expect("a temporary folder"));
    assert!(desk.runout(&["init", "mine"]).status.success());
    desk.changed("column.toml", "cohesion_kpa = \"cohesion_kpa\"", "cohesion_kpa = \"cohesion\"");
    desk.changed("key.toml", "porosity =", "porosty =");
    desk.changed("few.toml", "\"site.csv\"", "\"few.csv\"");
    desk.put("few.csv", "cohesion_kpa,friction_angle_deg\n5,20\n6,21\n");
    desk.changed("semicolons.toml", "\"site.csv\"", "\"semicolons.csv\"");
    desk.put("semicolons.csv", "cohesion_kpa;friction_angle_deg\n5;20\n");
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").to_string();
    let serve = ["serve", "mine/campaign.toml", "--out", "out"];

    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/errors.md");
    let page = std::fs::read_to_string(page).expect("docs/errors.md");
    let mut answered = BTreeSet::new();
    let mut meets = |arguments: &[&str], expected: &str| {
        let output = desk.runout(arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.contains(expected), "{arguments:?}\nexpected: {expected}\nsaid: {said}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        let code = if arguments[0] == "status" && expected.contains("answers") { 1 } else { 2 };
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(page.contains(expected), "docs/errors.md does not say: {expected}");
        answered.insert(expected.to_owned());
    };
    meets(&["check", "mine/campain.toml"], "there is no such file; did you mean campaign.toml?");
    meets(&["fit", "mine/column.toml"], "column `cohesion` is missing; the header has");
    meets(&["check", "mine/key.toml"], "did you mean `porosity`?");
    meets(&["fit", "mine/few.toml"], "at least 5 are needed");
    meets(&["fit", "mine/semicolons.toml"], "columns must be separated by commas");
    meets(
        &["run", "mine/campaign.toml", "--out", "out", "--worker-program", "nowhere"],
        "the worker program is not there",
    );
    meets(&[&serve[..], &["--listen", &port]].concat(), "another coordinator may be there");
    let page_taken = ["--listen", "127.0.0.1:0", "--page", &port];
    meets(&[&serve[..], &page_taken].concat(), "take another port (0 for any free one), or --no-page");
    meets(&["status", "mine"], "this is no run directory");
    meets(&["status", "http://127.0.0.1:9"], "no coordinator answers");
    assert!(!desk.0.path().join("out").exists(), "nothing was begun");
    assert_eq!(answered.len(), 10);
}

#[test]
fn completions_and_manual_pages_name_every_command() {
    let desk = Desk(tempfile::tempdir().expect("a temporary folder"));
    let help = String::from_utf8(desk.runout(&["--help"]).stdout).expect("text");
    let commands: Vec<&str> = help
        .lines()
        .skip_while(|line| !line.starts_with("Commands:"))
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.strip_prefix("  ")?.split(' ').next().filter(|name| !name.is_empty()))
        .filter(|name| *name != "help")
        .collect();
    assert!(commands.len() > 12, "{help}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = desk.runout(&["completions", shell]);
        let text = String::from_utf8(output.stdout).expect("text");
        assert!(output.status.success() && commands.iter().all(|name| text.contains(name)), "{shell}");
    }
    assert!(desk.runout(&["man", "pages/man1"]).status.success());
    for name in commands {
        let page = desk.0.path().join(format!("pages/man1/runout-{name}.1"));
        let text = std::fs::read_to_string(&page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        assert!(text.starts_with(".ie") || text.contains(".TH "), "{name}");
        assert!(text.contains(".SH SYNOPSIS") && text.contains(".SH DESCRIPTION"), "{name}");
    }
    std::fs::write(desk.0.path().join("file"), "").expect("it can be written");
    assert_eq!(desk.runout(&["man", "file/below"]).status.code(), Some(2));
}
