//! Builds firmware examples, and runs in QEMU those that answer requests, with access to their serial line and interlock.
//! The answers must not depend on time; a firmware whose result depends on time runs in `stepped.rs`.

use posegate::wire::{Frame, LONGEST_FRAME, Receiver, Reply, Request, encode};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

const TARGET: &str = "thumbv7em-none-eabihf";
const PROFILE: &str = "firmware";
/// Longer than any answer takes on a busy machine. A firmware that hangs fails the test after this time.
const PATIENCE: Duration = Duration::from_secs(120);

/// Builds an example for the Cortex-M4F and returns its ELF file.
///
/// # Panics
/// If the Rust target is missing (the message says how to install it), or if the example does not build.
pub fn build(example: &str) -> PathBuf {
    build_with(example, "firmware")
}

/// As [`build`], with features.
///
/// # Panics
/// As [`build`].
pub fn build_with(example: &str, features: &str) -> PathBuf {
    build_in(example, features, &[])
}

/// As [`build_with`], with variables of the compiler's environment.
///
/// # Panics
/// As [`build`].
pub fn build_in(example: &str, features: &str, environment: &[(&str, &str)]) -> PathBuf {
    demand_target();
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let directory = root.join("target").join("firmware");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .current_dir(root)
        .args(["build", "--locked", "-p", "posegate", "--profile", PROFILE])
        .args(["--target", TARGET, "--features", features])
        .args(["--example", example, "--target-dir"])
        .arg(&directory)
        // Flags for the host's build, such as those of a coverage run, are not valid for the board.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env_remove("RUSTC_WRAPPER")
        .env_remove("RUSTC_WORKSPACE_WRAPPER")
        .env_remove("POSEGATE_FAULT_TABLE")
        .envs(environment.iter().copied())
        .output()
        .unwrap_or_else(|error| panic!("cargo does not start: {error}"));
    assert!(
        output.status.success(),
        "the example `{example}` does not build for {TARGET}:\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
    directory
        .join(TARGET)
        .join(PROFILE)
        .join("examples")
        .join(example)
}

/// Builds an example that exists in Rust and in C: the one in Rust, or with `POSEGATE_FIRMWARE=c` the one in C.
///
/// # Panics
/// As [`build`] and [`build_c`], or if the variable names neither language.
pub fn in_either(example: &str) -> PathBuf {
    match std::env::var("POSEGATE_FIRMWARE").as_deref() {
        Err(_) | Ok("rust") => build(example),
        Ok("c") => build_c(example),
        Ok(other) => panic!("POSEGATE_FIRMWARE={other}: rust or c"),
    }
}

/// Builds a program of `examples/c` for the Cortex-M4F, as its Makefile does, and returns its ELF file.
///
/// # Panics
/// If a tool is missing (the message says how to install it), or if the program does not build.
pub fn build_c(example: &str) -> PathBuf {
    demand_target();
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let directory = root.join("target").join("firmware");
    let out = directory.join("c").join(TARGET);
    let elf = out.join(example).with_extension("elf");
    let output = Command::new("make")
        .arg("-C")
        .arg(root.join("examples/c"))
        .arg(format!("TARGET={TARGET}"))
        .arg(format!("OUT={}", out.display()))
        .arg(format!("CARGO_TARGET_DIR={}", directory.display()))
        .arg(&elf)
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env_remove("RUSTC_WRAPPER")
        .env_remove("RUSTC_WORKSPACE_WRAPPER")
        .output()
        .unwrap_or_else(|error| panic!("make does not start ({error}): apt-get install -y make"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "examples/c/{example}.c does not build (the compiler is of apt-get install -y gcc-arm-none-eabi):\n{errors}"
    );
    elf
}

fn demand_target() {
    let output = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", TARGET])
        .output()
        .unwrap_or_else(|error| panic!("rustc does not start: {error}"));
    let directory = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    assert!(
        output.status.success() && Path::new(&directory).is_dir(),
        "the Rust target {TARGET} is missing: rustup target add {TARGET}"
    );
}

/// An emulated board that runs a firmware in the host's time. Dropping this value ends the emulator.
pub struct Board {
    child: Child,
    to_uart: ChildStdin,
    from_uart: mpsc::Receiver<Vec<u8>>,
    /// Bytes that have arrived and have not been decoded.
    pending: std::collections::VecDeque<u8>,
    receiver: Receiver,
    monitor: Monitor,
    // Contains the socket; removed last.
    _directory: tempfile::TempDir,
}

/// Starts QEMU by this command.
///
/// # Panics
/// If QEMU is missing (the message says how to install it) or does not start.
pub fn start_qemu(command: &mut Command) -> Child {
    command.spawn().unwrap_or_else(|error| match error.kind() {
        ErrorKind::NotFound => {
            panic!("qemu-system-arm is missing: apt-get install -y qemu-system-arm")
        }
        _ => panic!("qemu-system-arm does not start: {error}"),
    })
}

impl Board {
    /// Starts a firmware.
    ///
    /// # Panics
    /// If QEMU is missing (the message says how to install it) or does not start.
    pub fn start(elf: &Path) -> Self {
        let directory = tempfile::tempdir().expect("a directory for the monitor's socket");
        let socket = directory.path().join("monitor");
        let mut child = start_qemu(
            Command::new("qemu-system-arm")
                .args(["-M", "mps2-an386", "-display", "none", "-serial", "stdio"])
                .args(["-semihosting-config", "enable=on,target=native"])
                .arg("-monitor")
                .arg(format!("unix:{},server=on,wait=off", socket.display()))
                .arg("-kernel")
                .arg(elf)
                .stdin(Stdio::piped())
                .stdout(Stdio::piped()),
        );
        let to_uart = child.stdin.take().expect("stdin is piped");
        let mut stdout = child.stdout.take().expect("stdout is piped");
        let (sender, from_uart) = mpsc::channel();
        // Ends with QEMU's output, or when the receiver is dropped.
        std::thread::spawn(move || {
            let mut buffer = [0; 4 * LONGEST_FRAME];
            while let Ok(length @ 1..) = stdout.read(&mut buffer) {
                if sender.send(buffer[..length].to_vec()).is_err() {
                    break;
                }
            }
        });
        let monitor = Monitor::connect(&socket, &mut child);
        Self {
            child,
            to_uart,
            from_uart,
            pending: std::collections::VecDeque::new(),
            receiver: Receiver::new(),
            monitor,
            _directory: directory,
        }
    }

    /// Puts bytes on the board's serial line.
    pub fn send(&mut self, bytes: &[u8]) {
        self.to_uart
            .write_all(bytes)
            .and_then(|()| self.to_uart.flush())
            .unwrap_or_else(|error| panic!("the board takes no bytes: {error}"));
    }

    /// Returns the next reply.
    ///
    /// # Panics
    /// If none arrives in time, the firmware has ended, or the frame is not a reply.
    pub fn reply(&mut self) -> Reply {
        let body = self.frame();
        Reply::from_body(&body).unwrap_or_else(|| panic!("no reply of this version: {body:?}"))
    }

    /// Returns the body of the next frame.
    ///
    /// # Panics
    /// If none arrives in time, the firmware has ended, or the frame is damaged.
    pub fn frame(&mut self) -> Frame {
        loop {
            while let Some(byte) = self.pending.pop_front() {
                if let Some(frame) = self.receiver.push(byte) {
                    return frame.unwrap_or_else(|error| panic!("a damaged frame: {error:?}"));
                }
            }
            match self.from_uart.recv_timeout(PATIENCE) {
                Ok(bytes) => self.pending.extend(bytes),
                Err(mpsc::RecvTimeoutError::Timeout) => {
                    panic!("the firmware has not answered for {PATIENCE:?}: it hangs or has halted")
                }
                Err(mpsc::RecvTimeoutError::Disconnected) => {
                    panic!("QEMU has ended: {:?}", self.child.wait())
                }
            }
        }
    }

    /// Sends a request and returns the reply.
    pub fn ask(&mut self, request: &Request) -> Reply {
        self.send(&encode(&request.body()));
        self.reply()
    }

    /// Returns `true` if the interlock output is high, by the emulated board's register.
    pub fn interlock_is_high(&mut self) -> bool {
        self.monitor.word(0x4002_8000) & 1 != 0
    }

    /// Waits until the interlock output is low.
    ///
    /// # Panics
    /// If it stays high for `PATIENCE`.
    pub fn wait_until_low(&mut self) {
        let start = Instant::now();
        while self.interlock_is_high() {
            assert!(start.elapsed() < PATIENCE, "the interlock stays high");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // Ends only this board's QEMU. An error means that it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// QEMU's monitor, which reads the board's registers without the firmware.
struct Monitor(UnixStream);

impl Monitor {
    const PROMPT: &str = "(qemu) ";

    fn connect(socket: &Path, child: &mut Child) -> Self {
        let start = Instant::now();
        let stream = loop {
            match UnixStream::connect(socket) {
                Ok(stream) => break stream,
                Err(error) => {
                    let ended = child.try_wait().expect("the state of QEMU");
                    assert!(ended.is_none(), "QEMU has ended at its start: {ended:?}");
                    if start.elapsed() > PATIENCE {
                        let _ = child.kill();
                        panic!("QEMU's monitor does not answer: {error}");
                    }
                    std::thread::sleep(Duration::from_millis(5));
                }
            }
        };
        stream
            .set_read_timeout(Some(PATIENCE))
            .expect("a limit on reading");
        let mut monitor = Self(stream);
        monitor.until_prompt();
        monitor
    }

    /// Returns the word at an address.
    fn word(&mut self, address: u32) -> u32 {
        let answer = self.command(&format!("xp /1wx {address:#x}"));
        answer
            .split_once(": 0x")
            .and_then(|(_, rest)| u32::from_str_radix(rest.get(..8)?, 16).ok())
            .unwrap_or_else(|| panic!("no word in the monitor's answer {answer:?}"))
    }

    /// Returns the monitor's answer to a command.
    fn command(&mut self, command: &str) -> String {
        writeln!(self.0, "{command}").expect("QEMU's monitor takes a command");
        self.until_prompt()
    }

    fn until_prompt(&mut self) -> String {
        let mut text = String::new();
        let mut buffer = [0; 512];
        while !text.ends_with(Self::PROMPT) {
            let length = self
                .0
                .read(&mut buffer)
                .unwrap_or_else(|error| panic!("QEMU's monitor is silent after {text:?}: {error}"));
            assert!(length > 0, "QEMU's monitor has closed after {text:?}");
            text.push_str(&String::from_utf8_lossy(&buffer[..length]));
        }
        text
    }
}
