"""Checks a motion written by `examples/random_motion.rs` against MuJoCo.

usage: python mujoco_motion.py RANDOM.motion SKELETON.xml

Reads RANDOM.json too, which the example writes beside the motion.

Prints the largest deviation of every track relative to its size; exits 1 above 1e-4 (accelerations, which both sides
get by differencing: 1e-2). Needs the packages mujoco, numpy and safetensors.
"""

import json
import pathlib
import sys

import mujoco
import numpy as np
from safetensors import safe_open

LIMIT = 1e-4
ACCELERATION_LIMIT = 1e-2


def load(path):
    with safe_open(path, framework="numpy") as file:
        header = json.loads(file.metadata()["mimic"])
        header["beside"] = json.loads(pathlib.Path(path).with_suffix(".json").read_text())
        return header, {k: file.get_tensor(k) for k in file.keys()}


def relative(ours, theirs):
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    return np.abs(ours - theirs).max() / max(np.abs(theirs).max(), 1e-12)


def differentiate(model, a, b, dt):
    qvel = np.zeros(model.nv)
    mujoco.mj_differentiatePos(model, qvel, dt, a, b)
    return qvel


def masses(model, header, ids):
    ours = header["beside"]["masses"]
    inertia = []
    for b in ids:
        r = np.zeros(9)
        mujoco.mju_quat2Mat(r, model.body_iquat[b])
        r = r.reshape(3, 3)
        inertia.append((r @ np.diag(model.body_inertia[b]) @ r.T).ravel())
    return {
        "mass": relative([m["mass"] for m in ours], model.body_mass[ids]),
        # Mass times centre: a body without mass has its centre nowhere.
        "first moment": relative(
            [m["mass"] * np.array(m["com"]) for m in ours],
            model.body_mass[ids][:, None] * model.body_ipos[ids],
        ),
        "inertia": max(relative(m["inertia"], i) for m, i in zip(ours, inertia)),
    }


def kinematics(model, header, t, ids):
    root = ids[0]
    mass = model.body_subtreemass[root]
    data = mujoco.MjData(model)
    rows = {k: [] for k in ("position", "rotation", "com", "linear", "angular")}
    for qpos, qvel in zip(t["qpos"], t["qvel"]):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_subtreeVel(model, data)
        rows["position"].append(data.xpos[ids].copy())
        rows["rotation"].append(data.xquat[ids].copy())
        rows["com"].append(data.subtree_com[root].copy())
        rows["linear"].append(mass * data.subtree_linvel[root])
        rows["angular"].append(data.subtree_angmom[root].copy())
    rotation = np.array(rows["rotation"])
    side = np.sign((rotation * t["body_rotation"]).sum(-1, keepdims=True))
    return {
        "body position": relative(t["body_position"], rows["position"]),
        "body rotation": relative(t["body_rotation"] * side, rotation),
        "com": relative(t["com"], rows["com"]),
        "com velocity": relative(t["com_velocity"], np.array(rows["linear"]) / mass),
        "linear momentum": relative(t["linear_momentum"], rows["linear"]),
        "angular momentum": relative(t["angular_momentum"], rows["angular"]),
    }


def velocities(model, header, t):
    dt = 1.0 / header["fps"]
    steps = [differentiate(model, a, b, dt) for a, b in zip(t["qpos"], t["qpos"][1:])]
    central = [(a + b) / 2 for a, b in zip(steps, steps[1:])]
    return {"qvel": relative(t["qvel"][1:-1], central)}


def wrenches(model, header, t):
    """Force and moment at the root, and torques of the joints, from mj_inverse, which is free of contacts here."""
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    qvel, inside = t["qvel"], slice(20, -20)
    qacc = (qvel[2:] - qvel[:-2]) * header["fps"] / 2
    force, moment, torques = [], [], []
    for q, v, a in zip(t["qpos"][1:-1], qvel[1:-1], qacc):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        r = np.zeros(9)
        mujoco.mju_quat2Mat(r, data.qpos[3:7])
        force.append(data.qfrc_inverse[:3].copy())
        moment.append(r.reshape(3, 3) @ data.qfrc_inverse[3:6])
        # What springs and dampers of the joints do is no drive.
        torques.append((data.qfrc_inverse + data.qfrc_passive)[6:])
    ours = t["root_wrench_residual"][1:-1]
    return {
        "root force": relative(ours[inside, :3], force[inside]),
        "root moment": relative(ours[inside, 3:], moment[inside]),
        "joint torques": relative(np.array(header["beside"]["joint_torques"])[1:-1, 6:][inside], torques[inside]),
    }


def main():
    header, t = load(sys.argv[1])
    model = mujoco.MjModel.from_xml_path(sys.argv[2])
    if t["qpos"].shape[1] != model.nq or t["qvel"].shape[1] != model.nv:
        sys.exit(f"shapes {t['qpos'].shape}, {t['qvel'].shape} differ from nq {model.nq}, nv {model.nv}")
    ids = [model.body(name).id for name in header["bodies"]]
    exact = masses(model, header, ids) | kinematics(model, header, t, ids) | velocities(model, header, t)
    differenced = wrenches(model, header, t)
    for name, deviation in (exact | differenced).items():
        print(f"{name:18} {deviation:.2e}")
    good = max(exact.values()) <= LIMIT and max(differenced.values()) <= ACCELERATION_LIMIT
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
