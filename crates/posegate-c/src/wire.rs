//! Estimates in and verdicts out over a serial line, in the frames of [`posegate::wire`].

use super::call::{answer, init};
use super::memory::{
    Plain, Storage, bytes, check, object, open, read, separate, separate_from_all, unused, write,
};
use super::{POSEGATE_PERMIT, posegate_belief, posegate_judge, posegate_status, posegate_verdict};
use posegate::contain::Margin;
use posegate::gate::{Reason, Verdict};
use posegate::num::BinaryAngle;
use posegate::pose::Pose;
use posegate::recordings::Evaluator;
use posegate::report::{Heading, PoseEstimate};
use posegate::set::{Estimate, RadiusSquared};
use posegate::wire::{Receiver, Reply, Request, WireError, encode};

/// Bytes of the longest message or frame.
pub const POSEGATE_LONGEST_MESSAGE: usize = 152;
/// Number of 64-bit words of a `posegate_receiver`.
pub const POSEGATE_RECEIVER_WORDS: usize = 24;

const _: () = assert!(posegate::wire::LONGEST_FRAME <= POSEGATE_LONGEST_MESSAGE);

/// The body of a message, or a frame for the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_message {
    /// 1 if a frame has ended, else 0. Only `posegate_receiver_push` sets it.
    pub is_complete: u8,
    /// Reserved: must be 0.
    pub reserved: [u8; 2],
    /// The number of valid bytes.
    pub length: u8,
    /// The bytes.
    pub bytes: [u8; POSEGATE_LONGEST_MESSAGE],
}

/// Storage of a receiver, which collects the bytes of a serial line into frames. `posegate_receiver_init`
/// initialises it.
#[repr(C)]
pub struct posegate_receiver {
    /// Private.
    pub words: [u64; POSEGATE_RECEIVER_WORDS],
}

/// A request to evaluate an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_request {
    /// The estimate: a yaw in radians, Gaussian or bounded.
    pub belief: posegate_belief,
    /// Returned in the reply: 16 bits.
    pub sequence: u32,
    /// The index of the controller's table to use.
    pub table: u32,
    /// The time of the estimate, milliseconds of a wrapping clock.
    pub stamp_ms: u32,
    /// The time at which the estimate is used, milliseconds of the same clock. A controller with its own clock uses that
    /// instead.
    pub now_ms: u32,
    /// Squared radius of a Gaussian set, unit 2^-16, at least that of the table.
    pub radius_squared_q16: u32,
    /// Reserved: must be 0.
    pub reserved: u32,
}

/// A reply with a verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_reply {
    /// The sequence number of the request: 16 bits; 0xffff if the frame was not a request that could be evaluated.
    pub sequence: u32,
    /// `POSEGATE_STATUS_OK`, or the `POSEGATE_STATUS_WIRE_` error of the frame or the request. With an
    /// error the verdict is ignored.
    pub status: i32,
    /// The verdict.
    pub verdict: posegate_verdict,
    /// 1 if the interlock output is high, read back after the verdict, else 0.
    pub interlock_high: u32,
}

// SAFETY: integers.
unsafe impl Storage for posegate_receiver {
    type Held = Receiver;
    const MARK: u32 = 0x7265_6376;
}

// SAFETY: integers.
unsafe impl Plain for posegate_message {}
// SAFETY: numbers.
unsafe impl Plain for posegate_request {}
// SAFETY: integers.
unsafe impl Plain for posegate_reply {}

impl posegate_message {
    fn of(bytes: &[u8]) -> Self {
        let mut message = Self::ZERO;
        for (to, byte) in message.bytes.iter_mut().zip(bytes) {
            *to = *byte;
        }
        // Every frame is shorter than the array, which is shorter than 256.
        message.length = u8::try_from(bytes.len()).unwrap_or(0);
        message
    }
}

impl posegate_request {
    const fn of(request: &Request) -> Self {
        Self {
            belief: posegate_belief::of(&PoseEstimate::new(request.estimate, request.spread)),
            sequence: request.sequence as u32,
            table: request.table as u32,
            stamp_ms: request.stamp_ms,
            now_ms: request.now_ms,
            radius_squared_q16: request.radius_squared.q16(),
            reserved: 0,
        }
    }

    fn request(&self) -> Option<Request> {
        unused(self.reserved).ok()?;
        let belief = self.belief.belief().ok()?;
        let Heading::Radians(yaw_rad) = belief.heading else {
            return None;
        };
        Some(Request {
            sequence: u16::try_from(self.sequence).ok()?,
            table: u8::try_from(self.table).ok()?,
            stamp_ms: self.stamp_ms,
            now_ms: self.now_ms,
            radius_squared: RadiusSquared::from_q16(self.radius_squared_q16)?,
            estimate: Estimate {
                x_m: belief.x_m,
                y_m: belief.y_m,
                yaw_rad,
            },
            spread: belief.spread?,
        })
    }
}

