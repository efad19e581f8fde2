//! The event loop: time, network, faults, and what must hold at the end.

use super::coordinator::{Call, Disk, Goes, Reply, Sender, Session};
use super::random::Random;
use super::worker::{Do, Nature, Process, Report, Timer, outcome};
use runout::engine::poison;
use runout::queue::Settings;
use runout::status;
use runout::store::log::{Entry, Record};
use runout_core::campaign::Campaign;
use runout_core::outcome::Reason;
use std::collections::BTreeMap;

const SECOND_US: u64 = 1_000_000;
/// Simulated time within which a campaign ends once the faults have stopped: hung realisations are noticed after 30 s,
/// stuck ones a minute later, up to three times for one index, and disputes take another two runs.
const BOUND_US: u64 = 2000 * SECOND_US;
const GRACE_US: u64 = 20 * SECOND_US;

/// What has to happen in some schedule, or the simulation shows nothing.
pub(crate) const HAPPENINGS: [&str; 19] = [
    "a message was lost",
    "a message came twice",
    "a message overtook another",
    "a worker was killed",
    "a coordinator was killed",
    "a coordinator was interrupted",
    "a worker was cut off",
    "a worker was paused",
    "a worker was lost",
    "a call was not answered",
    "a realisation hung",
    "a worker left because a realisation was stuck",
    "an index was poison",
    "an outcome had wrong bits",
    "an outcome contradicted another",
    "a worker was set aside",
    "a recorded outcome was corrected",
    "an outcome from an earlier process's spool was delivered",
    "an outcome was not wanted",
];

#[derive(Debug)]
enum Event {
    Arrive(Sender, Call),
    Answer(Sender, Reply),
    Timer(usize, u32, Timer),
    /// A group commit has reached the disk.
    Commit(u32),
    Tick(u32),
    StartCoordinator,
    StartWorker(usize),
    Fault,
}

#[derive(Debug)]
struct Worker {
    nature: Nature,
    process: Option<Process>,
    /// Processes started so far.
    generation: u32,
    renames: bool,
    spool: Vec<Report>,
    cut_off_until_us: u64,
    paused_until_us: u64,
}

/// How rough it is.
#[derive(Debug)]
struct Weather {
    loss: f64,
    twice: f64,
    slowest_us: u64,
    sync_us: u64,
    faults_end_us: u64,
    between_faults_us: u64,
}

/// What became of a schedule.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) happened: BTreeMap<&'static str, u64>,
}

#[derive(Debug)]
pub(crate) struct World {
    seed: u64,
    campaign: Campaign,
    settings: Settings,
    random: Random,
    weather: Weather,
    now_us: u64,
    next: u64,
    events: BTreeMap<(u64, u64), Event>,
    disk: Disk,
    session: Option<Session>,
    workers: Vec<Worker>,
    /// Whether one of them computes other bits.
    distrust: bool,
    happened: BTreeMap<&'static str, u64>,
    over: bool,
}

impl World {
    pub(crate) fn new(seed: u64, campaign: fn(u64, f64) -> Campaign) -> World {
        let mut random = Random::new(seed);
        // One schedule in three has a worker that computes other bits, and then every outcome is audited.
        let distrust = random.chance(0.33);
        let audit_fraction = if distrust { 1.0 } else { random.below(3) as f64 * 0.15 };
        let campaign = campaign(seed, audit_fraction);
        let mut settings = Settings::new(campaign.seed, audit_fraction, campaign.stop.maximum_realisations);
        settings.shortest_hang = std::time::Duration::from_secs(30);
        let rough = random.chance(0.8);
        let weather = Weather {
            loss: if rough { random.below(25) as f64 / 100.0 } else { 0.0 },
            twice: if rough { random.below(20) as f64 / 100.0 } else { 0.0 },
            slowest_us: [2_000, 100_000, 3 * SECOND_US][random.below(3) as usize],
            sync_us: [200, 20_000, 500_000][random.below(3) as usize],
            faults_end_us: random.between(10, 400) * SECOND_US,
            between_faults_us: random.between(1, 40) * SECOND_US,
        };
        let mean_us = [20_000, SECOND_US, 8 * SECOND_US][random.below(3) as usize];
        let hangs = if random.chance(0.25) { 0.03 } else { 0.0 };
        let dies_at = random.chance(0.15).then(|| random.below(30));
        let count = if distrust { random.between(3, 5) } else { random.between(1, 5) };
        let workers = (0..count)
            .map(|number| Worker {
                nature: Nature {
                    slots: random.between(1, 3) as usize,
                    mean_us: mean_us * if random.chance(0.1) { 20 } else { 1 },
                    wrong: if distrust && number == 0 { [0.1, 1.0][random.below(2) as usize] } else { 0.0 },
                    hangs,
                    stuck: 0.3,
                    dies_at,
                },
                process: None,
                generation: 0,
                // Trust goes by the name.
                renames: random.chance(0.5) && !(distrust && number == 0),
                spool: Vec::new(),
                cut_off_until_us: 0,
                paused_until_us: 0,
            })
            .collect();
        World {
            seed,
            campaign,
            settings,
            random,
            weather,
            now_us: 0,
            next: 0,
            events: BTreeMap::new(),
            disk: Disk::default(),
            session: None,
            workers,
            distrust,
            happened: BTreeMap::new(),
            over: false,
        }
    }

