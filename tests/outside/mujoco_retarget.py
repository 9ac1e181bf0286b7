"""Measures retargeted motions against their clips with MuJoCo's kinematics; shares no code with the retargeter.

usage: python mujoco_retarget.py [--json] [--keypoints CM] SKELETON.xml CLIP.clip MOTION.motion [CLIP MOTION ...]

For every pair:
- key points: median distance of shoulders, elbows, wrists, hips, knees and ankles from where the source's bones put
  them, each bone in the skeleton's length, from the middle of the hips on; of that middle from the source's path,
  scaled by the legs; cm
- skate: mean horizontal speed of the slowest sole point that is on the ground, while the source's ankle or toes stand
  still there; cm/s
- penetration: deepest point of any shape below z = 0; cm
- float: how high the lowest point of a body is that the motion says is in contact; 99th percentile over frames and bodies; cm
- limits: coordinates more than 1e-6 outside of their range
- overlap: how deep shapes are in each other at most, those that are apart at rest and whose bodies are neither joined nor
  hang on the same one; mean over frames, and most; cm
- jumps: the greatest step of a key point from a frame to the next beyond the source's own; cm

Prints a line for each and a summary. Exits 1 when, over all, the median of the key points exceeds CM (3), mean skate
2 cm/s, mean overlap 0.2 cm, any penetration or float 1 cm, or any limit is violated. Needs the packages mujoco, numpy and safetensors.
"""

import argparse
import json
import pathlib
import sys

import mujoco
import numpy as np
from safetensors import safe_open

LIMBS = [
    [f"{side}-{part}" for part in parts]
    for side in ("left", "right")
    for parts in (("upper-leg", "lower-leg", "foot"), ("upper-arm", "lower-arm", "hand"))
]
# The source's foot stands still: slower than this, and this near to the lowest that it comes; metres of the skeleton.
STILL_M_S, LOW_M = 0.05, 0.03
# Sole points this near to the lowest one are on the ground, if that is this near to z = 0.
SOLE_M, GROUND_M = 0.01, 0.03
# Hips that stay within this of one place never move, metres.
NAILED_M = 0.002


def load(path):
    with safe_open(path, framework="numpy") as file:
        return json.loads(file.metadata()["mimic"]), {k: file.get_tensor(k) for k in file.keys()}


def rotate(q, v):
    """Rotates vectors by quaternions w, x, y, z."""
    u, w = q[..., 1:], q[..., :1]
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def multiply(a, b):
    ua, wa, ub, wb = a[..., 1:], a[..., :1], b[..., 1:], b[..., :1]
    w = wa * wb - (ua * ub).sum(-1, keepdims=True)
    return np.concatenate([w, wa * ub + wb * ua + np.cross(ua, ub)], -1)


def source_joints(header, t):
    """World positions `[frames, joints, 3]`, and those of the rest pose."""
    parents = t["parent"]

    def forward(translation, rotation):
        p, q = np.array(translation, float), np.array(rotation, float)
        for j, parent in enumerate(parents):
            if parent >= 0:
                p[:, j] = p[:, parent] + rotate(q[:, parent], p[:, j])
                q[:, j] = multiply(q[:, parent], q[:, j])
        return p

    moving = forward(t["local_translation"], t["local_rotation"])
    return moving, forward(t["rest_translation"][None], t["rest_rotation"][None])[0]


