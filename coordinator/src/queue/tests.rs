//! The rules one by one; [`random`] has what holds under random events.

use super::*;
use crate::rulings::Opinion;

mod random;

const SECOND: Duration = Duration::from_secs(1);

fn settings(maximum: u64) -> Settings {
    Settings::new(1, 0.0, maximum)
}

fn held(lease: Lease, steps: u64) -> Held {
    Held { lease, steps, simulated_s: 0.0, reporting: false }
}

fn assigned(answer: LeaseAnswer) -> Lease {
    match answer {
        LeaseAnswer::Assigned(lease) => lease,
        other => panic!("{other:?} instead of a lease"),
    }
}

fn digest(index: u64) -> String {
    format!("{index:032x}")
}

fn done<'a>(index: u64, attempt: u32, digest: &'a str, worker: &'a str) -> Done<'a> {
    Done { index, digest, worker, attempt, wall_s: 1.0, poison: false }
}

/// Reports and stores in one go.
fn finish(queue: &mut Queue, worker: WorkerId, lease: Lease, now: Duration) -> ReportStep {
    finish_with(queue, worker, lease, &digest(lease.index), now).0
}

/// As [`finish`], with other bits; also what follows.
fn finish_with(
    queue: &mut Queue,
    worker: WorkerId,
    lease: Lease,
    digest: &str,
    now: Duration,
) -> (ReportStep, Vec<Event>) {
    let Lease { index, attempt } = lease;
    let step = queue.report(worker, lease, digest, now).unwrap();
    let name = queue.worker(worker).unwrap().name.clone();
    let events = match step {
        ReportStep::Store => {
            queue.stored(done(index, attempt, digest, &name));
            Vec::new()
        }
        ReportStep::AuditAgrees => queue.agreed(index, &name),
        ReportStep::Conflict => {
            queue.contradicted(index, Opinion { worker: name, attempt, digest: digest.to_owned() })
        }
        _ => Vec::new(),
    };
    (step, events)
}

#[test]
fn look_ahead_is_bounded_by_the_slots() {
    let mut queue = Queue::new(settings(100), 1);
    let fast = queue.register("fast", 1, &[], SECOND);
    let slow = queue.register("slow", 1, &[], SECOND);
    let first = assigned(queue.lease(slow, SECOND).unwrap());
    assert_eq!(first, Lease { index: 0, attempt: 1 });
    // 4 times 2 slots beyond the prefix, which the slow worker holds at 0.
    for index in 1..8 {
        let lease = assigned(queue.lease(fast, SECOND).unwrap());
        assert_eq!(lease.index, index);
        assert_eq!(finish(&mut queue, fast, lease, SECOND), ReportStep::Store);
    }
    assert_eq!(queue.lease(fast, SECOND), Ok(LeaseAnswer::Wait));
    assert_eq!(queue.prefix(), 0);
    finish(&mut queue, slow, first, SECOND);
    assert_eq!(queue.prefix(), 8);
    assert_eq!(assigned(queue.lease(fast, SECOND).unwrap()).index, 8);
    // A worker never holds more leases than it has slots.
    assert_eq!(queue.lease(fast, SECOND), Ok(LeaseAnswer::Wait));
}

#[test]
fn a_silent_worker_is_lost_and_three_losses_are_poison() {
    let mut queue = Queue::new(settings(100), 1);
    let mut now = SECOND;
    for attempt in 1..=3 {
        let worker = queue.register("w", 1, &[], now);
        assert_eq!(assigned(queue.lease(worker, now).unwrap()), Lease { index: 0, attempt });
        now += queue.settings().lost_after();
        assert_eq!(queue.tick(now), []);
        now += SECOND;
        let mut expected = vec![Event::WorkerLost { name: "w".into() }];
        if attempt == 3 {
            expected.push(Event::Poisoned { index: 0 });
        }
        assert_eq!(queue.tick(now), expected);
        assert_eq!(queue.lease(worker, now), Err(UnknownWorker));
    }
    queue.stored(Done { poison: true, ..done(0, 0, "poison", "coordinator") });
    assert_eq!(queue.prefix(), 1);
    // Its outcome is not wanted any more, should it ever come.
    let late = queue.register("late", 1, &[], now);
    assert_eq!(queue.report(late, Lease { index: 0, attempt: 2 }, "d", now), Ok(ReportStep::NotWanted));
}