impl posegate_reply {
    fn reply(&self) -> Option<Reply> {
        const NONE: i32 = posegate_status::Ok as i32;
        const FRAME: i32 = posegate_status::WireFrame as i32;
        const CHECKSUM: i32 = posegate_status::WireChecksum as i32;
        const CONTENT: i32 = posegate_status::WireContent as i32;
        const TABLE: i32 = posegate_status::WireTable as i32;
        let verdict = match self.status {
            NONE => Ok(self.verdict.decode()?),
            FRAME => Err(WireError::Frame),
            CHECKSUM => Err(WireError::Checksum),
            CONTENT => Err(WireError::Content),
            TABLE => Err(WireError::Table),
            _ => return None,
        };
        Some(Reply {
            sequence: u16::try_from(self.sequence).ok()?,
            verdict,
            interlock_high: match self.interlock_high {
                0 => false,
                1 => true,
                _ => return None,
            },
        })
    }
}

impl posegate_verdict {
    /// Returns the verdict, or `None` if the numbers contradict each other.
    fn decode(&self) -> Option<Verdict> {
        unused(self.reserved.into()).ok()?;
        let flag = |flag: u8| match flag {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        };
        let margin = flag(self.has_margin)?.then_some(Margin::from_q16(self.margin_q16));
        let pose = Pose {
            x_um: self.worst_pose.x_um,
            y_um: self.worst_pose.y_um,
            yaw: BinaryAngle(self.worst_pose.yaw_turn_q32),
        };
        let worst_pose = flag(self.has_worst_pose)?.then_some(pose);
        match (self.verdict, self.reason) {
            (POSEGATE_PERMIT, 0) if worst_pose.is_none() => {
                Some(Verdict::Permit { margin: margin? })
            }
            (0, code) => Some(Verdict::Deny {
                reason: Reason::from_code(u8::try_from(code).ok()?)?,
                margin,
                worst_pose,
            }),
            _ => None,
        }
    }
}

/// Initialises storage for an empty receiver.
///
/// # Safety
/// The pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_receiver_init(
    receiver: *mut posegate_receiver,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe { init(receiver, || Ok(Receiver::new())) }
}

/// Takes one byte of the line. At the end of a frame `is_complete` is 1. Then the body is in the message,
/// or a `POSEGATE_STATUS_WIRE_` error is returned.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_receiver_push(
    receiver: *mut posegate_receiver,
    byte: u8,
    body: *mut posegate_message,
) -> posegate_status {
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe {
        let apart = separate(receiver, body);
        write(body, posegate_message::ZERO)?;
        apart?;
        let Some(frame) = object(receiver)?.push(byte) else {
            return Ok(());
        };
        let mut message = posegate_message::of(frame.as_deref().unwrap_or_default());
        message.is_complete = 1;
        write(body, message)?;
        frame.map(|_| ()).map_err(Into::into)
    })
}

/// Decodes a request from the body of a message.
///
/// Errors: `POSEGATE_STATUS_WIRE_CONTENT` if the body is not a request.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type; `length` bytes of the body can be
/// read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_request_decode(
    body: *const u8,
    length: usize,
    request: *mut posegate_request,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(request, || {
            let decoded = Request::from_body(bytes(body, length)?)?;
            Ok(posegate_request::of(&decoded))
        })
    }
}

/// For recordings and benches only.
///
/// Writes the verdict of the judge that a request names by its index among `count` judges.
///
/// Errors: `POSEGATE_STATUS_WIRE_TABLE` if there is no such judge. `POSEGATE_STATUS_WIRE_CONTENT` if the
/// request has a smaller radius than the table was made for.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type; there are `count` judges.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_request_judge(
    request: *const posegate_request,
    judges: *const posegate_judge,
    count: usize,
    verdict: *mut posegate_verdict,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(verdict, || {
            let storages = judges.cast_mut();
            separate_from_all(storages, count, request)
                .and(separate_from_all(storages, count, verdict))?;
            let request = read(request)?.request().ok_or(posegate_status::BadValue)?;
            let index = usize::from(request.table);
            if index >= count {
                return Err(posegate_status::WireTable);
            }
            check(judges)?;
            let judge: &Evaluator<'_> = &*open(storages.wrapping_add(index))?;
            // `judge` is the only one in the slice.
            let asked = Request {
                table: 0,
                ..request
            };
            let result = asked.evaluate(core::slice::from_ref(judge))?;
            Ok(posegate_verdict::of(result))
        })
    }
}

/// Encodes the body of a reply.
///
/// Errors: `POSEGATE_STATUS_BAD_VALUE` if a number of the reply is not in its enum or out of its range.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_reply_encode(
    reply: *const posegate_reply,
    body: *mut posegate_message,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(body, || {
            let reply = read(reply)?.reply().ok_or(posegate_status::BadValue)?;
            Ok(posegate_message::of(&reply.body()))
        })
    }
}

/// Encodes the frame of a body: the bytes for the line, with the closing zero.
///
/// Errors: `POSEGATE_STATUS_BAD_LENGTH` if the body is longer than any message; `POSEGATE_STATUS_BAD_VALUE` if its `reserved` is not 0.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_frame_encode(
    body: *const posegate_message,
    frame: *mut posegate_message,
) -> posegate_status {
    // SAFETY: the caller's promise.
    unsafe {
        answer(frame, || {
            let body = read(body)?;
            unused(u16::from_le_bytes(body.reserved).into())?;
            let bytes = body.bytes.get(..usize::from(body.length));
            let bytes = bytes.filter(|bytes| bytes.len() <= posegate::wire::LONGEST_BODY);
            let bytes = bytes.ok_or(posegate_status::BadLength)?;
            Ok(posegate_message::of(&encode(bytes)))
        })
    }
}