class Rig:
    """A skeleton in MuJoCo."""

    def __init__(self, path):
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.model)
        slots = json.loads(path.with_suffix(".json").read_text())["slots"]
        self.body = {s: mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, n) for s, n in slots.items()}
        self.shapes = [g for g in range(self.model.ngeom) if self.model.geom_bodyid[g] > 0]
        self.pose(np.r_[0, 0, 0, self.model.qpos0[3:]])
        pairs = [(a, b) for i, a in enumerate(self.shapes) for b in self.shapes[i + 1 :] if not self.joined(a, b)]
        self.apart = [(a, b) for a, b in pairs if self.depth(a, b) <= 0]

    def joined(self, a, b):
        a, b = self.model.geom_bodyid[a], self.model.geom_bodyid[b]
        up = self.model.body_parentid
        return a == b or up[a] == b or up[b] == a or up[a] == up[b]

    def depth(self, a, b):
        return -mujoco.mj_geomDistance(self.model, self.data, a, b, 0.001, None)

    def overlap(self):
        """Of the pose set last."""
        return max((self.depth(a, b) for a, b in self.apart), default=0.0)

    def pose(self, qpos):
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        return self.data.xpos.copy()

    def corners(self):
        """For every shape: its body, and the points of it that can be lowest, in its own frame, with their radius."""
        out = []
        for g in self.shapes:
            size, kind = self.model.geom_size[g], self.model.geom_type[g]
            if kind == mujoco.mjtGeom.mjGEOM_BOX:
                signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
                out.append((g, signs * size, 0.0))
            elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
                out.append((g, np.array([[0, 0, size[1]], [0, 0, -size[1]]]), size[0]))
            else:
                out.append((g, np.zeros((1, 3)), size[0]))
        return out

    def surface(self, corners):
        """World positions of those points in the pose set last."""
        at = []
        for g, points, _ in corners:
            turn = self.data.geom_xmat[g].reshape(3, 3)
            at.append(self.data.geom_xpos[g] + points @ turn.T)
        return at

    def outside(self, qpos):
        count = 0
        m = self.model
        for a in range(m.nu):
            j = m.actuator_trnid[a, 0]
            at = m.jnt_qposadr[j]
            if m.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE:
                if m.jnt_limited[j]:
                    low, high = m.jnt_range[j]
                    count += not low - 1e-6 <= qpos[at] <= high + 1e-6
                continue
            if a and m.actuator_trnid[a - 1, 0] == j:
                continue  # a ball joint's three drives at once
            drives = [b for b in range(m.nu) if m.actuator_trnid[b, 0] == j]
            turn = np.zeros(3)
            mujoco.mju_quat2Vel(turn, qpos[at : at + 4], 1.0)
            angle = np.linalg.norm(turn)
            either = [turn] if angle < 1e-9 else [turn, turn * (1 - 2 * np.pi / angle)]
            off = []
            for v in either:
                x = m.actuator_gear[drives][:, :3] @ v
                low, high = m.actuator_ctrlrange[drives].T
                off.append(int(((x < low - 1e-6) | (x > high + 1e-6)).sum()))
            count += min(off)
        return count


def middle(points, left, right):
    return (points[left] + points[right]) / 2


def targets(rig, source, rest, zero):
    """Where the source's bones put the key points, by slot; `zero` is the skeleton's rest pose."""
    ours = {s: zero[b] for s, b in rig.body.items()}
    hips = middle(source, "left-upper-leg", "right-upper-leg")
    out = {}

    def spread(anchor, center, limbs):
        slots = [limb[0] for limb in limbs]
        scale = np.linalg.norm(ours[slots[0]] - ours[slots[1]]) / np.linalg.norm(rest[slots[0]] - rest[slots[1]])
        for limb in limbs:
            out[limb[0]] = anchor + (source[limb[0]] - center) * scale
            for a, b in zip(limb, limb[1:]):
                if b not in source or b not in ours:
                    break
                bone = source[b] - source[a]
                length = np.linalg.norm(ours[b] - ours[a])
                out[b] = out[a] + bone * length / np.maximum(np.linalg.norm(bone, axis=-1, keepdims=True), 1e-9)

    spread(np.zeros(3), hips, [LIMBS[0], LIMBS[2]])
    shoulders = middle(source, "left-upper-arm", "right-upper-arm")
    trunk = lambda at: np.linalg.norm(
        middle(at, "left-upper-arm", "right-upper-arm") - middle(at, "left-upper-leg", "right-upper-leg")
    )
    spread((shoulders - hips) * trunk(ours) / trunk(rest), shoulders, [LIMBS[1], LIMBS[3]])
    return out