    /// Runs the schedule to its end and checks the results.
    pub(crate) fn run(mut self) -> Ended {
        self.after(0, Event::StartCoordinator);
        for worker in 0..self.workers.len() {
            let wait_us = self.random.below(3 * SECOND_US);
            self.after(wait_us, Event::StartWorker(worker));
        }
        self.after(self.weather.between_faults_us, Event::Fault);
        while !self.over {
            let ((at_us, _), event) = self.events.pop_first().expect("the campaign stands still");
            self.now_us = at_us;
            let slowest_us = self.workers.iter().map(|worker| worker.nature.mean_us).max().unwrap_or(0);
            let work_us = 4 * self.settings.maximum_realisations * slowest_us;
            let limit_us = self.weather.faults_end_us + BOUND_US + work_us;
            assert!(self.now_us < limit_us, "the campaign does not end: {}", self.describe());
            self.react(event);
        }
        self.check_results();
        Ended { happened: self.happened }
    }

    /// What keeps it from ending, for whoever looks for the reason.
    fn describe(&self) -> String {
        let Some(session) = &self.session else { return "there is no coordinator".to_owned() };
        let queue = session.engine.queue();
        format!(
            "prefix {} of {}, {} audits due, leases {:?}, workers {:?}, nature {:?}",
            queue.prefix(),
            self.settings.maximum_realisations,
            queue.audits_due(),
            queue.leases().collect::<Vec<_>>(),
            queue.workers().collect::<Vec<_>>(),
            self.workers.iter().map(|worker| &worker.nature).collect::<Vec<_>>(),
        )
    }

    fn note(&mut self, what: &'static str) {
        *self.happened.entry(what).or_default() += 1;
    }

    fn after(&mut self, wait_us: u64, event: Event) {
        self.at(self.now_us + wait_us, event);
    }

    fn at(&mut self, at_us: u64, event: Event) {
        self.next += 1;
        self.events.insert((at_us, self.next), event);
    }

    fn is_rough(&self) -> bool {
        self.now_us < self.weather.faults_end_us
    }

    /// A message between a worker and the coordinator: lost, late, or twice.
    fn send(&mut self, worker: usize, message: impl Fn() -> Event) {
        let rough = self.is_rough();
        if rough
            && (self.now_us < self.workers[worker].cut_off_until_us || self.random.chance(self.weather.loss))
        {
            return self.note("a message was lost");
        }
        let copies = if rough && self.random.chance(self.weather.twice) { 2 } else { 1 };
        if copies == 2 {
            self.note("a message came twice");
        }
        for _ in 0..copies {
            let wait_us = 50 + self.random.below(if rough { self.weather.slowest_us } else { 2_000 });
            let overtakes = self.events.range((self.now_us + wait_us, u64::MAX)..);
            if overtakes
                .into_iter()
                .next()
                .is_some_and(|(_, e)| matches!(e, Event::Arrive(..) | Event::Answer(..)))
            {
                self.note("a message overtook another");
            }
            self.after(wait_us, message());
        }
    }

