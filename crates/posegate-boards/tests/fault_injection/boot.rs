//! A firmware whose image is damaged before it starts, or that was never sealed, never opens.

use crate::firmware::Firmware;
use crate::golden::Sample;
use crate::machine::{At, Event, Lamps, Machine};
use crate::random::Random;
use posegate::gate::Reason;
use std::path::Path;

/// Number of cycles that run: without damage the second opens.
const CYCLES: u32 = 4;

/// The results of starts with a damaged image.
#[derive(Default)]
pub struct Starts {
    pub tried: u64,
    /// The gate was latched by the check of the code.
    pub found: u64,
    /// The gate stayed closed before that, by the self-test, the check of the table, that of its own words or that of the table's identity.
    pub found_before: u64,
    /// The program ended before that, with the output low.
    pub ended: u64,
    pub opened: u64,
}

/// Starts the firmware `count` times, each time with one bit of the image flipped.
pub fn damaged(firmware: &Firmware, count: u64, seed: u64) -> Starts {
    let folder = tempfile::tempdir().expect("a directory for the damaged firmware");
    let mut starts = Starts::default();
    for index in 0..count {
        let mut random = Random::new(seed, index);
        let at = random.below(firmware.image.len() as u64) as u32;
        let file = firmware.damaged(at, random.below(8) as u8, folder.path());
        starts.add(firmware, &file);
    }
    starts
}

/// Starts the firmware as the linker left it, unsealed.
pub fn unsealed(firmware: &Firmware) -> Starts {
    let mut starts = Starts::default();
    starts.add(firmware, &firmware.built);
    starts
}

impl Starts {
    fn add(&mut self, firmware: &Firmware, file: &Path) {
        let mut machine = Machine::start_file(firmware, file, &[]);
        let stop = machine.stop_at(CYCLES).map(|()| machine.run());
        let ended = !stop.is_ok_and(|at| at == At::Address(firmware.stop));
        let events = machine.events();
        let opened = events
            .iter()
            .any(|event| matches!(event, Event::Lamps(lamps) if lamps.interlock()));
        let latched = |by: &[Reason]| {
            let codes: Vec<u32> = by.iter().map(|reason| u32::from(reason.code())).collect();
            let samples = Sample::all(Lamps::default(), &events);
            samples.len() == CYCLES as usize && samples.iter().all(|s| codes.contains(&s.reason))
        };
        let found = latched(&[Reason::CodeDamaged]);
        let found_before = latched(&[
            Reason::SelfTestFailed,
            Reason::TableDamaged,
            Reason::MemoryDamaged,
            // A bit of the name or of the digest, in the table or in the settings.
            Reason::WrongTask,
            Reason::WrongSite,
        ]);
        self.tried += 1;
        self.opened += u64::from(opened);
        self.found += u64::from(found);
        self.found_before += u64::from(found_before);
        // A program that ends after the check was latched in every cycle counts as found.
        self.ended += u64::from(ended && !found && !found_before);
    }
}
