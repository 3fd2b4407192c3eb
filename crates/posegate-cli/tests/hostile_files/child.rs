//! Runs the program on one file as a process, and reports its end, its largest memory and its processor time.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Limits of a run: MiB of resident memory, and seconds of processor time.
pub const MOST_MIB: u64 = 512;
pub const MOST_SECONDS: f64 = 20.0;
/// Limit of the address space: a larger reservation is refused, which ends the program. (Threads and libraries reserve memory that
/// they never use.)
const MOST_ADDRESSES: u64 = 2 << 30;
/// A process that hangs is ended after this time. Other processes may be running, so [`MOST_SECONDS`] limits the processor time.
const HANGS: Duration = Duration::from_secs(120);

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// An exit code of 0 to 3.
    Exit(i32),
    /// Another exit code.
    OtherExit(i32),
    /// A panic, caught or not.
    Panic,
    /// A panic in the crate that prints errors.
    PanicOfRenderer,
    /// A signal: out of memory, stack overflow, a hang.
    Killed(i32),
}

/// The result of a run.
pub struct Run {
    pub end: End,
    pub mib: u64,
    pub seconds: f64,
    /// The beginning of stderr.
    pub stderr: String,
}

impl Run {
    /// Returns `true` if the run is within its limits and ended with 0, 1 or 2. (Exit code 3 is an internal error, such as a caught
    /// panic.)
    pub fn is_good(&self) -> bool {
        let answered = match self.end {
            End::Exit(code) => code != 3,
            End::OtherExit(_) | End::Panic | End::PanicOfRenderer | End::Killed(_) => false,
        };
        answered && self.mib <= MOST_MIB && self.seconds <= MOST_SECONDS
    }
}

/// Runs the program in a folder.
pub fn run(folder: &Path, arguments: &[String]) -> Run {
    let log = folder.join("stderr.log");
    let stderr = File::create(&log).expect("a log");
    let mut command = Command::new(env!("CARGO_BIN_EXE_posegate"));
    command
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .env("RAYON_NUM_THREADS", "1")
        .env_remove("RUST_BACKTRACE")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr);
    // SAFETY: `setrlimit` may be called between fork and exec.
    unsafe {
        command.pre_exec(|| {
            limit(libc::RLIMIT_AS, MOST_ADDRESSES)?;
            limit(libc::RLIMIT_CPU, 3 * MOST_SECONDS as u64)?;
            limit(libc::RLIMIT_CORE, 0)
        });
    }
    // `ended` waits for the process by `wait4`, which reports its memory and time.
    #[expect(clippy::zombie_processes)]
    let child = command.spawn().expect("the program starts");
    let (status, mib, seconds) = ended(child.id().cast_signed());
    let mut stderr = String::new();
    let mut bytes = Vec::new();
    let mut reader = File::open(&log).expect("a log");
    // The message of a panic is at the beginning of the log, or after a long report at its end.
    reader
        .by_ref()
        .take(4096)
        .read_to_end(&mut bytes)
        .expect("a log");
    let length = reader.metadata().map_or(0, |data| data.len());
    if length > 8192 {
        reader.seek(SeekFrom::End(-4096)).expect("a log");
        reader.read_to_end(&mut bytes).expect("a log");
    }
    stderr.push_str(&String::from_utf8_lossy(&bytes));
    let panicked = stderr.contains("panicked at ");
    let end = match (status.code(), status.signal()) {
        (_, Some(signal)) => End::Killed(signal),
        _ if panicked && stderr.contains("/miette-") => End::PanicOfRenderer,
        _ if panicked => End::Panic,
        (Some(code @ 0..=3), _) => End::Exit(code),
        (code, _) => End::OtherExit(code.unwrap_or(-1)),
    };
    Run {
        end,
        mib,
        seconds,
        stderr,
    }
}

fn limit(of: libc::__rlimit_resource_t, most: u64) -> std::io::Result<()> {
    let limit = libc::rlimit {
        rlim_cur: most,
        rlim_max: most,
    };
    // SAFETY: the pointer is to a local value.
    match unsafe { libc::setrlimit(of, &raw const limit) } {
        0 => Ok(()),
        _ => Err(std::io::Error::last_os_error()),
    }
}

/// Waits for a child. Returns its status, its memory in MiB and its processor time in seconds.
fn ended(process: libc::pid_t) -> (ExitStatus, u64, f64) {
    let begun = Instant::now();
    let mut killed = false;
    let mut pause = Duration::from_micros(500);
    loop {
        let mut status = 0;
        // SAFETY: all zeros are a value of this plain struct.
        let mut used: libc::rusage = unsafe { std::mem::zeroed() };
        // SAFETY: both pointers are to local values.
        let done = unsafe { libc::wait4(process, &raw mut status, libc::WNOHANG, &raw mut used) };
        if done == process {
            let time = |of: libc::timeval| of.tv_sec as f64 + of.tv_usec as f64 * 1e-6;
            let mib = used.ru_maxrss.unsigned_abs().div_ceil(1024);
            let seconds = time(used.ru_utime) + time(used.ru_stime);
            return (ExitStatus::from_raw(status), mib, seconds);
        }
        assert_eq!(done, 0, "wait4: {}", std::io::Error::last_os_error());
        if begun.elapsed() > HANGS && !killed {
            killed = true;
            // SAFETY: the process is a child of this process and was not waited for yet.
            unsafe { libc::kill(process, libc::SIGKILL) };
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(20));
    }
}
