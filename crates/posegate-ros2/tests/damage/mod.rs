//! Damage to payloads, the same in every run.

/// SplitMix64, from a seed.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }
}

/// Cuts, lengthens, flips and overwrites a payload.
pub fn damage(payload: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(3) {
        let at = random.below(payload.len().max(1));
        match random.below(7) {
            0 => payload.truncate(at),
            1 => payload.extend((0..random.below(64)).map(|k| k as u8)),
            2 if at < payload.len() => payload[at] ^= 1 << random.below(8),
            3 if at < payload.len() => payload[at] = random.next() as u8,
            4 if at + 8 <= payload.len() => {
                let words = [
                    f64::NAN,
                    f64::INFINITY,
                    -0.0,
                    1e300,
                    f64::MIN_POSITIVE,
                    -1.0,
                    1e-3,
                ];
                payload[at & !7..][..8]
                    .copy_from_slice(&words[random.below(words.len())].to_le_bytes());
            }
            5 if payload.len() > 12 => {
                payload[8..12].copy_from_slice(&(random.next() as u32).to_le_bytes())
            }
            _ if at < payload.len() => drop(payload.remove(at)),
            _ => payload.clear(),
        }
    }
}