#[test]
fn orderly_release_is_no_loss() {
    let mut queue = Queue::new(settings(100), 1);
    for attempt in 1..=5 {
        let worker = queue.register("w", 1, &[], SECOND);
        let lease = assigned(queue.lease(worker, SECOND).unwrap());
        assert_eq!(lease, Lease { index: 0, attempt });
        assert_eq!(queue.release(worker, &[lease], false, true, SECOND), Ok(vec![]));
    }
    assert_eq!(queue.attempts(0), Attempts { attempt: 5, losses: 0 });
}

#[test]
fn a_late_result_is_welcome_and_its_repeat_is_cancelled() {
    let mut queue = Queue::new(settings(100), 1);
    let lost = queue.register("lost", 1, &[], SECOND);
    let lease = assigned(queue.lease(lost, SECOND).unwrap());
    let later = SECOND + queue.settings().lost_after() * 2;
    queue.tick(later);
    let other = queue.register("other", 1, &[], later);
    let repeat = assigned(queue.lease(other, later).unwrap());
    assert_eq!(repeat, Lease { index: 0, attempt: 2 });
    let back = queue.register("lost", 1, &[], later);
    assert_eq!(finish(&mut queue, back, lease, later), ReportStep::Store);
    assert_eq!(finish(&mut queue, back, lease, later), ReportStep::Duplicate);
    let (order, cancel, _) = queue.heartbeat(other, &[held(repeat, 5)], later).unwrap();
    assert_eq!((order, cancel), (Order::Continue, vec![repeat]));
}

#[test]
fn after_a_restart_a_worker_keeps_what_it_runs() {
    let mut queue = Queue::new(settings(100), 2);
    queue.restore_recorded(done(0, 1, &digest(0), "w"), false);
    queue.restore_attempts(1, Attempts { attempt: 4, losses: 1 });
    queue.restore_attempts(2, Attempts { attempt: 1, losses: 0 });
    let running = Lease { index: 1, attempt: 4 };
    let worker = queue.register("w", 1, &[held(running, 0)], SECOND);
    let other = queue.register("other", 1, &[], SECOND);
    assert_eq!(assigned(queue.lease(other, SECOND).unwrap()), Lease { index: 2, attempt: 2 });
    assert_eq!(queue.heartbeat(worker, &[held(running, 9)], SECOND).unwrap().1, []);
    assert_eq!(finish(&mut queue, worker, running, SECOND), ReportStep::Store);
    assert_eq!(queue.prefix(), 2);
}

#[test]
fn a_lease_that_never_arrived_is_taken_back() {
    let mut queue = Queue::new(settings(100), 1);
    let worker = queue.register("w", 1, &[], SECOND);
    let lost = assigned(queue.lease(worker, SECOND).unwrap());
    let later = SECOND + queue.settings().heartbeat * 3;
    queue.heartbeat(worker, &[], later).unwrap();
    assert_eq!(assigned(queue.lease(worker, later).unwrap()), Lease { attempt: 2, ..lost });
}

