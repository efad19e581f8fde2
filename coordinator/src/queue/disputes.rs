//! Second opinions on recorded outcomes, and what follows from them; the rules are in [`crate::rulings`].

use super::{Event, Lease, Queue, ReportStep, is_audited};
use crate::rulings::{self, Disputes, Opinion};

impl Queue {
    /// Takes over what an earlier session's log says of second runs: opinions on contested realisations, and who
    /// agreed with which outcome. Recorded outcomes are restored before.
    pub fn restore_opinions(&mut self, disputes: &Disputes, audits: &[(u64, String)]) {
        for (index, worker) in audits {
            self.auditors.entry(*index).or_default().push(worker.clone());
        }
        self.disputes.clone_from(disputes);
        if !disputes.is_empty() {
            // Records that were overruled came in corrected, so that what is said here was said before.
            self.judge();
            self.look_for_audits();
        }
    }

    /// Results that are contested and not decided.
    pub fn contested(&self) -> usize {
        self.disputes.keys().filter(|index| self.audits_due.contains(index)).count()
    }

    /// Whether the worker of this name was overruled.
    pub fn is_set_aside(&self, name: &str) -> bool {
        self.rulings.set_aside.contains(name)
    }

    /// An outcome of a recorded index, from a worker that is trusted.
    pub(super) fn second_opinion(
        &mut self,
        worker: String,
        lease: Lease,
        digest: &str,
        audit: bool,
    ) -> ReportStep {
        let index = lease.index;
        let recorded = &self.recorded[&index];
        if recorded.poison {
            return ReportStep::NotWanted;
        }
        let opinions = self.disputes.get(&index);
        let first = opinions.map_or(&recorded.digest, |all| &all[0].digest);
        let heard = opinions.is_some_and(|all| all.iter().any(|o| o.worker == worker && o.digest == digest));
        let key = (index, worker);
        if self.weighing.contains(&key) {
            return ReportStep::Busy;
        }
        if first != digest {
            if heard {
                return ReportStep::Duplicate;
            }
            self.weighing.insert(key);
            return ReportStep::Conflict;
        }
        // The same attempt, delivered twice, is no second computation.
        let second = recorded.attempt != lease.attempt && (audit || recorded.worker != key.1);
        if second && !heard && self.audits_due.remove(&index) {
            self.weighing.insert(key);
            return ReportStep::AuditAgrees;
        }
        ReportStep::Duplicate
    }

    /// An outcome that contradicts the one recorded first is durable now.
    pub fn contradicted(&mut self, index: u64, opinion: Opinion) -> Vec<Event> {
        self.weighing.remove(&(index, opinion.worker.clone()));
        let Some(recorded) = self.recorded.get(&index) else { return Vec::new() };
        let opinions = self.disputes.entry(index).or_insert_with(|| {
            let digest = &recorded.digest;
            let first = Opinion {
                worker: recorded.worker.clone(),
                attempt: recorded.attempt,
                digest: digest.clone(),
            };
            let agree =
                |worker: &String| Opinion { worker: worker.clone(), attempt: 0, digest: digest.clone() };
            let agreeing = self.auditors.get(&index).into_iter().flatten().map(agree);
            std::iter::once(first).chain(agreeing).collect()
        });
        opinions.push(opinion);
        self.settle(index)
    }

    /// That a second run agreed with the outcome recorded first is durable now.
    pub fn agreed(&mut self, index: u64, worker: &str) -> Vec<Event> {
        self.weighing.remove(&(index, worker.to_owned()));
        self.auditors.entry(index).or_default().push(worker.to_owned());
        match self.disputes.get_mut(&index) {
            None => Vec::new(),
            Some(opinions) => {
                let digest = opinions[0].digest.clone();
                opinions.push(Opinion { worker: worker.to_owned(), attempt: 0, digest });
                self.settle(index)
            }
        }
    }

    /// Rules anew after another opinion on `index`.
    fn settle(&mut self, index: u64) -> Vec<Event> {
        let events = self.judge();
        if self.is_due(index) {
            self.audits_due.insert(index);
        } else {
            self.audits_due.remove(&index);
        }
        if !self.audits_due.is_empty() && (self.is_due(index) || !events.is_empty()) {
            // What came to light after the audits were given up is looked into all the same.
            self.closed = false;
        }
        events
    }

    fn judge(&mut self) -> Vec<Event> {
        let rulings = rulings::rule(&self.disputes);
        let before = std::mem::replace(&mut self.rulings, rulings);
        if before == self.rulings {
            return Vec::new();
        }
        let mut events = Vec::new();
        for (index, digest) in &self.rulings.decided {
            let Some(recorded) = self.recorded.get_mut(index).filter(|r| r.digest != *digest) else {
                continue;
            };
            let found = self.disputes[index].iter().find(|opinion| opinion.digest == *digest);
            let counts = found.expect("a verdict is one of the opinions");
            recorded.digest.clone_from(digest);
            recorded.worker.clone_from(&counts.worker);
            recorded.attempt = counts.attempt;
            events.push(Event::Corrected { index: *index, digest: digest.clone() });
        }
        for id in self.workers.set_aside(&self.rulings.set_aside) {
            self.give_back_all(id);
        }
        self.look_for_audits();
        for name in self.rulings.set_aside.difference(&before.set_aside) {
            let of_it = |index: &&u64| self.recorded[*index].worker == *name;
            let doubtful = self.audits_due.iter().filter(of_it).count() as u64;
            events.push(Event::SetAside { name: name.clone(), doubtful });
        }
        events
    }

    /// Finds anew which recorded outcomes are to be run again.
    pub(super) fn look_for_audits(&mut self) {
        let due = self.recorded.keys().copied().filter(|index| self.is_due(*index)).collect();
        self.audits_due = due;
    }

    fn is_due(&self, index: u64) -> bool {
        let Some(recorded) = self.recorded.get(&index).filter(|r| !r.poison && index < self.end) else {
            return false;
        };
        if self.disputes.contains_key(&index) {
            return !self.rulings.decided.contains_key(&index);
        }
        let mut auditors = self.auditors.get(&index).into_iter().flatten();
        if self.rulings.set_aside.contains(&recorded.worker) {
            auditors.all(|worker| self.rulings.set_aside.contains(worker))
        } else {
            auditors.next().is_none() && is_audited(self.settings.seed, self.settings.audit_fraction, index)
        }
    }
}
