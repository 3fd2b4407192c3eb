//! Runs commands. Each line is logged to stderr, and a command that fails ends the job.

use std::error::Error;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::io::{BufRead, BufReader, PipeReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// What a job returns: its error is the message that is printed.
pub type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

/// Prints a heading to stderr.
pub fn say(text: &str) {
    eprintln!("\n== {text}");
}

/// Prints the output of a command that has ended: its JSON lines to stdout, the others to stderr.
pub fn show(text: &str) {
    for line in text.lines() {
        match is_json(line) {
            true => println!("{line}"),
            false => eprintln!("{line}"),
        }
    }
}

/// Returns a command of these words, which are separated by spaces; [`Cmd::arg`] takes one that contains spaces.
pub fn cmd(words: &str) -> Cmd {
    let mut words = words.split_whitespace();
    let program = words.next().expect("a command has a program");
    program_at(Path::new(program)).args(words)
}

/// Returns a command of a program at a path.
pub fn program_at(path: &Path) -> Cmd {
    let mut command = Command::new(path);
    // `cargo run` sets these for this program. Child processes must not use them.
    for (name, _) in std::env::vars_os() {
        let text = name.to_string_lossy();
        if text == "CARGO_MANIFEST_DIR"
            || text == "CARGO_MANIFEST_PATH"
            || text.starts_with("CARGO_PKG_")
        {
            command.env_remove(&name);
        }
    }
    command.stdin(Stdio::null());
    Cmd {
        command,
        line: quoted(path.as_os_str()),
        is_logged: true,
        input: None,
        limit: None,
    }
}

/// A command that is not yet started.
pub struct Cmd {
    command: Command,
    /// As it is logged.
    line: String,
    is_logged: bool,
    input: Option<Vec<u8>>,
    limit: Option<Duration>,
}

/// What a command that has ended returned.
pub struct Outcome {
    /// The exit code; 124 after a time limit, 128 or more after a signal.
    pub code: i32,
    pub text: String,
}

/// Where the lines of a command's output go.
enum Lines {
    /// Only to the result.
    Kept,
    /// Also to stderr.
    Logged,
    /// Also to stderr, and those that are JSON to stdout.
    Json,
}

impl Cmd {
    pub fn arg(mut self, argument: impl AsRef<OsStr>) -> Self {
        let argument = argument.as_ref();
        let _ = write!(self.line, " {}", quoted(argument));
        self.command.arg(argument);
        self
    }

    pub fn args<A: AsRef<OsStr>>(self, arguments: impl IntoIterator<Item = A>) -> Self {
        arguments
            .into_iter()
            .fold(self, |command, argument| command.arg(argument))
    }

    /// Appends arguments that are separated by spaces.
    pub fn words(self, words: &str) -> Self {
        self.args(words.split_whitespace())
    }

    pub fn env(mut self, name: &str, value: impl AsRef<OsStr>) -> Self {
        let value = value.as_ref();
        self.line = format!("{name}={} {}", quoted(value), self.line);
        self.command.env(name, value);
        self
    }

    pub fn dir(mut self, folder: &Path) -> Self {
        self.command.current_dir(folder);
        self
    }

    /// Gives the command this text on stdin; without, stdin is empty.
    pub fn input(mut self, text: impl Into<Vec<u8>>) -> Self {
        self.input = Some(text.into());
        self
    }

    /// Does not log the line: for a command that is repeated many times.
    pub fn unlogged(mut self) -> Self {
        self.is_logged = false;
        self
    }

    /// Kills the command after this time; the exit code is then 124.
    pub fn limit(mut self, seconds: u64) -> Self {
        self.limit = Some(Duration::from_secs(seconds));
        self
    }

    /// Runs it; its output goes to stderr.
    ///
    /// # Errors
    /// If it does not start, or its exit code is not 0.
    pub fn run(self) -> Result {
        let line = self.line.clone();
        succeeded(&line, self.code()?)
    }

    /// Runs it and returns the exit code; its output goes to stderr.
    pub fn code(mut self) -> Result<i32> {
        self.command.stdout(std::io::stderr());
        self.ended()
    }

    /// Runs it; its output goes to stdout, since it is results.
    pub fn print(self) -> Result {
        let line = self.line.clone();
        succeeded(&line, self.print_code()?)
    }

    /// As [`print`](Self::print), but returns the exit code.
    pub fn print_code(self) -> Result<i32> {
        self.ended()
    }

    /// Runs it and returns what it writes to stdout.
    pub fn read(self) -> Result<String> {
        let line = self.line.clone();
        let outcome = self.outcome()?;
        succeeded(&line, outcome.code)?;
        Ok(outcome.text)
    }

    /// Runs it and returns the exit code and what it writes to stdout.
    pub fn outcome(self) -> Result<Outcome> {
        self.piped(false, &Lines::Kept)
    }

    /// Runs it and returns the exit code and what it writes to stdout and stderr, without logging it.
    pub fn quiet(self) -> Result<Outcome> {
        self.piped(true, &Lines::Kept)
    }

    /// As [`quiet`](Self::quiet), and logs its output to stderr while it runs.
    pub fn logged(self) -> Result<Outcome> {
        self.piped(true, &Lines::Logged)
    }

    /// Runs it, with its output to stderr, and the JSON lines of its stdout to stdout. Returns what it writes to stdout.
    ///
    /// # Errors
    /// If it fails, or prints no JSON line: then it had nothing to measure.
    pub fn json(self) -> Result<String> {
        self.json_of(false)
    }

    /// As [`json`](Self::json), of both its stdout and its stderr.
    pub fn json_of_both(self) -> Result<String> {
        self.json_of(true)
    }

    fn json_of(self, both: bool) -> Result<String> {
        let line = self.line.clone();
        let outcome = self.piped(both, &Lines::Json)?;
        succeeded(&line, outcome.code)?;
        if !outcome.text.lines().any(is_json) {
            return Err(format!("no JSON line of: {line}").into());
        }
        Ok(outcome.text)
    }

    /// Starts it in the background. The child is killed when the value is dropped.
    pub fn start(mut self) -> Result<Running> {
        let child = self.spawn()?;
        Ok(Running { child })
    }

    /// Opens a pipe to its stdin, for [`start`](Self::start).
    pub fn with_stdin(mut self) -> Self {
        self.command.stdin(Stdio::piped());
        self
    }

    /// Opens a pipe from its stdout, for [`start`](Self::start).
    pub fn with_stdout(mut self) -> Self {
        self.command.stdout(Stdio::piped());
        self
    }

    fn spawn(&mut self) -> Result<Child> {
        if self.is_logged {
            eprintln!("$ {}", self.line);
        }
        if self.input.is_some() {
            self.command.stdin(Stdio::piped());
        }
        let spawned = self.command.spawn();
        let mut child =
            spawned.map_err(|error| format!("{} does not start: {error}", self.line))?;
        if let Some(input) = self.input.take() {
            let mut stdin = child.stdin.take().expect("stdin is piped");
            // A command that has read enough closes its end.
            std::thread::spawn(move || drop(stdin.write_all(&input)));
        }
        Ok(child)
    }

    fn ended(mut self) -> Result<i32> {
        let mut running = Running {
            child: self.spawn()?,
        };
        running.code(self.limit)
    }

    fn piped(mut self, both: bool, lines: &Lines) -> Result<Outcome> {
        let (from, to) = std::io::pipe()?;
        if both {
            self.command.stderr(to.try_clone()?);
        }
        self.command.stdout(to);
        let mut running = Running {
            child: self.spawn()?,
        };
        let limit = self.limit;
        // The command holds the writing ends of the pipe; the reader ends with the last of them.
        drop(self);
        let (text, code) = std::thread::scope(|scope| {
            let reader = scope.spawn(move || collected(from, lines));
            let code = running.code(limit);
            (reader.join().expect("the reader does not panic"), code)
        });
        Ok(Outcome {
            code: code?,
            text: text?,
        })
    }
}

/// A command in the background, killed when this is dropped.
pub struct Running {
    pub child: Child,
}

impl Running {
    fn code(&mut self, limit: Option<Duration>) -> Result<i32> {
        let Some(limit) = limit else {
            return Ok(code_of(self.child.wait()?));
        };
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait()? {
                return Ok(code_of(status));
            }
            if start.elapsed() > limit {
                self.child.kill()?;
                self.child.wait()?;
                eprintln!("killed after {} s", limit.as_secs());
                return Ok(124);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads lines until the pipe closes.
fn collected(from: PipeReader, lines: &Lines) -> std::io::Result<String> {
    let mut from = BufReader::new(from);
    let mut text = String::new();
    let mut line = Vec::new();
    while from.read_until(b'\n', &mut line)? > 0 {
        let decoded = String::from_utf8_lossy(&line);
        if !matches!(lines, Lines::Kept) {
            eprint!("{decoded}");
        }
        if matches!(lines, Lines::Json) && is_json(&decoded) {
            println!("{}", decoded.trim_end());
        }
        text.push_str(&decoded);
        line.clear();
    }
    Ok(text)
}

fn is_json(line: &str) -> bool {
    line.starts_with('{')
}

fn code_of(status: ExitStatus) -> i32 {
    use std::os::unix::process::ExitStatusExt;
    status
        .code()
        .unwrap_or_else(|| 128 + status.signal().unwrap_or(0))
}

fn succeeded(line: &str, code: i32) -> Result {
    match code {
        0 => Ok(()),
        _ => Err(format!("failed with {code}: {line}").into()),
    }
}

/// Returns an argument as a shell would take it.
fn quoted(argument: &OsStr) -> String {
    let text = argument.to_string_lossy();
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.into_owned();
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}