#[test]
fn a_hang_is_told_from_a_lost_heartbeat() {
    let mut queue = Queue::new(settings(100), 1);
    let worker = queue.register("w", 1, &[], SECOND);
    let lease = assigned(queue.lease(worker, SECOND).unwrap());
    let mut now = SECOND;
    while now < SECOND + queue.settings().shortest_hang {
        assert_eq!(queue.heartbeat(worker, &[held(lease, 0)], now).unwrap().1, []);
        now += queue.settings().heartbeat;
    }
    now += SECOND;
    let (_, cancel, events) = queue.heartbeat(worker, &[held(lease, 0)], now).unwrap();
    assert_eq!((cancel, events), (vec![lease], vec![Event::Hung { index: 0 }]));
    assert_eq!(queue.attempts(0).losses, 1);
    // A worker that has not yet obeyed does not get it back.
    assert_eq!(queue.heartbeat(worker, &[held(lease, 0)], now).unwrap().1, [lease]);
    assert_eq!(assigned(queue.lease(worker, now).unwrap()), Lease { index: 0, attempt: 2 });
}

#[test]
fn near_the_end_an_idle_worker_repeats_a_straggler() {
    let mut queue = Queue::new(settings(20), 1);
    let slow = queue.register("slow", 1, &[], SECOND);
    let straggler = assigned(queue.lease(slow, SECOND).unwrap());
    let idle = queue.register("idle", 8, &[], SECOND);
    for _ in 1..20 {
        let lease = assigned(queue.lease(idle, SECOND).unwrap());
        finish(&mut queue, idle, lease, SECOND);
    }
    // Realisations took 1 s each: at 2 s the straggler is not late yet.
    assert_eq!(queue.lease(idle, SECOND * 3), Ok(LeaseAnswer::Wait));
    let repeat = assigned(queue.lease(idle, SECOND * 4).unwrap());
    assert_eq!(repeat, Lease { index: straggler.index, attempt: 2 });
    assert_eq!(queue.lease(idle, SECOND * 4), Ok(LeaseAnswer::Wait));
    assert_eq!(finish(&mut queue, idle, repeat, SECOND * 5), ReportStep::Store);
    assert_eq!(queue.prefix(), 20);
}

/// All but one in a million realisations are audited.
fn with_audits(maximum: u64) -> Queue {
    Queue::new(Settings { audit_fraction: 0.999_999, ..settings(maximum) }, 1)
}

#[test]
fn audits_go_to_another_worker_and_a_third_decides_a_contradiction() {
    let mut queue = with_audits(100);
    let first = queue.register("first", 1, &[], SECOND);
    let second = queue.register("second", 1, &[], SECOND);
    let lease = assigned(queue.lease(first, SECOND).unwrap());
    finish(&mut queue, first, lease, SECOND);
    assert_eq!(assigned(queue.lease(first, SECOND).unwrap()).index, 1);
    let audit = assigned(queue.lease(second, SECOND).unwrap());
    assert_eq!(audit, Lease { index: 0, attempt: 2 });
    // The first report, delivered again by somebody who found it in the spool, is no second run.
    assert_eq!(queue.report(second, lease, &digest(0), SECOND), Ok(ReportStep::Duplicate));
    assert_eq!(finish(&mut queue, second, audit, SECOND), ReportStep::AuditAgrees);
    assert_eq!(queue.audits_due(), 0);
    finish(&mut queue, first, Lease { index: 1, attempt: 1 }, SECOND);
    let audit = assigned(queue.lease(second, SECOND).unwrap());
    assert_eq!(finish_with(&mut queue, second, audit, "other", SECOND), (ReportStep::Conflict, vec![]));
    // Delivered again it is no second voice.
    assert_eq!(queue.report(second, audit, "other", SECOND), Ok(ReportStep::Duplicate));
    // Neither of the two decides, and both go on.
    assert_eq!(queue.audits_due(), 1);
    for worker in [first, second] {
        assert_eq!(assigned(queue.lease(worker, SECOND).unwrap()).attempt, 1);
    }
    let third = queue.register("third", 1, &[], SECOND);
    let decisive = assigned(queue.lease(third, SECOND).unwrap());
    assert_eq!(decisive, Lease { index: 1, attempt: 3 });
    let (step, events) = finish_with(&mut queue, third, decisive, &digest(1), SECOND);
    assert_eq!(step, ReportStep::AuditAgrees);
    assert_eq!(events, [Event::SetAside { name: "second".into(), doubtful: 0 }]);
    assert_eq!(queue.lease(second, SECOND), Ok(LeaseAnswer::Finished));
    // Under the same name it is not let in again.
    let again = queue.register("second", 1, &[], SECOND);
    assert_eq!(queue.lease(again, SECOND), Ok(LeaseAnswer::Finished));
}

