//! Calls every function of the C boundary with every pair of its pointers sharing memory, fully and in part. Structs of
//! numbers may overlap: the answer is that of the same call without overlap. Storage must not overlap: the call returns
//! an error, a denial in the output, and storage that is no longer in use.

mod support;

use posegate::gate::Reason;
use posegate_c::*;
use std::collections::BTreeSet;
use support::functions::{
    Argument, Function, Kind, functions, memory, open, put, read, report, set_up_gate,
};
use support::{DOCK, settings};

/// Returns the address of each argument: all separate, or one of a pair the given number of bytes after the other.
fn places(arguments: &[Argument], pair: Option<(usize, usize, isize)>) -> Vec<*mut u8> {
    let mut places: Vec<_> = arguments
        .iter()
        .map(|argument| memory(argument.bytes.len()))
        .collect();
    if let Some((first, second, offset)) = pair {
        // Space before and after.
        let size = arguments[first].bytes.len() + 2 * arguments[second].bytes.len() + 64;
        let before = arguments[second].bytes.len().next_multiple_of(16) + 16;
        places[first] = memory(size + before).wrapping_add(before);
        places[second] = places[first].wrapping_offset(offset);
    }
    places
}

/// Returns the answer of a function with separate arguments: its status and its outputs.
fn apart(function: &Function, given: &[Vec<u8>], set: bool) -> (posegate_status, Vec<Vec<u8>>) {
    let places = places(&function.arguments, None);
    for ((argument, place), bytes) in function.arguments.iter().zip(&places).zip(given) {
        if !argument.is_storage() {
            put(*place, bytes);
        } else if set {
            argument.set_up(*place);
        }
    }
    let status = function.call(&places);
    (status, function.outputs(&places))
}

#[test]
fn overlapping_arguments_are_read_first_or_refused() {
    let (mut same, mut refused) = (0, 0);
    for function in functions() {
        let arguments = &function.arguments;
        let as_given: Vec<_> = arguments.iter().map(|a| a.bytes.clone()).collect();
        // The answer of an error: for storage that was never in use.
        let denied = apart(&function, &as_given, false).1;
        for first in 0..arguments.len() {
            for second in first + 1..arguments.len() {
                let (a, b) = (&arguments[first], &arguments[second]);
                let align = b.align.max(1) as isize;
                let lowest = -(b.bytes.len() as isize - 1) / align * align;
                for offset in (lowest..a.bytes.len() as isize).step_by(b.align.max(1)) {
                    let what = format!("{}: {first} and {second} at {offset}", function.name);
                    let places = places(arguments, Some((first, second, offset)));
                    let with_storage = a.is_storage() || b.is_storage();
                    for (k, (argument, place)) in arguments.iter().zip(&places).enumerate() {
                        if argument.is_storage() {
                            argument.set_up(*place);
                        } else if !(with_storage && (k == first || k == second)) {
                            put(*place, &argument.bytes);
                        }
                    }
                    let given: Vec<_> = arguments
                        .iter()
                        .zip(&places)
                        .map(|(argument, place)| read(*place, argument.bytes.len()))
                        .collect();
                    let status = function.call(&places);
                    let written = function.outputs(&places);
                    // A gate borrows its table, and writes its counter as long as it is used.
                    let borrowed =
                        function.name == "posegate_gate_init" && (first, second) == (1, 3);
                    if with_storage || borrowed {
                        assert_eq!(status, posegate_status::Overlap, "{what}");
                        assert_eq!(written, denied, "{what}");
                        for (k, argument) in arguments.iter().enumerate() {
                            let Kind::Storage { size, .. } = argument.kind else {
                                continue;
                            };
                            if k == first || k == second {
                                let other = if k == first { second } else { first };
                                let begins = places[other].addr();
                                let ends = begins + arguments[other].bytes.len();
                                // Elements of an array that are not overlapped do not change.
                                for at in (0..argument.bytes.len()).step_by(size) {
                                    let place = places[k].wrapping_add(at);
                                    let touched =
                                        place.addr() < ends && begins < place.addr() + size;
                                    assert_eq!(argument.is_in_use(place), !touched, "{what}");
                                }
                            }
                        }
                        refused += 1;
                    } else {
                        let expected = apart(&function, &given, true);
                        assert_eq!((status, written), expected, "{what}");
                        same += 1;
                    }
                }
            }
        }
    }
    assert!(same > 1000 && refused > 3000, "{same} {refused}");
}

