//! Reads a long file once: computes its digest and draws a random choice of its rows in bounded memory.

use super::random::mixed;
use sha2::{Digest, Sha256};
use std::io::{self, Read};

/// The longest line, bytes.
const LONGEST_LINE: u64 = 1 << 20;
/// Separates the draw of rows from other uses of the seed.
const PURPOSE: u64 = 0x6472_6177_6e20_6f66;

/// A reader that computes the digest of its input, and fails at a line without an end.
pub(super) struct Digesting<R> {
    inner: R,
    digest: Sha256,
    /// Bytes since the last end of a line.
    line: u64,
}

impl<R: Read> Digesting<R> {
    pub(super) fn new(inner: R) -> Self {
        Self {
            inner,
            digest: Sha256::new(),
            line: 0,
        }
    }

    /// Returns the digest of the complete input.
    pub(super) fn sha256(self) -> [u8; 32] {
        self.digest.finalize().into()
    }
}

impl<R: Read> Read for Digesting<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        let bytes = &buffer[..count];
        self.digest.update(bytes);
        match bytes.iter().rposition(|byte| *byte == b'\n') {
            Some(end) => self.line = (count - end - 1) as u64,
            None => self.line += count as u64,
        }
        if self.line > LONGEST_LINE {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                "a line of more than a MiB; check that it is the correct file",
            ));
        }
        Ok(count)
    }
}

/// The rows of a file, or a random choice of the allowed number of them by their positions: each choice is equally
/// likely.
pub(super) struct Kept<R> {
    most: usize,
    seed: u64,
    count: u64,
    /// Rows with a larger draw are not kept.
    limit: u64,
    /// Each with its draw and its position.
    rows: Vec<(u64, u64, R)>,
    /// The rows while there are few.
    all: Vec<R>,
}

impl<R> Kept<R> {
    pub(super) fn new(most: usize, seed: u64) -> Self {
        Self {
            most,
            seed: mixed(seed ^ PURPOSE),
            count: 0,
            limit: u64::MAX,
            rows: Vec::new(),
            all: Vec::new(),
        }
    }

    pub(super) fn push(&mut self, row: R) {
        let position = self.count;
        self.count += 1;
        if self.rows.is_empty() && self.all.len() < self.most {
            self.all.push(row);
            return;
        }
        if self.rows.is_empty() {
            let seed = self.seed;
            let drawn = |(position, row)| (drawn(seed, position), position, row);
            self.rows = (0..).zip(self.all.drain(..)).map(drawn).collect();
        }
        let draw = drawn(self.seed, position);
        if draw > self.limit {
            return;
        }
        self.rows.push((draw, position, row));
        if self.rows.len() >= 2 * self.most {
            self.cut();
        }
    }

    /// Keeps the rows with the smallest draws.
    fn cut(&mut self) {
        if self.rows.len() > self.most {
            let key = |row: &(u64, u64, R)| (row.0, row.1);
            self.rows.select_nth_unstable_by_key(self.most - 1, key);
            self.rows.truncate(self.most);
            self.limit = self.rows[self.most - 1].0;
        }
    }

    /// Returns the rows in the file's order, and the number of rows in the file if it has more.
    pub(super) fn rows(mut self) -> (Vec<R>, Option<u64>) {
        if self.rows.is_empty() {
            return (self.all, None);
        }
        self.cut();
        self.rows.sort_unstable_by_key(|row| row.1);
        let rows = self.rows.into_iter().map(|row| row.2).collect();
        (rows, Some(self.count))
    }
}

fn drawn(seed: u64, position: u64) -> u64 {
    mixed(seed ^ mixed(position))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Detection;

    fn row(number: u32) -> Detection {
        Detection {
            at: [f64::from(number), 0.0, 0.0],
            errors: None,
        }
    }

    fn drawn_of(count: u32, most: usize, seed: u64) -> (Vec<Detection>, Option<u64>) {
        let mut kept = Kept::new(most, seed);
        (0..count).for_each(|number| kept.push(row(number)));
        assert!(kept.rows.capacity() <= 4 * most + 4);
        kept.rows()
    }

    #[test]
    fn few_rows_are_kept_completely() {
        for count in [0, 1, 99, 100] {
            let (rows, of) = drawn_of(count, 100, 1);
            assert_eq!((rows.len() as u32, of), (count, None));
        }
    }

    /// Every part of a file is drawn with the same probability, and another seed draws other rows.
    #[test]
    fn rows_are_drawn_evenly() {
        let (rows, of) = drawn_of(100_000, 5000, 1);
        assert_eq!((rows.len(), of), (5000, Some(100_000)));
        assert!(rows.windows(2).all(|pair| pair[0].at[0] < pair[1].at[0]));
        let mut tenths = [0u32; 10];
        for row in &rows {
            tenths[(row.at[0] / 10_000.0) as usize] += 1;
        }
        assert!(tenths.iter().all(|n| (420..580).contains(n)), "{tenths:?}");
        let (other, _) = drawn_of(100_000, 5000, 2);
        let known: std::collections::BTreeSet<u64> =
            rows.iter().map(|row| row.at[0].to_bits()).collect();
        let both = other
            .iter()
            .filter(|row| known.contains(&row.at[0].to_bits()));
        assert!((170..340).contains(&both.count()));
        // One extra row already drops one.
        assert_eq!(drawn_of(101, 100, 1).0.len(), 100);
    }

    #[test]
    fn line_without_an_end_is_an_error() {
        let mut reader = Digesting::new(io::repeat(0));
        assert!(io::copy(&mut reader, &mut io::sink()).is_err());
        let mut reader = Digesting::new(b"abc".as_slice());
        io::copy(&mut reader, &mut io::sink()).unwrap();
        assert_eq!(reader.sha256()[..4], [0xba, 0x78, 0x16, 0xbf]);
    }
}
