//! Permissions and verdicts in the layout of C.

use super::memory::{Plain, read};
use posegate::contain::Margin;
use posegate::gate::{DENY, Permission, Verdict};
use posegate::pose::Pose;

/// The verdict byte of a permit. No other byte permits.
pub const POSEGATE_PERMIT: u8 = 0xa5;
/// The verdict byte of a denial.
pub const POSEGATE_DENY: u8 = 0;

const _: () = assert!(POSEGATE_PERMIT == posegate::gate::PERMIT && POSEGATE_DENY == DENY);

/// The permission that opens an interlock: a verdict byte, its complement, the signature of the checks that led
/// to it, low byte first, and the time of the step. Zeroed and erased memory is a denial, and so is every
/// change of a denial within one byte. A permission is valid only in the cycle for which it was made:
/// `posegate_permission_is_permit` refuses a stored one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_permission {
    /// `POSEGATE_PERMIT` or `POSEGATE_DENY`.
    pub verdict: u8,
    /// The complement of the verdict.
    pub complement: u8,
    /// The signature of the checks that led to the verdict, low byte first. Do not change it.
    pub flow: [u8; 2],
    /// The time of the step, milliseconds of the controller's clock, low byte first.
    pub made_ms: [u8; 4],
}

impl posegate_permission {
    pub(super) const fn of(permission: Permission) -> Self {
        let [verdict, complement, low, high, a, b, c, d] = permission.to_bytes();
        Self {
            verdict,
            complement,
            flow: [low, high],
            made_ms: [a, b, c, d],
        }
    }

    const fn permission(self) -> Permission {
        let ([low, high], [a, b, c, d]) = (self.flow, self.made_ms);
        Permission::from_bytes([self.verdict, self.complement, low, high, a, b, c, d])
    }
}

/// A pose in the world frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_pose {
    /// x, micrometres, world frame.
    pub x_um: i32,
    /// y, micrometres, world frame.
    pub y_um: i32,
    /// Yaw, 2^-32 turn, counter-clockwise from the x axis.
    pub yaw_turn_q32: u32,
}

/// The verdict of a judge on one estimate, or of a gate for telemetry. It does not open an interlock: only a
/// gate's permission does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct posegate_verdict {
    /// `POSEGATE_PERMIT` or `POSEGATE_DENY`.
    pub verdict: u8,
    /// 1 if `margin_q16` is valid, else 0.
    pub has_margin: u8,
    /// 1 if `worst_pose` is valid, else 0.
    pub has_worst_pose: u8,
    /// Reserved: must be 0.
    pub reserved: u8,
    /// A `posegate_reason`; 0 with a permit, and if an error was returned.
    pub reason: u32,
    /// The factor by which the pose-set could be scaled and still be inside, unit 2^-16, rounded down: at least
    /// 65,536 with a permit, below it otherwise.
    pub margin_q16: u32,
    /// A pose at the border of the pose-set that the table does not cover, world frame.
    pub worst_pose: posegate_pose,
}

// SAFETY: integers.
unsafe impl Plain for posegate_permission {
    const DENIED: Self = Self::of(Permission::DENIED);
}
// SAFETY: integers.
unsafe impl Plain for posegate_pose {}
// SAFETY: integers. Zero is `POSEGATE_DENY`.
unsafe impl Plain for posegate_verdict {}

impl posegate_pose {
    pub(super) const fn of(pose: Pose) -> Self {
        Self {
            x_um: pose.x_um,
            y_um: pose.y_um,
            yaw_turn_q32: pose.yaw.0,
        }
    }
}

impl posegate_verdict {
    pub(super) fn of(verdict: Verdict) -> Self {
        let (byte, reason, margin, worst) = match verdict {
            Verdict::Permit { margin } => (POSEGATE_PERMIT, 0, Some(margin), None),
            Verdict::Deny {
                reason,
                margin,
                worst_pose,
            } => (POSEGATE_DENY, reason.code(), margin, worst_pose),
        };
        Self {
            verdict: byte,
            has_margin: u8::from(margin.is_some()),
            has_worst_pose: u8::from(worst.is_some()),
            reserved: 0,
            reason: u32::from(reason),
            margin_q16: margin.map_or(0, Margin::q16),
            worst_pose: posegate_pose::of(worst.unwrap_or_default()),
        }
    }
}

/// Returns `POSEGATE_PERMIT` if the interlock may open in the cycle whose step or tick was given the time
/// `now_ms`: all parts of the permission permit, and that step made it. Otherwise returns `POSEGATE_DENY`, so a
/// stored permission opens nothing later. Compare the answer with `POSEGATE_PERMIT`.
///
/// # Safety
/// The pointer is null, misaligned, or points to a permission.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_permission_is_permit(
    permission: *const posegate_permission,
    now_ms: u32,
) -> u8 {
    // SAFETY: the caller's promise.
    match unsafe { read(permission) } {
        Ok(permission) if permission.permission().opens_at(now_ms) => POSEGATE_PERMIT,
        _ => POSEGATE_DENY,
    }
}
