//! Detects the format of a file from its first bytes.

/// The format of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// MCAP.
    Mcap,
    /// CSV with a header.
    Csv,
    /// TUM: eight numbers per line.
    Tum,
    /// A ROS 2 bag in SQLite; not supported.
    Sqlite,
    /// A ROS 1 bag; not supported.
    Ros1,
}

/// Returns the format of a file from its first bytes. A text has a header if its first line has a letter that is
/// not part of a number.
#[must_use]
pub fn format_of(start: &[u8]) -> Format {
    if start.starts_with(b"\x89MCAP") {
        return Format::Mcap;
    }
    if start.starts_with(b"SQLite format 3") {
        return Format::Sqlite;
    }
    if start.starts_with(b"#ROSBAG") {
        return Format::Ros1;
    }
    let first = start
        .split(|byte| *byte == b'\n')
        .map(|line| line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line))
        .find(|line| !line.trim_ascii().is_empty() && !line.trim_ascii_start().starts_with(b"#"));
    let is_header = first.is_some_and(|line| line.contains(&b',') || line.contains(&b'_'));
    if is_header { Format::Csv } else { Format::Tum }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn format_follows_from_the_first_bytes() {
        for (start, format) in [
            (&b"\x89MCAP0\r\n"[..], Format::Mcap),
            (b"SQLite format 3\0", Format::Sqlite),
            (b"#ROSBAG V2.0\n", Format::Ros1),
            (b"# a drive\n\nt_s,x_m\n", Format::Csv),
            (b"\xef\xbb\xbft_s,x_m\n", Format::Csv),
            (b"# t x y\n1.5 0 nan 0 0 0 0 1 # a, b\n", Format::Csv),
            (b"# t x y\n1.5e3 0 nan 0 0 0 0 1\n", Format::Tum),
            (b"", Format::Tum),
        ] {
            assert_eq!(format_of(start), format);
        }
    }
}