#[test]
fn what_a_worker_set_aside_has_recorded_is_run_again_and_corrected() {
    let mut queue = with_audits(100);
    let odd = queue.register("odd", 1, &[], SECOND);
    for _ in 0..3 {
        // Alone it records and audits itself.
        let lease = assigned(queue.lease(odd, SECOND).unwrap());
        finish_with(&mut queue, odd, lease, "odd", SECOND);
        let audit = assigned(queue.lease(odd, SECOND).unwrap());
        assert_eq!(finish_with(&mut queue, odd, audit, "odd", SECOND).0, ReportStep::AuditAgrees);
    }
    let lease = assigned(queue.lease(odd, SECOND).unwrap());
    finish_with(&mut queue, odd, lease, "odd", SECOND);
    let sound = ["a", "b"].map(|name| queue.register(name, 1, &[], SECOND));
    let mut corrected = Vec::new();
    for worker in sound {
        let lease = assigned(queue.lease(worker, SECOND).unwrap());
        assert_eq!(lease.index, 3);
        corrected.extend(finish_with(&mut queue, worker, lease, &digest(3), SECOND).1);
    }
    // It came first and is overruled by two; that it confirmed itself is worth nothing.
    assert_eq!(
        corrected,
        [
            Event::Corrected { index: 3, digest: digest(3) },
            Event::SetAside { name: "odd".into(), doubtful: 3 },
        ]
    );
    for index in 0..3 {
        let lease = assigned(queue.lease(sound[0], SECOND).unwrap());
        assert_eq!(lease.index, index);
        let (_, events) = finish_with(&mut queue, sound[0], lease, &digest(index), SECOND);
        assert_eq!(events, [Event::Corrected { index, digest: digest(index) }]);
    }
    assert_eq!((queue.audits_due(), queue.prefix()), (0, 4));
    assert!((0..4).all(|index| queue.digest(index) == Some(&digest(index))));
}

#[test]
fn a_worker_that_contradicts_itself_is_set_aside_and_anybody_else_decides() {
    let mut queue = with_audits(100);
    let fickle = queue.register("fickle", 1, &[], SECOND);
    let lease = assigned(queue.lease(fickle, SECOND).unwrap());
    finish(&mut queue, fickle, lease, SECOND);
    let audit = assigned(queue.lease(fickle, SECOND).unwrap());
    let (_, events) = finish_with(&mut queue, fickle, audit, "other", SECOND);
    assert_eq!(events, [Event::SetAside { name: "fickle".into(), doubtful: 1 }]);
    let other = queue.register("other", 1, &[], SECOND);
    let decisive = assigned(queue.lease(other, SECOND).unwrap());
    assert_eq!(decisive.index, 0);
    finish(&mut queue, other, decisive, SECOND);
    assert_eq!(queue.audits_due(), 0);
}

#[test]
fn a_worker_that_is_alone_audits_itself() {
    let mut queue = with_audits(100);
    let worker = queue.register("w", 1, &[], SECOND);
    let lease = assigned(queue.lease(worker, SECOND).unwrap());
    finish(&mut queue, worker, lease, SECOND);
    let audit = assigned(queue.lease(worker, SECOND).unwrap());
    assert_eq!(audit, Lease { index: 0, attempt: 2 });
    assert_eq!(finish(&mut queue, worker, audit, SECOND), ReportStep::AuditAgrees);
    assert_eq!(assigned(queue.lease(worker, SECOND).unwrap()).index, 1);
}

