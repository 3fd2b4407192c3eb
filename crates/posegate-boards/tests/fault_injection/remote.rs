//! The part of gdb's remote protocol that fault injection needs.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

/// The state of a firmware that was started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// It is at a breakpoint, or was interrupted.
    Stopped,
    /// It still runs.
    Running,
    /// The emulator has ended.
    EmulatorEnded,
}

/// The emulator has ended.
#[derive(Debug)]
pub struct EmulatorEnded;

/// A connection to an emulated processor.
pub struct Remote {
    stream: UnixStream,
    pending: Vec<u8>,
}

/// How long a read may wait before the caller checks the emulator.
pub const SLICE: Duration = Duration::from_millis(20);
/// Slices that an answer to a command takes at most, even on a busy machine.
const PATIENCE: u32 = 3000;

impl Remote {
    /// Connects to QEMU's stub.
    pub fn new(stream: UnixStream) -> Result<Self, EmulatorEnded> {
        stream
            .set_read_timeout(Some(SLICE))
            .expect("a limit on reading");
        let mut remote = Self {
            stream,
            pending: Vec::new(),
        };
        remote.ask("QStartNoAckMode")?;
        remote.stream.write_all(b"+").map_err(|_| EmulatorEnded)?;
        // Without this the stub answers neither `p` nor `P`.
        remote.ask("qXfer:features:read:target.xml:0,ffb")?;
        Ok(remote)
    }

    /// Connects to the socket. `None` if it does not exist yet.
    pub fn connect(socket: &Path) -> Option<UnixStream> {
        UnixStream::connect(socket).ok()
    }

    fn send(&mut self, command: &str) -> Result<(), EmulatorEnded> {
        let sum = command.bytes().fold(0u8, u8::wrapping_add);
        let packet = format!("${command}#{sum:02x}");
        self.stream
            .write_all(packet.as_bytes())
            .map_err(|_| EmulatorEnded)
    }

    /// Returns the next packet, if it arrives within a slice of time.
    fn packet(&mut self) -> Result<Option<String>, EmulatorEnded> {
        loop {
            if let Some(start) = self.pending.iter().position(|b| *b == b'$')
                && let Some(end) = self.pending[start..].iter().position(|b| *b == b'#')
                && self.pending.len() >= start + end + 3
            {
                let body = self.pending[start + 1..start + end].to_vec();
                self.pending.drain(..start + end + 3);
                return Ok(Some(String::from_utf8_lossy(&body).into_owned()));
            }
            let mut buffer = [0; 4096];
            match self.stream.read(&mut buffer) {
                Ok(0) => return Err(EmulatorEnded),
                Ok(length) => self.pending.extend(&buffer[..length]),
                Err(error) => match error.kind() {
                    ErrorKind::WouldBlock | ErrorKind::TimedOut => return Ok(None),
                    ErrorKind::Interrupted => {}
                    _ => return Err(EmulatorEnded),
                },
            }
        }
    }

    fn answer(&mut self) -> Result<String, EmulatorEnded> {
        for _ in 0..PATIENCE {
            if let Some(packet) = self.packet()? {
                return Ok(packet);
            }
        }
        panic!("QEMU's stub does not answer");
    }

    fn ask(&mut self, command: &str) -> Result<String, EmulatorEnded> {
        self.send(command)?;
        self.answer()
    }

    fn demand_ok(&mut self, command: &str) -> Result<(), EmulatorEnded> {
        let answer = self.ask(command)?;
        assert_eq!(answer, "OK", "QEMU's stub refuses {command}");
        Ok(())
    }

    /// Reads a register: 0 to 15, or [`XPSR`].
    pub fn register(&mut self, number: u8) -> Result<u32, EmulatorEnded> {
        let answer = self.ask(&format!("p{number:x}"))?;
        let bytes = bytes_of(&answer);
        let word = bytes.first_chunk().expect("a register of 32 bits");
        Ok(u32::from_le_bytes(*word))
    }

    pub fn set_register(&mut self, number: u8, value: u32) -> Result<(), EmulatorEnded> {
        let value = hex(&value.to_le_bytes());
        self.demand_ok(&format!("P{number:x}={value}"))
    }

    /// Reads all registers at once, in the stub's format.
    pub fn all_registers(&mut self) -> Result<String, EmulatorEnded> {
        self.ask("g")
    }

    pub fn set_all_registers(&mut self, all: &str) -> Result<(), EmulatorEnded> {
        self.demand_ok(&format!("G{all}"))
    }

