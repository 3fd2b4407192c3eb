//! Bytes as a table with a repaired checksum: every accessor, and decisions on its content.
//!
//! The input is a table, two sets near it, and a byte of options.
#![no_main]

use libfuzzer_sys::{Corpus, fuzz_mutator, fuzz_target, fuzzer_mutate};
use posegate::contain::{Decision, Margin, decide, decide_with_margin, examine};
use posegate::table::Table;
use posegate_fuzz::input::{Input, SET_LENGTH};
use posegate_fuzz::{judged, layout, mutation, sound};

const TAIL: usize = 2 * SET_LENGTH + 1;
/// Number of runs and facets beyond which a decision is too slow to be repeated thousands of times.
const EXPENSIVE: u32 = 20_000;

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutation::mutate(data, [size, max_size, TAIL], seed, fuzzer_mutate)
});

fuzz_target!(|data: &[u8]| -> Corpus {
    let Some((table, tail)) = data.len().checked_sub(TAIL).map(|at| data.split_at(at)) else {
        return Corpus::Reject;
    };
    // Unchanged bytes: nearly always refused, and never a panic.
    let _ = Table::parse(table);
    let (sets, options) = tail.split_at(2 * SET_LENGTH);
    let [options] = *options else {
        return Corpus::Reject;
    };
    let mut bytes = table.to_vec();
    layout::repair(&mut bytes, options & 1 == 0);
    let Ok(table) = Table::parse(&bytes) else {
        return Corpus::Keep;
    };
    let worst = layout::walk(&table);
    one_bit_is_enough(&bytes, sets);
    if worst.runs > EXPENSIVE || worst.world_facets + worst.robot_facets > EXPENSIVE {
        return Corpus::Keep;
    }
    for bytes in sets.chunks(SET_LENGTH) {
        let mut input = Input(bytes);
        let Some(set) = input.set_near(&table) else {
            continue;
        };
        let examination = examine(&table, &set);
        let (decision, margin) = decide_with_margin(&table, &set);
        assert_eq!(decide(&table, &set), examination.decision);
        assert_eq!(decision, examination.decision);
        let is_inside = decision == Decision::Inside;
        assert_eq!(margin >= Margin::ONE, is_inside);
        assert_eq!(examination.margin >= Margin::ONE, is_inside);
        assert!(examination.worst_pose.is_none() || !is_inside);
        if let Some(pose) = examination.worst_pose {
            sound::is_of(&set, pose);
        }
        let pick = [bytes[2], bytes[4], bytes[6]].map(|byte| byte as i8);
        let margins = if is_inside {
            [margin, examination.margin, Margin::ONE]
        } else {
            [examination.margin; 3]
        };
        for margin in margins.into_iter().filter(|margin| margin.q16() > 0) {
            sound::holds(&table, &set, margin, pick);
        }
        // One more examination, for half of the inputs.
        if options & 2 == 0 {
            judged::agrees(
                table.bytes(),
                set,
                u32::from(options),
                u32::from(bytes[0]),
                &examination,
            );
        }
    }
    Corpus::Keep
});

/// Asserts that a table with any bit flipped is refused.
fn one_bit_is_enough(bytes: &[u8], pick: &[u8]) {
    let mut input = Input(pick);
    let bit = usize::from(u16::from_le_bytes(input.take())) % (8 * bytes.len());
    let mut damaged = bytes.to_vec();
    damaged[bit / 8] ^= 1 << (bit % 8);
    assert!(Table::parse(&damaged).is_err());
}