def leg(at):
    return np.mean([sum(np.linalg.norm(at[b] - at[a]) for a, b in zip(l, l[1:])) for l in (LIMBS[0], LIMBS[2])])


def still_feet(source, scale, fps):
    """By side: frames from which to the next the ankle or the toes stand still near their lowest."""
    out = {}
    for side in ("left", "right"):
        stands = False
        for part in ("foot", "toes"):
            path = source.get(f"{side}-{part}")
            if path is None:
                continue
            path = path * scale
            step = np.linalg.norm(np.diff(path, axis=0), axis=1) * fps
            low = path[:-1, 2] < path[:, 2].min() + LOW_M
            stands = stands | ((step < STILL_M_S) & low)
        out[side] = stands
    return out


def measure(rig, clip, motion):
    header, t = load(clip)
    moved, m = load(motion)
    joints = {name: j for j, name in enumerate(header["joints"])}
    world, rest = source_joints(header, t)
    slots = {e["slot"]: joints[e["joint"]] for e in moved["report"]["map"]}
    source = {s: world[:, j] for s, j in slots.items()}
    rest = {s: rest[j] for s, j in slots.items()}
    zero = rig.pose(np.r_[0, 0, 0, rig.model.qpos0[3:]])
    ours = {s: zero[b] for s, b in rig.body.items()}
    scale = leg(ours) / leg(rest)
    qpos, fps = m["qpos"], header["fps"]
    corners = rig.corners()
    bodies, surfaces, overlaps, floats, depth, outside = [], [], [], [], 0.0, 0
    mine = [[i for i, c in enumerate(corners) if rig.model.geom_bodyid[c[0]] == rig.model.body(b).id] for b in moved["contact_bodies"]]
    for q, contact in zip(qpos, m["contact"]):
        bodies.append(rig.pose(q))
        at = rig.surface(corners)
        surfaces.append(at)
        heights = [p[:, 2].min() - c[2] for c, p in zip(corners, at)]
        depth = max(depth, -min(heights))
        floats += [max(min(heights[i] for i in shapes), 0.0) for shapes, on in zip(mine, contact) if on]
        outside += rig.outside(q)
        overlaps.append(max(rig.overlap(), 0.0))
    # A clip of few frames a second becomes a motion of a multiple of them: these are the clip's own.
    times = max(round(moved["fps"] / fps), 1)
    bodies, surfaces, qpos = np.array(bodies)[::times], surfaces[::times], qpos[::times]
    count = min(len(qpos), len(world))
    at = {s: bodies[:count, b] for s, b in rig.body.items()}
    source = {s: p[:count] for s, p in source.items()}
    hips = middle(at, "left-upper-leg", "right-upper-leg")
    wanted = targets(rig, source, rest, zero)
    errors = [np.linalg.norm(at[s] - hips - p, axis=1) for s, p in wanted.items()]
    path = middle(source, "left-upper-leg", "right-upper-leg") * scale
    away = hips - path
    ids = [p["id"] for p in moved["report"]["problems"]]
    # Hips that never move have no way to compare with, and only they may get one.
    nailed = "hips-restored" in ids
    if nailed and np.ptp(source["hips"] * scale, axis=0).max() > NAILED_M:
        sys.exit(f"{motion}: the hips move, but got another way")
    restored = nailed or "travel-restored" in ids
    if restored and not nailed:
        time = np.arange(count)[:, None] / max(count - 1, 1)
        away = away - time * (away[-1] - away[0])
    if not nailed:
        errors.append(np.linalg.norm(away - np.median(away, axis=0), axis=1))
    step = lambda p: np.linalg.norm(np.diff(p, axis=0), axis=1)
    jumps = [step(at[s] - hips) - step(p) for s, p in wanted.items()]
    speeds = []
    for side, still in still_feet(source, scale, fps).items():
        foot = rig.body[f"{side}-foot"]
        mine = [i for i, c in enumerate(corners) if under(rig.model, rig.model.geom_bodyid[c[0]], foot)]
        for f in np.flatnonzero(still[: count - 1]) if not restored else []:
            now = np.concatenate([surfaces[f][i] - [0, 0, corners[i][2]] for i in mine])
            then = np.concatenate([surfaces[f + 1][i] - [0, 0, corners[i][2]] for i in mine])
            on = (now[:, 2] < now[:, 2].min() + SOLE_M) & (now[:, 2] < GROUND_M)
            if on.any():
                speeds.append(np.linalg.norm((then - now)[on][:, :2], axis=1).min() * fps)
    return {
        "keypoints_cm": np.concatenate(errors) * 100,
        "skate_cm_s": np.array(speeds) * 100,
        "penetration_cm": depth * 100,
        "float_cm": float(np.percentile(floats, 99)) * 100 if floats else 0.0,
        "outside": outside,
        "overlap_cm": np.array(overlaps) * 100,
        "jump_cm": max((j.max(initial=0.0) for j in jumps), default=0.0) * 100,
    }


