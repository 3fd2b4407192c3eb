//! A serial line: raw bytes, and bodies in good frames, up to the verdict and back.
//!
//! The input is a byte of options, then the bytes of the line, or bodies with a byte of length before each.
#![no_main]

use libfuzzer_sys::fuzz_target;
use posegate::contain::Margin;
use posegate::gate::Verdict;
use posegate::recordings::Evaluator;
use posegate::wire::{LONGEST_BODY, Receiver, Reply, Request, encode};
use posegate_fuzz::judged::MAXIMUM_AGE_MS;
use posegate_fuzz::{sound, tables};
use std::sync::OnceLock;

fuzz_target!(|data: &[u8]| {
    let Some((options, mut rest)) = data.split_first() else {
        return;
    };
    let mut receiver = Receiver::new();
    if options & 1 == 0 {
        for frame in rest
            .iter()
            .filter_map(|byte| receiver.push(*byte))
            .flatten()
        {
            assert_eq!(
                through(&mut Receiver::new(), &frame).as_deref(),
                Some(&frame[..])
            );
            taken(&frame);
        }
        return;
    }
    while let Some((length, bytes)) = rest.split_first() {
        let (body, bytes) = bytes.split_at(usize::from(*length).min(bytes.len()));
        rest = bytes;
        let got = through(&mut receiver, body);
        let expected = (body.len() <= LONGEST_BODY).then_some(body);
        assert_eq!(got.as_deref(), expected);
        taken(body);
    }
});

/// Sends a body through a frame, if it fits into one: there is one answer, at the end of the frame.
fn through(receiver: &mut Receiver, body: &[u8]) -> Option<Vec<u8>> {
    let frame = encode(body);
    let (last, before) = frame.split_last()?;
    assert!(
        before
            .iter()
            .all(|byte| *byte != 0 && receiver.push(*byte).is_none())
    );
    let answer = receiver.push(*last).expect("a frame has an answer");
    answer.ok().map(|body| body.to_vec())
}

fn taken(body: &[u8]) {
    if let Ok(request) = Request::from_body(body) {
        assert_eq!(&request.body()[..], body, "a request has one spelling");
        judged(&request);
    }
    if let Some(reply) = Reply::from_body(body) {
        assert_eq!(Reply::from_body(&reply.body()), Some(reply));
    }
}

fn judged(request: &Request) {
    let verdict = request.evaluate(gates());
    if let Ok(Verdict::Permit { margin }) = verdict {
        let age = (i64::from(request.now_ms) - i64::from(request.stamp_ms)).rem_euclid(1 << 32);
        assert!(age <= i64::from(MAXIMUM_AGE_MS) && margin >= Margin::ONE);
        let set = request.pose_set().expect("it was permitted");
        let table = &tables::all()[usize::from(request.table)];
        sound::holds(table, &set, margin, [1, 2, -3]);
    }
    let reply = Reply {
        sequence: request.sequence,
        verdict,
        interlock_high: verdict.is_ok_and(|verdict| verdict.is_permit()),
    };
    let body = reply.body();
    assert_eq!(Reply::from_body(&body), Some(reply));
    assert_eq!(
        through(&mut Receiver::new(), &body).as_deref(),
        Some(&body[..])
    );
}

/// Returns a gate for each table, and one whose table is damaged.
fn gates() -> &'static [Evaluator<'static>] {
    static GATES: OnceLock<Vec<Evaluator<'static>>> = OnceLock::new();
    GATES.get_or_init(|| {
        let damaged = [&[0; 400][..]];
        let tables = tables::BYTES.into_iter().chain(damaged);
        let gates =
            tables.map(|bytes| Evaluator::new(bytes, MAXIMUM_AGE_MS).expect("an age in range"));
        gates.collect()
    })
}
