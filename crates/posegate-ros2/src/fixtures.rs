//! What the tests of several modules use: settings by a command line, moments, and messages of a robot.

use crate::arguments::Arguments;
use crate::clock::Now;
use crate::message::{Header, Odometry, Pose, PoseWithCovariance};
use crate::permit_gate::Origin;
use crate::settings::NodeSettings;

/// The table of the dock.
pub const TABLE: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");

/// Errors of the odometry.
pub const ODOMETRY: &str = "-p use_odometry:=true -p odometry_m_per_sqrt_m:=0.001 -p odometry_rad_per_sqrt_rad:=0.001 \
    -p odometry_rad_per_sqrt_m:=0.001 -p odometry_slip:=0.01";

/// Reads a command line.
pub fn arguments(line: &str) -> Arguments {
    Arguments::read(line.split_whitespace().map(str::to_owned)).unwrap()
}

/// Returns the settings by a table and the command line after it.
pub fn settings(table: &[u8], line: &str) -> NodeSettings {
    NodeSettings::new(&arguments(&format!("t.posegate {line}")), table).unwrap()
}

/// A moment, milliseconds after the start.
pub fn at(ms: impl Into<i128>) -> Now {
    Now::from_ns(1_800_000_000_000_000_000 + ms.into() * 1_000_000)
}

/// A message of the only publisher.
pub fn origin(number: i64) -> Origin {
    Origin {
        publisher: [1; 16],
        number,
    }
}

/// The header of a message.
pub fn header(now: Now, frame: &str) -> Header {
    Header {
        stamp: now.time(),
        frame_id: frame.into(),
    }
}

/// A pose on the x axis.
pub fn pose(x: f64) -> Pose {
    Pose {
        position: [x, 0.0, 0.0],
        orientation: [0.0, 0.0, 0.0, 1.0],
    }
}

/// A pose on the x axis with its variances of x, y and yaw.
pub fn with_variances(x: f64, variances: [f64; 3]) -> PoseWithCovariance {
    let mut covariance = [0.0; 36];
    [covariance[0], covariance[7], covariance[35]] = variances;
    PoseWithCovariance {
        pose: pose(x),
        covariance,
    }
}

/// A message of the odometry.
pub fn odometry(header: Header, child: &str, pose: PoseWithCovariance) -> Odometry {
    Odometry {
        header,
        child_frame_id: child.into(),
        pose,
        twist: Default::default(),
    }
}
