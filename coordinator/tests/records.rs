//! The commands that look after a run directory: verify, explain, workers, retry, and its tables.

mod ledger;

use ledger::{Ledger, REALISATIONS, outcome, undisturbed};
use runout::engine::poison;
use runout::events::{Events, What};
use runout::outcomes::COLUMNS;
use runout::run_directory;
use runout::status::{cache, tally};
use runout::store::Store;
use runout::store::log::{Entry, Record};
use runout_core::outcome::{OutcomeKind, Reason};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output};

fn runout(ledger: &Ledger, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_runout"));
    command.current_dir(ledger.dir()).args(arguments).env_remove("RUST_LOG").output().expect("it starts")
}

/// Standard output of a command that must end with `code`.
fn said(ledger: &Ledger, code: i32, arguments: &[&str]) -> String {
    let output = runout(ledger, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}{errors}");
    text.into_owned()
}

fn refused(ledger: &Ledger, code: i32, arguments: &[&str]) -> String {
    let output = runout(ledger, arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}");
    assert!(output.stdout.is_empty());
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn document(ledger: &Ledger, code: i32, arguments: &[&str]) -> Value {
    serde_json::from_str(&said(ledger, code, arguments)).expect("one JSON document and nothing else")
}

fn findings(ledger: &Ledger) -> Vec<String> {
    let document = document(ledger, 1, &["verify", ".", "--json"]);
    assert_eq!(document["sound"], false);
    serde_json::from_value(document["findings"].clone()).expect("a list of texts")
}

fn commit(ledger: &Ledger, entries: &[Entry]) {
    Store::open(&ledger.dir()).expect("it opens").0.commit(entries, &[]).expect("there is room");
}

fn record(index: u64) -> Record {
    Record { outcome: outcome(index), attempt: 1, worker: "maker".to_owned(), wall_s: 0.5 }
}

fn append(path: &Path, text: &str) {
    let mut file = fs::OpenOptions::new().append(true).create(true).open(path).expect("a file");
    file.write_all(text.as_bytes()).expect("there is room");
}

#[test]
fn a_sound_directory_is_sound_and_left_as_it_is() {
    let ledger = Ledger::with(20);
    let before = ledger.files();
    let document = document(&ledger, 0, &["verify", ".", "--json"]);
    assert_eq!(document["sound"], true);
    assert_eq!(document["outcomes"], document["stored"]);
    assert_eq!(document["outcomes"], document["results"]);
    assert!(said(&ledger, 0, &["verify", "."]).starts_with(".: sound\n"));
    assert_eq!(ledger.files(), before, "verify has changed something");

    // While a coordinator works on it, only the log is read.
    let lock = run_directory::lock(&ledger.dir()).expect("nobody else has it");
    let document = self::document(&ledger, 0, &["verify", ".", "--json"]);
    assert!(document["stored"].is_null());
    assert!(document["not_checked"][0].as_str().expect("a text").contains("only the log was read"));
    drop(lock);
}

#[test]
fn every_kind_of_damage_is_a_finding() {
    let ledger = Ledger::with(20);
    let whole = ledger.files();
    let log = fs::read_to_string(ledger.log()).expect("a file");
    let lines: Vec<&str> = log.lines().collect();
    let expect = |change: &dyn Fn(), finding: &str| {
        ledger.put(&whole);
        change();
        let found = findings(&ledger);
        assert!(found.iter().any(|f| f.contains(finding)), "{finding}: {found:?}");
    };
    let without = |line: usize| {
        let kept: String =
            lines.iter().enumerate().filter(|(n, _)| *n != line).map(|(_, l)| format!("{l}\n")).collect();
        kept
    };
    let again = |record: &Record| runout::store::log::line(&Entry::Outcome(record.clone()));
    let altered = |change: &dyn Fn(&mut Record)| {
        let mut altered = record(3);
        change(&mut altered);
        let place = lines.iter().position(|line| line.contains("\"index\":3,")).expect("it is recorded");
        log.replace(&format!("{}\n", lines[place]), &again(&altered))
    };
    let write = |text: String| fs::write(ledger.log(), text).expect("there is room");

    expect(&|| write(log.replacen("\"index\":2,", "\"index\":9,", 1)), "checksum or form is wrong");
    expect(&|| write(log[..log.len() - 9].to_owned()), "the last line is torn");
    expect(&|| write(log[..log.len() - 1].to_owned()), "the last line end is missing");
    expect(&|| write(without(4)), "outcomes that outcomes.log has not: ");
    expect(&|| write(format!("{log}{}", again(&record(40)))), "lacks 1 outcomes of outcomes.log: 40");
    expect(&|| write(format!("{log}{}", again(&record(3)))), "recorded again, and was not withdrawn before");
    expect(&|| write(altered(&|r| r.wall_s = 9.0)), "1 outcomes differ from outcomes.log: 3");
    expect(
        &|| write(altered(&|r| r.outcome.measures.as_mut().unwrap().toe_advance_m = -1.0)),
        "measures.toe_advance_m = -1",
    );
    expect(&|| write(altered(&|r| r.outcome.outcome = OutcomeKind::Stable)), "its runout says otherwise");
    expect(&|| write(altered(&|r| r.outcome.reason = Reason::LeftGrid)), "runout does not end as left-grid");
    expect(&|| write(altered(&|r| r.outcome.digest = "x".repeat(32))), "outcome.digest = x");
    let audit = runout::store::log::line(&Entry::Audit { index: 50, worker: "b".into() });
    expect(&|| write(format!("{log}{audit}")), "an audit of realisation 50, which is not recorded");
    let other = Entry::Withdrawn { index: 2, attempt: 7, digest: "d".into() };
    let other = runout::store::log::line(&other);
    expect(&|| write(format!("{log}{other}")), "a withdrawal of another outcome of realisation 2");
    let mut conflict = record(2);
    conflict.outcome.digest = "f".repeat(32);
    let conflict = runout::store::log::line(&Entry::Conflict(conflict));
    expect(&|| write(format!("{log}{conflict}")), "one of the machines computes wrongly");
    expect(&|| fs::remove_dir_all(ledger.store()).unwrap(), "there is no such folder");
    expect(&|| fs::write(ledger.store().join("db"), "").unwrap(), "lacks ");
    let campaign = ledger.dir().join("campaign.toml");
    let spec = ledger.dir().join("spec.json");
    let reseeded = fs::read_to_string(&campaign).expect("a file").replace("seed = 7", "seed = 8");
    expect(&|| fs::write(&campaign, &reseeded).unwrap(), "do not freeze to spec.json");
    let changed = fs::read_to_string(&spec).expect("a file").replace("\"seed\": 7", "\"seed\": 8");
    expect(&|| fs::write(&spec, &changed).unwrap(), "the file was changed");
    refused(&ledger, 2, &["verify", "store"]);
}

#[test]
fn what_was_given_up_is_retried_and_the_rest_only_on_demand() {
    let ledger = Ledger::new();
    // Realisation 2 took workers down; 10 and others fail numerically.
    commit(&ledger, &[poison(2)]);
    ledger.drive(30, |_| {});
    let document = document(&ledger, 0, &["retry", ".", "--failed", "--json"]);
    assert_eq!(document["reopened"], serde_json::json!([2]));
    assert!(document["left"].as_array().expect("a list").contains(&Value::from(10)));
    // Estimates end before the gap until it is filled; nothing else has changed.
    let status = self::document(&ledger, 0, &["status", ".", "--json"]);
    assert_eq!(status["realisations"], 2);
    assert_eq!(self::document(&ledger, 0, &["verify", ".", "--json"])["withdrawn"], 1);
    assert!(said(&ledger, 0, &["retry", ".", "--failed"]).starts_with("nothing to re-open\nleft "));
    let explained = said(&ledger, 0, &["explain", ".", "2"]);
    assert!(explained.contains("open; it is the first one missing"), "{explained}");
    assert!(explained.contains("withdrawn outcome: failed (poison)"), "{explained}");
    assert_eq!(ledger.finish(), undisturbed());
    assert_eq!(self::document(&ledger, 0, &["verify", ".", "--json"])["sound"], true);

    let again = self::document(&ledger, 0, &["retry", ".", "--failed", "--numerical", "--json"]);
    let reopened = again["reopened"].as_array().expect("a list").len() as u64;
    assert_eq!(
        reopened,
        (0..REALISATIONS).filter(|i| outcome(*i).outcome == OutcomeKind::Failed).count() as u64
    );
    assert_eq!(ledger.finish(), undisturbed());

    let _lock = run_directory::lock(&ledger.dir()).expect("nobody else has it");
    let said = refused(&ledger, 2, &["retry", ".", "--failed"]);
    assert!(said.contains("another coordinator is working on this run directory"), "{said}");
    refused(&ledger, 2, &["retry", "."]);
}

#[test]
fn a_realisation_tells_its_history() {
    let ledger = Ledger::with(20);
    let events = Events::open(&ledger.dir());
    let (a, b) = ("node-a".to_owned(), "node-b".to_owned());
    events.note(What::Registered { worker: a.clone(), slots: 4, held: 0, machine: None });
    events.note(What::Leased { index: 3, attempt: 1, worker: a.clone() });
    events.note(What::WorkerLost { worker: a });
    events.note(What::Leased { index: 3, attempt: 2, worker: b.clone() });
    events.note(What::Recorded {
        index: 3,
        attempt: 2,
        worker: b.clone(),
        reason: Reason::AtRest,
        wall_s: 0.5,
    });
    events.note(What::Leased { index: 25, attempt: 1, worker: b });
    commit(&ledger, &[Entry::Audit { index: 3, worker: "node-c".into() }]);

    let text = said(&ledger, 0, &["explain", ".", "3"]);
    for part in [
        "results, counted as a sample of the runout",
        "attempt 1 on node-a",
        "lost: the worker died or was not heard of any more",
        "attempt 2 on node-b",
        "run twice with the same bits, the second time on node-c",
        "unexpected losses: 1",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let document = document(&ledger, 0, &["explain", ".", "3", "--json"]);
    assert_eq!((&document["sample"], &document["losses"]), (&Value::from(true), &Value::from(1)));
    assert_eq!(document["attempts"].as_array().expect("a list").len(), 2);
    let stable = said(&ledger, 0, &["explain", ".", "4"]);
    assert!(stable.contains("counted as a slope that stood"), "{stable}");
    let open = said(&ledger, 0, &["explain", ".", "25"]);
    assert!(
        open.contains("realisation 25: open\n") && open.contains("it runs, or its coordinator"),
        "{open}"
    );
    let said = refused(&ledger, 2, &["explain", ".", "1000"]);
    assert!(said.contains("it has at most 60, from 0"), "{said}");
}

#[test]
fn workers_are_listed_with_what_they_did() {
    let ledger = Ledger::with(20);
    let events = Events::open(&ledger.dir());
    events.note(What::Registered { worker: "maker".into(), slots: 4, held: 0, machine: None });
    events.note(What::Leased { index: 50, attempt: 1, worker: "maker".into() });
    events.note(What::Hung { index: 50, worker: "maker".into() });
    let document = document(&ledger, 0, &["workers", ".", "--json"]);
    let [maker] = document.as_array().expect("a list").as_slice() else { panic!("{document}") };
    assert_eq!(
        (&maker["worker"], &maker["slots"], &maker["losses"]),
        (&"maker".into(), &4.into(), &1.into())
    );
    let realisations = maker["realisations"].as_u64().expect("a number");
    assert_eq!(maker["wall_s"].as_f64(), Some(0.5 * realisations as f64));
    assert!(maker["last_seen"].as_str().expect("a time").ends_with('Z'));
    let table = said(&ledger, 0, &["workers", "."]);
    assert!(table.starts_with("worker") && table.contains("maker"), "{table}");
}

#[test]
fn the_schema_describes_the_table_in_every_format() {
    let ledger = Ledger::with(20);
    let schema = document(&ledger, 0, &["results", "--schema"]);
    let columns = schema["columns"].as_array().expect("a list");
    let names: Vec<&str> = columns.iter().map(|c| c["name"].as_str().expect("a name")).collect();
    let csv = said(&ledger, 0, &["results", "."]);
    let header: Vec<&str> = csv.lines().next().expect("a header").split(',').collect();
    let flat =
        columns.iter().zip(&names).filter(|(column, _)| column["in_csv"] == true).map(|(_, name)| *name);
    assert_eq!(header, flat.collect::<Vec<_>>());
    assert_eq!(names.len() - header.len(), 3);
    let rows = document(&ledger, 0, &["results", ".", "--format", "json"]);
    for row in rows.as_array().expect("a list") {
        assert_eq!(row.as_object().expect("an object").len(), names.len());
        for (column, name) in columns.iter().zip(&names) {
            let cell = &row[name];
            let sound = match column["type"].as_str().expect("a type") {
                "text" => cell.as_str().is_some_and(|text| !text.is_empty()),
                "integer" => cell.is_u64(),
                "list of integers" => cell.as_array().is_some_and(|list| list.iter().all(Value::is_u64)),
                _ => cell.is_f64(),
            };
            assert!(sound || cell.is_null() && !column["missing"].is_null(), "{name}: {cell}");
        }
    }
    // A failed analysis has no measures: empty, not 0.
    let failed = csv.lines().find(|line| line.contains(",failed,")).expect("one fails");
    assert!(failed.contains(",failed,,,,,,,,"), "{failed}");
    said(&ledger, 0, &["results", ".", "--format", "parquet", "--out", "outcomes.parquet"]);
    let bytes = fs::read(ledger.dir().join("outcomes.parquet")).expect("it is written");
    assert_eq!((&bytes[..4], &bytes[bytes.len() - 4..]), (&b"PAR1"[..], &b"PAR1"[..]));
    let redirected = runout(&ledger, &["results", ".", "--format", "parquet"]);
    assert_eq!(redirected.stdout, bytes);
}

/// The profiles' CSV holds what JSON holds in lists; of a campaign without profiles it is refused.
#[test]
fn profiles_have_a_table_of_their_own() {
    let ledger = Ledger::with(20);
    let csv = said(&ledger, 0, &["results", ".", "--profiles"]);
    let rows = document(&ledger, 0, &["results", ".", "--format", "json"]);
    let columns = |row: &Value| {
        let length = |name: &str| row[name].as_array().map_or(0, Vec::len);
        length("deposit_depth_mm").max(length("highest_speed_mm_s"))
    };
    let expected: usize = rows.as_array().expect("a list").iter().map(columns).sum();
    assert!(expected > 60, "{expected}");
    assert_eq!(csv.lines().count(), 1 + expected);
    assert!(csv.contains("\n0,0.0,0.5,1.5,") && csv.contains("\n0,0.5,1.0,1.5,"), "{csv}");

    let text = said(&ledger, 0, &["explain", ".", "0"]);
    assert!(text.contains("in front of the toe, at most 1.50 m deep, passed at up to"), "{text}");
}

/// As people read it; where Python and pyarrow are installed.
#[test]
fn pyarrow_reads_the_table() {
    let ledger = Ledger::with(20);
    said(&ledger, 0, &["results", ".", "--format", "parquet", "--out", "t.parquet"]);
    let script = "
import json, sys
try:
    import pyarrow.parquet as pq
except ImportError:
    print('missing'); sys.exit()
table = pq.read_table('t.parquet')
meta = {k.decode(): v.decode() for k, v in table.schema.metadata.items()}
schema = json.loads(meta['runout.schema'])
print(json.dumps({'names': table.column_names, 'rows': table.num_rows,
    'types': [str(f.type) for f in table.schema], 'described': len(schema['columns']),
    'depths': table.column('deposit_depth_mm').to_pylist(),
    'nulls': table.column('toe_advance_m').null_count}))
";
    let Ok(output) = Command::new("python3").current_dir(ledger.dir()).args(["-c", script]).output() else {
        eprintln!("SKIPPED: there is no python3");
        return;
    };
    let text = String::from_utf8_lossy(&output.stdout);
    if text.trim() == "missing" {
        eprintln!("SKIPPED: python3 has no pyarrow");
        return;
    }
    let read: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {output:?}"));
    let rows = read["rows"].as_u64().expect("a number");
    let failed = (0..rows).filter(|index| outcome(*index).outcome == OutcomeKind::Failed).count();
    assert_eq!(read["names"], serde_json::json!(COLUMNS.map(|column| column.name)));
    assert_eq!((&read["described"], &read["nulls"]), (&COLUMNS.len().into(), &failed.into()));
    assert_eq!(
        (&read["types"][0], &read["types"][1], &read["types"][2]),
        (&"int64".into(), &"string".into(), &"double".into())
    );
    let depths = |index| outcome(index).profile.map(|profile| profile.depth_mm);
    assert_eq!(read["depths"], serde_json::json!((0..rows).map(depths).collect::<Vec<_>>()));
}

/// Cached estimates tell the same as the whole log, and are not taken when they do not belong to it.
#[test]
fn cached_estimates_are_those_of_the_log_or_not_taken() {
    let ledger = Ledger::with(20);
    let frame = run_directory::read_frame(&ledger.dir()).expect("it is a run directory");
    let campaign = runout::status::campaign_of_frame(&frame, &ledger.dir()).expect("the fixture is sound");
    let key = cache::key(&frame);
    let full = || tally::read(&ledger.dir(), &key, &campaign).expect("it can be read");
    let (at_20, _) = full();
    let (store, _) = Store::open(&ledger.dir()).expect("it opens");
    let end = store.end();
    drop(store);
    cache::save(&ledger.dir(), &key, &at_20, end).expect("there is room");
    let load = || cache::load(&ledger.dir(), &key, &campaign);
    let estimate =
        |tally: &tally::Tally| (tally.estimator().estimate(), tally.ahead(), tally.estimator().decision());
    assert_eq!(load().map(|(tally, place)| (estimate(&tally), place)), Some((estimate(&at_20), end)));

    // More is recorded: the rest of the log is read on top.
    ledger.drive(40, |_| {});
    let cached = fs::read(ledger.dir().join(cache::CACHE_FILE)).expect("it is there");
    let with_cache = full().0;
    fs::remove_file(ledger.dir().join(cache::CACHE_FILE)).expect("it is there");
    let without = full().0;
    assert_eq!(estimate(&with_cache), estimate(&without));
    assert!(without.estimator().realisations() > at_20.estimator().realisations());

    let put = |bytes: &[u8]| fs::write(ledger.dir().join(cache::CACHE_FILE), bytes).expect("there is room");
    put(&cached);
    assert!(load().is_some());
    // Of another campaign file.
    assert!(cache::load(&ledger.dir(), &cache::key_of("another", ""), &campaign).is_none());
    // Damaged, cut, empty.
    for place in (0..cached.len()).step_by(37) {
        let mut bytes = cached.clone();
        bytes[place] ^= 4;
        put(&bytes);
        assert!(load().is_none(), "byte {place}");
    }
    put(&cached[..cached.len() - 8]);
    assert!(load().is_none());
    put(b"");
    assert!(load().is_none());
    // The log is shorter than then, or its end is another.
    put(&cached);
    let log = fs::read(ledger.log()).expect("a file");
    fs::write(ledger.log(), &log[..end.bytes as usize - 1]).expect("there is room");
    assert!(load().is_none());
    let mut other = log.clone();
    other[end.bytes as usize - 100] ^= 1;
    fs::write(ledger.log(), &other).expect("there is room");
    assert!(load().is_none());
    // What was folded is withdrawn: all of the log is read.
    fs::write(ledger.log(), &log).expect("there is room");
    let named = Entry::Withdrawn { index: 3, attempt: 1, digest: outcome(3).digest };
    append(&ledger.log(), &runout::store::log::line(&named));
    assert!(load().is_some());
    assert_eq!(full().0.estimator().realisations(), 3);
    // One whose estimates are not the log's is a finding.
    fs::write(ledger.log(), &log).expect("there is room");
    let mut wrong = tally::Tally::new(&campaign);
    for index in 0..at_20.estimator().realisations() {
        let mut record = record(index);
        if let Some(measures) = &mut record.outcome.measures {
            measures.displacement_q999_m += 1.0;
        }
        let gist = runout::store::wire::Gist::of(&record).expect("its digest is one");
        wrong.push(&Entry::Outcome(gist)).expect("nothing is withdrawn");
    }
    cache::save(&ledger.dir(), &key, &wrong, end).expect("there is room");
    let found = findings(&ledger);
    assert!(found.iter().any(|f| f.contains("estimates.cache: not the log's estimates")), "{found:?}");
}
