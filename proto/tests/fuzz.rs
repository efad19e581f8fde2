//! Whatever arrives: no message panics on the way in, and one that keeps to the contract is the same after another
//! journey. Random bytes, and sound messages with some bytes changed.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use prost::Message;
use runout_proto::check::Check;
use runout_proto::convert::{decode_outcome, encode_outcome};
use runout_proto::v1;
use std::fmt::Debug;

/// Inputs of each property in the usual run, and in the long one.
const USUAL: u32 = 3_000;
const LONG: u32 = 1_000_000;

/// Decodes bytes as a message; if it is sound, nothing is lost by encoding it again.
fn journey<M: Message + Default + Check + Clone + PartialEq + Debug>(bytes: &[u8]) -> Option<M> {
    let message = M::decode(bytes).ok()?;
    let sound = message.check();
    let again = message.encode_to_vec();
    let back = M::decode(again.as_slice()).expect("what was encoded can be decoded");
    assert_eq!(back.encode_to_vec(), again);
    assert_eq!(back.check().is_ok(), sound.is_ok());
    // An unsound message may hold NaN, which is unequal to itself.
    sound.ok()?;
    assert_eq!(back, message);
    Some(message)
}

/// Bytes as every message of the contract; how many kinds took them for a sound message.
fn every_kind(bytes: &[u8]) -> usize {
    let report = journey::<v1::ReportRequest>(bytes);
    if let Some(report) = &report {
        let outcome = decode_outcome(report.outcome.clone()).expect("it was checked");
        assert_eq!(Some(encode_outcome(&outcome)), report.outcome);
    }
    let sound = [
        journey::<v1::RegisterRequest>(bytes).is_some(),
        journey::<v1::RegisterReply>(bytes).is_some(),
        journey::<v1::LeaseRequest>(bytes).is_some(),
        journey::<v1::LeaseReply>(bytes).is_some(),
        journey::<v1::HeartbeatRequest>(bytes).is_some(),
        journey::<v1::HeartbeatReply>(bytes).is_some(),
        report.is_some(),
        journey::<v1::ReportReply>(bytes).is_some(),
        journey::<v1::ReleaseRequest>(bytes).is_some(),
        journey::<v1::ReleaseReply>(bytes).is_some(),
        journey::<v1::StatusRequest>(bytes).is_some(),
        journey::<v1::StatusReply>(bytes).is_some(),
        journey::<v1::CancelRequest>(bytes).is_some(),
        journey::<v1::CancelReply>(bytes).is_some(),
    ];
    sound.into_iter().filter(|sound| *sound).count()
}

/// Sound messages, one of every kind that has fields, filled from `n`.
fn sound_messages(n: u64) -> Vec<Vec<u8>> {
    let lease = v1::LeaseRef { index: n, attempt: 1 + (n % 1000) as u32 };
    let leases = vec![lease; (n % 5) as usize];
    let number = (n % 100_000) as f64 / 7.0;
    let text = |length: u64| "ab1é-".chars().cycle().take(1 + (length % 100) as usize).collect::<String>();
    let running = v1::LeaseProgress {
        lease: Some(lease),
        steps: n,
        simulated_s: number,
        reporting: n.is_multiple_of(2),
    };
    let report = v1::ReportRequest {
        worker_id: n,
        attempt: lease.attempt,
        spec_digest: format!("{n:064x}"),
        outcome: Some(sound_outcome(n, number)),
        wall_s: number,
    };
    let register = v1::RegisterRequest {
        protocol: 2,
        build: text(n),
        fingerprint: format!("{n:016x}"),
        name: text(n / 3),
        slots: 1 + (n % 4096) as u32,
        held: leases.clone(),
        machine: (n.is_multiple_of(2)).then(|| v1::Machine {
            processor: text(n / 5),
            kernel: text(n / 7),
            cores: 1 + (n % 65_536) as u32,
        }),
    };
    let registered = v1::RegisterReply {
        worker_id: n,
        spec_json: text(n),
        heartbeat_s: 0.5 + number % 1000.0,
        lost_after_s: 3.0 * (0.5 + number % 1000.0),
    };
    let kind = 1 + (n % 4) as i32;
    vec![
        register.encode_to_vec(),
        registered.encode_to_vec(),
        v1::LeaseRequest { worker_id: n, poll_s: number }.encode_to_vec(),
        v1::LeaseReply { kind, lease: (kind == 1).then_some(lease) }.encode_to_vec(),
        v1::HeartbeatRequest { worker_id: n, running: vec![running; leases.len()] }.encode_to_vec(),
        v1::HeartbeatReply { order: 1 + (n % 3) as i32, cancel: leases.clone() }.encode_to_vec(),
        report.encode_to_vec(),
        v1::ReportReply { verdict: kind }.encode_to_vec(),
        v1::ReleaseRequest {
            worker_id: n,
            leases,
            error: (n.is_multiple_of(2)).then(|| text(n)),
            leaving: n.is_multiple_of(3),
        }
        .encode_to_vec(),
        v1::StatusReply { state: text(n), json: text(n) }.encode_to_vec(),
        v1::CancelRequest { spec_digest: (n.is_multiple_of(2)).then(|| format!("{n:064x}")) }.encode_to_vec(),
        v1::CancelReply { state: text(n), grace_s: number }.encode_to_vec(),
    ]
}

