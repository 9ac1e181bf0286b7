//! A multi-layer perceptron over a slice of a flat parameter vector.

use super::activation::Activation;
use super::kernels::{Matrix, Scalar, activation_backward, bias_and_activate, multiply, sum_rows};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::ops::Range;

/// The shape of a fully connected network: `y = W₂ᵀ·act(W₁ᵀ·x + b₁) + b₂` and so on, no activation after the last layer.
///
/// Parameters lie layer by layer: the weight `[inputs, outputs]` row-major, then the bias `[outputs]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mlp {
    layers: Vec<Layer>,
    activation: Activation,
    outputs: usize,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Layer {
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    /// Where weights and biases lie among the network's parameters.
    pub(crate) weight: Range<usize>,
    pub(crate) bias: Range<usize>,
}

impl Layer {
    /// The layer's weights `[inputs, outputs]`.
    fn weights<'a, T>(&self, parameters: &'a [T]) -> Matrix<'a, T> {
        let weight = &parameters[self.weight.clone()];
        Matrix::new(weight, self.inputs, self.outputs)
    }
}

/// Buffers of forward and backward passes, kept from call to call and grown to the largest batch seen.
#[derive(Clone, Debug, Default)]
pub struct Workspace<T> {
    /// `activations[l]`: the output of layer l, `[batch, outputs of l]`.
    activations: Vec<Vec<T>>,
    /// Gradients by a layer's output and by its input.
    deltas: [Vec<T>; 2],
}

impl Mlp {
    /// `hidden` lists the widths of the layers between inputs and outputs.
    pub fn new(inputs: usize, hidden: &[usize], outputs: usize, activation: Activation) -> Self {
        let mut layers = Vec::with_capacity(hidden.len() + 1);
        let (mut from, mut start) = (inputs, 0);
        for &to in hidden.iter().chain([&outputs]) {
            let weight = start..start + from * to;
            let bias = weight.end..weight.end + to;
            start = bias.end;
            layers.push(Layer {
                inputs: from,
                outputs: to,
                weight,
                bias,
            });
            from = to;
        }
        Self {
            layers,
            activation,
            outputs,
        }
    }

    /// Length of the network's part of the parameter vector.
    pub fn parameter_count(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.bias.end)
    }

    pub(crate) fn layers(&self) -> &[Layer] {
        &self.layers
    }

    fn activation_after(&self, layer: usize) -> Option<Activation> {
        (layer + 1 < self.layers.len()).then_some(self.activation)
    }

    /// The outputs `[batch, outputs]` for `input` `[batch, inputs]`; hidden activations stay in `workspace` for
    /// [`Mlp::backward`].
    ///
    /// # Panics
    /// When `parameters` or `input` has another length than the shape says.
    pub fn forward<'w, T: Scalar>(
        &self,
        parameters: &[T],
        input: &[T],
        batch: usize,
        workspace: &'w mut Workspace<T>,
    ) -> &'w [T] {
        workspace
            .activations
            .resize_with(self.layers.len(), Vec::new);
        for (index, layer) in self.layers.iter().enumerate() {
            let (before, rest) = workspace.activations.split_at_mut(index);
            let x = before.last().map_or(input, |h| &h[..batch * layer.inputs]);
            let out = grown(&mut rest[0], batch * layer.outputs);
            let x = Matrix::new(x, batch, layer.inputs);
            multiply(out, x, layer.weights(parameters), false);
            bias_and_activate(
                out,
                &parameters[layer.bias.clone()],
                self.activation_after(index),
            );
        }
        &workspace.activations[self.layers.len() - 1][..batch * self.outputs]
    }

    /// Adds to `gradient` the gradient by the parameters, given the gradient by the outputs `[batch, outputs]`.
    /// Must follow [`Mlp::forward`] on the same parameters, input and workspace.
    ///
    /// # Panics
    /// When a slice has another length than the shape says.
    pub fn backward<T: Scalar>(
        &self,
        parameters: &[T],
        input: &[T],
        batch: usize,
        output_gradient: &[T],
        workspace: &mut Workspace<T>,
        gradient: &mut [T],
    ) {
        let Workspace {
            activations,
            deltas: [delta, next],
        } = workspace;
        grown(delta, output_gradient.len()).copy_from_slice(output_gradient);
        for (index, layer) in self.layers.iter().enumerate().rev() {
            let delta_here = &mut delta[..batch * layer.outputs];
            let output = &activations[index][..batch * layer.outputs];
            let bias_gradient = &mut gradient[layer.bias.clone()];
            // From the gradient by the layer's output to δ, that by its pre-activation, and its sum over the batch.
            match self.activation_after(index) {
                Some(activation) => {
                    activation_backward(delta_here, output, bias_gradient, activation);
                }
                None => sum_rows(delta_here, bias_gradient),
            }
            let x = if index == 0 {
                input
            } else {
                &activations[index - 1][..batch * layer.inputs]
            };
            let by_output = Matrix::new(&*delta_here, batch, layer.outputs);
            let x = Matrix::new(x, batch, layer.inputs);
            // ∂/∂W = xᵀ·δ, added to what the gradient holds; ∂/∂x = δ·Wᵀ is the δ of the layer below.
            let weight_gradient = &mut gradient[layer.weight.clone()];
            multiply(weight_gradient, x.transposed(), by_output, true);
            if index > 0 {
                let by_input = grown(next, batch * layer.inputs);
                let weights = layer.weights(parameters).transposed();
                multiply(by_input, by_output, weights, false);
                std::mem::swap(delta, next);
            }
        }
    }

    /// Orthogonal weights times a gain (√2 before a ReLU, 1 otherwise, `last_gain` for the last layer), zero biases.
    /// Saxe et al. 2014, "Exact solutions to the nonlinear dynamics of learning in deep linear neural networks". √2 makes up
    /// for the half of its inputs that a ReLU cuts off (He et al. 2015, "Delving deep into rectifiers").
    ///
    /// # Panics
    /// When `parameters` is shorter than [`Mlp::parameter_count`].
    pub fn initialise<T: Scalar>(
        &self,
        last_gain: f64,
        rng: &mut ChaCha8Rng,
        parameters: &mut [T],
    ) {
        for (index, layer) in self.layers.iter().enumerate() {
            let gain = match self.activation_after(index) {
                None => last_gain,
                Some(Activation::Relu) => std::f64::consts::SQRT_2,
                Some(Activation::Elu | Activation::Tanh) => 1.0,
            };
            let weight = orthogonal(layer.inputs, layer.outputs, rng);
            for (p, w) in parameters[layer.weight.clone()].iter_mut().zip(weight) {
                *p = T::from_f64(gain * w);
            }
            parameters[layer.bias.clone()].fill(T::ZERO);
        }
    }
}