#[test]
fn audits_due_at_the_end_are_run_and_everything_else_is_cancelled() {
    let mut queue = with_audits(100);
    let first = queue.register("first", 2, &[], SECOND);
    let second = queue.register("second", 1, &[], SECOND);
    let leases = [first, first, second].map(|worker| assigned(queue.lease(worker, SECOND).unwrap()));
    finish(&mut queue, first, leases[0], SECOND);
    // The results end before index 1: what runs beyond is of no use, and is not audited.
    queue.finish(1);
    assert_eq!(queue.audits_due(), 1);
    assert!(queue.audit_limit().is_some());
    assert_eq!(queue.lease(first, SECOND), Ok(LeaseAnswer::Wait));
    assert!(!queue.everyone_told());
    let (order, cancel, _) = queue.heartbeat(second, &[held(leases[2], 5)], SECOND).unwrap();
    assert_eq!((order, cancel), (Order::Continue, vec![leases[2]]));
    let audit = assigned(queue.lease(second, SECOND).unwrap());
    assert_eq!(audit, Lease { index: 0, attempt: 2 });
    assert_eq!(queue.heartbeat(second, &[held(audit, 5)], SECOND).unwrap().1, []);
    assert_eq!(finish(&mut queue, second, audit, SECOND), ReportStep::AuditAgrees);
    assert_eq!(queue.audit_limit(), None);
    assert_eq!(queue.lease(second, SECOND), Ok(LeaseAnswer::Finished));
    assert_eq!(queue.heartbeat(first, &[held(leases[1], 5)], SECOND).unwrap().0, Order::Stop);
    assert!(queue.everyone_told());
}

#[test]
fn audits_that_are_given_up_hold_nobody() {
    let mut queue = with_audits(100);
    let first = queue.register("first", 1, &[], SECOND);
    let second = queue.register("second", 1, &[], SECOND);
    let lease = assigned(queue.lease(first, SECOND).unwrap());
    finish(&mut queue, first, lease, SECOND);
    queue.finish(1);
    queue.close();
    assert_eq!(queue.audits_due(), 1);
    assert_eq!(queue.audit_limit(), None);
    assert_eq!(queue.lease(second, SECOND), Ok(LeaseAnswer::Finished));
}

#[test]
fn first_attempts_are_reserved_by_the_round_within_the_look_ahead() {
    let mut queue = Queue::new(settings(100), 0);
    let id = queue.register("a", 2, &[], SECOND);
    assert_eq!(queue.reserve(), 0..6);
    assert_eq!(queue.reserve(), 0..0, "they are being made durable");
    let lease = assigned(queue.lease(id, SECOND).unwrap());
    assert!(!queue.is_reserved(lease), "not durable yet");
    queue.reserved(0..6);
    assert!(queue.is_reserved(lease));
    finish(&mut queue, id, lease, SECOND);
    assert!(!queue.is_reserved(lease), "it is done");

    let given_back = assigned(queue.lease(id, SECOND).unwrap());
    assert!(queue.is_reserved(given_back));
    queue.release(id, &[given_back], false, false, SECOND).unwrap();
    let again = assigned(queue.lease(id, SECOND).unwrap());
    assert_eq!(again, Lease { index: 1, attempt: 2 });
    assert!(!queue.is_reserved(again), "a second attempt has a number of its own");

    // 2 to 5 are reserved: more only once fewer than two are left, and never beyond the look-ahead of 4 a slot.
    for index in 2..5 {
        assert_eq!(queue.reserve(), 0..0);
        let lease = assigned(queue.lease(id, SECOND).unwrap());
        assert_eq!((lease.index, queue.is_reserved(lease)), (index, true));
        finish(&mut queue, id, lease, SECOND);
    }
    assert_eq!(queue.prefix(), 1);
    assert_eq!(queue.reserve(), 6..9);
    queue.drain();
    assert_eq!(queue.reserve(), 0..0);
}
