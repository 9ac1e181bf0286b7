"""Checks that a character moves as it does in MuJoCo: flying with all limbs turning, and held on the ground.

usage: python mujoco_simulation.py SIMULATION_TRACE [SKELETON.xml]

SIMULATION_TRACE is the built example of that name. All drives hold the rest pose, whose coordinates mean the same to
both. In flight the bodies' positions after half a second must come to MuJoCo's (at 20 kHz) as the rate of physics grows:
the error at 1920 Hz has to be below 3 mm, and below a third of that at 240 Hz. On the ground, where MuJoCo's contacts
are soft, the root has to be within 5 mm of MuJoCo's height after a second. Exits 1 otherwise.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import mujoco
import numpy as np

FINE = 5e-5


def trace(program, skeleton, start, hz, contact_s=0.0):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "start.json"
        path.write_text(json.dumps(start))
        done = subprocess.run([program, path, skeleton, str(hz), str(contact_s)], check=True, capture_output=True, text=True)
    return np.array(json.loads(done.stdout))


def peer(model, start):
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = start["qpos"], start["qvel"]
    for _ in range(round(start["steps"] / 30.0 / FINE)):
        mujoco.mj_step(model, data)
    return data.xpos[1:].copy()


def tumbling(model, seed):
    random, data = np.random.default_rng(seed), mujoco.MjData(model)
    turn = random.uniform(-0.6, 0.6, model.nv)
    turn[:6] = 0.0
    for joint in range(model.njnt):
        if model.jnt_limited[joint] and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
            low, high = model.jnt_range[joint]
            at = model.jnt_dofadr[joint]
            turn[at] = np.clip(turn[at], low + 0.3, high - 0.3) if high - low > 0.6 else (low + high) / 2
    qpos = model.qpos0.copy()
    mujoco.mj_integratePos(model, qpos, turn, 1.0)
    qpos[2] = 50.0
    qvel = random.uniform(-2.0, 2.0, model.nv)
    return {"qpos": qpos.tolist(), "qvel": qvel.tolist(), "steps": 15}


def main():
    program = sys.argv[1]
    skeleton = sys.argv[2] if len(sys.argv) > 2 else "skeletons/humanoid.xml"
    model = mujoco.MjModel.from_xml_path(skeleton)
    model.opt.timestep = FINE
    good = True
    for seed in range(3):
        start = tumbling(model, seed)
        expected = peer(model, start)
        coarse, fine = (np.abs(trace(program, skeleton, start, hz)[-1] - expected).max() for hz in (240, 1920))
        print(f"flight {seed}: {coarse * 1e3:.2f} mm off at 240 Hz, {fine * 1e3:.2f} mm at 1920 Hz")
        good &= fine < 3e-3 and fine < coarse / 3
    start = {"qpos": model.qpos0.tolist(), "qvel": [0.0] * model.nv, "steps": 30}
    expected, own = peer(model, start), trace(program, skeleton, start, 240)[-1]
    apart = own[0][2] - expected[0][2]
    print(f"held on the ground: root {apart * 1e3:.2f} mm above MuJoCo's")
    good &= abs(apart) < 5e-3
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