/// The first `length` elements of a buffer that is made longer where needed.
fn grown<T: Scalar>(buffer: &mut Vec<T>, length: usize) -> &mut [T] {
    if buffer.len() < length {
        buffer.resize(length, T::ZERO);
    }
    &mut buffer[..length]
}

/// A random `[rows, columns]` matrix whose rows, or columns if there are fewer, are orthonormal: normal deviates made
/// orthogonal by the modified Gram-Schmidt process.
fn orthogonal(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let (count, length) = (rows.min(columns), rows.max(columns));
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(count);
    while basis.len() < count {
        let mut vector: Vec<f64> = (0..length).map(|_| StandardNormal.sample(rng)).collect();
        for other in &basis {
            let along = dot(&vector, other);
            vector
                .iter_mut()
                .zip(other)
                .for_each(|(v, o)| *v -= along * o);
        }
        let norm = dot(&vector, &vector).sqrt();
        // A deviate almost inside the span of the others is drawn again.
        if norm > 1e-6 {
            vector.iter_mut().for_each(|v| *v /= norm);
            basis.push(vector);
        }
    }
    let at = |row: usize, column: usize| {
        if rows <= columns {
            basis[row][column]
        } else {
            basis[column][row]
        }
    };
    (0..rows * columns)
        .map(|i| at(i / columns, i % columns))
        .collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::rand_core::SeedableRng;

    #[test]
    fn forward_agrees_with_hand_computed_values() {
        let net = Mlp::new(2, &[2], 1, Activation::Relu);
        // W1 = [[1, -1], [2, 1]], b1 = [0.5, -1], W2 = [[3], [4]], b2 = [0.25]
        let parameters = [1.0, -1.0, 2.0, 1.0, 0.5, -1.0, 3.0, 4.0, 0.25];
        let mut workspace = Workspace::default();
        // x = (1, 1): pre-activation (3.5, -1), hidden (3.5, 0), y = 10.75.
        // x = (-1, 3): pre-activation (5.5, 3), hidden (5.5, 3), y = 28.75.
        let y = net.forward(&parameters, &[1.0, 1.0, -1.0, 3.0], 2, &mut workspace);
        assert_eq!(y, [10.75, 28.75]);
    }

    #[test]
    fn orthogonal_weights_are_orthogonal() {
        for (rows, columns) in [(5, 9), (9, 5), (6, 6), (1, 4)] {
            let w = orthogonal(rows, columns, &mut ChaCha8Rng::seed_from_u64(3));
            let m = nalgebra::DMatrix::from_row_slice(rows, columns, &w);
            let gram = if rows <= columns {
                &m * m.transpose()
            } else {
                m.transpose() * &m
            };
            let identity = nalgebra::DMatrix::identity(gram.nrows(), gram.ncols());
            assert!((gram - identity).amax() < 1e-12);
        }
    }

    #[test]
    fn every_activation_has_the_right_gradient() {
        for activation in [Activation::Relu, Activation::Elu, Activation::Tanh] {
            let net = Mlp::new(3, &[5, 4], 2, activation);
            let mut rng = ChaCha8Rng::seed_from_u64(11);
            let mut parameters = vec![0.0; net.parameter_count()];
            net.initialise(1.0, &mut rng, &mut parameters);
            let input: Vec<f64> = (0..21).map(|_| StandardNormal.sample(&mut rng)).collect();
            let weights: Vec<f64> = (0..14).map(|_| StandardNormal.sample(&mut rng)).collect();
            let mut workspace = Workspace::default();
            net.forward(&parameters, &input, 7, &mut workspace);
            let mut gradient = vec![0.0; parameters.len()];
            net.backward(
                &parameters,
                &input,
                7,
                &weights,
                &mut workspace,
                &mut gradient,
            );
            let mut loss = |p: &[f64]| dot(net.forward(p, &input, 7, &mut workspace), &weights);
            for i in 0..parameters.len() {
                let mut shifted = parameters.clone();
                shifted[i] = parameters[i] + 1e-6;
                let above = loss(&shifted);
                shifted[i] = parameters[i] - 1e-6;
                let slope = (above - loss(&shifted)) / 2e-6;
                assert!(
                    (slope - gradient[i]).abs() < 1e-8 * (1.0 + slope.abs()),
                    "{activation:?} {i}"
                );
            }
        }
    }
}
