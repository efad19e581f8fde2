//! The few pieces of HTML that the report is made of, and its style sheet.

use crate::table::{Table, significant};
use std::fmt::Display;

/// Style sheet: readable on a screen, light or dark, and on paper.
pub const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1f2328;--grey:#6e7781;--grid:#d8dce0;--page:#fff;--panel:#f6f7f8;--accent:#0072b2}
@media(prefers-color-scheme:dark){:root{--ink:#e6e8ea;--grey:#9aa4ae;--grid:#3a4048;--page:#16191d;--panel:#1f242a;--accent:#56b4e9}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:62rem;padding:2rem 1.25rem 4rem;background:var(--page);color:var(--ink);\
font:16px/1.55 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif}
h1{font-size:1.9rem;line-height:1.2;margin:0 0 .25rem}
h2{font-size:1.3rem;margin:2.6rem 0 .6rem;padding-top:.6rem;border-top:1px solid var(--grid)}
h3{font-size:1.05rem;margin:1.6rem 0 .4rem}
p{margin:.5rem 0;max-width:48rem}
.lead{color:var(--grey);margin-bottom:1.5rem}
.answer{background:var(--panel);border-left:4px solid var(--accent);padding:.9rem 1.2rem;margin:1rem 0}
.answer p{margin:.35rem 0;max-width:none}
.answer strong{font-size:1.15em}
.numbers{display:grid;grid-template-columns:repeat(auto-fit,minmax(7.2rem,1fr));gap:.75rem;margin:1.2rem 0}
.numbers div{background:var(--panel);padding:.7rem .9rem}
.numbers b{display:block;white-space:nowrap;font-size:1.25rem;font-weight:600;font-variant-numeric:tabular-nums}
.numbers span{color:var(--grey);font-size:.85rem}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:.87rem;font-variant-numeric:tabular-nums;margin:.6rem 0 1rem}
th,td{padding:.28rem .6rem;text-align:right;border-bottom:1px solid var(--grid);white-space:nowrap}
th{font-weight:600;color:var(--grey);white-space:normal;vertical-align:bottom}
th:first-child,td:first-child{text-align:left;padding-left:0}
th.text,td.text{text-align:left}
td.long{text-align:left;white-space:normal;min-width:12rem}
tr.best td{font-weight:600}
figure{margin:1rem 0;break-inside:avoid}
figure svg{display:block;width:100%;height:auto;color:var(--ink)}
figcaption{color:var(--grey);font-size:.9rem;max-width:48rem}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(24rem,1fr));gap:1rem}
code,pre{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;font-size:.86em}
pre{background:var(--panel);padding:.8rem 1rem;overflow-x:auto}
code{overflow-wrap:anywhere}
@media print{:root{--ink:#000;--page:#fff;--panel:#f3f3f3;--grid:#ccc;--grey:#444}
body{max-width:none;padding:0;font-size:10.5pt}h2,h3{break-after:avoid}tr{break-inside:avoid}thead{display:table-header-group}.scroll{overflow:visible}}
";

/// Significant digits of the numbers of [`from_table`].
const DIGITS: i32 = 6;
/// A cell with more characters is broken into lines.
const LONG_CELL: usize = 40;

/// `text` with the characters that mean something in HTML replaced.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A paragraph of finished HTML.
pub fn paragraph(html: impl Display) -> String {
    format!("<p>{html}</p>\n")
}

/// A table of plain text; rows for which the flag is set stand out.
pub fn table(header: &[&str], rows: &[(bool, Vec<String>)]) -> String {
    let mut html = String::from("<div class=\"scroll\"><table><thead><tr>");
    let is_text: Vec<bool> = (0..header.len()).map(|column| is_text(rows, column)).collect();
    let class = |column: usize, cell: &str| match is_text.get(column) {
        _ if cell.chars().count() > LONG_CELL => " class=\"long\"",
        Some(true) => " class=\"text\"",
        _ => "",
    };
    for (column, name) in header.iter().enumerate() {
        html.push_str(&format!("<th{}>{}</th>", class(column, ""), escape(name)));
    }
    html.push_str("</tr></thead><tbody>\n");
    for (stands_out, cells) in rows {
        html.push_str(if *stands_out { "<tr class=\"best\">" } else { "<tr>" });
        for (column, cell) in cells.iter().enumerate() {
            html.push_str(&format!("<td{}>{}</td>", class(column, cell), escape(cell)));
        }
        html.push_str("</tr>\n");
    }
    html + "</tbody></table></div>\n"
}

/// Whether a column holds words: it is set to the left then.
fn is_text(rows: &[(bool, Vec<String>)], column: usize) -> bool {
    let mut cells =
        rows.iter().filter_map(|(_, row)| row.get(column)).filter(|cell| !cell.is_empty()).peekable();
    cells.peek().is_some() && cells.all(|cell| cell.starts_with(char::is_alphabetic))
}

/// A text table as HTML, its numbers with fewer digits, as a page needs no more; rows whose first cell is a star stand out.
pub fn from_table(table: &Table) -> String {
    let mut header: Vec<&str> = table.header().iter().map(String::as_str).collect();
    if table.rows().iter().any(|row| row.len() > header.len() && !row[header.len()].is_empty()) {
        header.push("");
    }
    let rows: Vec<(bool, Vec<String>)> = table
        .rows()
        .iter()
        .map(|row| (row[0] == "*", row.iter().take(header.len()).map(|cell| shortened(cell)).collect()))
        .collect();
    self::table(&header, &rows)
}

fn shortened(cell: &str) -> String {
    match cell.parse::<f64>() {
        Ok(value) if cell.contains('.') => significant(value, DIGITS),
        _ => cell.to_owned(),
    }
}

/// A figure: an SVG document embedded so that it takes the page's colours and width.
pub fn figure(svg: &str, caption: &str) -> String {
    let start = svg.find("<svg").unwrap_or(0);
    let embedded = without_size(&svg[start..])
        .replace("#1F2328", "currentColor")
        .replace("#6E7781", "var(--grey)")
        .replace("#D8DCE0", "var(--grid)")
        // Lighter on a dark page.
        .replace("#0072B2", "var(--accent)");
    format!(
        "<figure role=\"img\" aria-label=\"{0}\">{embedded}<figcaption>{0}</figcaption></figure>\n",
        escape(caption)
    )
}

/// The document without `width` and `height`, so that it scales by its `viewBox`.
fn without_size(svg: &str) -> String {
    let Some(end) = svg.find('>') else { return svg.to_owned() };
    let (head, body) = svg.split_at(end);
    let kept: Vec<&str> =
        head.split(' ').filter(|a| !a.starts_with("width=") && !a.starts_with("height=")).collect();
    kept.join(" ") + body
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_files_cannot_become_markup() {
        let html = table(&["a"], &[(false, vec!["<script>".to_owned()])]);
        assert!(html.contains("&lt;script&gt;") && !html.contains("<script>"));
    }

    #[test]
    fn embedded_figures_scale_and_take_the_text_colour() {
        let svg = "<svg width=\"16\" height=\"9\" viewBox=\"0 0 16 9\"><line width=\"2\" stroke=\"#1F2328\"/></svg>";
        let html = figure(svg, "c");
        assert!(html.contains("<svg viewBox=\"0 0 16 9\"><line width=\"2\" stroke=\"currentColor\"/>"));
    }
}