/// A union of the report and the step, as in a controller with little memory: the denial that is written
/// first must not be evaluated as the report.
#[test]
fn report_overlapping_its_answer_is_read_before_the_write() {
    let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
    let counter = memory(4).cast();
    let union = memory(size_of::<posegate_report>());
    // SAFETY: valid pointers.
    unsafe {
        let (table, length) = (DOCK.as_ptr(), DOCK.len());
        let status = posegate_gate_init(gate, table, length, &settings(), counter, 0);
        assert_eq!(status, posegate_status::Ok);
        for sequence in 0..10 {
            let now_ms = 20 * sequence;
            union
                .cast::<posegate_report>()
                .write(report(sequence, now_ms, 7.0, -3.0));
            let step = union.cast::<posegate_step>();
            let status = posegate_gate_step(gate, now_ms, union.cast(), step);
            assert_eq!(status, posegate_status::Ok);
            let permission = &raw const (*step).permission;
            assert_eq!(
                posegate_permission_is_permit(permission, now_ms),
                POSEGATE_DENY
            );
            assert_eq!((*step).reason, u32::from(Reason::OutsideTable.code()));
        }
    }
}

/// Settings that share memory with the counter or the table are used as given: the gate opens as usual.
#[test]
fn settings_overlapping_the_counter_are_read_first() {
    for offset in (0..size_of::<posegate_settings>()).step_by(4) {
        let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
        let shared = memory(size_of::<posegate_settings>());
        // SAFETY: valid pointers.
        unsafe {
            let given = shared.cast::<posegate_settings>();
            given.write(settings());
            let counter = shared.add(offset).cast();
            let (table, length) = (DOCK.as_ptr(), DOCK.len());
            let status = posegate_gate_init(gate, table, length, given, counter, 0);
            assert_eq!(status, posegate_status::Ok, "{offset}");
            open(gate);
        }
    }
}

/// A later call that overwrites the counter is detected: the gate latches.
#[test]
fn an_output_in_the_counter_latches_the_gate() {
    let step = memory(size_of::<posegate_step>());
    for offset in (0..size_of::<posegate_step>()).step_by(4) {
        let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
        // SAFETY: valid pointers.
        unsafe {
            let (table, length) = (DOCK.as_ptr(), DOCK.len());
            let counter = step.add(offset).cast();
            let status = posegate_gate_init(gate, table, length, &settings(), counter, 0);
            assert_eq!(status, posegate_status::Ok);
            let step = step.cast::<posegate_step>();
            for sequence in 0..4 {
                let now_ms = 25 * sequence;
                let good = report(sequence, now_ms, 0.0, 0.0);
                let _ = posegate_gate_step(gate, now_ms, &good, step);
                let permission = &raw const (*step).permission;
                let permit = posegate_permission_is_permit(permission, now_ms);
                assert_eq!(permit, POSEGATE_DENY, "{offset}");
            }
        }
    }
}

/// An address of the counter with a flipped bit is not dereferenced.
#[test]
fn corrupted_counter_address_latches_the_gate() {
    let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
    let counter = memory(4).cast::<u32>();
    assert_eq!(set_up_gate(gate, counter), posegate_status::Ok);
    let whole = read(gate.cast(), size_of::<posegate_gate>());
    let address = counter.addr().to_le_bytes();
    let at = whole
        .windows(address.len())
        .position(|bytes| bytes == address)
        .expect("the address of the counter");
    for bit in 0..8 * address.len() {
        let mut fallen = whole.clone();
        fallen[at + bit / 8] ^= 1 << (bit % 8);
        put(gate.cast(), &fallen);
        // SAFETY: valid pointers.
        unsafe {
            let mut step = core::mem::zeroed();
            assert_eq!(posegate_gate_tick(gate, 76, &mut step), posegate_status::Ok);
            let reason = u32::from(Reason::MemoryDamaged.code());
            assert_eq!(step.state.reason, reason, "{bit}");
        }
    }
}

