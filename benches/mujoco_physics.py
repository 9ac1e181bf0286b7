"""Physics steps a second of MuJoCo on one core, of the character of `cargo bench -p mimic --bench physics` in the same cases.

usage: python benches/mujoco_physics.py [SKELETON.xml]

Same MJCF, same 240 Hz, drives aimed at the same targets 30 times a second; implicitfast, as the MJCF says.
"""

import sys
import time

import mujoco
import numpy as np

ROUNDS, STEPS, EPISODES, SUBSTEPS = 7, 60, 10, 8


def target(model, step, swing):
    """Control of every actuator: a hinge's angle, or a component of a ball's exponential map."""
    control, sine = np.zeros(model.nu), lambda i: swing * np.sin(step * 0.35 + i)
    links = {body: i for i, body in enumerate(b for b in range(1, model.nbody) if model.body_jntnum[b])}
    for actuator in range(model.nu):
        joint = model.actuator_trnid[actuator, 0]
        i = links[model.jnt_bodyid[joint]]
        ball = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL
        wave = np.array([0.5 * sine(i), 0.8 * sine(i + 3), 0.3 * sine(i + 5)])
        control[actuator] = model.actuator_gear[actuator, :3] @ wave if ball else 0.8 * swing + 0.6 * sine(i)
    return control


def rate(model, lift, controls):
    data = mujoco.MjData(model)
    begun = time.perf_counter()
    for _ in range(EPISODES):
        mujoco.mj_resetData(model, data)
        data.qpos[2] += lift
        for control in controls:
            data.ctrl[:] = control
            mujoco.mj_step(model, data, SUBSTEPS)
    return SUBSTEPS * STEPS * EPISODES / (time.perf_counter() - begun) / 1e3


def main():
    skeleton = sys.argv[1] if len(sys.argv) > 1 else "skeletons/humanoid.xml"
    model = mujoco.MjModel.from_xml_path(skeleton)
    model.opt.timestep = 1.0 / 240.0
    print(f"{skeleton}: thousands of physics steps a second, median of {ROUNDS}")
    for what, lift, swing in [("stands", 0.0, 0.0), ("flails on the ground", 0.0, 1.0), ("flails in the air", 50.0, 1.0)]:
        controls = [target(model, step, swing) for step in range(STEPS)]
        rates = sorted(rate(model, lift, controls) for _ in range(ROUNDS))
        print(f"{what:>22}: {rates[ROUNDS // 2]:6.1f}")


if __name__ == "__main__":
    main()
