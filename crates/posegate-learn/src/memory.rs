//! How long the scores of consecutive rows depend on each other.

/// The fewest blocks of consecutive rows for estimating the dependence of rows.
pub(super) const FEWEST_BLOCKS: usize = 20;

/// Consecutive rows of a run, or fewer at its end.
struct Block {
    run: u32,
    rows: u64,
    sum: f64,
}

/// Returns the memory of scores: their integrated autocorrelation time, in rows, at least 1. `rows` are the run and the score of
/// each row, run by run, in order of time.
///
/// The ranks of the scores, relative to the mean of their run, are summed over blocks of 1, 2, 4, ... rows. The variance of the sums, relative to that of independent rows,
/// counts the dependence within a block, and their correlation with the next block's the dependence beyond it, as if it decayed
/// geometrically. The largest result of all lengths with at least [`FEWEST_BLOCKS`] blocks is returned.
pub(super) fn memory(rows: &[(u32, f64)]) -> f64 {
    let ranks = centred_ranks(rows);
    let total: f64 = ranks.iter().map(|rank| rank * rank).sum();
    if total <= 0.0 {
        return 1.0;
    }
    let mut blocks: Vec<Block> = rows
        .iter()
        .zip(&ranks)
        .map(|((run, _), rank)| Block {
            run: *run,
            rows: 1,
            sum: *rank,
        })
        .collect();
    let (mut time, mut length) = (1.0f64, 1u64);
    loop {
        let count = blocks.len();
        if count < FEWEST_BLOCKS {
            return time;
        }
        let spread: f64 = blocks.iter().map(|block| block.sum * block.sum).sum();
        let ratio = spread * count as f64 / (count - 1) as f64 / total;
        let next = correlation(&blocks, length);
        time = time.max(ratio * (1.0 + next) / (1.0 - next));
        blocks = pairs(&blocks);
        length *= 2;
        if blocks.len() == count {
            return time;
        }
    }
}

/// Returns the ranks of the scores minus the mean of their run; equal scores have equal ranks.
fn centred_ranks(rows: &[(u32, f64)]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|a, b| rows[*a].1.total_cmp(&rows[*b].1));
    let mut ranks = std::vec![0.0; rows.len()];
    let mut first = 0.0;
    for equal in order.chunk_by(|a, b| rows[*a].1 == rows[*b].1) {
        let rank = first + 0.5 * (equal.len() as f64 - 1.0);
        for index in equal {
            ranks[*index] = rank;
        }
        first += equal.len() as f64;
    }
    let mut begin = 0;
    for run in rows.chunk_by(|a, b| a.0 == b.0) {
        let of_run = &mut ranks[begin..begin + run.len()];
        let mean = of_run.iter().sum::<f64>() / run.len() as f64;
        of_run.iter_mut().for_each(|rank| *rank -= mean);
        begin += run.len();
    }
    ranks
}

/// Returns the correlation, below 1, of a block's sum with that of the next block of its run, without the bias that the means of short runs give
/// it. 0 if it is not significant.
fn correlation(blocks: &[Block], length: u64) -> f64 {
    let (mut product, mut square, mut count) = (0.0, 0.0, 0u64);
    let runs = blocks.chunk_by(|a, b| a.run == b.run).count() as f64;
    for pair in blocks.windows(2) {
        if let [a, b] = pair
            && a.run == b.run
            && a.rows == length
            && b.rows == length
        {
            product += a.sum * b.sum;
            square += 0.5 * (a.sum * a.sum + b.sum * b.sum);
            count += 1;
        }
    }
    let number = count as f64;
    let found = product / square;
    if !(found > 2.0 / libm::sqrt(number)) {
        return 0.0;
    }
    (found + (1.0 + 3.0 * found) * runs / number).min(1.0 - 1e-9)
}

/// Returns blocks of twice the length.
fn pairs(blocks: &[Block]) -> Vec<Block> {
    let of_run = blocks.chunk_by(|a, b| a.run == b.run);
    of_run
        .flat_map(|run| run.chunks(2))
        .map(|pair| Block {
            run: pair[0].run,
            rows: pair.iter().map(|block| block.rows).sum(),
            sum: pair.iter().map(|block| block.sum).sum(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::mixed;

    /// Scores that stay for a number of rows.
    fn staying(count: u32, rows: u32) -> Vec<(u32, f64)> {
        (0..count)
            .map(|row| (0, (mixed(u64::from(row / rows)) >> 12) as f64))
            .collect()
    }

    #[test]
    fn memory_of_staying_scores_is_their_duration() {
        for rows in [1, 10, 100] {
            let found = memory(&staying(20_000, rows)) / f64::from(rows);
            assert!((0.9..4.0).contains(&found), "{rows}: {found}");
        }
        assert_eq!(memory(&staying(20_000, 20_000)), 1.0);
        assert_eq!(memory(&[]), 1.0);
    }

    /// A single memory that fills the data is seen, also beyond the longest block.
    #[test]
    fn memory_may_exceed_the_longest_block() {
        let drift: Vec<(u32, f64)> = (0..500).map(|row| (0, f64::from(row))).collect();
        assert!(memory(&drift) > 100.0, "{}", memory(&drift));
    }

    /// Runs are independent of each other: neither a jump between them nor their level is a memory.
    #[test]
    fn memory_ends_with_the_run() {
        let runs: Vec<(u32, f64)> = (0..3000u32)
            .map(|row| {
                (
                    row / 1000,
                    f64::from(row / 1000) + (mixed(u64::from(row)) >> 12) as f64 * 1e-16,
                )
            })
            .collect();
        let found = memory(&runs);
        assert!(found < 1.6, "{found}");
        let alone: Vec<(u32, f64)> = (0..2000u32).map(|row| (row, f64::from(row))).collect();
        assert!(memory(&alone) < 1.1, "{}", memory(&alone));
    }
}
