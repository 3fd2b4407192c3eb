//! Which part of a site.

use std::fmt;
use std::str::FromStr;

/// One of so many parts of a site, counted from 0: `2/5` is the third of five.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    index: u32,
    count: u32,
}

/// The largest number of shards.
const MOST: u32 = 1_000_000;

/// What is no shard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParseShardError {
    /// Not two numbers.
    #[error("`{0}` is no shard: write INDEX/COUNT, like 0/4")]
    NoNumbers(String),
    /// Not one number.
    #[error("`{0}` is no number of shards: write digits alone")]
    NoNumber(String),
    /// A site cut into more shards than any has pieces.
    #[error("shard {0}/{1}: a site is cut into {MOST} shards at most")]
    TooMany(u32, u32),
    /// A site cut into nothing.
    #[error("shard {0}/0: a site is cut into one shard at least")]
    NoShards(u32),
    /// An index that is not below the count.
    #[error("shard {index}/{count}: shards are counted from 0, the last of {count} is {}/{count}", count - 1)]
    Beyond {
        /// Which.
        index: u32,
        /// Of how many.
        count: u32,
    },
}

impl Shard {
    /// The whole site.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// Part `index`, from 0, of `count`, which is a million at most.
    ///
    /// # Errors
    /// [`ParseShardError`].
    pub const fn new(index: u32, count: u32) -> Result<Self, ParseShardError> {
        match (index, count) {
            (index, 0) => Err(ParseShardError::NoShards(index)),
            (index, count) if count > MOST => Err(ParseShardError::TooMany(index, count)),
            (index, count) if index >= count => Err(ParseShardError::Beyond { index, count }),
            (index, count) => Ok(Self { index, count }),
        }
    }

    /// Which, from 0.
    #[must_use]
    pub const fn index(self) -> u32 {
        self.index
    }

    /// Of how many.
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

/// The index of a shard, or a number of shards, as text: digits alone, where Rust's own numbers may begin with a sign.
///
/// # Errors
/// [`ParseShardError::NoNumber`].
pub fn number(text: &str) -> Result<u32, ParseShardError> {
    let digits = text.bytes().all(|byte| byte.is_ascii_digit());
    let number = text.parse().ok().filter(|_| digits);
    number.ok_or_else(|| ParseShardError::NoNumber(text.into()))
}
