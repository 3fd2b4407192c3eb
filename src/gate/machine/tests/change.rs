//! A gate that is given another table.

use super::*;

/// Returns the gate after a change of its table at 1010 ms.
fn change<'a>(gate: &Gate<'a>, bytes: &'a [u8], settings: &'a Settings<'a>) -> Gate<'a> {
    Gate::after(gate.is_sound(), bytes, settings, 1010).unwrap()
}

#[test]
fn a_changed_gate_is_closed_and_opens_with_its_own_task() {
    let (see_t7, dock) = (Table::parse(SEE_T7).unwrap(), Table::parse(DOCK).unwrap());
    let (first, second) = (settings(&see_t7, 1), settings(&dock, 1));
    let mut gate = Gate::new(SEE_T7, &first, 900).unwrap();
    assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
    let mut gate = change(&gate, DOCK, &second);
    assert_eq!(gate.state(), State::Inhibited(Reason::Silent));
    assert!(!gate.tick(1011).permission.is_permit());
    // 0.5 m beside the goal: inside the first success set only.
    let beside = |gate: &mut Gate<'_>| gate.step(1050, &report(5, 0.5)).permission.is_permit();
    let mut at_dock = report(6, 0.0);
    let small = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-7]];
    at_dock.belief.spread = Some(Uncertainty::Gaussian(small));
    assert!(!beside(&mut gate));
    let step = gate.step(1090, &at_dock);
    assert_eq!(step.verdict, Ok(()));
    assert!(step.permission.is_permit());
    assert!(beside(&mut change(&gate, SEE_T7, &first)));
    // The settings of another task are refused as in a new gate.
    let wrong = change(&gate, SEE_T7, &second);
    assert_eq!(wrong.state(), State::Latched(Reason::WrongTask));
    // A gate that has no table for that reason alone can be given one.
    let healed = change(&wrong, DOCK, &second);
    assert_eq!(healed.state(), State::Inhibited(Reason::Silent));
}

/// A gate without a table is latched for that. A fault that is found then must not be lost with the reason of the table.
#[test]
fn a_fault_of_a_gate_without_a_table_outlives_a_change() {
    let table = Table::parse(SEE_T7).unwrap();
    let given = settings(&table, 1);
    for bytes in [b"".as_slice(), DOCK] {
        let mut refused = Gate::new(bytes, &given, 900).unwrap();
        refused.fault(Reason::InterlockFault);
        refused.fault(Reason::MemoryDamaged);
        let changed = change(&refused, SEE_T7, &given);
        assert_eq!(changed.state(), State::Latched(Reason::InterlockFault));
    }
}

#[test]
fn a_latched_fault_outlives_a_change() {
    let table = Table::parse(SEE_T7).unwrap();
    let given = settings(&table, 1);
    let mut gate = Gate::new(SEE_T7, &given, 900).unwrap();
    gate.fault(Reason::InterlockFault);
    let latched = State::Latched(Reason::InterlockFault);
    assert_eq!(change(&gate, SEE_T7, &given).state(), latched);
    // Also through a table that is refused on the way.
    assert_eq!(
        change(&change(&gate, b"", &given), SEE_T7, &given).state(),
        latched
    );

    for (state, checked) in [(0, given.digest()), (1, given.digest()), (0, 7)] {
        let mut gate = Gate::new(SEE_T7, &given, 900).unwrap();
        if state == 1 {
            gate.state = RedundantWord::new(0x1234_5678);
        }
        gate.checked = RedundantWord::new(checked);
        let is_damaged = state == 1 || checked == 7;
        let expected = if is_damaged {
            State::Latched(Reason::MemoryDamaged)
        } else {
            State::Inhibited(Reason::Silent)
        };
        assert_eq!(change(&gate, SEE_T7, &given).state(), expected);
    }
    let failed = Gate::after(Err(Reason::SelfTestFailed), SEE_T7, &given, 900).unwrap();
    let latched = State::Latched(Reason::SelfTestFailed);
    assert_eq!(change(&failed, SEE_T7, &given).state(), latched);
}
