//! Eight numbers at a time: the same quantity of eight characters, one in each lane of a vector.
//!
//! A step goes through the tree in the same order whatever the character does, so that eight characters can take it
//! together. All code that computes with lanes is `inline(always)` into [`on_widest_lanes`], where it is compiled for the
//! instructions that the processor was found to have. Each operation rounds by itself (no fused multiply-add), so all
//! kinds of lanes give the same bits.

#![allow(
    unsafe_code,
    reason = "the processor is asked whether it has AVX2 before functions compiled for it are called"
)]

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use wide::f32x8;

/// Number of characters that step together: as many f32 as an AVX register holds. Eight in the air take little more time
/// than one; eight on the ground take two to three times as long (`cargo bench --bench physics`).
pub const LANES: usize = 8;

/// Eight numbers, or eight masks, each of which has all bits set or none.
///
/// # Safety
/// The type has to consist of eight packed f32, and any bits have to be valid for it.
pub(super) unsafe trait Lanes:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    const ZERO: Self;
    /// The same number in every lane.
    fn splat(x: f32) -> Self;
    fn sqrt(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// Mask of the lanes in which `self < other`; NaN compares as false.
    fn below(self, other: Self) -> Self;
    /// Mask of the lanes in which `self >= other`; NaN compares as false.
    fn at_least(self, other: Self) -> Self;
    /// The bits that both masks have.
    fn and(self, other: Self) -> Self;
    /// Of each lane, `yes` where this mask is set and `no` elsewhere.
    fn select(self, yes: Self, no: Self) -> Self;
    /// A mask as bits: bit k belongs to lane k.
    fn bits(self) -> u32;

    /// Mask of the lanes that are zero, of either sign.
    #[inline(always)]
    fn is_zero(self) -> Self {
        Self::ZERO.at_least(self.abs())
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> f32 {
        self.as_array()[lane]
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, x: f32) {
        self.as_array_mut()[lane] = x;
    }

    #[inline(always)]
    fn as_array(&self) -> &[f32; LANES] {
        const { assert!(size_of::<Self>() == size_of::<[f32; LANES]>()) };
        // SAFETY: the trait promises eight packed f32, and an array of f32 needs no larger alignment than the vector.
        unsafe { &*std::ptr::from_ref(self).cast() }
    }

    #[inline(always)]
    fn as_array_mut(&mut self) -> &mut [f32; LANES] {
        const { assert!(size_of::<Self>() == size_of::<[f32; LANES]>()) };
        // SAFETY: as in `as_array`.
        unsafe { &mut *std::ptr::from_mut(self).cast() }
    }

    /// The mask with these bits.
    #[inline(always)]
    fn mask(bits: u32) -> Self {
        let mut mask = Self::ZERO;
        for lane in 0..LANES {
            let all = if bits >> lane & 1 == 1 { u32::MAX } else { 0 };
            mask.set(lane, f32::from_bits(all));
        }
        mask
    }
}

/// Work that can run on any kind of lanes.
pub(super) trait Work {
    fn run<L: Lanes>(self);
}

/// Runs `work` on AVX registers where the processor has AVX2, and else on what every processor has.
pub(super) fn on_widest_lanes(work: impl Work) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn avx2(work: impl Work) {
            work.run::<avx::Avx>();
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has the feature that the function is compiled for.
            return unsafe { avx2(work) };
        }
    }
    work.run::<f32x8>();
}

// SAFETY: `f32x8` is `repr(C)` of one AVX register, or of two registers of four f32.
unsafe impl Lanes for f32x8 {
    const ZERO: Self = f32x8::ZERO;
    #[inline(always)]
    fn splat(x: f32) -> Self {
        f32x8::splat(x)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.fast_min(other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.fast_max(other)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn below(self, other: Self) -> Self {
        self.simd_lt(other)
    }
    #[inline(always)]
    fn at_least(self, other: Self) -> Self {
        self.simd_ge(other)
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        self & other
    }
    #[inline(always)]
    fn select(self, yes: Self, no: Self) -> Self {
        self.select(yes, no)
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self.to_bitmask()
    }
}

#[cfg(target_arch = "x86_64")]
mod avx {
    use super::Lanes;
    use std::arch::x86_64::*;
    use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

    /// One AVX register. Only [`super::on_widest_lanes`] makes values of this type, after it has found that the processor has
    /// AVX2. All SAFETY comments below rely on that.
    #[derive(Clone, Copy, Debug)]
    #[repr(transparent)]
    pub(super) struct Avx(__m256);

    macro_rules! operator {
        ($trait:ident $method:ident, $assign:ident $assigned:ident, $intrinsic:ident) => {
            operator!($trait $method, $intrinsic);
            impl $assign for Avx {
                #[inline(always)]
                fn $assigned(&mut self, other: Self) {
                    *self = $trait::$method(*self, other);
                }
            }
        };
        ($trait:ident $method:ident, $intrinsic:ident) => {
            impl $trait for Avx {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: see `Avx`.
                    Avx(unsafe { $intrinsic(self.0, other.0) })
                }
            }
        };
    }
    operator!(Add add, AddAssign add_assign, _mm256_add_ps);
    operator!(Sub sub, SubAssign sub_assign, _mm256_sub_ps);
    operator!(Mul mul, _mm256_mul_ps);
    operator!(Div div, _mm256_div_ps);

    impl Neg for Avx {
        type Output = Self;
        #[inline(always)]
        fn neg(self) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
        }
    }

    // SAFETY: the type is `repr(transparent)` over a register of eight f32.
    unsafe impl Lanes for Avx {
        // SAFETY: all bits 0 are eight zeros.
        const ZERO: Self = Avx(unsafe { std::mem::zeroed() });

        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_sqrt_ps(self.0) })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
        }
        #[inline(always)]
        fn below(self, other: Self) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn at_least(self, other: Self) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_cmp_ps::<_CMP_GE_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn and(self, other: Self) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_and_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn select(self, yes: Self, no: Self) -> Self {
            // SAFETY: see `Avx`.
            Avx(unsafe { _mm256_blendv_ps(no.0, yes.0, self.0) })
        }
        #[inline(always)]
        fn bits(self) -> u32 {
            // SAFETY: see `Avx`.
            unsafe { _mm256_movemask_ps(self.0) as u32 }
        }
    }
}
