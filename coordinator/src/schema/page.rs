//! The description as a page of the documentation, in Markdown.

use super::{Key, Kind, SECTIONS, Section};

const HEAD: &str = "\
# The campaign file

<!-- Written by `runout schema --page`; a test holds it against the program. -->

Editors that know JSON schemas complete and check a campaign file with `runout schema > campaign.schema.json` and, in its
first line, `#:schema ./campaign.schema.json` (Even Better TOML, Taplo). What a schema cannot say, for example which keys
belong to which rule, `runout check` does. Which number to take, and what hangs on it, stands in the comments of
[the example campaigns](../campaigns/elkhorn-river/campaign.toml).

";

/// The reference page.
pub fn page() -> String {
    HEAD.to_owned() + &SECTIONS.iter().map(part).collect::<String>()
}

fn part(section: &Section) -> String {
    let heading = match section.header {
        "" => "## Top level".to_owned(),
        header => format!("## `{}`", header.replace(" or ", "` or `")),
    };
    let rows: String = section.keys.iter().map(row).collect();
    format!(
        "{heading}\n\n{}\n\n| key | type | unit | allowed | if absent | meaning |\n|---|---|---|---|---|---|\n{rows}\n",
        section.meaning
    )
}

fn row(key: &Key) -> String {
    let (kind, allowed) = words(&key.kind);
    let absent = key.absent.unwrap_or("**needed**");
    format!("| `{}` | {kind} | {} | {allowed} | {absent} | {} |\n", key.name, key.unit(), key.meaning)
}

/// The type and what is allowed, in words.
fn words(kind: &Kind) -> (String, String) {
    let plain = |kind: &str| (kind.to_owned(), String::new());
    match kind {
        Kind::Text => plain("text"),
        Kind::Words(words) => {
            let quoted: Vec<String> = words.iter().map(|word| format!("`\"{word}\"`")).collect();
            ("word".to_owned(), quoted.join(", "))
        }
        Kind::Number(range) => ("number".to_owned(), range.words()),
        Kind::Whole(least, u64::MAX) => ("whole number".to_owned(), format!("{least} or more")),
        Kind::Whole(least, most) if *most == i64::MAX as u64 => {
            ("whole number".to_owned(), format!("{least} to 2^63 - 1"))
        }
        Kind::Whole(least, most) => ("whole number".to_owned(), format!("{least} to {most}")),
        Kind::Flag => ("flag".to_owned(), "`true`, `false`".to_owned()),
        Kind::Pair => ("pair".to_owned(), "`[smallest, largest]`".to_owned()),
        Kind::Line => ("line".to_owned(), "`[[x, y], ...]`".to_owned()),
        Kind::Matrix => plain("matrix"),
        Kind::With(name, range) => {
            ("table".to_owned(), format!("`{{ {name} = number }}`, {}", range.words()))
        }
        Kind::Either(kinds) => {
            let (kinds, allowed): (Vec<String>, Vec<String>) = kinds.iter().map(words).unzip();
            let allowed: Vec<String> = allowed.into_iter().filter(|a| !a.is_empty()).collect();
            (kinds.join(" or "), allowed.join("; "))
        }
        Kind::Table(_) => plain("section"),
        Kind::Tables(_) => plain("sections"),
        Kind::ByProperty(_) => plain("by property"),
    }
}
