//! The rules of a plan as bytes in flash. They are parsed once; then no accessor can fail.
//!
//! | at | what | |
//! |---|---|---|
//! | 0 | 4 bytes | `PGSQ` |
//! | 4 | u16 | format version, 1 |
//! | 6 | u16 | number of rules, from 1 |
//! | 8 | u16 | number of task names |
//! | 10 | u16 | 0 |
//! | 12 | u32 | total length, the CRC included |
//! | 16 | 32 bytes | SHA-256 of the site |
//! | 48 | 32 bytes each | names of tasks, UTF-8, filled with zeros |
//! | then | 56 bytes each | rules |
//! | end - 4 | u32 | CRC-32C of all bytes before |
//!
//! A rule: kind (u8: 0 work, 1 look, 2 drive), attempts (u8), task name (u16), tag (u32), the next rule (u16), the next
//! rule after a failure (u16, 65535 for none), the pose where the step begins (i32 um, i32 um, u32 of 2^-32 turn), the
//! tolerance of the estimate there (i32 um, i32 of 2^-24 turn), the largest pose-set (i32 um, i32 of 2^-24
//! turn), the target pose of a drive (same encoding), zero (u32). All little-endian.

use crate::num::BinaryAngle;
use crate::pose::Pose;
use crate::table::{CRC_LENGTH, checksum};
use crate::task::Cylinder;

/// First four bytes of a rule table.
pub const MAGIC: [u8; 4] = *b"PGSQ";
/// Version of the format of rule tables.
pub const VERSION: u16 = 1;
/// Bytes before the task names.
pub const HEAD: usize = 48;
/// Bytes of one task name.
pub const NAME: usize = 32;
/// Bytes of one rule.
pub const RULE: usize = 56;
/// The number that means no rule.
pub const NONE: u16 = u16::MAX;

/// Tag number of a rule that looks at no tag, or at several.
pub const NO_TAG: u32 = u32::MAX;

/// The kind of step that a rule prescribes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// The work.
    Work,
    /// A look at a tag.
    Look,
    /// A drive.
    Drive,
}

/// A step of a plan and the conditions for which it is proven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rule {
    /// The kind of step.
    pub kind: Kind,
    /// Number of attempts, at least 1.
    pub attempts: u8,
    /// Index of the task's name.
    pub task: u16,
    /// Tag of a look.
    pub tag: u32,
    /// The next rule after a success; a work rule refers to itself.
    pub then: u16,
    /// The next rule after the last failed attempt; `None` gives up.
    pub otherwise: Option<u16>,
    /// Pose where the step begins.
    pub place: Pose,
    /// Largest distance of the estimate from `place`.
    pub spread: Cylinder,
    /// The largest pose-set, for any confidence: the plan's risk is for the sets that it was made for.
    pub set: Cylinder,
    /// Target pose of a drive.
    pub to: Pose,
}

/// Why bytes are not a valid rule table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RulesError {
    /// The length differs from the header.
    Length,
    /// The magic bytes, the version or another header field is wrong.
    Header,
    /// The checksum is wrong.
    Checksum,
    /// A name is empty or not UTF-8.
    Name,
    /// A rule refers to a missing entry, or has a number out of range.
    Rule,
}

messages!(RulesError {
    Length => "the length of the rule table differs from its header",
    Header => "the magic bytes, the version or another header field of the rule table is wrong",
    Checksum => "the checksum of the rule table is wrong: the bytes are damaged",
    Name => "a name of the rule table is empty or not UTF-8",
    Rule => "a rule refers to a missing entry, or has a number out of range",
});

/// The rules of a plan.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rules<'a> {
    names: &'a [[u8; NAME]],
    rules: &'a [[u8; RULE]],
    digest: &'a [u8; 32],
}

