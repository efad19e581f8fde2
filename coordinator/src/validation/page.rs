//! `validation.html`: the summary first, then case by case what was analysed, what was found, and the figures.

use super::{Drawn, Ran, table};
use crate::report::html::{STYLE, escape, figure, from_table, paragraph};
use crate::table::{Table, significant};
use runout_core::validation::{Comparison, Depth};

/// The whole document; `drawn` holds the figures of each case.
pub fn page(ran: &[Ran], drawn: &[Vec<Drawn>], depth: Depth, kernel: &str) -> String {
    let failed = ran.iter().filter(|r| !r.passes()).count();
    let form = match depth {
        Depth::Quick => "quick form",
        Depth::Full => "full form",
    };
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <title>Validation of Runout</title><style>\n{STYLE}</style></head><body>\n\
         <h1>Validation of Runout</h1>\n<p class=\"lead\">Version {}, kernel {}, {form} of {} cases</p>\n\
         <div class=\"answer\"><p><strong>{}</strong></p></div>\n",
        env!("CARGO_PKG_VERSION"),
        escape(kernel),
        ran.len(),
        match failed {
            0 => "Every check passes.".to_owned(),
            1 => "One case fails.".to_owned(),
            n => format!("{n} cases fail."),
        }
    );
    html.push_str(&from_table(&summary(ran)));
    html.push_str(&paragraph(
        "Every kernel gives the same bits, so that what holds for one holds for all. Errors are relative where the \
         tolerance is in percent. <i>info</i>: shown beside a reference, without a verdict.",
    ));
    for (ran, drawn) in ran.iter().zip(drawn) {
        html.push_str(&section(ran, drawn));
    }
    html + "</body></html>\n"
}

/// One row a case.
pub(super) fn summary(ran: &[Ran]) -> Table {
    let mut table = Table::new(["case", "what", "checks", "failed", "for information", "verdict", "seconds"]);
    for ran in ran {
        let information = ran.checks().iter().filter(|c| c.comparison == Comparison::Information).count();
        table.row([
            ran.case.name.to_owned(),
            ran.case.title.to_owned(),
            (ran.checks().len() - information).to_string(),
            ran.failures().to_string(),
            information.to_string(),
            if ran.passes() { "pass" } else { "FAIL" }.to_owned(),
            significant(ran.wall.as_secs_f64(), 2),
        ]);
    }
    table
}

fn section(ran: &Ran, drawn: &[Drawn]) -> String {
    let case = &ran.case;
    let mut html =
        format!("<section id=\"{0}\"><h2>{1} <code>{0}</code></h2>\n", escape(case.name), escape(case.title));
    html.push_str(&paragraph(escape(case.about)));
    match &ran.findings {
        Ok(findings) => {
            html.push_str(&from_table(&table(&findings.checks)));
            for note in &findings.notes {
                html.push_str(&paragraph(escape(note)));
            }
        }
        Err(message) => html.push_str(&paragraph(format!("<strong>FAIL</strong>: {}", escape(message)))),
    }
    for drawn in drawn {
        html.push_str(&figure(&drawn.embedded, &drawn.title));
    }
    html + "</section>\n"
}
