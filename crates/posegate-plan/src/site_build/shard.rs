//! The part of a site that a process makes.

use std::fmt;
use std::str::FromStr;

/// One of `count` parts of a site, counted from 0: `2/5` is the third of five.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    index: u32,
    count: u32,
}

/// The largest number of shards.
const MAX_COUNT: u32 = 1_000_000;

/// The reason why a text or two numbers are not a shard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParseShardError {
    /// The text is not two numbers.
    #[error("`{0}` is no shard: write INDEX/COUNT, like 0/4")]
    NoNumbers(String),
    /// The text is not one number.
    #[error("`{0}` is no number of shards: write digits alone")]
    NoNumber(String),
    /// The count is above the largest number of shards.
    #[error("shard {0}/{1}: a site is cut into {MAX_COUNT} shards at most")]
    TooMany(u32, u32),
    /// The count is 0.
    #[error("shard {0}/0: a site is cut into one shard at least")]
    NoShards(u32),
    /// The index is not below the count.
    #[error("shard {index}/{count}: shards are counted from 0, the last of {count} is {}/{count}", count - 1)]
    Beyond {
        /// The index.
        index: u32,
        /// The number of shards.
        count: u32,
    },
}

impl Shard {
    /// The only shard of a site that is not divided.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// Returns the shard `index`, from 0, of `count`, which is 1 to 1,000,000.
    ///
    /// # Errors
    /// [`ParseShardError::NoShards`], [`ParseShardError::TooMany`] or [`ParseShardError::Beyond`].
    pub const fn new(index: u32, count: u32) -> Result<Self, ParseShardError> {
        match (index, count) {
            (index, 0) => Err(ParseShardError::NoShards(index)),
            (index, count) if count > MAX_COUNT => Err(ParseShardError::TooMany(index, count)),
            (index, count) if index >= count => Err(ParseShardError::Beyond { index, count }),
            (index, count) => Ok(Self { index, count }),
        }
    }

    /// Returns the index, from 0.
    #[must_use]
    pub const fn index(self) -> u32 {
        self.index
    }

    /// Returns the number of shards.
    #[must_use]
    pub const fn count(self) -> u32 {
        self.count
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = ParseShardError;

    fn from_str(text: &str) -> Result<Self, ParseShardError> {
        let bad = || ParseShardError::NoNumbers(text.into());
        let (index, count) = text.split_once('/').ok_or_else(bad)?;
        let number = |text| number(text).map_err(|_| bad());
        Self::new(number(index)?, number(count)?)
    }
}

/// Parses the index of a shard or a number of shards: only digits, no sign.
///
/// # Errors
/// [`ParseShardError::NoNumber`].
pub fn number(text: &str) -> Result<u32, ParseShardError> {
    let digits = text.bytes().all(|byte| byte.is_ascii_digit());
    let number = text.parse().ok().filter(|_| digits);
    number.ok_or_else(|| ParseShardError::NoNumber(text.into()))
}
