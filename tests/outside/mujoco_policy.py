"""Checks that `examples/mujoco_policy.py` sees and aims as `mimic` does.

usage: python mujoco_policy.py RUN TRACE.json

The trace is of `examples/policy_trace.rs`: states, observations, actions and joint targets of a policy in `mimic`. From
the same states, observation, action and targets are built anew in Python, over MuJoCo's masses and kinematics. Prints the
largest deviations, of numbers above 1 relative to them; exits 1 above 1e-4 (1e-3 for actions, which a network of single
precision computes). Needs the packages mujoco, numpy and safetensors.
"""

import json
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "examples"))
import mujoco_policy as example  # noqa: E402

LIMITS = {"momentum scale": 1e-5, "observation": 1e-4, "action": 1e-3, "target": 1e-4}


def deviation(ours, theirs):
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    return (np.abs(ours - theirs) / np.maximum(np.abs(theirs), 1.0)).max()


def goals(agent, control, targets):
    """Pairs of angles and rotations that both aim at."""
    for (_, _, _, actuators, limits), target in zip(agent.joints, targets):
        aimed = control[actuators]
        if limits is not None:
            yield aimed[0], target
        else:
            apart = example.multiply(example.inverse(np.array(target)), example.quaternion(aimed))
            yield np.linalg.norm(example.rotation_vector(apart)), 0.0


def main():
    agent = example.Agent(sys.argv[1])
    trace = json.load(open(sys.argv[2]))
    worst = dict.fromkeys(LIMITS, 0.0)
    worst["momentum scale"] = abs(agent.momentum_scale / trace["momentum_scale"] - 1.0)
    for step in trace["steps"]:
        bodies = example.Bodies(*(step[k] for k in ("position", "rotation", "linear", "angular")))
        wanted, contacts, phase = agent.reference.sample(step["time"] + agent.dt)
        seen = agent.observe(bodies, step["touching"], wanted, contacts, phase)
        found = {
            "observation": deviation(seen, step["observation"]),
            "action": deviation(agent.act(np.array(step["observation"])), step["action"]),
            "target": max(
                deviation(*pair) for pair in goals(agent, agent.targets(wanted, np.array(step["action"])), step["targets"][1:])
            ),
        }
        for name, value in found.items():
            worst[name] = max(worst[name], value)
    for name, value in worst.items():
        print(f"{name:16} {value:.1e}")
    sys.exit(0 if all(worst[name] <= limit for name, limit in LIMITS.items()) else 1)


if __name__ == "__main__":
    main()
