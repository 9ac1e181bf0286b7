//! Products of small dense matrices in registers, the kernels of [`super::banded`].
//!
//! A tile of four rows and eight columns of the result stays in registers while its products are summed, so that memory is
//! read once for each product of a row with a column and written once in the end. Every product is added by a fused
//! multiply-add whether the processor has wide instructions or not, and in the same order, so the bits are the same on all
//! processors.

#![allow(
    unsafe_code,
    reason = "the processor is asked whether it has AVX2 before functions compiled for it are called"
)]

/// Rows of a tile.
pub(super) const TALL: usize = 4;
/// Columns of a tile: two vectors of four doubles.
pub(super) const WIDE: usize = 8;

/// Runs `work` compiled for wide instructions where the processor has them.
pub(super) fn widely<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma")]
        fn avx2<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        if has_avx() {
            // SAFETY: the processor has the features that the function is compiled for.
            return unsafe { avx2(work) };
        }
    }
    work()
}

/// Whether the processor has vectors of four doubles and fused multiply-add.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn has_avx() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

/// c −= aᵀ b for `height` rows and [`WIDE`] columns of c, all with rows of `stride` numbers.
#[inline(always)]
pub(super) fn subtract_product(
    c: &mut [f64],
    (a, b): (&[f64], &[f64]),
    stride: usize,
    height: usize,
) {
    match height {
        TALL => subtract_tile::<TALL>(c, a, b, stride),
        3 => subtract_tile::<3>(c, a, b, stride),
        2 => subtract_tile::<2>(c, a, b, stride),
        _ => subtract_tile::<1>(c, a, b, stride),
    }
}

/// The same for `H` rows.
#[inline(always)]
fn subtract_tile<const H: usize>(c: &mut [f64], a: &[f64], b: &[f64], stride: usize) {
    #[cfg(target_arch = "x86_64")]
    if has_avx() {
        // SAFETY: the processor has the features that the function is compiled for.
        return unsafe { subtract_tile_avx::<H>(c, a, b, stride) };
    }
    // Without these instructions the same sums in the same order.
    let mut sums = [[0.0; WIDE]; H];
    for (a, b) in tile_rows::<H>(a, b, stride) {
        for (sums, a) in sums.iter_mut().zip(a) {
            for (sum, b) in sums.iter_mut().zip(b) {
                *sum = a.mul_add(*b, *sum);
            }
        }
    }
    subtract_sums(c, &sums, stride);
}

/// The same in AVX2; the compiler doesn't find these instructions by itself.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
#[inline]
fn subtract_tile_avx<const H: usize>(c: &mut [f64], a: &[f64], b: &[f64], stride: usize) {
    use std::arch::x86_64::{__m256d, _mm256_fmadd_pd, _mm256_set1_pd, _mm256_setr_pd};
    let mut sums = [[_mm256_set1_pd(0.0); 2]; H];
    for (a, b) in tile_rows::<H>(a, b, stride) {
        let halves = [
            _mm256_setr_pd(b[0], b[1], b[2], b[3]),
            _mm256_setr_pd(b[4], b[5], b[6], b[7]),
        ];
        for (sums, a) in sums.iter_mut().zip(a) {
            let a = _mm256_set1_pd(*a);
            for (sum, half) in sums.iter_mut().zip(halves) {
                *sum = _mm256_fmadd_pd(a, half, *sum);
            }
        }
    }
    // SAFETY: eight doubles are as large as two vectors of four, and any bits of them are doubles.
    let sums = sums.map(|row| unsafe { std::mem::transmute::<[__m256d; 2], [f64; WIDE]>(row) });
    subtract_sums(c, &sums, stride);
}

/// Rows of a and b in pairs: `H` numbers of a, eight of b.
#[inline(always)]
fn tile_rows<'a, const H: usize>(
    a: &'a [f64],
    b: &'a [f64],
    stride: usize,
) -> impl Iterator<Item = (&'a [f64; H], &'a [f64; WIDE])> {
    let pairs = a.chunks(stride).zip(b.chunks(stride));
    pairs.map_while(|(a, b)| Some((a.first_chunk()?, b.first_chunk()?)))
}

/// Takes the sums of a tile from the result.
#[inline(always)]
fn subtract_sums(c: &mut [f64], sums: &[[f64; WIDE]], stride: usize) {
    for (c, sums) in c.chunks_mut(stride).zip(sums) {
        for (c, sum) in c.iter_mut().zip(sums) {
            *c -= sum;
        }
    }
}

/// Sum of products in eight strands, which the compiler can keep side by side.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; WIDE];
    // What doesn't fill eight strands is added last.
    let (wide_a, wide_b) = (a.chunks_exact(WIDE), b.chunks_exact(WIDE));
    let rest = wide_a.remainder().iter().zip(wide_b.remainder());
    let mut sum = 0.0;
    for (x, y) in rest {
        sum = x.mul_add(*y, sum);
    }
    for (x, y) in wide_a.zip(wide_b) {
        for (sum, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
            *sum = x.mul_add(*y, *sum);
        }
    }
    sums.iter().sum::<f64>() + sum
}
