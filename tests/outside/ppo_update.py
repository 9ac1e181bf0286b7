"""Computes one PPO update again with JAX and compares it with what the library made.

Needs jax and safetensors (`requirements.txt`). From the root of the repository:

    cargo run --release --example ppo_update -- FOLDER
    python tests/outside/ppo_update.py FOLDER

recomputes the update that the example wrote in 64-bit floats from the published formulas, with gradients by automatic
differentiation. Every figure is the largest absolute difference over the largest absolute value of the reference. Ends
with status 1 when one of them is above its bound, 1e-5 in 32 bits.

The change of the parameters is compared as a whole, by Euclidean norms. Adam divides a gradient by its own size, so a
parameter whose gradient cancels almost to nothing moves by a step that rounding decides: by the largest difference,
this update computed by JAX in 32 bits is 3e-4 from itself in 64.
"""

import json
import math
import pathlib
import sys

import jax
import jax.numpy as jnp
from jax.scipy.stats import norm as normal
import numpy as np
from safetensors import safe_open

jax.config.update("jax_enable_x64", True)


def load(path):
    with safe_open(path, framework="numpy") as file:
        tensors = {name: file.get_tensor(name) for name in file.keys()}
        return tensors, json.loads(file.metadata()["mimic"])


def unflatten(flat, layout):
    """A tree of named arrays from the flat vector."""
    return {
        name: jnp.asarray(flat[start : start + math.prod(shape)]).reshape(shape)
        for name, shape, start in layout
    }


def flatten(tree, layout):
    return np.concatenate([np.ravel(tree[name]) for name, _, _ in layout])


def network(tree, prefix, x):
    layers = sum(name.startswith(prefix) and name.endswith("weight") for name in tree)
    for layer in range(layers):
        x = x @ tree[f"{prefix}.{layer}.weight"] + tree[f"{prefix}.{layer}.bias"]
        if layer + 1 < layers:
            x = jax.nn.relu(x)
    return x


def log_prob(tree, observations, actions):
    mean = network(tree, "actor", observations)
    return normal.logpdf(actions, mean, jnp.exp(tree["log_std"])).sum(axis=-1)


def terms(tree, data, config):
    """Schulman et al. 2017, eq. 7 and 9, with the value targets on the critic's scale, and the action bound."""
    ratio = jnp.exp(log_prob(tree, data["observations"], data["actions"]) - data["log_probs"])
    clipped = jnp.clip(ratio, 1 - config["clip"], 1 + config["clip"])
    policy = -jnp.minimum(ratio * data["advantages"], clipped * data["advantages"]).mean()
    value = jnp.square(network(tree, "critic", data["observations"])[:, 0] - data["targets"]).mean()
    mean = network(tree, "actor", data["observations"])
    bound = jnp.square(jax.nn.relu(jnp.abs(mean) - config["action_bound"])).sum(axis=-1).mean()
    kl = (ratio - 1 - jnp.log(ratio)).mean()
    outside = jnp.where(jnp.abs(ratio - 1) > config["clip"], 1.0, 0.0).mean()
    return policy, value, bound, kl, outside


def loss(tree, data, config):
    policy, value, bound, kl, outside = terms(tree, data, config)
    entropy = (0.5 * jnp.log(2 * jnp.pi * jnp.e * jnp.exp(tree["log_std"]) ** 2)).sum()
    total = (
        policy
        + config["value_coefficient"] * value
        - config["entropy_coefficient"] * entropy
        + config["action_bound_coefficient"] * bound
    )
    return total, (policy, value, bound, kl, outside)


def targets(tree, returns):
    return (returns - tree["value_mean"]) / tree["value_std"]


def rescale(tree, mean, std):
    """Van Hasselt et al. 2016: the critic's outputs times the scale stay the same."""
    last = max(name for name in tree if name.startswith("critic") and name.endswith("weight"))
    bias = last.replace("weight", "bias")
    old_mean, old_std = tree["value_mean"], tree["value_std"]
    return tree | {
        last: tree[last] * (old_std / std),
        bias: (old_std * tree[bias] + old_mean - mean) / std,
        "value_mean": jnp.full(1, mean),
        "value_std": jnp.full(1, std),
    }


def clip(gradient, limit):
    size = jnp.sqrt(sum(jnp.vdot(leaf, leaf) for leaf in jax.tree.leaves(gradient)))
    return size, jax.tree.map(lambda leaf: leaf * jnp.minimum(1.0, limit / size), gradient)


def adam(tree, gradient, state, config):
    """Kingma & Ba 2015, algorithm 1."""
    steps, first, second = state
    beta1, beta2, epsilon = (config["adam"][key] for key in ("beta1", "beta2", "epsilon"))
    steps += 1
    first = jax.tree.map(lambda m, g: beta1 * m + (1 - beta1) * g, first, gradient)
    second = jax.tree.map(lambda v, g: beta2 * v + (1 - beta2) * g**2, second, gradient)

    def move(p, m, v):
        m_hat, v_hat = m / (1 - beta1**steps), v / (1 - beta2**steps)
        return p - config["learning_rate"] * m_hat / (jnp.sqrt(v_hat) + epsilon)

    return jax.tree.map(move, tree, first, second), (steps, first, second)


