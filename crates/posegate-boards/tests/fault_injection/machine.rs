//! An emulated board under a debugger: runs a firmware from marker to marker, and looks at its lamps.

use crate::firmware::Firmware;
use crate::remote::{Gone, PC, Remote, Stop};
use posegate_testkit::firmware::start_qemu;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The lamps of the board: the interlock and the heartbeat.
const LEDS: u32 = 0x4002_8000;
/// Where the number of the cycle stands in which the firmware shall stop; above all that it uses.
const STOP_AT: u32 = 0x2030_0000;
pub const NEVER: u32 = u32::MAX;
/// The board shows its flash once more so much higher.
pub const SHOWN_AGAIN: u32 = 0x0040_0000;
/// Flash, twice, and RAM; from behind their first instruction on.
const MEMORY: [Range<u32>; 2] = [2..2 * SHOWN_AGAIN, 0x2000_0002..0x2040_0000];
/// Where the board has nothing, or nothing but zeros: the emulator executes those, an instruction that does nothing, and
/// takes long for it. From here a processor does not come out in a second.
const EMPTY: [Range<u32>; 3] = [
    2 * SHOWN_AGAIN..0x1e00_0000,
    0x2040_0000..0x3e00_0000,
    0x6000_0000..0x9e00_0000,
];
const INTERLOCK: u8 = 1;
const HEARTBEAT: u8 = 2;

/// The board's own count of hundredths of a second.
const HUNDREDTHS: u32 = 0x4002_8014;
/// A firmware that has come to no marker in so long, by the board's clock, hangs: the whole schedule takes a tenth of it.
/// The emulator counts instructions and takes 64 ns for each, so what hangs is the same on every machine.
const HANGS_AFTER: u32 = 100;
/// Slices of waiting after which the board's clock is looked at.
const A_LOOK: u32 = 5;

/// Where a firmware has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum At {
    /// At a breakpoint.
    Address(u32),
    /// At none, for good: it loops or sleeps.
    Hung,
    /// The processor has locked up, which ends the emulation.
    LockedUp,
}

/// The lamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lamps(u8);

/// What a firmware has done, by the emulator's log.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    Lamps(Lamps),
    /// The cycle of a number begins.
    Begins(u32),
    /// It is over, with a verdict's reason.
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
    /// What of the log is of no interest any more, bytes.
    forgotten: u64,
    // Holds the socket and the log; removed last.
    _directory: tempfile::TempDir,
}

impl Machine {
    /// A board with the firmware loaded, before its first instruction.
    ///
    /// # Panics
    /// Where QEMU is missing (says how to install it) or does not start.
    pub fn start(firmware: &Firmware, arguments: &[&str]) -> Self {
        Self::start_file(firmware, &firmware.file, arguments)
    }

    /// The same with another file in the firmware's place.
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
        let remote = Remote::new(stream).unwrap_or_else(|Gone| panic!("QEMU has ended"));
        let mut machine = Self {
            child,
            remote,
            registers: [0; 16],
            log,
            forgotten: 0,
            _directory: directory,
        };
        for marker in firmware.stops() {
            // A jump may lead to where the board shows its flash again: it runs there as well.
            for place in [marker, marker + SHOWN_AGAIN] {
                machine
                    .remote
                    .set_breakpoint(place)
                    .unwrap_or_else(|Gone| panic!("QEMU has ended"));
            }
        }
        machine
            .stop_at(NEVER)
            .unwrap_or_else(|Gone| panic!("QEMU has ended"));
        machine
    }

    /// Lets the firmware stop where this cycle begins.
    pub fn stop_at(&mut self, cycle: u32) -> Result<(), Gone> {
        self.remote.write(STOP_AT, &cycle.to_le_bytes())
    }

    /// Runs, without a fault, to the beginning of a cycle, and passes the marker.
    pub fn run_to(&mut self, firmware: &Firmware, cycle: u32) -> Result<(), Gone> {
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

    fn try_run(&mut self) -> Result<At, Gone> {
        let started = self.hundredths()?;
        self.remote.start()?;
        let (mut slices, mut asleep_at) = (0, None);
        loop {
            match self.remote.wait() {
                Stop::Stopped => break,
                Stop::Gone => return Err(Gone),
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
        // Later than a look would have let it: so it does not matter when it was looked at.
        if self.hundredths()?.wrapping_sub(started) > HANGS_AFTER {
            return Ok(At::Hung);
        }
        let address = self.registers[usize::from(PC)];
        Ok(At::Address(address % SHOWN_AGAIN))
    }

    /// Whether the processor stands behind a `wfi`. At two looks in the same place it sleeps, and nothing wakes it: the
    /// firmware enables no interrupt. The board's clock stands still as well.
    fn is_behind_wfi(&mut self, at: u32) -> Result<bool, Gone> {
        const WFI: [u8; 2] = [0x30, 0xbf];
        let is_code = MEMORY.iter().any(|part| part.contains(&at));
        Ok(is_code && self.remote.read(at - 2, 2)? == WFI)
    }

    fn hundredths(&mut self) -> Result<u32, Gone> {
        let bytes = self.remote.read(HUNDREDTHS, 4)?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    /// Passes over the first instruction of a marker, which does nothing.
    pub fn pass(&mut self) -> Result<(), Gone> {
        let next = self.registers[usize::from(PC)] + 2;
        self.remote.set_register(PC, next)
    }

    /// The lamps as they are.
    pub fn lamps(&mut self) -> Result<Lamps, Gone> {
        Ok(Lamps(self.remote.read(LEDS, 4)?[0]))
    }

    /// Sets the lamps: by the store instruction at an address, since the stub writes to memory only. Changes
    /// registers.
    pub fn set_lamps(&mut self, lamps: Lamps, store: u32) -> Result<(), Gone> {
        self.remote.set_register(0, LEDS)?;
        self.remote.set_register(1, u32::from(lamps.0))?;
        self.remote.set_register(PC, store)?;
        self.remote.step()?;
        assert_eq!(self.lamps()?, lamps, "the lamps are not set");
        Ok(())
    }

    /// The lamps as they were last written, by the emulator's log: for when it has ended.
    pub fn last_lamps(&self) -> Lamps {
        let lamps = self
            .events_after(0)
            .into_iter()
            .rev()
            .find_map(Event::lamps);
        lamps.unwrap_or(Lamps(0))
    }

    /// Whether a firmware that comes to no marker still beats. What it does meanwhile is in the log.
    pub fn beats(&mut self) -> bool {
        let before = self.events().len();
        match self.run() {
            At::LockedUp => false,
            // At a marker after all: it lives.
            At::Address(_) => true,
            At::Hung => {
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
        }
    }

    /// Forgets what has happened so far.
    pub fn forget(&mut self) {
        self.forgotten = std::fs::metadata(&self.log).map_or(0, |data| data.len());
    }

    /// What has happened so far and is not forgotten.
    pub fn events(&self) -> Vec<Event> {
        self.events_after(self.forgotten)
    }

    fn events_after(&self, forgotten: u64) -> Vec<Event> {
        // "MPS2 FPGAIO write: offset 0x0 data 0x1 size 4"
        let mut text = Vec::new();
        let read = std::fs::File::open(&self.log).and_then(|mut file| {
            file.seek(SeekFrom::Start(forgotten))?;
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
        // Only this machine's own QEMU. It may have ended already: then there is nothing to stop.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