    fn react(&mut self, event: Event) {
        match event {
            Event::Arrive(from, call) => {
                // A call to a coordinator that is down is not answered.
                let Some(session) = &mut self.session else { return };
                if let Some(reply) = session.take(&mut self.disk, from, call, self.now_us) {
                    self.send(from.0, || Event::Answer(from, reply.clone()));
                }
                self.after_coordinator();
            }
            Event::Answer(to, reply) => {
                let paused_until_us = self.workers[to.0].paused_until_us;
                if self.now_us < paused_until_us {
                    return self.at(paused_until_us, Event::Answer(to, reply));
                }
                self.with_process(to.0, to.1, |now_us, process| process.answer(to.2, reply, now_us));
            }
            Event::Timer(worker, generation, timer) => {
                let paused_until_us = self.workers[worker].paused_until_us;
                if self.now_us < paused_until_us {
                    return self.at(paused_until_us, Event::Timer(worker, generation, timer));
                }
                self.with_process(worker, generation, |now_us, process| process.timer(timer, now_us));
            }
            Event::Commit(number) => {
                let Some(session) = self.session.as_mut().filter(|s| s.number == number) else { return };
                let salt = self.random.next();
                let answers = session.commit(&mut self.disk, |count| (salt % count as u64) as usize);
                for (to, reply) in answers {
                    self.send(to.0, || Event::Answer(to, reply.clone()));
                }
                self.after_coordinator();
            }
            Event::Tick(number) => {
                let Some(session) = self.session.as_mut().filter(|s| s.number == number) else { return };
                session.tick(self.now_us);
                self.after(1_250_000, Event::Tick(number));
                self.after_coordinator();
            }
            Event::StartCoordinator => self.start_coordinator(),
            Event::StartWorker(worker) => self.start_worker(worker),
            Event::Fault => self.fault(),
        }
    }

    fn after_coordinator(&mut self) {
        let patient = self.distrust;
        let Some(session) = &mut self.session else { return };
        for what in std::mem::take(&mut session.happened) {
            *self.happened.entry(what).or_default() += 1;
        }
        let number = session.number;
        if session.begins_commit() {
            let wait_us = 1 + self.random.below(self.weather.sync_us);
            self.after(wait_us, Event::Commit(number));
        }
        let goes = self.session.as_mut().expect("it runs").goes(patient, self.now_us);
        match goes {
            Goes::On => {}
            Goes::Drained => {
                self.session = None;
                let wait_us = self.random.below(30 * SECOND_US);
                self.after(wait_us, Event::StartCoordinator);
            }
            Goes::Over => self.over = true,
        }
    }

    fn with_process(
        &mut self,
        worker: usize,
        generation: u32,
        act: impl FnOnce(u64, &mut Process) -> Vec<Do>,
    ) {
        let now_us = self.now_us;
        let known = &mut self.workers[worker];
        let Some(process) = known.process.as_mut().filter(|_| known.generation == generation) else { return };
        let wanted = act(now_us, process);
        self.obey(worker, generation, wanted);
    }

    fn obey(&mut self, worker: usize, generation: u32, wanted: Vec<Do>) {
        for one in wanted {
            match one {
                Do::Send(call, what) => {
                    self.send(worker, || Event::Arrive((worker, generation, call), what.clone()));
                }
                Do::Wait(wait_us, timer) => self.after(wait_us, Event::Timer(worker, generation, timer)),
                Do::Note(what) => self.note(what),
                Do::Acknowledged(index) => {
                    assert!(self.disk.holds(index), "{index} was acknowledged and is not on the disk");
                }
                Do::End { told_to } => {
                    self.end_process(worker);
                    // Somebody starts it again, sooner if it was not told to leave.
                    self.after(if told_to { 30 * SECOND_US } else { SECOND_US }, Event::StartWorker(worker));
                }
            }
        }
    }

    fn end_process(&mut self, worker: usize) {
        let known = &mut self.workers[worker];
        if let Some(process) = known.process.take() {
            known.spool = process.spool();
        }
    }

