//! Detects the format of a file from its first bytes.

use crate::trajectories::names_quaternion;

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
    /// EuRoC: the time and seven numbers per line, separated by commas.
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
/// not part of a number. The header of a EuRoC trajectory begins with a time and names the parts of a quaternion, also without the `#` of a
/// comment.
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
    let names = |line: &[u8]| {
        let header = String::from_utf8_lossy(line).to_ascii_lowercase();
        let mut orders = ["wxyz", "xyzw"].iter();
        orders.any(|order| names_quaternion(&header, order))
    };
    let all = || {
        let lines = start.split(|byte| *byte == b'\n');
        lines.map(|line| line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line))
    };
    let is_comment = |line: &&[u8]| {
        let line = line.trim_ascii_start();
        line.is_empty() || line.starts_with(b"#")
    };
    let is_named = all().take_while(is_comment).any(names);
    let mut lines = all().filter(|line| !is_comment(line));
    let Some(first) = lines.next() else {
        return Format::Tum;
    };
    let is_header = first.to_ascii_lowercase().starts_with(b"t") && names(first);
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
        let count = fields.clone().count();
        let time = fields.next().unwrap_or_default().trim_ascii();
        let is_whole = !time.is_empty() && time.iter().all(u8::is_ascii_digit);
        let is_pose = match count {
            // Twelve are the rows of a KITTI pose with commas.
            1 | 12 => false,
            // With velocities and biases.
            8 | 17 => number(time),
            _ => is_whole || number(time) && is_named,
        };
        return if is_pose && fields.all(number) {
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
            (b"#timestamp [s],x,y,z,q_w,q_x,q_y,q_z\r\n1403636579.763,0.1,0.2,0.3,1,0,0,0,0,0\r\n", Format::Euroc),
            (b"Time,tx,ty,tz,qx,qy,qz,qw\n1.5,0.1,0.2,0.3,0,0,0,1\n", Format::Euroc),
            (b"1.5,0.1,0.2,0.3,1,0,0,0\n", Format::Euroc),
            (b"1.5,0.1,0.2,0.3,0.01,0,0,0.01,0,0.01\n", Format::Csv),
            (b"1 0 0 0.1 0 1 0 0.2 0 0 1 0\n", Format::Kitti),
            (b"\x28\xb5\x2f\xfd", Format::Zstd),
        ] {
            assert_eq!(format_of(start), format);
        }
    }
}