def learned(gradient):
    """The value scale takes no gradient steps."""
    return gradient | {name: jnp.zeros(1) for name in ("value_mean", "value_std")}


def update(tree, data, order, config):
    """All epochs; gives the parameters and the means of the statistics over minibatches."""
    slope = jax.jit(jax.value_and_grad(lambda t, d: loss(t, d, config), has_aux=True))
    zeros = jax.tree.map(jnp.zeros_like, tree)
    state, records = (0, zeros, zeros), []
    samples = len(data["returns"])
    parts = round(samples / config["minibatch"])
    for epoch in order.reshape(config["epochs"], samples):
        for indices in np.split(epoch, parts):
            part = {name: values[indices] for name, values in data.items()}
            (_, values), gradient = slope(tree, part)
            size, gradient = clip(learned(gradient), config["max_gradient_norm"])
            tree, state = adam(tree, gradient, state, config)
            records.append([float(v) for v in (*values, size)])
    return tree, np.array(records)


def difference(found, expected):
    found, expected = np.asarray(found), np.asarray(expected)
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))


def distance(found, expected):
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def compare(path):
    tensors, metadata = load(path)
    config, layout, stats = (metadata[key] for key in ("config", "layout", "stats"))
    tree = unflatten(tensors["parameters_before"], layout)
    rows = len(tensors["returns"])
    data = {name: tensors[name] for name in ("log_probs", "advantages", "returns")}
    data |= {name: tensors[name].reshape(rows, -1) for name in ("observations", "actions")}
    data["advantages"] = (data["advantages"] - data["advantages"].mean()) / data["advantages"].std()
    figures = {}

    noise = tensors["noise"].reshape(rows, -1)
    mean = network(tree, "actor", data["observations"])
    figures["actions"] = difference(data["actions"], mean + jnp.exp(tree["log_std"]) * noise)
    expected = log_prob(tree, data["observations"], data["actions"])
    figures["log-probabilities"] = difference(tensors["log_probs_acted"], expected)
    figures["values"] = difference(tensors["values"], network(tree, "critic", data["observations"])[:, 0])

    first = {name: values[:150] for name, values in data.items()}
    first["targets"] = targets(tree, first["returns"])
    gradient, values = jax.grad(loss, has_aux=True)(tree, first, config)
    figures["losses"] = difference(tensors["losses"], values[:3])
    figures["divergence"] = difference(tensors["divergence"], values[3:])
    figures["gradient"] = difference(tensors["gradient"], flatten(learned(gradient), layout))

    tree = rescale(tree, data["returns"].mean(), data["returns"].std())
    data["targets"] = targets(tree, data["returns"])
    before = flatten(tree, layout)
    tree, records = update(tree, data, tensors["order"].astype(int), config)
    after = flatten(tree, layout)
    figures["parameters after"] = difference(tensors["parameters_after"], after)
    figures["change of parameters"] = distance(tensors["parameters_after"] - before, after - before)
    means = records.mean(axis=0)
    names = ("policy_loss", "value_loss", "action_bound_loss", "clip_fraction", "gradient_norm")
    figures["statistics"] = difference([stats[name] for name in names], means[[0, 1, 2, 4, 5]])
    last_epoch = records[len(records) // config["epochs"] * (config["epochs"] - 1) :, 3].mean()
    figures["approximate KL"] = difference([stats["approx_kl"]], [last_epoch])
    residual = tensors["returns"] - tensors["values"]
    explained = 1 - residual.var() / tensors["returns"].var()
    figures["explained variance"] = difference([stats["explained_variance"]], [explained])
    entropy = (0.5 * np.log(2 * np.pi * np.e) + np.asarray(tree["log_std"])).sum()
    figures["entropy"] = difference([stats["entropy"]], [entropy])
    print(f"{path.stem}: {len(records)} steps, gradient norms {records[:, 5].min():.3f}..{records[:, 5].max():.3f},", end=" ")
    print(f"clipped {means[4]:.0%}, KL {last_epoch:.4f}")
    return figures


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: ppo_update.py FOLDER, which the example ppo_update has filled")
    folder = pathlib.Path(sys.argv[1])
    failed = False
    for name, bound in (("f64", 1e-12), ("f32", 1e-5)):
        for what, figure in compare(folder / f"{name}.safetensors").items():
            failed |= not figure <= bound
            print(f"  {what:24} {figure:.1e}{'' if figure <= bound else f'  above {bound:.0e}'}")
    sys.exit(failed)


if __name__ == "__main__":
    main()