    fn start_worker(&mut self, worker: usize) {
        let random = Random::new(self.random.next());
        let known = &mut self.workers[worker];
        if known.process.is_some() {
            return;
        }
        known.generation += 1;
        let suffix = if known.renames { format!(".{}", known.generation) } else { String::new() };
        let spool = std::mem::take(&mut known.spool);
        let (process, wanted) = Process::start(
            format!("worker-{worker}{suffix}"),
            self.seed,
            known.nature.clone(),
            spool,
            random,
        );
        known.process = Some(process);
        let generation = known.generation;
        self.obey(worker, generation, wanted);
    }

    fn start_coordinator(&mut self) {
        if self.session.is_none() {
            let session = Session::start(&mut self.disk, &self.campaign, self.settings.clone(), self.now_us);
            let number = session.number;
            self.session = Some(session);
            self.after(0, Event::Tick(number));
        }
    }

    fn fault(&mut self) {
        if !self.is_rough() {
            for worker in &mut self.workers {
                worker.paused_until_us = 0;
            }
            return;
        }
        let wait_us = 1 + self.random.below(2 * self.weather.between_faults_us);
        self.after(wait_us, Event::Fault);
        let worker = self.random.below(self.workers.len() as u64) as usize;
        let lasts_us = self.random.below(60 * SECOND_US);
        match self.random.below(6) {
            0 | 1 if self.workers[worker].process.is_some() => {
                self.note("a worker was killed");
                self.end_process(worker);
                self.after(lasts_us, Event::StartWorker(worker));
            }
            2 if self.session.is_some() => {
                self.note("a coordinator was killed");
                let lines = self.random.below(4) as usize;
                self.session.take().expect("it runs").crash(&mut self.disk, lines);
                self.after(lasts_us, Event::StartCoordinator);
            }
            3 => {
                if let Some(session) = &mut self.session {
                    session.drain(GRACE_US, self.now_us);
                    self.note("a coordinator was interrupted");
                }
            }
            4 => {
                self.note("a worker was cut off");
                self.workers[worker].cut_off_until_us = self.now_us + lasts_us;
            }
            5 => {
                self.note("a worker was paused");
                self.workers[worker].paused_until_us = self.now_us + lasts_us;
            }
            _ => {}
        }
    }

    /// The results are those of the undisturbed campaign, but for poison.
    fn check_results(&mut self) {
        let contents = self.disk.records();
        let mut alone = false;
        for record in &contents.records {
            let recorded = &record.outcome;
            let index = &recorded.index;
            let expected = match recorded.reason {
                Reason::Poison => continue,
                _ => outcome(self.seed, *index),
            };
            let by = |worker: &str| worker == "worker-0";
            // Nobody else was there to run it again, so that nobody could have noticed.
            let unseen = self.distrust
                && by(&record.worker)
                && !contents.disputes.contains_key(index)
                && contents.audits.iter().any(|(i, who)| i == index && by(who))
                && contents.audits.iter().all(|(i, who)| i != index || by(who));
            alone |= unseen && *recorded != expected;
            // Beyond the stopping index nothing is audited.
            let counts = *index < self.session.as_ref().map_or(0, |s| s.engine.estimator().realisations());
            assert!(unseen || !counts || *recorded == expected, "{record:?} instead of {expected:?}");
        }
        if self.distrust {
            let end = self.session.as_ref().map_or(0, |s| s.engine.estimator().realisations());
            assert_eq!(contents.doubtful.range(..end).count(), 0, "a dispute stays open");
        }
        if alone {
            return self.note("a faulty worker was alone with an outcome");
        }
        let undisturbed: Vec<_> = (0..self.settings.maximum_realisations)
            .map(|index| match contents.record(index) {
                Some(record) if record.outcome.reason == Reason::Poison => given_up(index).outcome,
                _ => outcome(self.seed, index),
            })
            .collect();
        let expected = status::fold(&self.campaign, undisturbed.iter());
        let found = status::fold(&self.campaign, contents.records.iter().map(|record| &record.outcome));
        let engine = &self.session.as_ref().expect("it has just ended").engine;
        assert_eq!(found.decision(), expected.decision());
        assert_eq!(found.estimate(), expected.estimate());
        assert_eq!(engine.estimator().estimate(), expected.estimate());
        assert_eq!(engine.estimator().decision(), expected.decision());
    }
}

fn given_up(index: u64) -> Record {
    match poison(index) {
        Entry::Outcome(record) => record,
        other => panic!("{other:?} is no outcome"),
    }
}
