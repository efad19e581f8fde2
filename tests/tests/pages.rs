//! What the pages in docs/ name is there: files behind links; files, symbols, commands and sections of the report in
//! docs/from-the-paper.md.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// What stands between two of `mark`, line by line, outside blocks of code.
fn between<'a>(page: &'a str, mark: &str) -> Vec<&'a str> {
    let prose = page.split("```").step_by(2);
    prose.flat_map(str::lines).flat_map(|line| line.split(mark).skip(1).step_by(2)).collect()
}

/// Whether a file's text has `symbol` as a word.
fn has_word(text: &str, symbol: &str) -> bool {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == symbol)
}

/// Texts of all Rust files below a folder.
fn texts_below(folder: &Path, texts: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            texts_below(&path, texts);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            texts.push(fs::read_to_string(path).expect("a Rust file"));
        }
    }
}

#[test]
fn what_the_page_on_the_paper_names_is_there() {
    let page = read("docs/from-the-paper.md");
    let (mut files, mut symbols, mut commands) = (0, 0, 0);
    for code in between(&page, "`") {
        if let Some(command) = code.strip_prefix("runout ") {
            let name = command.split(' ').next().expect("a name");
            let source = root().join("coordinator/src/cli").join(name);
            assert!(source.with_extension("rs").is_file() || source.is_dir(), "there is no command {name}");
            commands += 1;
        } else if code.contains('/') && !code.contains(' ') {
            let (path, symbol) =
                code.split_once("::").map_or((code, None), |(path, symbol)| (path, Some(symbol)));
            let text = read(path);
            files += 1;
            if let Some(symbol) = symbol {
                assert!(has_word(&text, symbol), "{path} has no {symbol}");
                symbols += 1;
            }
        }
    }
    assert!(files > 45 && symbols > 30 && commands > 15, "{files}, {symbols}, {commands}");

    let mut sources = Vec::new();
    texts_below(&root().join("coordinator/src/report"), &mut sources);
    let sections: Vec<&str> =
        between(&page, "*").into_iter().filter(|name| name.starts_with(char::is_uppercase)).collect();
    assert!(sections.len() > 15, "{sections:?}");
    for name in sections {
        let heading = format!("\"{name}\"");
        assert!(sources.iter().any(|text| text.contains(&heading)), "the report has no section {name}");
    }
}

#[test]
fn links_of_the_pages_lead_to_files() {
    let mut pages = vec!["README.md".to_owned(), "campaigns/readings/README.md".to_owned()];
    for entry in fs::read_dir(root().join("docs")).expect("docs").flatten() {
        let name = entry.file_name().into_string().expect("a name in UTF-8");
        if name.ends_with(".md") {
            pages.push(format!("docs/{name}"));
        }
    }
    let readme = read("README.md");
    for page in &pages {
        assert!(page == "README.md" || readme.contains(page.as_str()), "README.md does not link to {page}");
        let text = read(page);
        let folder = root().join(page).parent().expect("a folder").to_owned();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().expect("a path");
            if !file.is_empty() && !file.contains(':') {
                assert!(folder.join(file).exists(), "{page} links to {link}, which is not there");
            }
        }
    }
}
