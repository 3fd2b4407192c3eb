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
    /// EuRoC: nanoseconds and seven numbers per line, separated by commas.
    Euroc,
    /// KITTI: twelve numbers per line, without times.
    Kitti,
    /// A ROS 2 bag in SQLite.
    Sqlite,
    /// A ROS 1 bag.
    Ros1,
    /// A file that is compressed as a whole by zstd.
    Zstd,
}

impl Format {
    /// Returns `true` for a bag, which has topics, also if it is compressed.
    #[must_use]
    pub const fn is_bag(self) -> bool {
        matches!(self, Self::Mcap | Self::Sqlite | Self::Ros1 | Self::Zstd)
    }
}

/// Returns the format of a file from its first bytes. A text has a header if its first line has a letter that is
/// not part of a number. The header of a EuRoC trajectory begins with `timestamp`, also without the `#` of a comment.
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
    if start.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        return Format::Zstd;
    }
    let mut lines = start
        .split(|byte| *byte == b'\n')
        .map(|line| line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line))
        .filter(|line| !line.trim_ascii().is_empty() && !line.trim_ascii_start().starts_with(b"#"));
    let Some(first) = lines.next() else {
        return Format::Tum;
    };
    let is_timestamp = first.trim_ascii().starts_with(b"timestamp");
    let turn = first.split(|byte| *byte == b',').nth(4).unwrap_or_default();
    let is_header = is_timestamp && turn.trim_ascii().starts_with(b"q");
    if is_header && lines.next().map(format_of) == Some(Format::Euroc) {
        return Format::Euroc;
    }
    if first.contains(&b',') || first.contains(&b'_') {
        // A CSV has a header: names, not numbers.
        let number = |field: &[u8]| {
            let text = std::str::from_utf8(field).ok();
            text.is_some_and(|text| text.trim().parse::<f64>().is_ok())
        };
        let mut fields = first.split(|byte| *byte == b',');
        let time = fields.next().unwrap_or_default().trim_ascii();
        let is_whole = !time.is_empty() && time.iter().all(u8::is_ascii_digit);
        // Twelve are the rows of a KITTI pose with commas.
        let is_kitti = first.split(|byte| *byte == b',').count() == 12;
        return if is_whole && first.contains(&b',') && !is_kitti && fields.all(number) {
            Format::Euroc
        } else {
            Format::Csv
        };
    }
    let fields = first.split(|byte| *byte == b'#').next().unwrap_or_default();
    let fields = fields.split(u8::is_ascii_whitespace);
    match fields.filter(|field| !field.is_empty()).count() {
        12 => Format::Kitti,
        _ => Format::Tum,
    }
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
            (
                b"#timestamp [ns],p_x\n1403636579763555584,0.1,0.2,0.3,1,0,0,0\n",
                Format::Euroc,
            ),
            (b"0,0.1,0.2,0.3,1,0,0,0\n", Format::Euroc),
            (b"1,0,0,0.1,0,1,0,0.2,0,0,1,0\n", Format::Csv),
            (
                b"timestamp, p_x, p_y, p_z, q_x, q_y, q_z, q_w\n1403636579763555584, 0.1, 0.2, 0.3, 0, 0, 0, 1\n",
                Format::Euroc,
            ),
            (
                b"timestamp,t_s,x_m,y_m,yaw_rad\n1500000000,1.5,0.1,0,0\n",
                Format::Csv,
            ),
            (b"1 0 0 0.1 0 1 0 0.2 0 0 1 0\n", Format::Kitti),
            (b"\x28\xb5\x2f\xfd", Format::Zstd),
        ] {
            assert_eq!(format_of(start), format);
        }
    }
}
