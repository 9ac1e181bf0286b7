//! Eight numbers at a time: the same one of each of eight characters.
//!
//! A step takes the same way through the tree whatever the character does, so eight of them go it together. All that
//! computes with lanes is inlined into [`on_widest`], so that it is compiled for the instructions that the processor was
//! found to have. No operation is fused with another, so all kinds give the same bits.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use wide::f32x8;

/// How many characters move together: in the air in little more time than one takes, on the ground in two to three times
/// it.
pub const LANES: usize = 8;

/// Eight numbers, or eight masks: all bits or none.
///
/// # Safety
/// The type is eight packed f32, and its bits may be any.
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
    fn splat(x: f32) -> Self;
    fn sqrt(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// A mask.
    fn below(self, other: Self) -> Self;
    /// A mask.
    fn at_least(self, other: Self) -> Self;
    /// Of two masks.
    fn and(self, other: Self) -> Self;
    /// `yes` where this mask is set.
    fn choose(self, yes: Self, no: Self) -> Self;
    /// Of a mask: bit k is that of lane k.
    fn bits(self) -> u32;

    /// A mask of the zeros, of either sign.
    #[inline(always)]
    fn is_zero(self) -> Self {
        Self::ZERO.at_least(self.abs())
    }

    #[inline(always)]
    fn of(&self, lane: usize) -> f32 {
        self.all()[lane]
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, x: f32) {
        self.all_mut()[lane] = x;
    }

    #[inline(always)]
    fn all(&self) -> &[f32; LANES] {
        const { assert!(size_of::<Self>() == size_of::<[f32; LANES]>()) };
        // SAFETY: the trait's promise; an f32 needs no more than its alignment.
        unsafe { &*std::ptr::from_ref(self).cast() }
    }

    #[inline(always)]
    fn all_mut(&mut self) -> &mut [f32; LANES] {
        const { assert!(size_of::<Self>() == size_of::<[f32; LANES]>()) };
        // SAFETY: as in `all`.
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

/// What runs on the widest kind of lanes that the processor has.
pub(super) trait Work {
    fn run<L: Lanes>(self);
}

/// Runs `work` on AVX's lanes where there are any, else on what every processor has.
pub(super) fn on_widest(work: impl Work) {
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

// SAFETY: `repr(C)` of an AVX register or of two of four f32.
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
    fn choose(self, yes: Self, no: Self) -> Self {
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

    /// One register of AVX. Only [`super::on_widest`] makes any, where the processor has AVX2: what all the SAFETY lines
    /// here stand on.
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

    // SAFETY: `repr(transparent)` of a register of eight f32.
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
        fn choose(self, yes: Self, no: Self) -> Self {
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
