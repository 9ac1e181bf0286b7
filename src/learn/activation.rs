//! What follows a hidden layer.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What follows every hidden layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Activation {
    /// max(0, x).
    #[default]
    Relu,
    /// x above 0, exp(x) − 1 below.
    Elu,
    /// Hyperbolic tangent.
    Tanh,
}
