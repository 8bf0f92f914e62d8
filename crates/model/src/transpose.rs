//! Blocks of numbers turned over in registers: from the order of lanes to that of configurations and back.

use core::arch::x86_64::*;
use core::mem::transmute;

/// Defines both ways for `$width` configurations on a machine with the instructions named.
///
/// `lanes`: one number of all configurations after the other; `own`: for each configuration its numbers, as many from
/// `at` on.
macro_rules! turned_over {
    ($features:literal, $width:literal, $transposed:ident, $to_lanes:ident, $from_lanes:ident) => {
        #[target_feature(enable = $features)]
        pub(crate) fn $to_lanes(own: &[&[f64]; $width], lanes: &mut [f64]) {
            let (blocks, rest) = lanes.as_chunks_mut::<{ $width * $width }>();
            for (k, block) in blocks.iter_mut().enumerate() {
                let mut rows = [[0.0; $width]; $width];
                for (row, own) in rows.iter_mut().zip(own) {
                    row.copy_from_slice(&own[k * $width..][..$width]);
                }
                block.copy_from_slice($transposed(&rows).as_flattened());
            }
            let at = blocks.len() * $width;
            for (k, lanes) in rest.chunks_exact_mut($width).enumerate() {
                for (x, own) in lanes.iter_mut().zip(own) {
                    *x = own[at + k];
                }
            }
        }

        #[target_feature(enable = $features)]
        pub(crate) fn $from_lanes(lanes: &[f64], at: usize, own: &mut [&mut [f64]; $width]) {
            let (blocks, rest) = lanes.as_chunks::<$width>().0.as_chunks::<$width>();
            for (k, block) in blocks.iter().enumerate() {
                for (row, own) in $transposed(block).iter().zip(own.iter_mut()) {
                    own[at + k * $width..][..$width].copy_from_slice(row);
                }
            }
            if !rest.is_empty() {
                let mut block = [[0.0; $width]; $width];
                for (to, from) in block.iter_mut().zip(rest) {
                    *to = *from;
                }
                let at = at + blocks.len() * $width;
                for (row, own) in $transposed(&block).iter().zip(own.iter_mut()) {
                    copy_few(row, &mut own[at..][..rest.len()]);
                }
            }
        }
    };
}
turned_over!("avx512f", 8, transposed_eight, to_eight_lanes, from_eight_lanes);
turned_over!("avx2", 4, transposed_four, to_four_lanes, from_four_lanes);

/// The first numbers of a row of at most eight, in pieces whose lengths the compiler knows: a call for so few takes
/// longer than they do.
#[inline(always)]
fn copy_few(from: &[f64], to: &mut [f64]) {
    let (n, mut at) = (to.len(), 0);
    if n & 4 != 0 {
        to[..4].copy_from_slice(&from[..4]);
        at = 4;
    }
    if n & 2 != 0 {
        to[at..][..2].copy_from_slice(&from[at..][..2]);
        at += 2;
    }
    if n & 1 != 0 {
        to[at] = from[at];
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn transposed_eight(rows: &[[f64; 8]; 8]) -> [[f64; 8]; 8] {
    // SAFETY: a register of eight numbers is as large as they are, and any bits are numbers.
    let [a, b, c, d, e, f, g, h]: [__m512d; 8] = unsafe { transmute(*rows) };
    // numbers 0, 2, 4, 6 of two rows in pairs, and 1, 3, 5, 7
    let even = [
        _mm512_unpacklo_pd(a, b),
        _mm512_unpacklo_pd(c, d),
        _mm512_unpacklo_pd(e, f),
        _mm512_unpacklo_pd(g, h),
    ];
    let odd = [
        _mm512_unpackhi_pd(a, b),
        _mm512_unpackhi_pd(c, d),
        _mm512_unpackhi_pd(e, f),
        _mm512_unpackhi_pd(g, h),
    ];
    let ([a, c, e, g], [b, d, f, h]) = (transposed_pairs(even), transposed_pairs(odd));
    // SAFETY: as above.
    unsafe { transmute::<[__m512d; 8], _>([a, b, c, d, e, f, g, h]) }
}

/// Four rows of four pairs turned over.
#[inline]
#[target_feature(enable = "avx512f")]
fn transposed_pairs([a, b, c, d]: [__m512d; 4]) -> [__m512d; 4] {
    // pairs 0 and 2 of two rows, and 1 and 3
    let (x, y) = (_mm512_shuffle_f64x2::<0x88>(a, b), _mm512_shuffle_f64x2::<0x88>(c, d));
    let (z, w) = (_mm512_shuffle_f64x2::<0xdd>(a, b), _mm512_shuffle_f64x2::<0xdd>(c, d));
    [
        _mm512_shuffle_f64x2::<0x88>(x, y),
        _mm512_shuffle_f64x2::<0x88>(z, w),
        _mm512_shuffle_f64x2::<0xdd>(x, y),
        _mm512_shuffle_f64x2::<0xdd>(z, w),
    ]
}

#[inline]
#[target_feature(enable = "avx2")]
fn transposed_four(rows: &[[f64; 4]; 4]) -> [[f64; 4]; 4] {
    // SAFETY: a register of four numbers is as large as they are, and any bits are numbers.
    let [a, b, c, d]: [__m256d; 4] = unsafe { transmute(*rows) };
    let (even, odd) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
    let (even_below, odd_below) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
    let columns = [
        _mm256_permute2f128_pd::<0x20>(even, even_below),
        _mm256_permute2f128_pd::<0x20>(odd, odd_below),
        _mm256_permute2f128_pd::<0x31>(even, even_below),
        _mm256_permute2f128_pd::<0x31>(odd, odd_below),
    ];
    // SAFETY: as above.
    unsafe { transmute::<[__m256d; 4], _>(columns) }
}
