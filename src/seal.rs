//! Seals firmware files: the work of `posegate table seal` after linking.
//!
//! The *image* is the content that the file loads into flash: every loadable segment that has bytes, by its load
//! address, from the lowest to the highest. A linker may leave some bytes between two segments to align the
//! second. The first is then extended by zeros, so that every flash tool writes them; it is loaded from a
//! copy at the end of the file. The firmware has one record ([`Seal`]) in its constants. Sealing writes the
//! image's address and length into it, and the one word that makes the CRC-32C over the whole image,
//! including the record, equal to [`Seal::SUM`]. The sum of the image is a linear function of that word's
//! bits, so the word is found by solving 32 equations.
//!
//! Sealing a sealed file changes nothing.
//!
//! ```no_run
//! use posegate::seal::seal;
//!
//! let linked = std::fs::read("firmware.elf")?;
//! let sealed = seal(&linked)?;
//! println!("{} bytes from {:#x}", sealed.image.len(), sealed.start);
//! std::fs::write("firmware-sealed.elf", &sealed.file)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::gate::Seal;
use crate::table::{checksum, checksum_continued};
use object::elf::{FileHeader32, PT_LOAD, ProgramHeader32};
use object::read::elf::{FileHeader, ProgramHeader};
use object::{Endianness, LittleEndian};
use std::ops::Range;

/// A sealed firmware file.
#[derive(Clone, Debug)]
pub struct Sealed {
    /// The bytes of the sealed file.
    pub file: Vec<u8>,
    /// Load address of the image.
    pub start: u32,
    /// The image: the bytes that the controller must find in its flash from `start` on.
    pub image: Vec<u8>,
}

/// Why a firmware file cannot be sealed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SealError {
    /// The file is not a 32-bit little-endian ELF file.
    #[error("not a 32-bit little-endian ELF file: {0}")]
    NotElf(std::string::String),
    /// No segment with bytes.
    #[error("the file loads nothing into flash")]
    Empty,
    /// Two segments overlap at this address.
    #[error("two segments are loaded to address {0:#x}")]
    Overlap(u32),
    /// Nothing is loaded from the first address to the second.
    #[error("nothing is loaded from {0:#x} to {1:#x}, so the contents of flash there are unknown")]
    Gap(u32, u32),
    /// The firmware has no seal record.
    #[error("the firmware holds no seal record")]
    NoRecord,
    /// The firmware has more than one seal record.
    #[error("the firmware holds {0} seal records")]
    ManyRecords(usize),
}

impl SealError {
    /// Returns how to fix the problem.
    #[must_use]
    pub const fn help(&self) -> &'static str {
        match self {
            Self::NotElf(_) => {
                "give the linker's output, before it is turned into a binary or hex file"
            }
            Self::Empty => "give the linked firmware, not an object file",
            Self::Overlap(_) | Self::Gap(..) => {
                "in the linker script, place vectors, code, constants and initial values in flash without gaps"
            }
            Self::NoRecord => {
                "add `#[used] static SEAL: Seal = Seal::UNSEALED;` to the firmware, use it, and link again"
            }
            Self::ManyRecords(_) => "leave one `static` of type `Seal` in the firmware",
        }
    }
}

/// Largest gap that a linker leaves for alignment, bytes.
const LARGEST_GAP: u32 = 4096;

/// A part of the image in the file.
struct Part {
    address: u32,
    bytes: Range<usize>,
    /// The original position, to which sections still refer, if the part is loaded from a copy.
    section: Option<Range<usize>>,
    /// Offset of its program header in the file.
    header: usize,
}

/// Returns the file with its seal record filled in.
///
/// # Errors
/// [`SealError`] if the file has no valid image or not exactly one record.
pub fn seal(file: &[u8]) -> Result<Sealed, SealError> {
    let mut file = file.to_vec();
    let mut parts = parts(&file)?;
    close_gaps(&mut file, &mut parts)?;
    let start = parts.first().ok_or(SealError::Empty)?.address;
    let mut image = Vec::new();
    for part in &parts {
        image.extend(&file[part.bytes.clone()]);
    }
    let at = record(&image, start)?;
    let length = (image.len() as u32).to_le_bytes();
    image[at + 8..at + 12].copy_from_slice(&start.to_le_bytes());
    image[at + 12..at + 16].copy_from_slice(&length);
    balance(&mut image, at + 16);
    let mut rest: &[u8] = &image;
    for part in &parts {
        let (bytes, after) = rest.split_at(part.bytes.len());
        file[part.bytes.clone()].copy_from_slice(bytes);
        if let Some(section) = part.section.clone() {
            let length = section.len();
            file[section].copy_from_slice(&bytes[..length]);
        }
        rest = after;
    }
    Ok(Sealed { file, start, image })
}

