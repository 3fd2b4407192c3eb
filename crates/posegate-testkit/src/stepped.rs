//! An emulated board in virtual time, which a test drives. `stepper.rs` stops the board before each control cycle and
//! at each interrupt of its watchdog. The board then takes the test's bytes and runs to the next stop. QEMU derives
//! time from the number of executed instructions, so two runs of a test are identical, on any machine and under any
//! load.

use crate::firmware::start_qemu;
use posegate::wire::{Frame, LONGEST_FRAME, Receiver};
use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{LazyLock, mpsc};
use std::time::Duration;

/// Longer than a control cycle takes on any machine. An emulator that hangs fails the test after this time.
const PATIENCE: Duration = Duration::from_secs(120);
/// Largest size of a firmware in flash, bytes.
const FLASH: usize = 0x2_0000;
/// The loop of an idle processor, `wfi` and a branch back to it; and the `nop` that replaces the `wfi`.
const IDLE: [u8; 4] = [0x30, 0xbf, 0xfd, 0xe7];
const NOP: [u8; 2] = [0x00, 0xbf];

/// Where a board stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum At {
    /// Before the firmware's first instruction.
    Start,
    /// Before a control cycle: the timer's interrupt has come.
    Cycle,
    /// The watchdog's interrupt has come.
    Watchdog,
}

/// A stop of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    pub at: At,
    /// The board's clock.
    pub now_ms: u32,
    /// The register of lamps: bit 0 the interlock, bit 1 the heartbeat.
    lamps: u32,
}

impl Stop {
    pub const fn interlock_is_high(&self) -> bool {
        self.lamps & 1 != 0
    }

    pub const fn heartbeat_is_high(&self) -> bool {
        self.lamps & 2 != 0
    }
}

/// An emulated board that runs a firmware. Dropping this value ends the emulator.
pub struct Stepped {
    child: Child,
    commands: ChildStdin,
    answers: mpsc::Receiver<Vec<u8>>,
    /// Answers of the stepper that have arrived and have not been used.
    pending: VecDeque<u8>,
    line: UnixStream,
    receiver: Receiver,
    frames: VecDeque<Frame>,
    /// Total number of bytes that the board must wait for.
    delivered: u32,
    stop: Stop,
    // Contains the socket; removed last.
    _directory: tempfile::TempDir,
}

static STEPPER: LazyLock<PathBuf> = LazyLock::new(compile);

