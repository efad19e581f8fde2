//! What holds whatever happens, in any order.

use super::*;
use proptest::prelude::*;

/// What a random peer does next.
#[derive(Debug, Clone)]
enum Action {
    Register,
    Lease(usize),
    Heartbeat(usize),
    Report(usize),
    /// The worker forgets its leases and is never heard of again.
    Vanish(usize),
    Release(usize),
    Leave(usize),
    Time(u8),
}

fn action() -> impl Strategy<Value = Action> {
    let who = 0..8_usize;
    prop_oneof![
        1 => Just(Action::Register),
        8 => who.clone().prop_map(Action::Lease),
        3 => who.clone().prop_map(Action::Heartbeat),
        6 => who.clone().prop_map(Action::Report),
        1 => who.clone().prop_map(Action::Vanish),
        1 => who.clone().prop_map(Action::Release),
        1 => who.prop_map(Action::Leave),
        2 => (0..8_u8).prop_map(Action::Time),
    ]
}

/// Workers as they see themselves, and how often each index was recorded.
#[derive(Default)]
struct World {
    now: Duration,
    workers: Vec<(WorkerId, Vec<Lease>)>,
    recorded: BTreeMap<u64, u32>,
}

impl World {
    fn step(&mut self, queue: &mut Queue, action: Action) {
        match action {
            Action::Register => {
                self.workers.push((queue.register(&format!("{:?}", self.now), 2, &[], self.now), vec![]));
            }
            Action::Time(seconds) => {
                self.now += SECOND * u32::from(seconds);
                let events = queue.tick(self.now);
                self.note(queue, events);
            }
            Action::Vanish(who) => {
                if who < self.workers.len() {
                    self.workers.remove(who);
                }
            }
            Action::Lease(who) => self.with(who, |world, id, leases| {
                if let Ok(LeaseAnswer::Assigned(lease)) = queue.lease(id, world.now) {
                    assert!(!leases.contains(&lease), "a lease is given out once");
                    leases.push(lease);
                }
            }),
            Action::Heartbeat(who) => self.with(who, |world, id, leases| {
                let steps = world.now.as_secs();
                let all: Vec<Held> = leases.iter().map(|l| held(*l, steps)).collect();
                if let Ok((_, cancel, events)) = queue.heartbeat(id, &all, world.now) {
                    leases.retain(|lease| !cancel.contains(lease));
                    world.note(queue, events);
                }
            }),
            Action::Report(who) => self.with(who, |world, id, leases| {
                let Some(lease) = leases.pop() else { return };
                match queue.report(id, lease, &digest(lease.index), world.now) {
                    Ok(ReportStep::Store) => world.store(queue, lease, false),
                    Ok(ReportStep::AuditAgrees) => {
                        let name = queue.worker(id).unwrap().name.clone();
                        assert_eq!(queue.agreed(lease.index, &name), []);
                    }
                    Ok(step) => assert_ne!(step, ReportStep::Conflict),
                    Err(UnknownWorker) => leases.push(lease),
                }
            }),
            Action::Release(who) => self.with(who, |world, id, leases| {
                let lease = leases.pop();
                let events = queue.release(id, lease.as_slice(), false, false, world.now);
                world.note(queue, events.unwrap_or_default());
            }),
            Action::Leave(who) => {
                if who < self.workers.len() {
                    let (id, _) = self.workers.remove(who);
                    let events = queue.release(id, &[], false, true, self.now);
                    self.note(queue, events.unwrap_or_default());
                }
            }
        }
    }

    fn with(&mut self, who: usize, act: impl FnOnce(&mut World, WorkerId, &mut Vec<Lease>)) {
        if who < self.workers.len() {
            let (id, mut leases) = self.workers[who].clone();
            act(self, id, &mut leases);
            self.workers[who].1 = leases;
        }
    }

    fn note(&mut self, queue: &mut Queue, events: Vec<Event>) {
        for event in events {
            if let Event::Poisoned { index } = event {
                self.store(queue, Lease { index, attempt: 0 }, true);
            }
        }
    }

    fn store(&mut self, queue: &mut Queue, lease: Lease, poison: bool) {
        let prefix = queue.prefix();
        let Lease { index, attempt } = lease;
        queue.stored(Done { poison, ..done(index, attempt, &digest(index), "w") });
        *self.recorded.entry(index).or_default() += 1;
        assert!(queue.prefix() >= prefix, "the prefix never shrinks");
    }
}

proptest! {
    #[test]
    fn whatever_happens_every_index_is_recorded_once(
        actions in proptest::collection::vec(action(), 0..400),
        maximum in 1_u64..60,
        audit_fraction in 0.0..0.5_f64,
    ) {
        let mut queue = Queue::new(Settings { audit_fraction, ..settings(maximum) }, 1);
        let mut world = World::default();
        let mut most_slots = 1;
        for action in actions {
            world.step(&mut queue, action);
            // Slots of vanished workers count until they are noticed, so the bound follows the most there were.
            most_slots = most_slots.max(2 * queue.workers().count() as u64);
            let bound = queue.prefix() + queue.settings().look_ahead_per_slot * most_slots;
            prop_assert!(queue.leases().all(|(lease, _)| lease.index < bound.min(maximum)));
            prop_assert!((0..queue.prefix()).all(|index| world.recorded.contains_key(&index)));
            prop_assert!(!world.recorded.contains_key(&queue.prefix()));
        }
        // No lease is lost for ever: one good worker brings any campaign to its end.
        world.workers.clear();
        world.now += queue.settings().lost_after() * 2;
        world.step(&mut queue, Action::Time(0));
        world.step(&mut queue, Action::Register);
        // Each turn records an index or completes an audit.
        for _ in 0..2 * maximum {
            world.step(&mut queue, Action::Lease(0));
            world.step(&mut queue, Action::Report(0));
        }
        prop_assert_eq!(queue.prefix(), maximum);
        prop_assert_eq!(world.recorded, (0..maximum).map(|index| (index, 1)).collect());
    }
}