fn sound_outcome(n: u64, number: f64) -> v1::Outcome {
    let failed = n % 3 == 2;
    let measures = v1::Measures {
        max_displacement_m: number,
        displacement_q999_m: number / 2.0,
        toe_advance_m: number / 3.0,
        crest_retreat_m: number / 4.0,
        moved_area_m2: number / 5.0,
        deposit_height_at_toe_m: number / 6.0,
        time_to_rest_s: (n.is_multiple_of(2)).then_some(number),
    };
    let energy =
        v1::Energy { outer_work_j: -number, drift_j: number, available_j: number, ..v1::Energy::default() };
    v1::Outcome {
        index: n,
        kind: 1 + (n % 3) as i32,
        reason: 1 + (n % 8) as i32,
        measures: (!failed).then_some(measures),
        simulated_s: number,
        steps: n,
        points: n / 2,
        profile: (!failed && n.is_multiple_of(2)).then(|| v1::Profile {
            column_m: 0.5,
            depth_mm: (0..n % 64).map(|column| 1 + (n.wrapping_mul(column) % 10_000_000) as u32).collect(),
            speed_mm_s: (0..n % 7).map(|column| 1 + column as u32).collect(),
        }),
        digest: format!("{n:032x}"),
        energy: (!failed).then_some(energy),
        energy_drifted: n.is_multiple_of(5),
    }
}

/// What may happen to bytes.
#[derive(Debug, Clone)]
enum Edit {
    Set(usize, u8),
    Flip(usize, u8),
    Insert(usize, u8),
    Remove(usize),
    Cut(usize),
    Repeat(usize, usize),
}

fn edit() -> impl Strategy<Value = Edit> {
    let (place, byte) = (0_usize..300, any::<u8>());
    prop_oneof![
        (place.clone(), byte).prop_map(|(place, byte)| Edit::Set(place, byte)),
        (place.clone(), 0_u8..8).prop_map(|(place, bit)| Edit::Flip(place, 1 << bit)),
        (place.clone(), byte).prop_map(|(place, byte)| Edit::Insert(place, byte)),
        place.clone().prop_map(Edit::Remove),
        place.clone().prop_map(Edit::Cut),
        (place.clone(), 1_usize..40).prop_map(|(place, length)| Edit::Repeat(place, length)),
    ]
}

fn changed(mut bytes: Vec<u8>, edits: &[Edit]) -> Vec<u8> {
    for edit in edits {
        let length = bytes.len();
        match *edit {
            Edit::Insert(place, byte) => bytes.insert(place % (length + 1), byte),
            _ if length == 0 => {}
            Edit::Set(place, byte) => bytes[place % length] = byte,
            Edit::Flip(place, bit) => bytes[place % length] ^= bit,
            Edit::Remove(place) => {
                bytes.remove(place % length);
            }
            Edit::Cut(place) => bytes.truncate(place % length),
            Edit::Repeat(place, count) => {
                let start = place % length;
                let part = bytes[start..length.min(start + count)].to_vec();
                bytes.extend(part);
            }
        }
    }
    bytes
}

/// Runs a property; each failure is shrunk and shown by proptest.
fn run<S: Strategy>(cases: u32, inputs: &S, property: impl Fn(S::Value)) {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    let tested = TestRunner::new(config).run(inputs, |input| {
        property(input);
        Ok(())
    });
    if let Err(failure) = tested {
        panic!("{failure}");
    }
}

fn random_bytes(cases: u32) {
    run(cases, &vec(any::<u8>(), 0..200), |bytes| {
        every_kind(&bytes);
    });
}

fn changed_messages(cases: u32) {
    run(cases, &(any::<u64>(), 0_usize..12, vec(edit(), 0..4)), |(n, which, edits)| {
        let bytes = sound_messages(n).swap_remove(which);
        let sound = every_kind(&changed(bytes, &edits));
        assert!(sound > 0 || !edits.is_empty(), "message {which} of {n} is not sound");
    });
}

#[test]
fn random_bytes_do_no_harm() {
    random_bytes(USUAL);
}

#[test]
fn changed_messages_do_no_harm() {
    changed_messages(USUAL);
}

/// Two million inputs: `cargo test --release -p runout-proto --test fuzz -- --ignored`.
#[test]
#[ignore = "takes minutes; the two tests above are its usual form"]
fn two_million_inputs_do_no_harm() {
    random_bytes(LONG);
    changed_messages(LONG);
}
