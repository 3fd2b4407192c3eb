//! Damaged frames, and intact frames with wrong content, as a broken line, a broken sender or a broken filter
//! would send them instead of a good report. Also random bytes.

use crate::controller::Chance;
use crate::dock::good_belief;
use posegate::report::{FrameId, Heading, PoseEstimate, Report};
use posegate::set::{Estimate, Uncertainty};
use posegate::wire::{encode, report_body};

/// Returns the frame of a report, with its final zero.
pub fn frame(report: &Report) -> Vec<u8> {
    encode(&report_body(report)).to_vec()
}

/// Returns a frame damaged during transmission. Some results still contain a report: a frame sent twice, or an intact
/// frame next to a damaged copy.
pub fn damaged(chance: &mut Chance, good: &Report) -> Vec<u8> {
    let mut bytes = frame(good);
    match chance.below(9) {
        0 | 1 => {
            for _ in 0..=chance.below(4) {
                let bit = chance.below(bytes.len() * 8);
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
        }
        2 => {
            for _ in 0..=chance.below(3) {
                bytes.remove(chance.below(bytes.len()));
            }
        }
        3 => {
            for _ in 0..=chance.below(3) {
                let byte = chance.next() as u8;
                bytes.insert(chance.below(bytes.len()), byte);
            }
        }
        4 => {
            let (a, b) = (chance.below(bytes.len()), chance.below(bytes.len()));
            bytes.swap(a, b);
        }
        5 => {
            bytes.truncate(chance.below(bytes.len()));
            bytes.push(0);
        }
        6 => {
            // Two frames joined: the zero between them is lost.
            bytes.pop();
            bytes.extend(frame(good));
        }
        7 => {
            // The tail of one and the head of another.
            let cut = chance.below(bytes.len());
            bytes.rotate_left(cut);
        }
        _ => {
            let byte = chance.next() as u8;
            let at = chance.below(bytes.len());
            for place in bytes.iter_mut().skip(at).take(1 + chance.below(20)) {
                *place = byte;
            }
        }
    }
    bytes
}

/// Returns an intact frame with a correct checksum whose report differs from the good one; by chance it may also be
/// good.
pub fn lying(chance: &mut Chance, good: &Report) -> Vec<u8> {
    let mut report = *good;
    let PoseEstimate { spread, .. } = good_belief();
    let Some(Uncertainty::Gaussian(mut covariance)) = spread else {
        panic!("the good belief is Gaussian")
    };
    let mut pose = Estimate {
        x_m: good.belief.x_m,
        y_m: good.belief.y_m,
        yaw_rad: 0.004,
    };
    let odd = [
        f64::NAN,
        f64::INFINITY,
        -1e300,
        0.5,
        -0.09,
        2.1,
        3000.0,
        -0.0,
    ][chance.below(8)];
    let (row, column) = (chance.below(3), chance.below(3));
    match chance.below(16) {
        0 => pose.x_m = odd,
        1 => pose.y_m = odd,
        2 => pose.yaw_rad = odd,
        // Near the border of the dock, on either side.
        3 => pose.x_m = 0.06 + 0.005 * (chance.below(1000) as f64 / 1000.0),
        4 => pose.y_m = 0.04 + 0.005 * (chance.below(1000) as f64 / 1000.0),
        5 => covariance = [[0.0; 3]; 3],
        6 => covariance[row][column] = odd,
        7 => covariance[row][row] *= 10f64.powi(chance.below(12) as i32 - 3),
        8 => {
            report.sequence = report
                .sequence
                .wrapping_add(chance.below(5) as u32)
                .wrapping_sub(2)
        }
        9 => report.sequence = chance.next() as u32,
        10 => report.stamp_ms = report.stamp_ms.wrapping_sub(chance.below(400) as u32),
        11 => report.stamp_ms = report.stamp_ms.wrapping_add(chance.below(400) as u32),
        12 => report.stamp_ms = chance.next() as u32,
        13 => report.source = 1 + chance.below(255) as u8,
        14 => report.frame = [FrameId::of("odom"), FrameId::UNNAMED][chance.below(2)],
        _ => {
            // Bits of the body flipped, and the checksum computed again.
            report.belief = PoseEstimate::new(pose, Uncertainty::Gaussian(covariance));
            let mut body = report_body(&report);
            for _ in 0..=chance.below(4) {
                let bit = chance.below(body.len() * 8);
                body[bit / 8] ^= 1 << (bit % 8);
            }
            return encode(&body).to_vec();
        }
    }
    let spread = match chance.below(12) {
        0 => None,
        1 => Some(Uncertainty::Bounded {
            translation_m: [0.01, 0.0, -1.0, 0.07, f64::NAN][chance.below(5)],
            yaw_rad: [0.01, 0.0, 0.08, 7.0][chance.below(4)],
        }),
        _ => Some(Uncertainty::Gaussian(covariance)),
    };
    report.belief = PoseEstimate {
        x_m: pose.x_m,
        y_m: pose.y_m,
        heading: Heading::Radians(pose.yaw_rad),
        spread,
    };
    frame(&report)
}

/// Returns random bytes, of one of several kinds.
pub fn random_bytes(chance: &mut Chance, good: &Report) -> Vec<u8> {
    let length = 1 + chance.below(400);
    let mut bytes: Vec<u8> = (0..length).map(|_| chance.next() as u8).collect();
    match chance.below(5) {
        // Any bytes.
        0 => {}
        // Mostly ends of frames.
        1 => bytes
            .iter_mut()
            .for_each(|byte| *byte = if *byte < 40 { *byte } else { 0 }),
        // No end of a frame.
        2 => bytes.iter_mut().for_each(|byte| *byte |= 1),
        // One byte, over and over.
        3 => bytes.fill(chance.next() as u8),
        // The head of a good frame, then random bytes.
        _ => {
            let frame = frame(good);
            let head = chance.below(frame.len() - 1);
            bytes.splice(..0, frame.into_iter().take(head));
        }
    }
    bytes
}
