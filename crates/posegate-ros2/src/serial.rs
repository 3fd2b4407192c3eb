//! A serial line: opened raw, read and written without blocking, and opened again after a loss.

use rustix::fs::{Mode, OFlags};
use rustix::termios::{ControlModes, OptionalActions};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The time before a lost line is opened again.
const RETRY: Duration = Duration::from_secs(1);
/// The most bytes that are read in a cycle: a line that sends without end does not stop the node.
const MOST: usize = 1 << 16;

/// The reason why a line cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum SerialError {
    /// The operating system refuses.
    #[error(
        "cannot open the serial line {0}: {1}; expected the device of the controller, such as /dev/ttyUSB0, and the right to use it (on Debian and Ubuntu: the group dialout)"
    )]
    Open(String, std::io::Error),
    /// The path is a file, or another device.
    #[error("{0} is not a serial line: expected a device such as /dev/ttyUSB0")]
    NotATerminal(String),
    /// The driver refuses the speed.
    #[error(
        "the serial line {0} cannot be set to {1} baud: {2}; give --baud the speed of the controller's line"
    )]
    Speed(String, u32, std::io::Error),
}

/// A serial line.
#[derive(Debug)]
pub struct Port {
    path: PathBuf,
    baud: u32,
    /// The open line; or when and why it was lost.
    file: Result<File, (Instant, String)>,
    /// The bytes that did not fit yet.
    pending: Vec<u8>,
}

impl Port {
    /// Opens a line: raw, 8 bits, no flow control, exclusive for this program.
    ///
    /// # Errors
    /// [`SerialError`]
    pub fn open(path: &Path, baud: u32) -> Result<Self, SerialError> {
        Ok(Self {
            path: path.into(),
            baud,
            file: Ok(open(path, baud)?),
            // Ends a frame that an earlier program left unfinished.
            pending: vec![0],
        })
    }

    /// Reads the bytes that have arrived. Returns `None` if the line is lost; it is then opened again after a time.
    pub fn read(&mut self, now: Instant) -> Option<Vec<u8>> {
        if let Err((lost_at, _)) = self.file
            && now.saturating_duration_since(lost_at) >= RETRY
        {
            let again = open(&self.path, self.baud);
            self.file = again.map_err(|error| (now, error.to_string()));
        }
        let file = self.file.as_mut().ok()?;
        let mut all = Vec::new();
        let mut buffer = [0; 4096];
        while all.len() < MOST {
            match file.read(&mut buffer) {
                Ok(0) => {
                    self.lose(now, "it was disconnected".into());
                    return None;
                }
                Ok(length) => all.extend(buffer.iter().take(length)),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => {
                    self.lose(now, error.to_string());
                    return None;
                }
            }
        }
        Some(all)
    }

    /// Writes a complete frame, later if necessary. Returns `false` if the line accepts no bytes: the frame is then
    /// dropped.
    pub fn write(&mut self, frame: &[u8], now: Instant) -> bool {
        // The rest of the previous frame.
        self.flush(now);
        if self.file.is_err() || self.pending.len() > 1 {
            return false;
        }
        self.pending.extend(frame);
        self.flush(now);
        true
    }

    /// Writes the bytes that did not fit before.
    pub fn flush(&mut self, now: Instant) {
        let Ok(file) = &mut self.file else {
            return;
        };
        while !self.pending.is_empty() {
            match file.write(&self.pending) {
                Ok(length) if length > 0 => drop(self.pending.drain(..length)),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Ok(_) => return self.lose(now, "it takes no bytes".into()),
                Err(error) => return self.lose(now, error.to_string()),
            }
        }
    }

    fn lose(&mut self, now: Instant, problem: String) {
        self.file = Err((now, problem));
        self.pending = vec![0];
    }

    /// Returns the reason why the line is lost; `None` if it is open.
    #[must_use]
    pub fn problem(&self) -> Option<&str> {
        let (_, problem) = self.file.as_ref().err()?;
        Some(problem)
    }

