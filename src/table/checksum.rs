//! The checksum of tables and of firmware: CRC-32C (Castagnoli), in small code.
//!
//! CRC-32C detects every error of one, two or three bits, and of any odd number of bits, in up to 2^31 bits. Its parameters
//! (RFC 3720, section 12.1): polynomial 0x1edc6f41, all values reflected, initial register and final exclusive or all ones.

/// The reflected polynomial.
const POLYNOMIAL: u32 = 0x82f6_3b78;

/// The terms that the four bits shifted out add to the register. 64 bytes of flash; 256 entries would take 1 kB and halve the time.
static OF_FOUR_BITS: [u32; 16] = of_four_bits();

const fn of_four_bits() -> [u32; 16] {
    let mut table = [0; 16];
    let mut rest: &mut [u32] = &mut table;
    let mut bits = 0_u32;
    while let Some((entry, after)) = rest.split_first_mut() {
        let mut register = bits;
        let mut step = 0_u32;
        while step < 4 {
            let carry = register & 1;
            register = (register >> 1) ^ (POLYNOMIAL & carry.wrapping_neg());
            step = step.wrapping_add(1);
        }
        *entry = register;
        rest = after;
        bits = bits.wrapping_add(1);
    }
    table
}

/// Returns the CRC-32C of bytes. A table ends with that of its other bytes.
#[must_use]
pub fn checksum(bytes: &[u8]) -> u32 {
    checksum_continued(0, bytes)
}

/// Continues a checksum: returns the checksum of data whose first part has the checksum `so_far` and whose rest is
/// `bytes`, for a long check in short steps. The checksum of no bytes is 0.
#[must_use]
pub fn checksum_continued(so_far: u32, bytes: &[u8]) -> u32 {
    // A checksum is the inverted register.
    let mut register = !so_far;
    for byte in bytes {
        register = shifted(shifted(register ^ u32::from(*byte)));
    }
    !register
}

/// Returns the register after four bits.
#[inline(always)]
fn shifted(register: u32) -> u32 {
    let entry = OF_FOUR_BITS.get((register & 15) as usize);
    (register >> 4) ^ entry.copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published check values of CRC-32/ISCSI (RFC 3720, B.4, and the usual "123456789").
    #[test]
    fn checksum_is_crc_32c() {
        assert_eq!(checksum(b"123456789"), 0xe306_9283);
        assert_eq!(checksum(&[0; 32]), 0x8a91_36aa);
        assert_eq!(checksum(&[0xff; 32]), 0x62a8_ab43);
    }

    #[test]
    fn checksum_can_be_continued() {
        let bytes: Vec<u8> = (0..200u8).map(|v| v.wrapping_mul(37)).collect();
        for at in 0..=bytes.len() {
            let (first, rest) = bytes.split_at(at);
            assert_eq!(checksum_continued(checksum(first), rest), checksum(&bytes));
        }
        assert_eq!(checksum(&[]), 0);
    }

    /// Compares the table with the definition, bit by bit.
    #[test]
    fn nibble_table_matches_polynomial() {
        for length in 0..64_u8 {
            let bytes: Vec<u8> = (0..length)
                .map(|v| v.wrapping_mul(91).wrapping_add(length))
                .collect();
            let mut register = u32::MAX;
            for bit in bytes
                .iter()
                .flat_map(|byte| (0..8).map(move |at| byte >> at & 1))
            {
                let carry = (register ^ u32::from(bit)) & 1;
                register = (register >> 1) ^ if carry == 1 { POLYNOMIAL } else { 0 };
            }
            assert_eq!(checksum(&bytes), !register, "{length}");
        }
    }
}
