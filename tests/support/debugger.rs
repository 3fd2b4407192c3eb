//! A debugger's hand in an emulated board: reads and changes memory, flash too, while the board stands
//! still (GDB's remote serial protocol, of which three packets).

use std::fmt::Write as _;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

/// A connection, during which the board stands still. It goes on when this is dropped.
pub struct Debugger(UnixStream);

impl Debugger {
    /// Connects to the socket that QEMU listens on.
    ///
    /// # Panics
    /// Where it does not.
    pub fn connect(socket: &Path) -> Self {
        let stream = UnixStream::connect(socket)
            .unwrap_or_else(|error| panic!("QEMU takes no debugger: {error}"));
        stream
            .set_read_timeout(Some(Duration::from_secs(20)))
            .expect("a limit on reading");
        let mut debugger = Self(stream);
        // The board has stopped when it says so.
        debugger.send("?");
        assert!(is_stop(&debugger.answer()));
        debugger
    }

    /// The bytes at an address.
    pub fn read(&mut self, address: u32, length: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        while bytes.len() < length {
            let part = (length - bytes.len()).min(1024);
            let hex = self.ask(&format!("m{:x},{part:x}", address as usize + bytes.len()));
            assert_eq!(hex.len(), 2 * part, "no memory at {address:#x}: {hex}");
            let byte = |at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal");
            bytes.extend((0..hex.len()).step_by(2).map(byte));
        }
        bytes
    }

    /// Puts bytes at an address.
    pub fn write(&mut self, address: u32, bytes: &[u8]) {
        let mut packet = format!("M{address:x},{:x}:", bytes.len());
        for byte in bytes {
            write!(packet, "{byte:02x}").expect("a string takes text");
        }
        assert_eq!(self.ask(&packet), "OK", "{address:#x}");
    }

    fn ask(&mut self, packet: &str) -> String {
        self.send(packet);
        // It may say more than once that it has stopped.
        loop {
            let answer = self.answer();
            if !is_stop(&answer) {
                return answer;
            }
        }
    }

    /// `+`, and then `$`, the text, `#` and two digits.
    fn answer(&mut self) -> String {
        let mut text = String::new();
        let mut byte = [0];
        loop {
            self.0
                .read_exact(&mut byte)
                .expect("QEMU answers a debugger");
            if byte == *b"#" {
                break;
            }
            text.push(char::from(byte[0]));
        }
        self.0.read_exact(&mut [0; 2]).expect("a checksum");
        self.0.write_all(b"+").expect("QEMU takes an answer");
        text.rsplit('$').next().unwrap_or_default().to_owned()
    }

    fn send(&mut self, packet: &str) {
        let sum = packet.bytes().fold(0u8, u8::wrapping_add);
        write!(self.0, "${packet}#{sum:02x}").expect("QEMU takes a packet");
    }
}

impl Drop for Debugger {
    fn drop(&mut self) {
        // Detached, the board goes on.
        self.ask("D");
    }
}

fn is_stop(answer: &str) -> bool {
    answer.starts_with(['T', 'S'])
}
