//! Power cuts at 30 points of a campaign: what was not synced is lost, torn or half there.
//!
//! After every commit of a campaign, which is when its acknowledgements are sent, all files are recorded: everything in
//! them has been synced. A cut between two such moments leaves what was synced at the first one and any part of what
//! was written since. It is simulated block by block: each block of 512 bytes that differs is the old one, the new one
//! or, where there was none before, zeros; a file that grew has any length between; one that is new may be missing. The
//! store syncs the outcome log before it touches sled, so that a cut either catches the log, with sled as before, or
//! sled, with the log complete.
//!
//! What this shows: whatever a disk that honours a sync does with the rest, every acknowledged outcome is there again,
//! no outcome is wrong, and the campaign ends with the same bytes. What it does not show: that the kernel and the disk
//! honour a sync (they must), damage to the file system itself, or a block torn within its 512 bytes.

mod ledger;

use ledger::{Ledger, draw, undisturbed};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const CUTS: u64 = 30;
const BLOCK: usize = 512;

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Numbers that follow from a seed.
struct Luck {
    cut: u64,
    drawn: u64,
}

impl Luck {
    fn below(&mut self, bound: usize) -> usize {
        self.drawn += 1;
        (draw(&format!("cut {}", self.cut), self.drawn) % bound.max(1) as u64) as usize
    }
}

/// A file of which `before` was synced and any part of `after` may have reached the disk.
fn half_written(before: &[u8], after: &[u8], luck: &mut Luck) -> Vec<u8> {
    let length = match luck.below(3) {
        0 => before.len(),
        1 => after.len(),
        _ => before.len().min(after.len()) + luck.below(before.len().abs_diff(after.len()) + 1),
    };
    let mut file = before.to_vec();
    file.resize(length, 0);
    // In some cuts nearly nothing has arrived, in others nearly everything.
    let share = luck.below(101);
    for from in (0..length).step_by(BLOCK) {
        let to = (from + BLOCK).min(length).min(after.len());
        if from < to && luck.below(100) < share {
            file[from..to].copy_from_slice(&after[from..to]);
        }
    }
    file
}

/// The files that a cut leaves.
fn cut(before: &Files, after: &Files, log: &Path, luck: &mut Luck) -> Files {
    let in_log = luck.below(2) == 0 && before.get(log) != after.get(log);
    let names: BTreeSet<&PathBuf> = before.keys().chain(after.keys()).collect();
    let mut left = Files::new();
    for name in names {
        let (old, new) = (before.get(name), after.get(name));
        let reached = match (name == log, in_log) {
            (true, true) | (false, false) => {
                // One that is new may not have its name yet, one that was removed may have it still.
                let there = (old.is_some() && new.is_some()) || luck.below(2) == 0;
                let empty = Vec::new();
                let old_or = old.unwrap_or(&empty);
                there.then(|| half_written(old_or, new.unwrap_or(old_or), luck))
            }
            // Synced before sled is touched.
            (true, false) => new.cloned(),
            (false, true) => old.cloned(),
        };
        left.extend(reached.map(|bytes| (name.clone(), bytes)));
    }
    left
}

fn indices(ledger: &Ledger, files: &Files) -> BTreeSet<u64> {
    ledger.put(files);
    ledger.look().0.into_iter().collect()
}

#[test]
fn thirty_power_cuts_lose_nothing_that_was_acknowledged() {
    let undisturbed = undisturbed();
    let ledger = Ledger::new();
    let mut moments = vec![ledger.files()];
    ledger.drive(u64::MAX, |_| moments.push(ledger.files()));
    assert!(moments.len() as u64 > 20, "{} commits", moments.len());
    let mut repaired = 0;
    for number in 0..CUTS {
        let mut luck = Luck { cut: number, drawn: 0 };
        let at = luck.below(moments.len() - 1);
        let (before, after) = (&moments[at], &moments[at + 1]);
        let acknowledged = indices(&ledger, before);
        let written = indices(&ledger, after);
        ledger.put(&cut(before, after, &ledger.log(), &mut luck));
        let (found, notes) = ledger.look();
        let found: BTreeSet<u64> = found.into_iter().collect();
        assert!(found.is_superset(&acknowledged), "cut {number} after commit {at} lost some: {notes:?}");
        assert!(found.is_subset(&written), "cut {number} after commit {at} made some up: {notes:?}");
        repaired += u64::from(!notes.is_empty());
        assert_eq!(ledger.finish(), undisturbed, "cut {number} after commit {at}: {notes:?}");
    }
    assert!(repaired > 0, "no cut left anything to repair: they hit nothing");
}
