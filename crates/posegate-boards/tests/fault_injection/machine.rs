//! An emulated board under a debugger: runs a firmware from marker to marker, and reads its lamps.

use crate::firmware::Firmware;
use crate::remote::{EmulatorEnded, PC, Remote, Stop};
use posegate_testkit::firmware::start_qemu;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The lamps of the board: the interlock and the heartbeat.
pub const LEDS: u32 = 0x4002_8000;
/// Address of the number of the cycle in which the firmware must stop; above all memory that the firmware uses.
const STOP_AT: u32 = 0x2030_0000;
pub const NEVER: u32 = u32::MAX;
/// The board mirrors its flash at this address.
pub const SHOWN_AGAIN: u32 = 0x0040_0000;
/// Flash with its mirror, and RAM; each from its second instruction on.
const MEMORY: [Range<u32>; 2] = [2..2 * SHOWN_AGAIN, 0x2000_0002..0x2040_0000];
/// Addresses with no memory or only zeros. The emulator executes zeros as an instruction without effect, slowly. A
/// processor does not leave these addresses within a second.
const EMPTY: [Range<u32>; 3] = [
    2 * SHOWN_AGAIN..0x1e00_0000,
    0x2040_0000..0x3e00_0000,
    0x6000_0000..0x9e00_0000,
];
const INTERLOCK: u8 = 1;
const HEARTBEAT: u8 = 2;

/// The board's own count of hundredths of a second.
const HUNDREDTHS: u32 = 0x4002_8014;
/// A firmware hangs if it reaches no marker in this time of the board's clock; the whole schedule takes a tenth of it.
/// The emulator counts 64 ns per instruction, so the same firmware hangs on every machine.
const HANGS_AFTER: u32 = 100;
/// Stops at corrupted numbers of cycles after which a firmware counts as one that loops.
const MOST_STOPS: u32 = 1_000;
/// Slices of waiting after which the board's clock is read.
const A_LOOK: u32 = 5;

/// Where a firmware has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum At {
    /// At a breakpoint.
    Address(u32),
    /// At no breakpoint: the firmware loops or sleeps forever.
    Hung,
    /// The processor has locked up, which ends the emulation.
    LockedUp,
}

/// The lamps' levels, as bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lamps(u8);

/// An event of the firmware in the emulator's log.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    Lamps(Lamps),
    /// The cycle with this number begins.
    Begins(u32),
    /// A cycle ends, with the verdict's reason.
    Done {
        number: u32,
        reason: u32,
    },
}

impl Event {
    fn lamps(self) -> Option<Lamps> {
        match self {
            Self::Lamps(lamps) => Some(lamps),
            _ => None,
        }
    }
}

/// The offset of the register that markers write to.
const MARKS: u32 = 0x4c;

impl Lamps {
    pub const fn interlock(self) -> bool {
        self.0 & INTERLOCK != 0
    }
}

pub struct Machine {
    child: Child,
    pub remote: Remote,
    /// The sixteen core registers at the last stop.
    pub registers: [u32; 16],
    log: PathBuf,
    /// Bytes at the start of the log that are ignored.
    discarded: u64,
    // Contains the socket and the log; removed last.
    _directory: tempfile::TempDir,
}

impl Machine {
    /// Starts a board with the firmware loaded, stopped before its first instruction.
    ///
    /// # Panics
    /// If QEMU is missing (the message says how to install it) or does not start.
    pub fn start(firmware: &Firmware, arguments: &[&str]) -> Self {
        Self::start_file(firmware, &firmware.file, arguments)
    }