    /// Reads the sixteen core registers.
    pub fn registers(&mut self) -> Result<[u32; 16], EmulatorEnded> {
        let bytes = bytes_of(&self.ask("g")?);
        let word = |k: usize| bytes[4 * k..4 * k + 4].first_chunk().copied();
        Ok(std::array::from_fn(|k| {
            u32::from_le_bytes(word(k).expect("sixteen registers"))
        }))
    }

    pub fn read(&mut self, address: u32, length: u32) -> Result<Vec<u8>, EmulatorEnded> {
        let answer = self.ask(&format!("m{address:x},{length:x}"))?;
        let bytes = bytes_of(&answer);
        assert_eq!(bytes.len(), length as usize, "no memory at {address:#x}");
        Ok(bytes)
    }

    pub fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), EmulatorEnded> {
        self.demand_ok(&format!("M{address:x},{:x}:{}", bytes.len(), hex(bytes)))
    }

    /// Reads memory of any length; a packet contains 2 kB.
    pub fn read_long(&mut self, address: u32, length: u32) -> Result<Vec<u8>, EmulatorEnded> {
        let mut bytes = Vec::new();
        while (bytes.len() as u32) < length {
            let at = bytes.len() as u32;
            bytes.extend(self.read(address + at, (length - at).min(1024))?);
        }
        Ok(bytes)
    }

    pub fn write_long(&mut self, address: u32, bytes: &[u8]) -> Result<(), EmulatorEnded> {
        for (number, part) in (0..).zip(bytes.chunks(1024)) {
            self.write(address + 1024 * number, part)?;
        }
        Ok(())
    }

    /// Flips a bit of memory.
    pub fn flip(&mut self, address: u32, bit: u8) -> Result<(), EmulatorEnded> {
        let byte = self.read(address, 1)?[0];
        self.write(address, &[byte ^ 1 << bit])
    }

    pub fn set_breakpoint(&mut self, address: u32) -> Result<(), EmulatorEnded> {
        self.demand_ok(&format!("Z0,{address:x},2"))
    }

    pub fn clear_breakpoint(&mut self, address: u32) -> Result<(), EmulatorEnded> {
        self.demand_ok(&format!("z0,{address:x},2"))
    }

    /// Runs a command of QEMU's monitor.
    pub fn console(&mut self, command: &str) -> Result<(), EmulatorEnded> {
        self.send(&format!("qRcmd,{}", hex(command.as_bytes())))?;
        // Its output arrives in separate packets before `OK`.
        while self.answer()? != "OK" {}
        Ok(())
    }

    /// Starts the processor.
    pub fn start(&mut self) -> Result<(), EmulatorEnded> {
        self.send("c")
    }

    /// Executes one instruction.
    pub fn step(&mut self) -> Result<(), EmulatorEnded> {
        self.ask("s").map(drop)
    }

    /// Waits a slice of time for the processor to stop.
    pub fn wait(&mut self) -> Stop {
        match self.packet() {
            Ok(Some(packet)) if packet.starts_with('T') || packet.starts_with('S') => Stop::Stopped,
            Ok(Some(packet)) if packet.starts_with('W') || packet.starts_with('X') => {
                Stop::EmulatorEnded
            }
            Ok(_) => Stop::Running,
            Err(EmulatorEnded) => Stop::EmulatorEnded,
        }
    }

    /// Stops the processor wherever it is.
    pub fn interrupt(&mut self) -> Result<(), EmulatorEnded> {
        self.stream.write_all(&[3]).map_err(|_| EmulatorEnded)?;
        for _ in 0..PATIENCE {
            match self.wait() {
                Stop::Stopped => return Ok(()),
                Stop::EmulatorEnded => return Err(EmulatorEnded),
                Stop::Running => {}
            }
        }
        panic!("QEMU does not stop");
    }
}

pub const SP: u8 = 13;
pub const PC: u8 = 15;
/// The number of the program status register for M-profile cores.
pub const XPSR: u8 = 25;

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn bytes_of(text: &str) -> Vec<u8> {
    let pairs = text.as_bytes().chunks(2);
    pairs
        .map(|pair| {
            std::str::from_utf8(pair)
                .ok()
                .and_then(|pair| u8::from_str_radix(pair, 16).ok())
                .unwrap_or_else(|| panic!("the stub answers {text:?}"))
        })
        .collect()
}
