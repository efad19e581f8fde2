//! Which of several contradicting outcomes of one realisation counts, and whose results are doubtful.
//!
//! The same (spec, index) gives the same bits on a sound machine, so two digests mean that one machine computes
//! wrongly, and who came first says nothing about which. A third run by another worker decides. A ruling follows
//! from the opinions in the outcome log alone: a restarted coordinator, `status` and `results` come to the same one.
//!
//! A worker that is overruled is set aside. What it has recorded and nobody else has confirmed is doubtful and is run
//! again; where the new bits differ, they replace the recorded ones.
//!
//! Workers are told apart by their names. Two that compute the same wrong bits outvote a sound one: the fingerprint
//! at registration and the variety of machines stand against that, not this module.

use crate::store::Contents;
use crate::store::wire::Form;
use std::collections::{BTreeMap, BTreeSet};

/// What one worker says about one realisation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Opinion {
    /// Who says it.
    pub worker: String,
    /// In which attempt.
    pub attempt: u32,
    /// Digest of its outcome.
    pub digest: String,
}

impl Opinion {
    /// The opinion that a record is.
    pub fn of(record: &impl Form) -> Opinion {
        Opinion {
            worker: record.worker().to_owned(),
            attempt: record.attempt(),
            digest: record.digest().into_owned(),
        }
    }
}

/// Opinions on contested realisations, by index; the first of each is the outcome that was recorded first.
pub type Disputes = BTreeMap<u64, Vec<Opinion>>;

/// What follows from the opinions.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Rulings {
    /// Names of the workers that compute wrongly.
    pub set_aside: BTreeSet<String>,
    /// Digest of the outcome that counts, by index. A contested index that is missing waits for another opinion.
    pub decided: BTreeMap<u64, String>,
}

/// Rules on all disputes together: a worker overruled in one has no say in the others.
pub fn rule(disputes: &Disputes) -> Rulings {
    let mut set_aside: BTreeSet<String> = disputes.values().flat_map(|opinions| fickle(opinions)).collect();
    loop {
        let overruled: BTreeSet<String> = disputes
            .values()
            .filter_map(|opinions| Some((opinions, verdict(opinions, &set_aside)?)))
            .flat_map(|(opinions, digest)| {
                opinions.iter().filter(move |o| o.digest != digest).map(|o| o.worker.clone())
            })
            .filter(|worker| !set_aside.contains(worker))
            .collect();
        if overruled.is_empty() {
            break;
        }
        set_aside.extend(overruled);
    }
    let decided = disputes
        .iter()
        .filter_map(|(index, opinions)| Some((*index, verdict(opinions, &set_aside)?.to_owned())))
        .collect();
    Rulings { set_aside, decided }
}

/// Workers that contradict themselves: faulty whoever is right.
fn fickle(opinions: &[Opinion]) -> impl Iterator<Item = String> {
    opinions
        .iter()
        .filter(|o| opinions.iter().any(|other| other.worker == o.worker && other.digest != o.digest))
        .map(|o| o.worker.clone())
}

/// The digest that most trusted workers found: at least two of them, or the only one that trusted workers found.
fn verdict<'a>(opinions: &'a [Opinion], set_aside: &BTreeSet<String>) -> Option<&'a str> {
    let mut voters: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for opinion in opinions.iter().filter(|o| !set_aside.contains(&o.worker)) {
        voters.entry(&opinion.digest).or_default().insert(&opinion.worker);
    }
    let mut by_votes: Vec<(usize, &str)> =
        voters.into_iter().map(|(digest, who)| (who.len(), digest)).collect();
    by_votes.sort_unstable_by_key(|(votes, _)| std::cmp::Reverse(*votes));
    match by_votes[..] {
        [(_, only)] => Some(only),
        [(most, digest), (next, _), ..] if most >= 2 && most > next => Some(digest),
        _ => None,
    }
}

/// Rules on what a store holds: replaces records that are overruled, and names workers and outcomes in doubt.
pub fn apply<R: Form>(contents: &mut Contents<R>) {
    let records = contradicting(contents);
    contents.disputes =
        records.iter().map(|(index, all)| (*index, all.iter().map(Opinion::of).collect())).collect();
    for (index, worker) in &contents.audits {
        if let Some(opinions) = contents.disputes.get_mut(index) {
            let digest = opinions[0].digest.clone();
            opinions.push(Opinion { worker: worker.clone(), attempt: 0, digest });
        }
    }
    if contents.disputes.is_empty() {
        return;
    }
    let rulings = rule(&contents.disputes);
    for (index, digest) in &rulings.decided {
        let found = records[index].iter().find(|record| record.digest() == *digest);
        let counts = found.expect("a verdict is one of the opinions");
        let place = contents.records.binary_search_by_key(index, Form::index);
        let recorded = &mut contents.records[place.expect("a contested outcome is recorded")];
        if recorded.digest() != *digest {
            contents.overruled.push(std::mem::replace(recorded, counts.clone()));
        }
    }
    let vouched: BTreeSet<u64> = contents
        .audits
        .iter()
        .filter(|(_, worker)| !rulings.set_aside.contains(worker))
        .map(|(index, _)| *index)
        .collect();
    let doubtful = |record: &&R| match contents.disputes.contains_key(&record.index()) {
        true => !rulings.decided.contains_key(&record.index()),
        false => rulings.set_aside.contains(record.worker()) && !vouched.contains(&record.index()),
    };
    contents.doubtful = contents.records.iter().filter(doubtful).map(Form::index).collect();
}

