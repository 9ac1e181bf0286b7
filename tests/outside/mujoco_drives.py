"""Checks that MuJoCo drives a character's joints to the targets that its position actuators are given.

usage: python mujoco_drives.py [SKELETON.xml]

Random targets within ctrlrange, and within the range of a hinge that can be aimed beyond it, are set all at once,
without gravity; after four seconds every hinge angle and every component of every ball joint's exponential map has to
be at its target. A rotation vector longer than pi is the same rotation as a shorter one, so targets stay below 2.5 rad.
Prints the largest error, exits 1 above 1e-3 rad.
"""

import sys

import mujoco
import numpy as np


def targets(model, random):
    low, high = model.actuator_ctrlrange.T.copy()
    joints = model.actuator_trnid[:, 0]
    limited = (model.jnt_type[joints] == mujoco.mjtJoint.mjJNT_HINGE) & (model.jnt_limited[joints] == 1)
    low[limited] = np.maximum(low, model.jnt_range[joints, 0])[limited]
    high[limited] = np.minimum(high, model.jnt_range[joints, 1])[limited]
    target = low + (high - low) * random.uniform(0.1, 0.9, model.nu)
    for joint in range(model.njnt):
        servos = model.actuator_trnid[:, 0] == joint
        target[servos] *= min(1.0, 2.5 / max(np.linalg.norm(target[servos]), 1e-9))
    return target


def coordinate(model, data, actuator):
    joint = model.actuator_trnid[actuator, 0]
    at = model.jnt_qposadr[joint]
    if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_BALL:
        return data.qpos[at]
    vector = np.zeros(3)
    mujoco.mju_quat2Vel(vector, data.qpos[at : at + 4], 1.0)
    return vector @ model.actuator_gear[actuator, :3]


def main():
    model = mujoco.MjModel.from_xml_path(sys.argv[1] if len(sys.argv) > 1 else "skeletons/humanoid.xml")
    model.opt.gravity[:] = 0
    worst = 0.0
    for seed in range(8):
        data = mujoco.MjData(model)
        data.qpos[2] = 5.0
        data.ctrl[:] = targets(model, np.random.default_rng(seed))
        for _ in range(int(4.0 / model.opt.timestep)):
            mujoco.mj_step(model, data)
        reached = [coordinate(model, data, a) for a in range(model.nu)]
        worst = max(worst, np.abs(reached - data.ctrl).max())
    print(f"largest error {worst:.2e} rad")
    sys.exit(0 if worst <= 1e-3 else 1)


if __name__ == "__main__":
    main()