def under(model, body, top):
    while body > 0:
        if body == top:
            return True
        body = model.body_parentid[body]
    return False


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--keypoints", type=float, default=3.0)
    parser.add_argument("skeleton", type=pathlib.Path)
    parser.add_argument("files", nargs="+")
    arguments = parser.parse_args()
    as_json, files = arguments.json, arguments.files
    rig = Rig(arguments.skeleton)
    keypoints, skates, overlaps, ok = [], [], [], True
    rows = []
    for clip, motion in zip(files[::2], files[1::2]):
        r = measure(rig, clip, motion)
        keypoints.append(r["keypoints_cm"])
        skates.append(r["skate_cm_s"])
        overlaps.append(r["overlap_cm"])
        ok &= r["penetration_cm"] <= 1.0 and r["float_cm"] <= 1.0 and r["outside"] == 0
        row = {
            "motion": pathlib.Path(motion).stem,
            "keypoints_median_cm": float(np.median(r["keypoints_cm"])),
            "keypoints_p99_cm": float(np.percentile(r["keypoints_cm"], 99)),
            "skate_cm_s": float(r["skate_cm_s"].mean()) if len(r["skate_cm_s"]) else 0.0,
            "still_frames": len(r["skate_cm_s"]),
            "penetration_cm": float(r["penetration_cm"]),
            "float_cm": r["float_cm"],
            "outside": r["outside"],
            "overlap_mean_cm": float(r["overlap_cm"].mean()),
            "overlap_max_cm": float(r["overlap_cm"].max()),
            "jump_cm": float(r["jump_cm"]),
        }
        rows.append(row)
        if not as_json:
            numbers = "  ".join(f"{k} {v:.2f}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items() if k != "motion")
            print(f"{row['motion']:44} {numbers}", flush=True)
    every, skate = np.concatenate(keypoints), np.concatenate(skates)
    total = {
        "motions": len(rows),
        "keypoints_median_cm": float(np.median(every)),
        "skate_mean_cm_s": float(skate.mean()) if len(skate) else 0.0,
        "penetration_max_cm": max(r["penetration_cm"] for r in rows),
        "float_max_cm": max(r["float_cm"] for r in rows),
        "outside": sum(r["outside"] for r in rows),
        "overlap_mean_cm": float(np.concatenate(overlaps).mean()),
    }
    ok &= total["keypoints_median_cm"] <= arguments.keypoints and total["skate_mean_cm_s"] <= 2.0
    ok &= total["overlap_mean_cm"] <= 0.2
    print(json.dumps({"rows": rows, "total": total}) if as_json else json.dumps(total))
    sys.exit(0 if ok else 1)


if __name__ == "__main__":
    main()