/// The records of each contested realisation, the one recorded first in front.
///
/// Without a recorded outcome (its line was damaged) there is nothing to contradict; it will be run again.
fn contradicting<R: Form>(contents: &Contents<R>) -> BTreeMap<u64, Vec<R>> {
    let mut records: BTreeMap<u64, Vec<R>> = BTreeMap::new();
    for conflict in &contents.conflicts {
        let index = conflict.index();
        let Some(first) = contents.record(index) else { continue };
        records.entry(index).or_insert_with(|| vec![first.clone()]).push(conflict.clone());
    }
    records
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::tests::record;

    fn opinions(all: &[(&str, &str)]) -> Vec<Opinion> {
        let opinion = |(attempt, (worker, digest)): (usize, &(&str, &str))| Opinion {
            worker: (*worker).to_owned(),
            attempt: attempt as u32 + 1,
            digest: (*digest).to_owned(),
        };
        all.iter().enumerate().map(opinion).collect()
    }

    fn names(rulings: &Rulings) -> Vec<&str> {
        rulings.set_aside.iter().map(String::as_str).collect()
    }

    #[test]
    fn two_opinions_decide_nothing_and_a_third_does_whoever_came_first() {
        let two = Disputes::from([(5, opinions(&[("a", "x"), ("b", "y")]))]);
        assert_eq!(rule(&two), Rulings::default());
        let late = Disputes::from([(5, opinions(&[("a", "x"), ("b", "y"), ("c", "x")]))]);
        assert_eq!(names(&rule(&late)), ["b"]);
        let first = Disputes::from([(5, opinions(&[("a", "x"), ("b", "y"), ("c", "y")]))]);
        assert_eq!(names(&rule(&first)), ["a"]);
        assert_eq!(rule(&first).decided[&5], "y");
        // The same worker twice is one voice.
        let loud = Disputes::from([(5, opinions(&[("a", "x"), ("b", "y"), ("b", "y")]))]);
        assert_eq!(rule(&loud), Rulings::default());
        let all_differ = Disputes::from([(5, opinions(&[("a", "x"), ("b", "y"), ("c", "z")]))]);
        assert_eq!(rule(&all_differ), Rulings::default());
    }

    #[test]
    fn who_is_overruled_once_has_no_say_elsewhere() {
        let disputes = Disputes::from([
            (3, opinions(&[("a", "x"), ("b", "y")])),
            (5, opinions(&[("a", "x"), ("c", "y"), ("d", "y")])),
            (7, opinions(&[("b", "x"), ("c", "y")])),
        ]);
        let rulings = rule(&disputes);
        assert_eq!(names(&rulings), ["a"]);
        assert_eq!(rulings.decided, BTreeMap::from([(3, "y".to_owned()), (5, "y".to_owned())]));
    }

    #[test]
    fn who_contradicts_itself_is_faulty_and_anybody_else_decides() {
        let fickle = opinions(&[("a", "x"), ("a", "y")]);
        assert_eq!(rule(&Disputes::from([(1, fickle.clone())])).decided, BTreeMap::new());
        let settled = rule(&Disputes::from([(1, [fickle, opinions(&[("b", "y")])].concat())]));
        assert_eq!((names(&settled), settled.decided[&1].as_str()), (vec!["a"], "y"));
    }

    #[test]
    fn what_a_worker_set_aside_has_recorded_is_doubtful_unless_others_confirmed_it() {
        let of = |index: u64, worker: &str, digest: &str| {
            let mut record = record(index);
            (record.worker, record.outcome.digest) = (worker.to_owned(), digest.to_owned());
            record
        };
        let mut contents = Contents {
            records: (0..4).map(|index| of(index, "bad", "wrong")).chain([of(4, "b", "right")]).collect(),
            conflicts: vec![of(2, "b", "right"), of(2, "c", "right")],
            audits: vec![(0, "b".to_owned()), (1, "bad".to_owned())],
            ..Contents::default()
        };
        apply(&mut contents);
        assert_eq!(contents.records[2], of(2, "b", "right"));
        assert_eq!(contents.doubtful, BTreeSet::from([1, 3]));
    }
}
