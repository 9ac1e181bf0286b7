//! The loops that take the time: matrix products, and element-wise passes compiled for two vector widths.
//!
//! Element-wise passes are plain Rust compiled once per instruction set and chosen at run time. None of them lets the
//! compiler contract a multiplication and an addition, and sums run over a fixed number of lanes, so every instruction
//! set gives the same bits.

#![allow(
    unsafe_code,
    reason = "the processor is asked for its vector instructions before functions compiled for them are called"
)]

use super::activation::Activation;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// A floating-point type that networks compute in: `f32` to train, `f64` to check.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// The nearest number of this type.
    fn from_f64(value: f64) -> Self;
    /// The same number in double precision.
    fn to_f64(self) -> f64;
    /// e to this power.
    fn exp(self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
}

macro_rules! scalar {
    ($type:ty) => {
        impl Scalar for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $type
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                self.exp()
            }
            #[inline(always)]
            fn tanh(self) -> Self {
                self.tanh()
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
        }
    };
}
scalar!(f32);
scalar!(f64);

/// A row-major matrix, read as it is or transposed.
#[derive(Clone, Copy)]
pub(crate) struct Matrix<'a, T> {
    data: &'a [T],
    rows: usize,
    columns: usize,
    row_stride: usize,
    column_stride: usize,
}

impl<'a, T> Matrix<'a, T> {
    /// `data` is `[rows, columns]`.
    pub(crate) fn new(data: &'a [T], rows: usize, columns: usize) -> Self {
        assert_eq!(data.len(), rows * columns, "matrix data length");
        Self {
            data,
            rows,
            columns,
            row_stride: columns,
            column_stride: 1,
        }
    }

    pub(crate) fn transposed(self) -> Self {
        Self {
            data: self.data,
            rows: self.columns,
            columns: self.rows,
            row_stride: self.column_stride,
            column_stride: self.row_stride,
        }
    }
}

/// `out = left · right`, or `out += left · right` when `accumulate`; `out` is row-major.
pub(crate) fn multiply<T: Scalar>(
    out: &mut [T],
    left: Matrix<T>,
    right: Matrix<T>,
    accumulate: bool,
) {
    assert_eq!(left.columns, right.rows, "inner dimensions");
    assert_eq!(out.len(), left.rows * right.columns, "output length");
    // SAFETY: `Matrix` can only be built with rows × columns elements, and transposing swaps dimensions together with
    // strides, so every index row · row_stride + column · column_stride lies inside `data`; `out` was checked above and
    // can't overlap the inputs because it is borrowed mutably. `Scalar` is only implemented for f32 and f64.
    unsafe {
        gemm::gemm(
            left.rows,
            right.columns,
            left.columns,
            out.as_mut_ptr(),
            1,
            right.columns as isize,
            accumulate,
            left.data.as_ptr(),
            left.column_stride as isize,
            left.row_stride as isize,
            right.data.as_ptr(),
            right.column_stride as isize,
            right.row_stride as isize,
            T::ONE,
            T::ONE,
            false,
            false,
            false,
            gemm::Parallelism::None,
        );
    }
}

