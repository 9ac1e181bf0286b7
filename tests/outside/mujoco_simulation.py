"""Checks that a character moves as it does in MuJoCo: flying under drives that turn every joint, and held on the ground.

usage: python mujoco_simulation.py SIMULATION_TRACE [SKELETON.xml]

SIMULATION_TRACE is the built example of that name. In flight all drives go to random targets, many at their force limit.
The bodies' positions after 0.1 and 0.5 s must come to MuJoCo's (at 5 kHz) as the rate of physics grows: 1920 Hz has to be
within 6 mm, 240 Hz within 25 mm. On the ground the drives hold the rest pose: the root has to be within 5 mm of MuJoCo's
height after a second, whether ours is hard or yields as MuJoCo's does. Exits 1 otherwise.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import mujoco
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "examples"))
from mujoco_policy import Servos  # noqa: E402

FINE = 2e-4
LIMITS = {240: 25e-3, 1920: 6e-3}


def trace(program, skeleton, start, hz, contact_s=0.0):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "start.json"
        path.write_text(json.dumps(start))
        command = [program, path, skeleton, str(hz), str(contact_s)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    return np.array(json.loads(done.stdout))


def actuators(model):
    """In the order of the character's drive coordinates: by joint, a ball's along x, y, z."""
    order = []
    for joint in range(model.njnt):
        own = np.flatnonzero(model.actuator_trnid[:, 0] == joint)
        order.extend(own[np.argmax(np.abs(model.actuator_gear[own][:, :3]), axis=1).argsort()])
    return np.array(order)


def peer(model, start):
    """Positions of all bodies after every 1/30 s."""
    data, positions = mujoco.MjData(model), []
    data.qpos[:], data.qvel[:] = start["qpos"], start["qvel"]
    data.ctrl[actuators(model)] = start["control"]
    servos = Servos(model)
    goals = servos.goals(data.ctrl)
    for step in range(1, round(start["steps"] / 30.0 / FINE) + 1):
        servos.aim(data, goals)
        mujoco.mj_step(model, data)
        if step % (1.0 / 30.0 / FINE) < 1.0:
            positions.append(data.xpos[1:].copy())
    return np.array(positions)


def tumbling(model, seed):
    """A random pose, motion and target, hinges within their range."""
    random = np.random.default_rng(seed)
    turn, control = random.uniform(-0.6, 0.6, model.nv), random.uniform(-0.6, 0.6, model.nv)
    turn[:6] = 0.0
    # Several hinges of a body, which `mimic` drives together, hold the rest pose.
    several = model.body_dofnum[model.dof_bodyid] > np.where(model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_HINGE, 1, 3)
    control[several] = 0.0
    for joint in range(model.njnt):
        if model.jnt_limited[joint] and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
            (low, high), at = model.jnt_range[joint], model.jnt_dofadr[joint]
            edge = min(0.3, (high - low) / 4)
            turn[at], control[at] = np.clip([turn[at], control[at]], low + edge, high - edge)
    qpos = model.qpos0.copy()
    mujoco.mj_integratePos(model, qpos, turn, 1.0)
    qpos[2] = 50.0
    qvel = random.uniform(-2.0, 2.0, model.nv)
    return {"qpos": qpos.tolist(), "qvel": qvel.tolist(), "control": control[6:].tolist(), "steps": 15}


def main():
    program = sys.argv[1]
    skeleton = sys.argv[2] if len(sys.argv) > 2 else "skeletons/humanoid.xml"
    model = mujoco.MjModel.from_xml_path(skeleton)
    model.opt.timestep = FINE
    model.actuator_ctrllimited[:] = 0
    good = True
    for seed in range(3):
        start = tumbling(model, seed)
        expected = peer(model, start)
        for hz, limit in LIMITS.items():
            apart = np.abs(trace(program, skeleton, start, hz) - expected).max(axis=(1, 2))
            print(f"flight {seed} at {hz} Hz: {apart[2] * 1e3:.2f} mm off after 0.1 s, {apart[14] * 1e3:.2f} mm after 0.5 s")
            good &= max(apart[2], apart[14]) < limit
    start = {"qpos": model.qpos0.tolist(), "qvel": [0.0] * model.nv, "control": [0.0] * model.nu, "steps": 30}
    expected = peer(model, start)
    for ground, contact_s in (("hard", 0.0), ("yielding", 0.02)):
        apart = (trace(program, skeleton, start, 240, contact_s) - expected)[-1][0][2]
        print(f"held on {ground} ground: root {apart * 1e3:.2f} mm above MuJoCo's")
        good &= abs(apart) < 5e-3
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
