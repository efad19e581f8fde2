//! The few pieces of HTML that the report is made of, and its style sheet.

use super::figures::{Content, Figure};
use crate::table::{Table, significant};
use base64::Engine;
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
.numbers{display:grid;grid-template-columns:repeat(auto-fit,minmax(6.3rem,1fr));gap:.75rem;margin:1.2rem 0}
.numbers div{background:var(--panel);padding:.7rem .6rem}
.numbers b{display:block;white-space:nowrap;font-size:1.25rem;font-weight:600;font-variant-numeric:tabular-nums}
.numbers span{color:var(--grey);font-size:.85rem}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:.87rem;font-variant-numeric:tabular-nums;margin:.6rem 0 1rem}
th,td{padding:.28rem .6rem;text-align:right;border-bottom:1px solid var(--grid);white-space:nowrap}
th{font-weight:600;color:var(--grey);white-space:normal;vertical-align:bottom}
td,tbody th{vertical-align:top}
tbody th{font-weight:400;color:var(--ink);white-space:nowrap}
th:first-child,td:first-child{text-align:left;padding-left:0}
th.text,td.text{text-align:left}
td.long{text-align:left;white-space:normal;min-width:12rem}
tr.best td,tr.best th{font-weight:600}
caption{text-align:left;color:var(--grey);padding-bottom:.3rem}\
.scroll caption{position:sticky;left:0;max-width:min(48rem,calc(100vw - 2rem))}
figure{margin:1rem 0;break-inside:avoid}
figure svg,figure img{display:block;width:100%;height:auto;color:var(--ink)}
figure img{background:#fff;padding:.3rem}
figcaption{color:var(--grey);font-size:.9rem;max-width:48rem;margin-top:.25rem}
.pair{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(24rem,100%),1fr));gap:0 1.2rem}
nav ol{columns:2;padding-left:1.3rem;margin:.6rem 0}
nav a,p a{color:var(--accent)}
a:focus-visible,.scroll:focus-visible,summary:focus-visible{outline:2px solid var(--accent);outline-offset:2px}
code,pre{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;font-size:.86em}
pre{background:var(--panel);padding:.8rem 1rem;overflow-x:auto}
code{overflow-wrap:anywhere}
@media(max-width:34rem){body{padding:1.2rem .8rem 3rem;font-size:15px}nav ol{columns:1}h1{font-size:1.5rem}}
@page{size:A4;margin:15mm 14mm}
@media print{:root{color-scheme:light;--ink:#000;--page:#fff;--panel:#f3f3f3;--grid:#ccc;--grey:#444;--accent:#0072b2}
body{max-width:none;padding:0;font-size:9.5pt}h2,h3{break-after:avoid}h2{margin-top:1.6rem}p{orphans:3;widows:3}tr{break-inside:avoid}\
thead{display:table-header-group}.scroll{overflow:visible}table{font-size:7.8pt}th,td{padding:.2rem .35rem}nav{display:none}\
.numbers,.answer,.scroll:not(:has(tbody tr:nth-child(16))){break-inside:avoid}.pair{grid-template-columns:1fr 1fr}figure.tall img,figure.tall svg{max-height:235mm;width:auto;max-width:100%;margin:auto}\
details::details-content{content-visibility:visible;height:auto}summary{list-style:none;font-weight:600}pre{white-space:pre-wrap}}
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

/// A table under its caption, which also names the region that the keyboard scrolls.
pub fn captioned(caption: &str, table: &str) -> String {
    let caption = escape(caption);
    table
        .replacen(
            "<div class=\"scroll\" ",
            &format!("<div class=\"scroll\" role=\"region\" aria-label=\"{caption}\" "),
            1,
        )
        .replacen("<table>", &format!("<table><caption>{caption}</caption>"), 1)
}

/// A table of plain text, the first column heading the rows; rows for which the flag is set stand out.
pub fn table(header: &[&str], rows: &[(bool, Vec<String>)]) -> String {
    // The keyboard scrolls what it can reach.
    let mut html = String::from("<div class=\"scroll\" tabindex=\"0\"><table>");
    let is_text: Vec<bool> =
        header.iter().enumerate().map(|(column, name)| *name == "value" || is_text(rows, column)).collect();
    let class = |column: usize, cell: &str| match is_text.get(column) {
        _ if cell.chars().count() > LONG_CELL => " class=\"long\"",
        Some(true) => " class=\"text\"",
        _ => "",
    };
    html.push_str("<thead><tr>");
    for (column, name) in header.iter().enumerate() {
        // A heading without a word is none.
        let (tag, scope) = if name.is_empty() { ("td", "") } else { ("th", " scope=\"col\"") };
        html.push_str(&format!("<{tag}{scope}{}>{}</{tag}>", class(column, ""), escape(name)));
    }
    html.push_str("</tr></thead><tbody>\n");
    // The row's heading is its first cell with a word: the first one may be a star.
    let heading = usize::from(
        header.first().is_some_and(|name| name.is_empty()) && header.len() > 2 && header[1] == "family",
    );
    for (stands_out, cells) in rows {
        html.push_str(if *stands_out { "<tr class=\"best\">" } else { "<tr>" });
        for (column, cell) in cells.iter().enumerate() {
            let (tag, scope) = if column == heading { ("th", " scope=\"row\"") } else { ("td", "") };
            html.push_str(&format!("<{tag}{scope}{}>{}</{tag}>", class(column, cell), escape(cell)));
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
/// What a row has to say beyond the columns stands below the table.
pub fn from_table(table: &Table) -> String {
    let header: Vec<&str> = table.header().iter().map(String::as_str).collect();
    let columns = header.len();
    let rows: Vec<(bool, Vec<String>)> = table
        .rows()
        .iter()
        .map(|row| (row[0] == "*", row.iter().take(columns).map(|cell| shortened(cell)).collect()))
        .collect();
    let remarks = table.rows().iter().filter_map(|row| {
        let (family, remark) = (row.get(1)?, row.get(columns).filter(|remark| !remark.is_empty())?);
        Some(if remark.starts_with(family.as_str()) { remark.clone() } else { format!("{family}: {remark}") })
    });
    let remarks: String = remarks.map(|remark| paragraph(escape(&remark))).collect();
    self::table(&header, &rows) + &remarks
}

fn shortened(cell: &str) -> String {
    match cell.parse::<f64>() {
        Ok(value) if cell.contains('.') => significant(value, DIGITS),
        _ => cell.to_owned(),
    }
}

/// A chart with its caption; it takes the page's colours and width.
pub fn figure(svg: &str, caption: &str) -> String {
    let caption = escape(caption);
    format!("<figure>{}<figcaption>{caption}</figcaption></figure>\n", embedded(svg, &caption))
}

/// A figure of the report: a chart as [`figure()`] shows it, or a picture, which keeps its colours.
pub fn illustration(figure: &Figure) -> String {
    let alt = escape(&format!("{} {}", figure.caption, figure.alt));
    let (embedded, class) = match &figure.content {
        Content::Chart { svg, .. } => (embedded(svg, &alt), ""),
        Content::Picture(png) => {
            let data = base64::engine::general_purpose::STANDARD.encode(png);
            let [width, height] = png_size(png);
            let class = if height > width { " class=\"tall\"" } else { "" };
            let image = format!(
                "<img alt=\"{alt}\" width=\"{width}\" height=\"{height}\" src=\"data:image/png;base64,{data}\">"
            );
            (image, class)
        }
    };
    format!("<figure{class}>{embedded}<figcaption>{}</figcaption></figure>\n", escape(&figure.caption))
}

/// Width and height from a PNG file's first chunk (PNG specification, Section 11.2.1).
fn png_size(png: &[u8]) -> [u32; 2] {
    let at =
        |from: usize| png.get(from..from + 4).and_then(|b| b.try_into().ok()).map_or(0, u32::from_be_bytes);
    [at(16), at(20)]
}

fn embedded(svg: &str, alt: &str) -> String {
    let start = svg.find("<svg").unwrap_or(0);
    without_size(&svg[start..])
        .replacen("<svg ", &format!("<svg role=\"img\" aria-label=\"{alt}\" "), 1)
        .replace("#1F2328", "currentColor")
        .replace("#6E7781", "var(--grey)")
        .replace("#D8DCE0", "var(--grid)")
        // Lighter on a dark page.
        .replace("#0072B2", "var(--accent)")
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
        let html = embedded(svg, "c");
        assert!(html.contains("viewBox=\"0 0 16 9\"><line width=\"2\" stroke=\"currentColor\"/>"), "{html}");
        assert!(html.starts_with("<svg role=\"img\" aria-label=\"c\" "), "{html}");
    }
}