    /// Returns the path of the device.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

fn open(path: &Path, baud: u32) -> Result<File, SerialError> {
    let name = || path.display().to_string();
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let fd = rustix::fs::open(path, flags, Mode::empty())
        .map_err(|error| SerialError::Open(name(), error.into()))?;
    if !rustix::termios::isatty(&fd) {
        return Err(SerialError::NotATerminal(name()));
    }
    let refused = |error: rustix::io::Errno| SerialError::Open(name(), error.into());
    rustix::termios::ioctl_tiocexcl(&fd).map_err(refused)?;
    let mut modes = rustix::termios::tcgetattr(&fd).map_err(refused)?;
    modes.make_raw();
    modes.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
    modes.control_modes &= !(ControlModes::CRTSCTS | ControlModes::CSTOPB | ControlModes::PARENB);
    let slow = |error: rustix::io::Errno| SerialError::Speed(name(), baud, error.into());
    modes.set_speed(baud).map_err(slow)?;
    // Drops the bytes that arrived before: their time is not known.
    rustix::termios::tcsetattr(&fd, OptionalActions::Flush, &modes).map_err(slow)?;
    Ok(File::from(fd))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use std::os::unix::ffi::OsStrExt;

    /// Returns the far end of a line, and the path of the near one.
    fn line() -> (File, PathBuf) {
        let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&far).unwrap();
        unlockpt(&far).unwrap();
        let name = ptsname(&far, Vec::new()).unwrap();
        let path = PathBuf::from(std::ffi::OsStr::from_bytes(name.to_bytes()));
        (File::from(far), path)
    }

    #[test]
    fn every_byte_passes_in_both_directions() {
        let (mut far, path) = line();
        let mut port = Port::open(&path, 115_200).unwrap();
        let all: Vec<u8> = (0..=255).collect();
        far.write_all(&all).unwrap();
        let now = Instant::now();
        assert_eq!(port.read(now), Some(all.clone()));
        assert_eq!(port.read(now), Some(Vec::new()));
        assert!(port.write(&all, now));
        let mut received = [0; 257];
        far.read_exact(&mut received).unwrap();
        // The first byte is zero, which ends an earlier frame.
        assert_eq!((received[0], &received[1..]), (0, &all[..]));
    }

    #[test]
    fn blocked_line_drops_complete_frames() {
        let (mut far, path) = line();
        let mut port = Port::open(&path, 115_200).unwrap();
        let now = Instant::now();
        let frame = [7; 1000];
        let mut taken = 0;
        while port.write(&frame, now) {
            taken += 1;
            assert!(taken < 1000, "the line takes everything");
        }
        // The accepted frames arrive completely when there is space again.
        let mut received = vec![0; 1 + taken * frame.len()];
        let mut at = 0;
        while at < received.len() {
            at += far.read(&mut received[at..]).unwrap();
            port.flush(now);
        }
        assert!(received[1..].iter().all(|byte| *byte == 7));
        assert!(port.write(&frame, now));
    }

    #[test]
    fn lost_line_is_detected_and_opened_again() {
        let (far, path) = line();
        let mut port = Port::open(&path, 115_200).unwrap();
        let now = Instant::now();
        drop(far);
        assert_eq!(port.read(now), None);
        assert!(port.problem().is_some() && !port.write(&[1], now));
        // Not before its time; the path may then be that of another line.
        let (mut far, other) = line();
        port.path = other;
        assert_eq!(port.read(now), None);
        let later = now + RETRY;
        assert_eq!(port.read(later), Some(Vec::new()));
        assert!(port.problem().is_none() && port.write(&[1], later));
        let mut received = [9; 2];
        far.read_exact(&mut received).unwrap();
        assert_eq!(received, [0, 1]);
    }

    #[test]
    fn files_and_missing_devices_have_their_own_errors() {
        let error = |path: &str| Port::open(Path::new(path), 9600).unwrap_err().to_string();
        assert!(error("/no/such/tty").contains("cannot open the serial line /no/such/tty"));
        assert!(error("/dev/null").contains("is not a serial line"));
    }
}
