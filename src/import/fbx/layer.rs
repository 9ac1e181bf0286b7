//! A layer of a take, and how it blends with the layers below it.

use super::properties::Properties;
use super::transform::{Order, Property, from_euler, slerp, to_euler};
use nalgebra::{Matrix3, Vector3};

/// How a layer joins what is below it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Blend {
    /// Its values, times its weight, are added.
    Additive,
    /// Its values replace those below.
    Override,
    /// Its values replace those below by its weight.
    Passthrough,
}

/// An `AnimationLayer`.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// It doesn't count.
    pub muted: bool,
    /// If some layer is solo, only such layers count.
    pub solo: bool,
    pub blend: Blend,
    /// Rotations join as rotations, not angle by angle.
    compose_rotation: bool,
    /// Scales join by multiplication.
    compose_scale: bool,
    /// 0 to 1.
    pub weight: f64,
    /// Index of the curve that drives the weight, in percent.
    pub weight_curve: Option<usize>,
}

impl Layer {
    /// Reads a layer's properties.
    pub fn read(properties: &Properties) -> Self {
        let composes = |name| properties.int(name).unwrap_or(0) == 0;
        let is = |name| properties.int(name).unwrap_or(0) != 0;
        Self {
            muted: is("Mute"),
            solo: is("Solo"),
            blend: match properties.int("BlendMode").unwrap_or(0) {
                0 => Blend::Additive,
                2 => Blend::Passthrough,
                _ => Blend::Override,
            },
            compose_rotation: composes("RotationAccumulationMode"),
            compose_scale: composes("ScaleAccumulationMode"),
            weight: unit_weight(properties.real("Weight").unwrap_or(100.0)),
            weight_curve: None,
        }
    }

    /// The value of a property, given the value below this layer, the layer's own and its weight. Rotations are Euler angles
    /// in degrees, in the node's order.
    pub fn join(
        &self,
        property: Property,
        under: Vector3<f64>,
        over: Vector3<f64>,
        weight: f64,
        order: Order,
    ) -> Vector3<f64> {
        let rotates = self.compose_rotation && property == Property::Rotation;
        let scales = self.compose_scale && property == Property::Scaling;
        let turned = |v| from_euler(v, order);
        match self.blend {
            Blend::Override => over,
            // Scales multiply, rotations compose, and everything else adds or mixes number by number.
            Blend::Additive if scales => under.component_mul(&power(over, weight)),
            Blend::Additive if rotates => to_euler(
                &(turned(under) * slerp(&Matrix3::identity(), &turned(over), weight)),
                order,
            ),
            Blend::Additive => under + over * weight,
            Blend::Passthrough if scales => {
                power(under, 1.0 - weight).component_mul(&power(over, weight))
            }
            Blend::Passthrough if rotates => {
                to_euler(&slerp(&turned(under), &turned(over), weight), order)
            }
            Blend::Passthrough => under * (1.0 - weight) + over * weight,
        }
    }
}

/// Scale to a power between 0 and 1. A negative scale mirrors, and still does to any power above 0.
fn power(scale: Vector3<f64>, exponent: f64) -> Vector3<f64> {
    if exponent <= 0.0 {
        return Vector3::repeat(1.0);
    }
    scale.map(|value| value.abs().powf(exponent).copysign(value))
}

/// A weight from 0 to 1 out of percent.
pub(super) fn unit_weight(percent: f64) -> f64 {
    (percent / 100.0).clamp(0.0, 1.0)
}