    /// As [`Machine::start`], with another file instead of the firmware's.
    pub fn start_file(firmware: &Firmware, file: &Path, arguments: &[&str]) -> Self {
        let directory = tempfile::tempdir().expect("a directory for the socket");
        let socket = directory.path().join("gdb");
        let log = directory.path().join("log");
        let mut child = start_qemu(
            Command::new("qemu-system-arm")
                .args(["-M", "mps2-an386", "-display", "none", "-serial", "null"])
                .args(["-monitor", "none", "-accel", "tcg,tb-size=16", "-S"])
                .args(["-icount", "shift=6"])
                .arg("-gdb")
                .arg(format!("unix:{},server=on,wait=off", socket.display()))
                .args(["-trace", "mps2_fpgaio_write", "-D"])
                .arg(&log)
                .args(arguments)
                .arg("-kernel")
                .arg(file)
                .arg("-device")
                .arg(firmware.erased())
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                .stderr(Stdio::null()),
        );
        let start = Instant::now();
        let stream = loop {
            if let Some(stream) = Remote::connect(&socket) {
                break stream;
            }
            let ended = child.try_wait().expect("the state of QEMU");
            assert!(ended.is_none(), "QEMU has ended at its start: {ended:?}");
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "QEMU's stub does not answer"
            );
            std::thread::sleep(Duration::from_millis(2));
        };
        let remote = Remote::new(stream).unwrap_or_else(|EmulatorEnded| panic!("QEMU has ended"));
        let mut machine = Self {
            child,
            remote,
            registers: [0; 16],
            log,
            discarded: 0,
            _directory: directory,
        };
        for marker in firmware.stops() {
            // A jump may lead to the mirror of the flash, and the firmware runs there as well.
            for place in [marker, marker + SHOWN_AGAIN] {
                machine
                    .remote
                    .set_breakpoint(place)
                    .unwrap_or_else(|EmulatorEnded| panic!("QEMU has ended"));
            }
        }
        machine
            .stop_at(NEVER)
            .unwrap_or_else(|EmulatorEnded| panic!("QEMU has ended"));
        machine
    }

    /// Makes the firmware stop at the beginning of this cycle.
    pub fn stop_at(&mut self, cycle: u32) -> Result<(), EmulatorEnded> {
        self.remote.write(STOP_AT, &cycle.to_le_bytes())
    }

    /// Runs, without a fault, to the beginning of a cycle, and passes the marker.
    pub fn run_to(&mut self, firmware: &Firmware, cycle: u32) -> Result<(), EmulatorEnded> {
        self.stop_at(cycle)?;
        let at = self.run();
        assert_eq!((at, self.registers[0]), (At::Address(firmware.stop), cycle));
        self.pass()?;
        self.stop_at(NEVER)
    }

    /// Lets the firmware run to the next breakpoint.
    pub fn run(&mut self) -> At {
        self.try_run().unwrap_or(At::LockedUp)
    }

    fn try_run(&mut self) -> Result<At, EmulatorEnded> {
        let started = self.hundredths()?;
        self.remote.start()?;
        let (mut slices, mut asleep_at) = (0, None);
        loop {
            match self.remote.wait() {
                Stop::Stopped => break,
                Stop::EmulatorEnded => return Err(EmulatorEnded),
                Stop::Running => slices += 1,
            }
            if slices == A_LOOK {
                slices = 0;
                self.remote.interrupt()?;
                if self.hundredths()?.wrapping_sub(started) > HANGS_AFTER {
                    return Ok(At::Hung);
                }
                let at = self.remote.registers()?[usize::from(PC)];
                let is_asleep = self.is_behind_wfi(at)?;
                if EMPTY.iter().any(|part| part.contains(&at)) || is_asleep && asleep_at == Some(at)
                {
                    return Ok(At::Hung);
                }
                asleep_at = is_asleep.then_some(at);
                self.remote.start()?;
            }
        }
        self.registers = self.remote.registers()?;
        // Hung by the same limit, so that the result does not depend on when the clock was read.
        if self.hundredths()?.wrapping_sub(started) > HANGS_AFTER {
            return Ok(At::Hung);
        }
        let address = self.registers[usize::from(PC)];
        Ok(At::Address(address % SHOWN_AGAIN))
    }

    /// Returns `true` if the processor is just after a `wfi`. If it is there twice in succession, it sleeps forever: the
    /// firmware enables no interrupt. The board's clock is stopped as well.
    fn is_behind_wfi(&mut self, at: u32) -> Result<bool, EmulatorEnded> {
        const WFI: [u8; 2] = [0x30, 0xbf];
        let is_code = MEMORY.iter().any(|part| part.contains(&at));
        Ok(is_code && self.remote.read(at - 2, 2)? == WFI)
    }

    fn hundredths(&mut self) -> Result<u32, EmulatorEnded> {
        let bytes = self.remote.read(HUNDREDTHS, 4)?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    /// Passes over the first instruction of a marker, which does nothing.
    pub fn pass(&mut self) -> Result<(), EmulatorEnded> {
        let next = self.registers[usize::from(PC)] + 2;
        self.remote.set_register(PC, next)
    }

    /// Reads the lamps.
    pub fn lamps(&mut self) -> Result<Lamps, EmulatorEnded> {
        Ok(Lamps(self.remote.read(LEDS, 4)?[0]))
    }

    /// Sets the lamps by the store instruction at an address, because the stub writes only to memory. Changes
    /// registers.
    pub fn set_lamps(&mut self, lamps: Lamps, store: u32) -> Result<(), EmulatorEnded> {
        self.remote.set_register(0, LEDS)?;
        self.remote.set_register(1, u32::from(lamps.0))?;
        self.remote.set_register(PC, store)?;
        self.remote.step()?;
        assert_eq!(self.lamps()?, lamps, "the lamps are not set");
        Ok(())
    }

    /// Returns the lamps as last written, by the emulator's log. Used after the emulator has ended.
    pub fn last_lamps(&self) -> Lamps {
        let lamps = self
            .events_after(0)
            .into_iter()
            .rev()
            .find_map(Event::lamps);
        lamps.unwrap_or(Lamps(0))
    }

    /// Lets a firmware with a fault run to its end. A corrupted number of a cycle may be the one that means never: then the firmware
    /// stops for the harness, and goes on.
    pub fn run_to_end(&mut self, firmware: &Firmware) -> Result<At, EmulatorEnded> {
        for _ in 0..MOST_STOPS {
            let at = self.run();
            if at != At::Address(firmware.stop) {
                return Ok(at);
            }
            self.pass()?;
        }
        Ok(At::Hung)
    }

    /// Returns `true` if a firmware that hangs goes on like this for as long again, and changes its heartbeat. Its events meanwhile are
    /// in the log. One that reaches its end after that time has no heartbeat either.
    pub fn beats(&mut self, firmware: &Firmware) -> bool {
        let before = self.events().len();
        if !self.run_to_end(firmware).is_ok_and(|at| at == At::Hung) {
            return false;
        }
        let all = self.events();
        let lamps = |events: &[Event]| -> Vec<Lamps> {
            events.iter().filter_map(|event| event.lamps()).collect()
        };
        let (old, new) = all.split_at(before);
        let mut seen = lamps(old).split_off(lamps(old).len().saturating_sub(1));
        seen.extend(lamps(new));
        let beats = |pair: &[Lamps]| pair[0].0 & HEARTBEAT != pair[1].0 & HEARTBEAT;
        seen.windows(2).any(beats)
    }

    /// Discards all events so far.
    pub fn discard_events(&mut self) {
        self.discarded = std::fs::metadata(&self.log).map_or(0, |data| data.len());
    }

    /// Returns the events that are not discarded.
    pub fn events(&self) -> Vec<Event> {
        self.events_after(self.discarded)
    }

    fn events_after(&self, discarded: u64) -> Vec<Event> {
        // "MPS2 FPGAIO write: offset 0x0 data 0x1 size 4"
        let mut text = Vec::new();
        let read = std::fs::File::open(&self.log).and_then(|mut file| {
            file.seek(SeekFrom::Start(discarded))?;
            file.read_to_end(&mut text)
        });
        // Before the first event there is no log.
        let _ = read;
        let number = |line: &str, name: &str| {
            let (_, rest) = line.split_once(name)?;
            u32::from_str_radix(rest.split(' ').next()?, 16).ok()
        };
        String::from_utf8_lossy(&text)
            .lines()
            .filter_map(|line| {
                let value = number(line, "data 0x")?;
                match number(line, "offset 0x")? {
                    0 => Some(Event::Lamps(Lamps(value as u8))),
                    MARKS if value >> 30 == 1 => Some(Event::Begins(value & 0xffff)),
                    MARKS if value >> 31 == 1 => Some(Event::Done {
                        number: value & 0xffff,
                        reason: value >> 16 & 0x7fff,
                    }),
                    _ => None,
                }
            })
            .collect()
    }

    /// The log that the emulator writes.
    pub fn log(&self) -> &Path {
        &self.log
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        // Ends only this machine's QEMU. An error means that it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