impl<'a> Rules<'a> {
    /// Parses and checks a rule table.
    ///
    /// # Errors
    /// [`RulesError`] if the length, header, checksum, a name or a rule is invalid.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, RulesError> {
        let end = bytes
            .len()
            .checked_sub(CRC_LENGTH)
            .ok_or(RulesError::Length)?;
        let (content, crc) = bytes.split_at_checked(end).ok_or(RulesError::Length)?;
        let (head, rest) = content.split_at_checked(HEAD).ok_or(RulesError::Length)?;
        let mut head = Reader(head);
        let magic: &[u8; 4] = head.take().ok_or(RulesError::Header)?;
        let version = head.u16().ok_or(RulesError::Header)?;
        if *magic != MAGIC || version != VERSION {
            return Err(RulesError::Header);
        }
        let rules = head.u16().ok_or(RulesError::Header)?;
        let names = head.u16().ok_or(RulesError::Header)?;
        let zero = head.u16().ok_or(RulesError::Header)?;
        let length = head.u32().ok_or(RulesError::Header)?;
        let digest: &[u8; 32] = head.take().ok_or(RulesError::Header)?;
        if rules == 0 || rules == NONE || zero != 0 {
            return Err(RulesError::Header);
        }
        if usize::try_from(length) != Ok(bytes.len()) {
            return Err(RulesError::Length);
        }
        if Reader(crc).u32() != Some(checksum(content)) {
            return Err(RulesError::Checksum);
        }
        let across = usize::from(names)
            .checked_mul(NAME)
            .ok_or(RulesError::Length)?;
        let (named, rest) = rest.split_at_checked(across).ok_or(RulesError::Length)?;
        let (named, _) = named.as_chunks::<NAME>();
        let (ruled, left) = rest.as_chunks::<RULE>();
        if ruled.len() != usize::from(rules) || !left.is_empty() {
            return Err(RulesError::Length);
        }
        let parsed = Self {
            names: named,
            rules: ruled,
            digest,
        };
        for name in 0..names {
            parsed
                .name(name)
                .filter(|name| !name.is_empty())
                .ok_or(RulesError::Name)?;
        }
        for number in 0..rules {
            let rule = parsed.get(number).ok_or(RulesError::Rule)?;
            let known = |number: u16| number < rules;
            let good = known(rule.then)
                && rule.otherwise.is_none_or(known)
                && rule.attempts > 0
                && (rule.kind == Kind::Drive || rule.task < names);
            if !good {
                return Err(RulesError::Rule);
            }
        }
        Ok(parsed)
    }

    /// Returns the number of rules.
    #[must_use]
    pub const fn count(&self) -> u16 {
        // `parse` ensures fewer than 2^16.
        self.rules.len() as u16
    }

    /// Returns the SHA-256 of the site from which the plan was made.
    #[must_use]
    pub const fn site_digest(&self) -> &'a [u8; 32] {
        self.digest
    }

    /// Returns a task's name; `None` beyond the last.
    #[must_use]
    pub fn name(&self, number: u16) -> Option<&'a str> {
        let bytes = self.names.get(usize::from(number))?;
        let length = bytes.iter().position(|byte| *byte == 0).unwrap_or(NAME);
        let (name, fill) = bytes.split_at_checked(length)?;
        if fill.iter().any(|byte| *byte != 0) {
            return None;
        }
        core::str::from_utf8(name).ok()
    }

    /// Returns a rule; `None` beyond the last.
    #[must_use]
    pub fn get(&self, number: u16) -> Option<Rule> {
        let mut bytes = Reader(self.rules.get(usize::from(number))?);
        let kind = match bytes.u8()? {
            0 => Kind::Work,
            1 => Kind::Look,
            2 => Kind::Drive,
            _ => return None,
        };
        let attempts = bytes.u8()?;
        let task = bytes.u16()?;
        let tag = bytes.u32()?;
        let then = bytes.u16()?;
        let otherwise = Some(bytes.u16()?).filter(|number| *number != NONE);
        let place = bytes.pose()?;
        let spread = bytes.cylinder()?;
        let set = bytes.cylinder()?;
        let to = bytes.pose()?;
        (bytes.u32()? == 0).then_some(Rule {
            kind,
            attempts,
            task,
            tag,
            then,
            otherwise,
            place,
            spread,
            set,
            to,
        })
    }
}

/// Reads numbers from the front of a slice.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take<const N: usize>(&mut self) -> Option<&'a [u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(first)
    }

    fn u8(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| *byte)
    }

    fn u16(&mut self) -> Option<u16> {
        self.take().map(|bytes| u16::from_le_bytes(*bytes))
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(|bytes| u32::from_le_bytes(*bytes))
    }

    fn i32(&mut self) -> Option<i32> {
        self.take().map(|bytes| i32::from_le_bytes(*bytes))
    }

    fn pose(&mut self) -> Option<Pose> {
        Some(Pose {
            x_um: self.i32()?,
            y_um: self.i32()?,
            yaw: BinaryAngle(self.u32()?),
        })
    }

    fn cylinder(&mut self) -> Option<Cylinder> {
        Cylinder::from_um_q24(i64::from(self.i32()?), i64::from(self.i32()?))
    }
}
