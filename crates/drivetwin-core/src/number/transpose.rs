// SPDX-License-Identifier: MIT
//! Transposition of packs: one column per run.

use super::SimdVector;
#[cfg(target_arch = "x86_64")]
use pulp::{cast, x86::V3};

/// Rows that are transposed at once.
pub const FOUR: usize = 4;

/// Rows of several runs by fours, as columns of each run: `rows` gives four from a row on, and as many are
/// asked for as cover the first `count` places of `columns`, which have room for whole fours of them.
///
/// Compilers make gathers of plain loops over these, several times as slow: vectors are shuffled here where
/// there are such.
///
/// # Panics
///
/// If a column ends within a four that is asked for, or runs are not by fours.
#[inline(always)]
pub fn transpose<const K: usize, const N: usize>(
    rows: impl Fn(usize) -> [SimdVector<K>; FOUR],
    columns: &mut [[f64; N]; K],
    count: usize,
) {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = V3::try_new() {
        return transpose_tiles(
            rows,
            columns,
            count,
            #[inline(always)]
            |block| transpose_in_registers(simd, block),
        );
    }
    transpose_tiles(rows, columns, count, transpose_scalar);
}

/// Columns by squares of four rows and runs.
#[inline(always)]
fn transpose_tiles<const K: usize, const N: usize>(
    rows: impl Fn(usize) -> [SimdVector<K>; FOUR],
    columns: &mut [[f64; N]; K],
    count: usize,
    transposed: impl Fn([[f64; FOUR]; FOUR]) -> [[f64; FOUR]; FOUR],
) {
    for at in (0..count).step_by(FOUR) {
        let rows = rows(at);
        for run in (0..K).step_by(FOUR) {
            let square = rows.map(|row| *row.0[run..].first_chunk().expect("whole fours of runs"));
            for (column, values) in columns[run..].iter_mut().zip(transposed(square)) {
                column[at..][..FOUR].copy_from_slice(&values);
            }
        }
    }
}

#[inline(always)]
fn transpose_scalar(rows: [[f64; FOUR]; FOUR]) -> [[f64; FOUR]; FOUR] {
    std::array::from_fn(|run| rows.map(|row| row[run]))
}

/// [`transpose_scalar`], in registers.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn transpose_in_registers(simd: V3, [a, b, c, d]: [[f64; FOUR]; FOUR]) -> [[f64; FOUR]; FOUR] {
    let (avx, [a, b, c, d]) = (simd.avx, [cast(a), cast(b), cast(c), cast(d)]);
    let even = [avx._mm256_unpacklo_pd(a, b), avx._mm256_unpacklo_pd(c, d)];
    let odd = [avx._mm256_unpackhi_pd(a, b), avx._mm256_unpackhi_pd(c, d)];
    [
        cast(avx._mm256_permute2f128_pd::<0x20>(even[0], even[1])),
        cast(avx._mm256_permute2f128_pd::<0x20>(odd[0], odd[1])),
        cast(avx._mm256_permute2f128_pd::<0x31>(even[0], even[1])),
        cast(avx._mm256_permute2f128_pd::<0x31>(odd[0], odd[1])),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_run_gets_its_column() {
        let row = |k: usize| SimdVector::<8>(std::array::from_fn(|run| (100 * run + k) as f64));
        let rows = |at: usize| std::array::from_fn(|k| row(at + k));
        for count in [0, 1, 4, 6, 12] {
            let (mut columns, mut expected) = ([[0.0; 12]; 8], [[0.0; 12]; 8]);
            transpose(rows, &mut columns, count);
            transpose_tiles(rows, &mut expected, count, transpose_scalar);
            assert_eq!(columns, expected);
            for (run, column) in columns.iter().enumerate() {
                let there = column[..count].iter().enumerate();
                assert!(there.into_iter().all(|(k, &value)| value == row(k).0[run]));
            }
        }
    }
}