/// Returns the parts that the file loads into flash, sorted by address.
fn parts(file: &[u8]) -> Result<Vec<Part>, SealError> {
    let wrong = |error: object::Error| SealError::NotElf(std::format!("{error}"));
    let elf = FileHeader32::<Endianness>::parse(file).map_err(wrong)?;
    let endian = elf.endian().map_err(wrong)?;
    if endian != Endianness::Little {
        return Err(SealError::NotElf("big-endian".into()));
    }
    let table = elf.e_phoff(endian) as usize;
    let mut parts = Vec::new();
    let headers = elf.program_headers(endian, file).map_err(wrong)?;
    for (index, header) in headers.iter().enumerate() {
        let length = header.p_filesz(endian) as usize;
        if header.p_type(endian) != PT_LOAD || length == 0 {
            continue;
        }
        let first = header.p_offset(endian) as usize;
        let address = header.p_paddr(endian);
        let end = first.checked_add(length).filter(|end| *end <= file.len());
        let fits = u32::try_from(length).is_ok_and(|l| address.checked_add(l).is_some());
        let Some(end) = end.filter(|_| fits) else {
            return Err(SealError::NotElf(
                "a segment reaches beyond the file".into(),
            ));
        };
        parts.push(Part {
            address,
            bytes: first..end,
            section: None,
            header: table + index * size_of::<ProgramHeader32<LittleEndian>>(),
        });
    }
    parts.sort_by_key(|part| part.address);
    Ok(parts)
}

/// Extends each part to the start of the next.
fn close_gaps(file: &mut Vec<u8>, parts: &mut [Part]) -> Result<(), SealError> {
    for index in 1..parts.len() {
        let (before, after) = parts.split_at_mut(index);
        let (Some(part), Some(next)) = (before.last_mut(), after.first()) else {
            continue;
        };
        let end = part.address + part.bytes.len() as u32;
        let gap = next
            .address
            .checked_sub(end)
            .ok_or(SealError::Overlap(next.address))?;
        if gap > LARGEST_GAP {
            return Err(SealError::Gap(end, next.address));
        }
        if gap > 0 {
            lengthen(file, part, gap as usize);
        }
    }
    Ok(())
}

/// Loads a part, with zeros after it, from a copy at the end of the file.
fn lengthen(file: &mut Vec<u8>, part: &mut Part, by: usize) {
    // An offset must equal the address modulo the alignment, which divides 4096.
    while file.len() % 4096 != part.address as usize % 4096 {
        file.push(0);
    }
    let start = file.len();
    file.extend_from_within(part.bytes.clone());
    file.resize(file.len() + by, 0);
    part.section = Some(part.bytes.clone());
    part.bytes = start..file.len();
    let length = part.bytes.len() as u32;
    // Offset, and sizes in the file and in memory.
    for (field, value) in [(4, start as u32), (16, length), (20, length)] {
        let at = part.header + field;
        file[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
}

/// Returns the position of the record: its magic bytes, followed by content that only a record has.
fn record(image: &[u8], start: u32) -> Result<usize, SealError> {
    let fresh = [0xff; 12];
    let mut own = start.to_le_bytes().to_vec();
    own.extend((image.len() as u32).to_le_bytes());
    let places: Vec<usize> = (0..image.len())
        .step_by(4)
        .filter(|at| {
            image.get(*at..at + Seal::LENGTH).is_some_and(|bytes| {
                let (magic, rest) = bytes.split_at(Seal::MAGIC.len());
                magic == Seal::MAGIC && (rest == fresh || rest.starts_with(&own))
            })
        })
        .collect();
    match places[..] {
        [at] => Ok(at),
        [] => Err(SealError::NoRecord),
        _ => Err(SealError::ManyRecords(places.len())),
    }
}

/// Sets the four bytes at `at` so that the sum is right.
fn balance(image: &mut [u8], at: usize) {
    let before = checksum(&image[..at]);
    let after = image[at + 4..].to_vec();
    let sum =
        |word: u32| checksum_continued(checksum_continued(before, &word.to_le_bytes()), &after);
    let none = sum(0);
    // The effect of each bit of the word on the sum, in triangular form. A CRC's register can be run
    // backwards as well as forwards, so the 32 effects are independent.
    let mut rows: [(u32, u32); 32] = std::array::from_fn(|bit| (sum(1 << bit) ^ none, 1 << bit));
    let mut wanted = (none ^ Seal::SUM, 0u32);
    for bit in 0..32 {
        let Some(pivot) = (bit..32).find(|row| rows[*row].0 >> bit & 1 == 1) else {
            continue;
        };
        rows.swap(bit, pivot);
        let row = rows[bit];
        for other in rows.iter_mut().skip(bit + 1).chain([&mut wanted]) {
            if other.0 >> bit & 1 == 1 {
                *other = (other.0 ^ row.0, other.1 ^ row.1);
            }
        }
    }
    image[at..at + 4].copy_from_slice(&wanted.1.to_le_bytes());
    debug_assert_eq!(checksum(image), Seal::SUM);
}

#[cfg(test)]
mod tests;
