//! Damage to the files of a run directory: nothing recorded is lost while one of its two places holds it, what is lost of
//! both is said, and a campaign that is resumed ends with the same bytes.

mod ledger;

use ledger::{Ledger, REALISATIONS, draw, undisturbed};
use runout::store::log::Record;
use runout::store::scan::{Line, Place, scan};
use std::fs::{self, File, OpenOptions};
use std::path::Path;
use std::thread;
use std::time::Duration;

/// Outcomes recorded when the damage is done.
const BEFORE: u64 = 24;

fn damaged() -> (Ledger, Vec<u64>) {
    let ledger = Ledger::with(BEFORE);
    let (indices, notes) = ledger.look();
    assert!(indices.len() as u64 >= BEFORE && notes.is_empty(), "{notes:?}");
    (ledger, indices)
}

/// Whether any of the notes holds `text`.
fn says(notes: &[String], text: &str) -> bool {
    notes.iter().any(|note| note.contains(text))
}

fn cut(path: &Path, bytes: u64) {
    OpenOptions::new().write(true).open(path).and_then(|file| file.set_len(bytes)).expect("a file");
}

fn length(path: &Path) -> u64 {
    fs::metadata(path).expect("a file").len()
}

fn flip(path: &Path, bit: u64) {
    let mut bytes = fs::read(path).expect("a file");
    bytes[(bit / 8) as usize] ^= 1 << (bit % 8);
    fs::write(path, bytes).expect("a file");
}

/// Names of sled's snapshots of its page table.
fn snapshots(ledger: &Ledger) -> Vec<std::path::PathBuf> {
    let entries =
        fs::read_dir(ledger.store()).expect("a folder").map(|entry| entry.expect("an entry").path());
    entries.filter(|path| path.to_string_lossy().contains("snap.")).collect()
}

#[test]
fn sled_damaged_in_each_known_way_is_rebuilt_from_the_log() {
    type Damage = fn(&Ledger);
    let cases: [(&str, Damage, &str); 12] = [
        ("a stale snapshot", |l| fs::write(l.store().join("snap.00.generating"), "").unwrap(), "stale"),
        ("data cut to half", |l| cut(&l.store().join("db"), length(&l.store().join("db")) / 2), ""),
        ("data cut to a byte", |l| cut(&l.store().join("db"), 1), "restored"),
        ("data cut to nothing", |l| cut(&l.store().join("db"), 0), "restored"),
        (
            "data zeroed",
            |l| {
                let db = l.store().join("db");
                let bytes = vec![0; length(&db) as usize];
                fs::write(db, bytes).unwrap();
            },
            "restored",
        ),
        ("data gone", |l| fs::remove_file(l.store().join("db")).unwrap(), "restored"),
        ("settings gone", |l| fs::remove_file(l.store().join("conf")).unwrap(), ""),
        ("settings cut", |l| cut(&l.store().join("conf"), 3), ""),
        ("snapshots gone", |l| snapshots(l).iter().for_each(|s| fs::remove_file(s).unwrap()), ""),
        ("snapshots cut", |l| snapshots(l).iter().for_each(|s| cut(s, length(s) / 2)), ""),
        (
            "the folder empty",
            |l| {
                fs::remove_dir_all(l.store()).unwrap();
                fs::create_dir(l.store()).unwrap()
            },
            "restored",
        ),
        ("the folder gone", |l| fs::remove_dir_all(l.store()).unwrap(), "restored"),
    ];
    let undisturbed = undisturbed();
    for (what, damage, expected) in cases {
        let (ledger, before) = damaged();
        damage(&ledger);
        let (after, notes) = ledger.look();
        assert_eq!(after, before, "{what}: {notes:?}");
        assert!(expected.is_empty() || says(&notes, expected), "{what}: {notes:?}");
        // What was rebuilt stays: the next one that opens it has nothing to say.
        assert_eq!(ledger.look(), (before, Vec::new()), "{what}");
        assert_eq!(ledger.finish(), undisturbed, "{what}");
    }
}

/// Wherever a bit of sled's data flips, every outcome is still there.
#[test]
fn bits_that_flip_in_sled_cost_nothing() {
    let (ledger, before) = damaged();
    let whole = ledger.files();
    let undisturbed = undisturbed();
    let mut rebuilt = 0;
    for round in 0..40 {
        ledger.put(&whole);
        let db = ledger.store().join("db");
        // Most of the file is room for later; a flip among the used bytes matters.
        let used = fs::read(&db).expect("a file").iter().rposition(|b| *b != 0).expect("it holds something");
        flip(&db, draw("flip in sled", round) % (8 * (used as u64 + 1)));
        let (after, notes) = ledger.look();
        assert_eq!(after, before, "round {round}: {notes:?}");
        rebuilt += u64::from(says(&notes, "restored"));
        if round % 8 == 0 {
            assert_eq!(ledger.finish(), undisturbed, "round {round}");
        }
    }
    assert!(rebuilt > 0, "no flip was noticed: they hit nothing");
}