/// The tests above, and that of bad pointers, cover all functions of the header with a pointer that return a status.
#[test]
fn every_function_with_a_pointer_is_tested() {
    let header = include_str!("../../../include/posegate.h");
    let (_, declared) = header.split_once("extern \"C\" {").unwrap();
    let mut tried: BTreeSet<_> = functions().iter().map(|f| f.name.to_owned()).collect();
    for declaration in declared.split(';') {
        let code: String = declaration
            .split("*/")
            .last()
            .unwrap()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        let Some((head, parameters)) = code.split_once('(') else {
            continue;
        };
        let name = head.rsplit([' ', '*']).next().unwrap();
        if head.starts_with("posegate_status ") && parameters.contains('*') {
            assert!(tried.remove(name), "{name} is not tried");
        }
    }
    assert_eq!(tried, BTreeSet::new());
}

/// A saved gate that is restored after a fault does not contain the fault, but its counter shows it.
#[test]
fn restored_gate_copy_is_refused() {
    let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
    assert_eq!(set_up_gate(gate, memory(4).cast()), posegate_status::Ok);
    let step = memory(size_of::<posegate_step>()).cast::<posegate_step>();
    let open = |now_ms| {
        // SAFETY: valid pointers.
        unsafe {
            let status = posegate_gate_tick(gate, now_ms, step);
            assert_eq!(status, posegate_status::Ok);
            let permission = &raw const (*step).permission;
            posegate_permission_is_permit(permission, now_ms) == POSEGATE_PERMIT
        }
    };
    assert!(open(76));
    let saved = read(gate.cast(), size_of::<posegate_gate>());
    // SAFETY: a valid pointer.
    let status = unsafe { posegate_gate_fault(gate, u32::from(Reason::CodeDamaged.code())) };
    assert_eq!(status, posegate_status::Ok);
    assert!(!open(77));
    for _ in 0..3 {
        put(gate.cast(), &saved);
        assert!(!open(78));
        // SAFETY: a valid pointer.
        let state = unsafe { (*step).state };
        assert_eq!(state.kind, posegate_state_kind::Latched as u32);
        assert_eq!(state.reason, u32::from(Reason::MemoryDamaged.code()));
    }
    // After another start, successful or not, an old copy is refused, too.
    let mut latched = settings();
    latched.task_digest[0] ^= 1;
    let mut refused = settings();
    refused.permits_in_a_row = 0;
    for (settings, expected) in [
        (latched, posegate_status::Ok),
        (refused, posegate_status::PermitsInARow),
    ] {
        let gate = memory(size_of::<posegate_gate>()).cast::<posegate_gate>();
        let counter = memory(4).cast();
        assert_eq!(set_up_gate(gate, counter), posegate_status::Ok);
        let saved = read(gate.cast(), size_of::<posegate_gate>());
        // SAFETY: valid pointers.
        unsafe {
            let (table, length) = (DOCK.as_ptr(), DOCK.len());
            let status = posegate_gate_init(gate, table, length, &settings, counter, 76);
            assert_eq!(status, expected);
            put(gate.cast(), &saved);
            assert_eq!(posegate_gate_tick(gate, 77, step), posegate_status::Ok);
            assert_eq!(
                (*step).state.reason,
                u32::from(Reason::MemoryDamaged.code())
            );
        }
    }
    // A manual reset ends it, as for any latched fault.
    // SAFETY: a valid pointer.
    assert_eq!(
        unsafe { posegate_gate_reset(gate, 80) },
        posegate_status::Ok
    );
    assert!(!open(81));
    // SAFETY: a valid pointer.
    assert_eq!(
        unsafe { (*step).state.kind },
        posegate_state_kind::Inhibited as u32
    );
}