/// Compiles `stepper.rs`, at an address far above the firmware's variables.
fn compile() -> PathBuf {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let folder = root.join("target/firmware");
    std::fs::create_dir_all(&folder).expect("a folder for the stepper");
    // Another test may compile at the same time.
    let made = folder.join(format!("stepper-{}", std::process::id()));
    let output = Command::new("rustc")
        .args([
            "--edition",
            "2024",
            "--target",
            "thumbv7em-none-eabihf",
            "-O",
        ])
        .args([
            "-C",
            "panic=abort",
            "-C",
            "link-arg=--image-base=0x20300000",
        ])
        .args([
            "-C",
            "link-arg=--entry=start",
            "-C",
            "link-arg=--nmagic",
            "-o",
        ])
        .arg(&made)
        .arg(root.join("crates/posegate-testkit/stepper.rs"))
        .output()
        .unwrap_or_else(|error| panic!("rustc does not start: {error}"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "crates/posegate-testkit/stepper.rs:\n{errors}"
    );
    let stepper = folder.join("stepper");
    std::fs::rename(made, &stepper).expect("a place for the stepper");
    stepper
}

impl Stepped {
    /// Starts a firmware, and stops before its first instruction.
    ///
    /// # Panics
    /// If QEMU is missing (the message says how to install it) or does not start.
    pub fn start(elf: &Path) -> Self {
        let directory = tempfile::tempdir().expect("a directory for the line's socket");
        let socket = directory.path().join("line");
        let listener = UnixListener::bind(&socket).expect("a socket for the line");
        let mut child = start_qemu(
            Command::new("qemu-system-arm")
                .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none"])
                // An instruction takes 64 ns of the board's time, independent of the host's time.
                .args(["-icount", "shift=6,sleep=off"])
                .args(["-semihosting-config", "enable=on,target=native", "-chardev"])
                .arg(format!("socket,id=line,path={}", socket.display()))
                .args(["-serial", "chardev:line", "-device"])
                .arg(format!("loader,file={},cpu-num=0", STEPPER.display()))
                .arg("-kernel")
                .arg(elf)
                .stdin(Stdio::piped())
                .stdout(Stdio::piped()),
        );
        let commands = child.stdin.take().expect("stdin is piped");
        let answers = answers(&mut child);
        let mut pending = VecDeque::new();
        let stop = next_stop(&answers, &mut pending);
        // QEMU connects before it executes anything.
        let (line, _) = listener.accept().expect("the board's line");
        line.set_nonblocking(true)
            .expect("a line that is looked at");
        let mut board = Self {
            child,
            commands,
            answers,
            pending,
            line,
            receiver: Receiver::new(),
            frames: VecDeque::new(),
            delivered: 0,
            stop,
            _directory: directory,
        };
        assert_eq!(board.stop.at, At::Start);
        board.never_sleep();
        board
    }

    /// Replaces `wfi` by `nop`. QEMU advances the time of a sleeping processor to the next event, or sometimes to the
    /// one after it. A processor may treat `wfi` as `nop`.
    fn never_sleep(&mut self) {
        let flash = self.read(0, FLASH);
        let found = flash.windows(IDLE.len()).enumerate();
        let found: Vec<usize> = found
            .filter(|(_, bytes)| *bytes == IDLE)
            .map(|(at, _)| at)
            .collect();
        let [at] = found[..] else {
            panic!("one place where the firmware is idle, `wfi` in a loop of its own: {found:x?}")
        };
        self.write(at as u32, &NOP);
    }

    /// Returns the current stop.
    pub const fn stop(&self) -> Stop {
        self.stop
    }

    /// Runs to the next stop. The board first receives these bytes, before any instruction of a control cycle.
    pub fn run(&mut self, bytes: &[u8]) -> Stop {
        self.run_late(bytes, 0)
    }

    /// As [`Stepped::run`], with a cycle that begins `late_ms` milliseconds late, after the bytes.
    ///
    /// # Panics
    /// If bytes or a delay are requested at another stop than that of a cycle.
    pub fn run_late(&mut self, bytes: &[u8], late_ms: u32) -> Stop {
        assert!(self.stop.at == At::Cycle || bytes.is_empty() && late_ms == 0);
        self.put_on_line(bytes);
        self.delivered = self.delivered.wrapping_add(bytes.len() as u32);
        self.command([0, self.delivered, late_ms]);
        self.go_on()
    }

    /// Runs to the next stop without the firmware's handler: the interrupt has no effect.
    pub fn run_without_handler(&mut self) -> Stop {
        self.command([3, 0, 0]);
        self.go_on()
    }

    fn go_on(&mut self) -> Stop {
        self.stop = next_stop(&self.answers, &mut self.pending);
        self.listen();
        self.stop
    }

    /// Puts bytes on the line of a firmware that no longer reads, without waiting for them to be read.
    pub fn put_on_line(&mut self, bytes: &[u8]) {
        self.line.set_nonblocking(false).expect("a line that waits");
        self.line
            .write_all(bytes)
            .unwrap_or_else(|error| panic!("the board's line takes no bytes: {error}"));
        self.line
            .set_nonblocking(true)
            .expect("a line that does not");
    }

    /// Returns the body of the next frame that the firmware has sent. No frame is in transit while the board is
    /// stopped.
    pub fn next_frame(&mut self) -> Option<Frame> {
        self.frames.pop_front()
    }

    fn listen(&mut self) {
        let mut buffer = [0; 4 * LONGEST_FRAME];
        loop {
            match self.line.read(&mut buffer) {
                Ok(length @ 1..) => {
                    let frames = buffer[..length]
                        .iter()
                        .filter_map(|byte| self.receiver.push(*byte));
                    let sound = |frame: Result<_, _>| {
                        frame.unwrap_or_else(|error| panic!("a damaged frame: {error:?}"))
                    };
                    self.frames.extend(frames.map(sound));
                }
                Ok(0) => panic!("the board's line is closed"),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => panic!("the board's line: {error}"),
            }
        }
    }

    /// Returns the bytes at an address of the board, in memory or of a device.
    pub fn read(&mut self, address: u32, length: usize) -> Vec<u8> {
        self.command([1, address, length as u32]);
        answer(&self.answers, &mut self.pending, length)
    }

    /// Writes bytes to an address; flash can be written, too.
    pub fn write(&mut self, address: u32, bytes: &[u8]) {
        self.command([2, address, bytes.len() as u32]);
        self.commands
            .write_all(bytes)
            .expect("the stepper takes bytes");
    }

    fn command(&mut self, words: [u32; 3]) {
        let bytes = words.map(u32::to_le_bytes);
        self.commands
            .write_all(bytes.as_flattened())
            .expect("the stepper takes a command");
    }
}

impl Drop for Stepped {
    fn drop(&mut self) {
        // Ends only this board's QEMU. An error means that it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns a channel with QEMU's output.
fn answers(child: &mut Child) -> mpsc::Receiver<Vec<u8>> {
    let mut stdout = child.stdout.take().expect("stdout is piped");
    let (sender, answers) = mpsc::channel();
    // Ends with QEMU's output, or when the receiver is dropped.
    std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(length @ 1..) = stdout.read(&mut buffer) {
            if sender.send(buffer[..length].to_vec()).is_err() {
                break;
            }
        }
    });
    answers
}

/// Returns the next bytes that the stepper writes.
fn answer(answers: &mpsc::Receiver<Vec<u8>>, pending: &mut VecDeque<u8>, length: usize) -> Vec<u8> {
    while pending.len() < length {
        match answers.recv_timeout(PATIENCE) {
            Ok(bytes) => pending.extend(bytes),
            Err(mpsc::RecvTimeoutError::Timeout) => {
                panic!(
                    "the board has not stopped for {PATIENCE:?}: neither timer nor watchdog comes"
                )
            }
            Err(mpsc::RecvTimeoutError::Disconnected) => panic!("QEMU has ended by itself"),
        }
    }
    pending.drain(..length).collect()
}

fn next_stop(answers: &mpsc::Receiver<Vec<u8>>, pending: &mut VecDeque<u8>) -> Stop {
    let bytes = answer(answers, pending, 12);
    let word = |k: usize| u32::from_le_bytes([bytes[k], bytes[k + 1], bytes[k + 2], bytes[k + 3]]);
    let at = match word(0) {
        0 => At::Start,
        1 => At::Cycle,
        2 => At::Watchdog,
        other => panic!("no stop of the stepper: {other}"),
    };
    Stop {
        at,
        now_ms: word(4),
        lamps: word(8),
    }
}