/// Compiles a function for AVX2 and for the baseline, and picks one at run time. (AVX-512 gained nothing measurable.)
macro_rules! vectorised {
    ($(#[$doc:meta])* fn $name:ident($($argument:ident: $type:ty),* $(,)?) $(-> $out:ty)? $body:block) => {
        $(#[$doc])*
        pub(crate) fn $name<T: Scalar>($($argument: $type),*) $(-> $out)? {
            #[inline(always)]
            fn body<T: Scalar>($($argument: $type),*) $(-> $out)? $body
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                fn avx2<T: Scalar>($($argument: $type),*) $(-> $out)? {
                    body($($argument),*)
                }
                if is_x86_feature_detected!("avx2") {
                    // SAFETY: the processor has the feature that the function is compiled for.
                    return unsafe { avx2($($argument),*) };
                }
            }
            body($($argument),*)
        }
    };
}

#[inline(always)]
fn relu<T: Scalar>(x: T) -> T {
    // In this order a NaN passes through.
    if x < T::ZERO { T::ZERO } else { x }
}

#[inline(always)]
fn elu<T: Scalar>(x: T) -> T {
    if x < T::ZERO { x.exp() - T::ONE } else { x }
}

/// `x = f(x + b)` in each row, with `bias` `[width]`.
#[inline(always)]
fn map_rows<T: Scalar>(rows: &mut [T], bias: &[T], f: impl Fn(T) -> T) {
    for row in rows.chunks_exact_mut(bias.len()) {
        for (x, &b) in row.iter_mut().zip(bias) {
            *x = f(*x + b);
        }
    }
}

/// Multiplies `delta` by the slope that each output tells, and adds its rows to `sum` `[width]`: in one pass over memory.
#[inline(always)]
fn scale_and_sum_rows<T: Scalar>(
    delta: &mut [T],
    output: &[T],
    sum: &mut [T],
    slope: impl Fn(T) -> T,
) {
    let width = sum.len();
    for (row, output) in delta
        .chunks_exact_mut(width)
        .zip(output.chunks_exact(width))
    {
        for ((d, &y), s) in row.iter_mut().zip(output).zip(sum.iter_mut()) {
            *d = *d * slope(y);
            *s += *d;
        }
    }
}

vectorised! {
    /// `rows = activation(rows + bias)` for each row of `bias.len()` values; no activation for `None`.
    fn bias_and_activate(rows: &mut [T], bias: &[T], activation: Option<Activation>) {
        match activation {
            None => map_rows(rows, bias, |x| x),
            Some(Activation::Relu) => map_rows(rows, bias, relu),
            Some(Activation::Elu) => map_rows(rows, bias, elu),
            Some(Activation::Tanh) => map_rows(rows, bias, T::tanh),
        }
    }
}

vectorised! {
    /// Turns the gradient by a layer's output into the gradient by its pre-activation, given that output, and adds the
    /// sum over rows to the bias gradient.
    fn activation_backward(delta: &mut [T], output: &[T], bias_gradient: &mut [T], activation: Activation) {
        // The output alone tells the slope: 1 or 0 for a ReLU, exp(x) = y + 1 for an ELU, 1 − y² for tanh.
        match activation {
            Activation::Relu => scale_and_sum_rows(delta, output, bias_gradient, |y| {
                if y > T::ZERO { T::ONE } else { T::ZERO }
            }),
            Activation::Elu => scale_and_sum_rows(delta, output, bias_gradient, |y| {
                if y < T::ZERO { y + T::ONE } else { T::ONE }
            }),
            Activation::Tanh => scale_and_sum_rows(delta, output, bias_gradient, |y| T::ONE - y * y),
        }
    }
}

vectorised! {
    /// Adds each row of `rows` to `sum`.
    fn sum_rows(rows: &[T], sum: &mut [T]) {
        for row in rows.chunks_exact(sum.len()) {
            for (s, &x) in sum.iter_mut().zip(row) {
                *s += x;
            }
        }
    }
}

vectorised! {
    /// `sum += term`.
    fn add(sum: &mut [T], term: &[T]) {
        for (s, &x) in sum.iter_mut().zip(term) {
            *s += x;
        }
    }
}

vectorised! {
    /// Σ x², over 16 lanes that are added last: two AVX2 vectors of `f32`. A number that is fixed here, and not by the
    /// instruction set, gives the same bits everywhere.
    fn sum_of_squares(values: &[T]) -> f64 {
        let mut lanes = [T::ZERO; 16];
        let blocks = values.chunks_exact(16);
        let rest = blocks.remainder();
        for block in blocks {
            for (lane, &x) in lanes.iter_mut().zip(block) {
                *lane += x * x;
            }
        }
        for (lane, &x) in lanes.iter_mut().zip(rest) {
            *lane += x * x;
        }
        let mut sum = 0.0;
        for lane in lanes {
            sum += lane.to_f64();
        }
        sum
    }
}

/// The numbers that one Adam step needs, bias corrections folded in.
#[derive(Clone, Copy)]
pub(crate) struct AdamStep<T> {
    /// What the gradient is multiplied by first (clipping).
    pub(crate) gradient_scale: T,
    pub(crate) beta1: T,
    pub(crate) beta2: T,
    pub(crate) one_minus_beta1: T,
    pub(crate) one_minus_beta2: T,
    pub(crate) step_size: T,
    pub(crate) epsilon: T,
}

vectorised! {
    /// One Adam step on a piece of the parameter vector.
    fn adam(parameters: &mut [T], mean: &mut [T], square: &mut [T], gradient: &[T], step: AdamStep<T>) {
        let moments = mean.iter_mut().zip(square.iter_mut());
        for ((p, (m, v)), &g) in parameters.iter_mut().zip(moments).zip(gradient) {
            let g = g * step.gradient_scale;
            *m = step.beta1 * *m + step.one_minus_beta1 * g;
            *v = step.beta2 * *v + step.one_minus_beta2 * (g * g);
            *p = *p - step.step_size * *m / (v.sqrt() + step.epsilon);
        }
    }
}

/// The numbers that one step of plain momentum needs.
#[derive(Clone, Copy)]
pub(crate) struct MomentumStep<T> {
    /// What the gradient is multiplied by first (clipping).
    pub(crate) gradient_scale: T,
    pub(crate) momentum: T,
    pub(crate) step_size: T,
}

vectorised! {
    /// One step of gradient descent with momentum on a piece of the parameter vector.
    fn momentum_step(parameters: &mut [T], sum: &mut [T], gradient: &[T], step: MomentumStep<T>) {
        for ((p, m), &g) in parameters.iter_mut().zip(sum).zip(gradient) {
            *m = step.momentum * *m + step.gradient_scale * g;
            *p = *p - step.step_size * *m;
        }
    }
}

vectorised! {
    /// `out = clamp((raw − mean) · inverse_deviation, ±limit)`, row by row; a NaN stays.
    fn standardise(raw: &[T], mean: &[T], inverse_deviation: &[T], limit: T, out: &mut [T]) {
        let width = mean.len();
        for (row, out) in raw.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
            for (((&x, &m), &s), y) in row.iter().zip(mean).zip(inverse_deviation).zip(out) {
                let z = (x - m) * s;
                let z = if z > limit { limit } else { z };
                *y = if z < -limit { -limit } else { z };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of both signs, of a length that fills no vector width.
    fn values(seed: u32) -> Vec<f32> {
        (0..16 * 13 + 11)
            .map(|i| ((i * 7919 + seed * 104_729) as f32).sin() * 3.0)
            .collect()
    }

    #[test]
    fn vectorised_loops_have_the_bits_of_scalar_arithmetic() {
        let (mut p, mut m, mut v, g) = (values(1), values(2), values(3), values(4));
        v.iter_mut().for_each(|v| *v = v.abs());
        let step = AdamStep {
            gradient_scale: 0.3,
            beta1: 0.9,
            beta2: 0.999,
            one_minus_beta1: 0.1,
            one_minus_beta2: 0.001,
            step_size: 0.003,
            epsilon: 1e-8,
        };
        let scalar = (0..p.len()).map(|i| {
            let g = g[i] * 0.3;
            let m = std::hint::black_box(0.9 * m[i]) + std::hint::black_box(0.1 * g);
            let v = std::hint::black_box(0.999 * v[i]) + std::hint::black_box(0.001 * (g * g));
            p[i] - std::hint::black_box(0.003 * m / (v.sqrt() + 1e-8))
        });
        let scalar: Vec<f32> = scalar.collect();
        adam(&mut p, &mut m, &mut v, &g, step);
        assert_eq!(p, scalar);

        let mut lanes = [0.0_f32; 16];
        for (i, x) in g.iter().enumerate() {
            lanes[i % 16] += std::hint::black_box(x * x);
        }
        let sum: f64 = lanes.iter().map(|&lane| f64::from(lane)).sum();
        assert_eq!(sum_of_squares(&g), sum);
    }

    #[test]
    fn products_read_transposed_matrices() {
        let (a, b) = (
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            [1.0, 0.0, -1.0, 2.0, 0.5, 1.0],
        );
        let (a, b) = (Matrix::new(&a, 2, 3), Matrix::new(&b, 2, 3));
        let mut out = [10.0; 4];
        multiply(&mut out, a, b.transposed(), false);
        assert_eq!(out, [-2.0, 6.0, -2.0, 16.5]);
        let mut out = [10.0; 9];
        multiply(&mut out, a.transposed(), b, true);
        assert_eq!(out, [19.0, 12.0, 13.0, 22.0, 12.5, 13.0, 25.0, 13.0, 13.0]);
    }

    #[test]
    fn a_value_that_is_not_a_number_is_passed_on() {
        let mut row = [f32::NAN, -1.0, 2.0];
        bias_and_activate(&mut row, &[0.0; 3], Some(Activation::Relu));
        assert!(row[0].is_nan() && row[1..] == [0.0, 2.0]);
        let mut out = [0.0; 1];
        standardise(&[f32::NAN], &[0.0], &[1.0], 10.0, &mut out);
        assert!(out[0].is_nan());
    }
}