#[test]
fn a_lock_that_is_held_for_a_moment_is_waited_for() {
    let (ledger, before) = damaged();
    let held = File::options().read(true).write(true).open(ledger.store().join("db")).expect("a file");
    held.lock().expect("nobody else holds it");
    let release = thread::spawn(move || {
        // Long enough that the other side finds it held; how long does not matter.
        thread::sleep(Duration::from_millis(300));
        drop(held);
    });
    assert_eq!(ledger.look(), (before, Vec::new()));
    release.join().expect("it ends");
}

/// Sound entries of a log's bytes, and whether anything of it is said to be off.
fn read(bytes: &[u8]) -> (usize, bool) {
    let mut entries = 0;
    let scan = scan(bytes, Place::default(), |_: Line<'_, Record>| {
        entries += 1;
        Ok(())
    });
    let scan = scan.expect("bytes in memory are read");
    (entries, !scan.is_sound() || scan.unfinished_bytes > 0 || scan.missing_line_end)
}

/// Every number of bytes from 1 to five lines and more.
#[test]
fn a_log_cut_anywhere_is_read_up_to_the_cut() {
    let (ledger, before) = damaged();
    let bytes = fs::read(ledger.log()).expect("a file");
    let line_ends: Vec<usize> =
        bytes.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(place, _)| place).collect();
    let first = line_ends[line_ends.len() - 6];
    for kept in first..bytes.len() {
        // A line is whole with its last byte before the line end.
        let whole = line_ends.iter().filter(|end| **end <= kept).count();
        let at_a_line = line_ends.iter().any(|end| end + 1 == kept);
        assert_eq!(read(&bytes[..kept]), (whole, !at_a_line), "{kept} of {} bytes", bytes.len());
    }

    let undisturbed = undisturbed();
    let whole = ledger.files();
    for (round, kept) in (first..bytes.len()).step_by(199).enumerate() {
        // With sled, nothing is missing, and it is said.
        ledger.put(&whole);
        cut(&ledger.log(), kept as u64);
        let (after, notes) = ledger.look();
        assert_eq!(after, before, "{notes:?}");
        let missing = line_ends.iter().filter(|end| **end > kept).count();
        assert!(missing == 0 || says(&notes, &format!("{missing} outcomes restored from sled")), "{notes:?}");
        assert_eq!(ledger.look(), (before.clone(), Vec::new()));
        // Without it, exactly what was cut off is missing, and is run again.
        ledger.put(&whole);
        cut(&ledger.log(), kept as u64);
        fs::remove_dir_all(ledger.store()).expect("a folder");
        let (after, notes) = ledger.look();
        assert_eq!(after.len(), before.len() - missing, "{notes:?}");
        assert!(says(&notes, "torn") || says(&notes, "line end") || !read(&bytes[..kept]).1, "{notes:?}");
        if round % 4 == 0 {
            assert_eq!(ledger.finish(), undisturbed);
        }
    }
}

/// Zeroed blocks and flipped bits, in the middle and in the tail of the log.
#[test]
fn a_log_with_holes_loses_nothing_that_sled_holds() {
    let (ledger, before) = damaged();
    let whole = ledger.files();
    let bytes = fs::read(ledger.log()).expect("a file");
    let undisturbed = undisturbed();
    for round in 0..30 {
        let mut holed = bytes.clone();
        let place = (draw("place", round) % bytes.len() as u64) as usize;
        match round % 3 {
            // A block of the disk.
            0 => holed[place..(place + 512).min(bytes.len())].fill(0),
            // From somewhere to the end.
            1 => holed[place.max(bytes.len() / 2)..].fill(0),
            _ => holed[place] ^= 1 << (round % 8),
        }
        let (sound, off) = read(&holed);
        assert!(off, "round {round}: nothing is said");
        for with_sled in [true, false] {
            ledger.put(&whole);
            fs::write(ledger.log(), &holed).expect("a file");
            if !with_sled {
                fs::remove_dir_all(ledger.store()).expect("a folder");
            }
            let (after, notes) = ledger.look();
            let expected = if with_sled { before.len() } else { sound };
            assert_eq!(after.len(), expected, "round {round}, sled {with_sled}: {notes:?}");
            assert!(says(&notes, "outcomes.log: "), "round {round}: {notes:?}");
            assert!(says(&notes, "the damaged log is kept as"), "round {round}: {notes:?}");
            if round % 6 < 3 {
                assert_eq!(ledger.finish(), undisturbed, "round {round}, sled {with_sled}");
            }
        }
    }
}

#[test]
fn a_log_that_is_gone_is_written_anew_from_sled() {
    let (ledger, before) = damaged();
    fs::remove_file(ledger.log()).expect("a file");
    let (after, notes) = ledger.look();
    assert_eq!(after, before);
    assert_eq!(notes, [format!("outcomes.log: {} outcomes restored from sled", before.len())]);
    assert_eq!(ledger.finish(), undisturbed());
}

/// With both places gone, the campaign begins anew and ends the same.
#[test]
fn without_any_record_the_campaign_is_run_again() {
    let (ledger, _) = damaged();
    fs::remove_file(ledger.log()).expect("a file");
    fs::remove_dir_all(ledger.store()).expect("a folder");
    assert_eq!(ledger.look().0, Vec::<u64>::new());
    let results = ledger.finish();
    assert_eq!(results.lines().count() as u64, REALISATIONS);
    assert_eq!(results, undisturbed());
}
