"""Performs a trained policy in MuJoCo: the skill, without the engine that it was learned in.

usage: python mujoco_policy.py RUN [--seconds S] [--start SHARE] [--view]

Reads the run's policy and reference, builds observation and joint targets as `mimic` does (src/task), and lets MuJoCo's
own position actuators drive the character of the same MJCF. Those of a ball joint compare rotation vectors component by
component; so that they turn it along the rotation that is left, as `mimic` does, they are aimed anew in every step. Prints how long it lasts, how far the bodies are from their
reference, and says how it ended; exits 1 if it fell. For policies of the default preset (observations `tracking`, actions
`residual`) on characters of ball joints and single hinges. Needs the packages mujoco, numpy and safetensors.
"""

import argparse
import functools
import json
import pathlib
import sys

import mujoco
import numpy as np
from safetensors import safe_open

# As in src/task/reference.rs, src/motion/sample.rs, src/task/imitate.rs and src/learn: rate of the reference's table, over how
# long on either side its velocities are means, the acceleration, less gravity, below which it falls freely (m/s^2), how far
# beyond its range a hinge may be aimed, and where normalised observations are cut off.
TABLE_HZ = 120.0
AVERAGED_S = 1.0 / 30.0
# A body may touch the ground while the reference's is this near it, in leg lengths, and so long before and after; feet always may.
NEAR_LEGS, AROUND_S = 0.06, 0.15
FREELY = 1.0
GRAVITY = np.array([0.0, 0.0, -9.81])
BEYOND_LIMIT = 0.5
OBSERVATION_LIMIT = 10.0
SMALLEST_DEVIATION = 1e-4
# Mean distance of bodies beyond which an episode has failed, metres.
LOST_M = 0.5
# Physics steps in a control step: a drive at its limit moves a light limb by jerks when they are longer.
SUBSTEPS = 160


def load(path):
    with safe_open(path, framework="numpy") as file:
        return json.loads(file.metadata()["mimic"]), {k: file.get_tensor(k) for k in file.keys()}


def multiply(a, b):
    """Products of quaternions [..., 4], scalar first."""
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    scalar = aw * bw - (av * bv).sum(-1, keepdims=True)
    return np.concatenate([scalar, aw * bv + bw * av + np.cross(av, bv)], -1)


def inverse(q):
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def rotate(q, v):
    return v + 2.0 * np.cross(q[..., 1:], np.cross(q[..., 1:], v) + q[..., :1] * v)


def rotation_vector(q):
    q = q * np.where(q[..., :1] < 0.0, -1.0, 1.0)
    size = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(size, q[..., :1])
    return q[..., 1:] * np.where(size > 1e-9, angle / np.maximum(size, 1e-9), 2.0)


def quaternion(v):
    angle = np.linalg.norm(v)
    if angle < 1e-12:
        return np.array([1.0, 0.0, 0.0, 0.0])
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * v / angle])


class Bodies:
    """World poses and velocities of all bodies' origins: [B, 3], [B, 4], [B, 3], [B, 3]."""

    def __init__(self, position, rotation, linear, angular):
        self.position, self.rotation = np.asarray(position), np.asarray(rotation)
        self.linear, self.angular = np.asarray(linear), np.asarray(angular)

    @staticmethod
    def of(model, data):
        twist = np.zeros((model.nbody - 1, 6))
        for body in range(1, model.nbody):
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twist[body - 1], 0)
        return Bodies(data.xpos[1:].copy(), data.xquat[1:].copy(), twist[:, 3:], twist[:, :3])

    def moved(self, position, rotation):
        turn = lambda v: rotate(rotation, v)
        return Bodies(position + turn(self.position), multiply(rotation, self.rotation), turn(self.linear), turn(self.angular))

    def blended(self, other, share):
        mix = lambda a, b: a + (b - a) * share
        near = np.where((self.rotation * other.rotation).sum(-1, keepdims=True) < 0.0, -1.0, 1.0) * other.rotation
        rotation = mix(self.rotation, near)
        rotation /= np.linalg.norm(rotation, axis=-1, keepdims=True)
        return Bodies(mix(self.position, other.position), rotation, mix(self.linear, other.linear), mix(self.angular, other.angular))


class Servos:
    """Aims the actuators of ball joints so that they turn along the rotation that is left to their target."""

    def __init__(self, model):
        balls = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_BALL)
        self.at = model.jnt_qposadr[balls][:, None] + np.arange(4)
        own = [np.flatnonzero(model.actuator_trnid[:, 0] == ball) for ball in balls]
        axis = lambda a: np.argmax(np.abs(model.actuator_gear[a][:, :3]), axis=1)
        self.actuators = np.array([a[axis(a).argsort()] for a in own], int).reshape(-1, 3)

    def goals(self, control):
        """Target rotations whose rotation vectors `control` holds."""
        return np.array([quaternion(v) for v in control[self.actuators]]).reshape(-1, 4)

    def aim(self, data, goals):
        now = data.qpos[self.at]
        left = rotation_vector(multiply(inverse(now), goals))
        data.ctrl[self.actuators] = rotation_vector(now) + left


def lowest_of_geom(model, data, geom):
    size, down = model.geom_size[geom], np.abs(data.geom_xmat[geom].reshape(3, 3)[2])
    kind = model.geom_type[geom]
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return data.geom_xpos[geom][2] - down @ size
    return data.geom_xpos[geom][2] - size[0] - (down[2] * size[1] if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0)


def lowest(model, data):
    """Height of the lowest point of every body; infinite without shapes."""
    heights = np.full(model.nbody - 1, np.inf)
    for geom in np.flatnonzero(model.geom_bodyid > 0):
        body = model.geom_bodyid[geom] - 1
        heights[body] = min(heights[body], lowest_of_geom(model, data, geom))
    return heights


class Reference:
    """The motion at any time: body states, contacts, phase."""

    def __init__(self, model, path, leg):
        header, tensors = load(path)
        self.loops = header["loop"] == "wrap"
        self.cycle = header["cycle"]
        self.contact_bodies = [model.body(name).id - 1 for name in header["contact_bodies"]]
        fps, qpos, qvel = header["fps"], tensors["qpos"], tensors["qvel"]
        self.duration = (len(qpos) - 1) / fps
        finer = max(1, int(np.ceil(TABLE_HZ / fps)))
        self.rate = fps * finer
        data, change = mujoco.MjData(model), np.zeros(model.nv)
        self.falls = self.falling(model, data, qpos, fps)
        self.frames, self.contacts, heights = [], [], []
        for row in range((len(qpos) - 1) * finer + 1):
            frame = min(row // finer, len(qpos) - 2)
            share = row / finer - frame
            mujoco.mj_differentiatePos(model, change, 1.0, qpos[frame], qpos[frame + 1])
            data.qpos[:] = qpos[frame]
            mujoco.mj_integratePos(model, data.qpos, change, share)
            data.qvel[:] = self.velocity(qvel, fps, row / self.rate)
            mujoco.mj_forward(model, data)
            self.frames.append(Bodies.of(model, data))
            self.contacts.append(tensors["contact"][frame + (share >= 0.5)].astype(bool))
            heights.append(lowest(model, data))
        self.may_touch = self.allowed(np.array(heights), leg)

    def allowed(self, heights, leg):
        """Bodies that may touch the ground, by frame: those that the reference has near it a little before or after."""
        low, reach = heights < NEAR_LEGS * leg, int(np.floor(AROUND_S * self.rate + 0.5))
        last, wide = len(low) - 1, np.zeros_like(low)
        for frame, row in enumerate(low):
            for near in range(frame - reach, frame + reach + 1):
                if self.loops:
                    wide[near % last] |= row
                elif 0 <= near <= last:
                    wide[near] |= row
        if self.loops:
            wide[last] = wide[0]
        return wide

    def falling(self, model, data, qpos, fps):
        """Frames, by number in any cycle, in which the centre of mass falls freely from the one before to the one after."""
        com = []
        for row in qpos:
            data.qpos[:] = row
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            com.append(data.subtree_com[0].copy())

        def at(frame):
            n, f = divmod(frame, len(com) - 1) if self.loops else (0, frame)
            shift, turn = self.offset(n)
            return shift + rotate(turn, com[f])

        def falls(frame):
            if not self.loops and not 0 < frame < len(com) - 1:
                return False
            acceleration = (at(frame - 1) - 2.0 * at(frame) + at(frame + 1)) * fps**2
            return bool(np.linalg.norm(acceleration - GRAVITY) < FREELY)

        return functools.cache(falls)

    def velocity(self, qvel, fps, time):
        """Mean of the steps between frames around a time, all of them in the air or none; `qvel` is the mean of the two at a
        frame."""
        count = max(1, int(np.floor(AVERAGED_S * fps + 0.5)))
        around = lambda n: range(int(np.floor(time * fps - n + 1e-6)), int(np.ceil(time * fps + n - 1e-6)) + 1)
        while count > 1 and len({self.falls(frame) for frame in around(count)}) > 1:
            count -= 1
        return np.mean([self.momentary(qvel, fps, time + (2 * i + 1 - count) / fps) for i in range(count)], 0)

    def momentary(self, qvel, fps, time):
        if not self.loops:
            time = min(max(time, 0.0), self.duration)
        n = np.floor(time / self.duration) if self.loops else 0
        at = (time - n * self.duration) * fps
        frame = min(max(int(at), 0), len(qvel) - 2)
        found = qvel[frame] + (qvel[frame + 1] - qvel[frame]) * (at - frame)
        found[:3] = rotate(self.offset(n)[1], found[:3])
        return found

    def split(self, time):
        if not self.loops:
            return 0, min(max(time, 0.0), self.duration)
        cycle = max(np.floor(time / self.duration), 0.0)
        return cycle, min(max(time - cycle * self.duration, 0.0), self.duration)

    def offset(self, n):
        """Carries the first cycle to cycle n: the n-th power of a planar rigid motion."""
        half, shift = self.cycle["heading"] / 2.0, np.array(self.cycle["translation"])
        about_z = lambda angle: quaternion(np.array([0.0, 0.0, angle]))
        if abs(np.sin(half)) < 1e-9:
            return shift * n, about_z(2.0 * half * n)
        return rotate(about_z((n - 1.0) * half), shift) * np.sin(n * half) / np.sin(half), about_z(2.0 * half * n)

    def sample(self, time):
        cycle, within = self.split(time)
        at = within * self.rate
        frame = min(int(at), len(self.frames) - 2)
        share = min(max(at - frame, 0.0), 1.0)
        bodies = self.frames[frame].blended(self.frames[frame + 1], share)
        nearest = frame + (share >= 0.5)
        self.may = self.may_touch[nearest]
        return bodies.moved(*self.offset(cycle)), self.contacts[nearest], within / self.duration


class Agent:
    """A run's policy on its character."""

    def __init__(self, run):
        run = pathlib.Path(run)
        header, self.tensors = load(run / "policy.safetensors")
        details, self.layers = header["details"], len(header["policy"]["hidden"]) + 1
        self.task, slots = details["task"], json.loads(details["slots"])["slots"]
        observations, follows = self.task.get("observations", "tracking"), self.task.get("cycles_follow", False)
        if observations != "tracking" or self.task["actions"]["kind"] != "residual" or follows:
            sys.exit(f"{run}: this example knows observations, actions and cycles of the default preset alone; train with it")
        self.activation = {"relu": lambda x: np.maximum(x, 0.0), "tanh": np.tanh, "elu": lambda x: np.where(x < 0, np.expm1(x), x)}[
            header["policy"]["activation"]
        ]
        self.model = model = mujoco.MjModel.from_xml_string(details["mjcf"])
        self.dt = 1.0 / self.task["physics"]["control_hz"]
        model.opt.timestep = self.dt / SUBSTEPS
        # Drives of ball joints may be aimed anywhere, as in `mimic`; hinges are held to theirs below.
        model.actuator_ctrllimited[:] = 0
        self.joints = [self.joint(run, body) for body in range(2, model.nbody) if model.body_jntnum[body]]
        self.keys = [model.body(slots[s]).id - 1 for s in ("head", "left-hand", "right-hand", "left-foot", "right-foot") if s in slots]
        leg = self.leg(slots)
        self.momentum_scale = model.body_mass.sum() * leg * np.sqrt(9.81 * leg)
        self.reference = Reference(model, run / "reference-0.motion", leg)
        self.feet = {b - 1 for b in range(1, model.nbody) if self.hangs_on(b, [slots[s] for s in ("left-foot", "right-foot") if s in slots])}

    def joint(self, run, body):
        """Body, its parent, axes of its coordinates, its actuators, and a hinge's range."""
        model = self.model
        joint = model.body_jntadr[body]
        kinds = [int(mujoco.mjtJoint.mjJNT_BALL), int(mujoco.mjtJoint.mjJNT_HINGE)]
        if model.body_jntnum[body] != 1 or model.jnt_type[joint] not in kinds:
            sys.exit(f"{run}: body `{model.body(body).name}` has another joint than one ball or one hinge; train on `humanoid`")
        ball = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL
        axes = np.eye(3) if ball else model.jnt_axis[joint][None]
        actuators = np.flatnonzero(model.actuator_trnid[:, 0] == joint)
        along = model.actuator_gear[actuators][:, :3] if ball else np.ones((1, 1))
        order = np.argmax(np.abs(along), axis=1).argsort()
        return body, model.body_parentid[body], axes, actuators[order], None if ball else model.jnt_range[joint]

    def hangs_on(self, body, names):
        while body > 0:
            if self.model.body(body).name in names:
                return True
            body = self.model.body_parentid[body]
        return False

    def leg(self, slots):
        """Leg length of a character that rests on straight legs."""
        model, data = self.model, mujoco.MjData(self.model)
        mujoco.mj_kinematics(model, data)
        hip = data.xanchor[model.body(slots["left-upper-leg"]).jntadr[0]][2]
        foot = np.flatnonzero(model.geom_bodyid == model.body(slots["left-foot"]).id)
        return hip - min(lowest_of_geom(model, data, geom) for geom in foot)

    def dynamics(self, bodies):
        """Centre of mass, its velocity, angular momentum about it."""
        model = self.model
        mass, arm = model.body_mass[1:, None], rotate(bodies.rotation, model.body_ipos[1:])
        velocity = bodies.linear + np.cross(bodies.angular, arm)
        at = bodies.position + arm
        frame = multiply(bodies.rotation, model.body_iquat[1:])
        spin = rotate(frame, model.body_inertia[1:] * rotate(inverse(frame), bodies.angular))
        com, drift = (mass * at).sum(0) / mass.sum(), (mass * velocity).sum(0) / mass.sum()
        return com, drift, (spin + mass * np.cross(at - com, velocity - drift)).sum(0)

    def relative(self, bodies, body, parent):
        """Joint rotation, and angular velocity against the parent in the body's frame."""
        mine, other = bodies.rotation[body - 1], bodies.rotation[parent - 1]
        turn = multiply(inverse(self.model.body_quat[body]), multiply(inverse(other), mine))
        return turn, rotate(inverse(mine), bodies.angular[body - 1] - bodies.angular[parent - 1])

    def observe(self, bodies, contacts, wanted, wanted_contacts, phase):
        turn, center = inverse(bodies.rotation[0]), bodies.position[0]
        into_root = lambda v: rotate(turn, v)
        com, drift, momentum = self.dynamics(bodies)
        rotations, rates, rotation_errors, rate_errors = [], [], [], []
        for body, parent, axes, _, _ in self.joints:
            (q, rate), (goal, goal_rate) = self.relative(bodies, body, parent), self.relative(wanted, body, parent)
            rotations.extend(axes @ rotation_vector(q))
            rates.extend(axes @ rate)
            rotation_errors.extend(axes @ rotation_vector(multiply(inverse(q), goal)))
            rate_errors.extend(axes @ (goal_rate - rate))
        blocks = [
            center[2:],
            into_root(np.array([0.0, 0.0, 1.0])),
            into_root(bodies.linear[0]),
            into_root(bodies.angular[0]),
            rotations,
            rates,
            *[into_root(bodies.position[key] - center) for key in self.keys],
            into_root(com - center),
            into_root(drift),
            into_root(momentum) / self.momentum_scale,
            contacts,
            rotation_errors,
            rate_errors,
            into_root(wanted.position[0] - center),
            rotation_vector(multiply(turn, wanted.rotation[0])),
            into_root(wanted.linear[0] - bodies.linear[0]),
            into_root(wanted.angular[0] - bodies.angular[0]),
            wanted_contacts,
            [phase, *(f(k * 2 * np.pi * phase) for k in (1, 2) for f in (np.sin, np.cos))],
        ]
        return np.concatenate([np.asarray(block, float) for block in blocks])

    def act(self, observation):
        t = self.tensors
        deviation = np.sqrt(t["normalizer.squares"] / np.maximum(t["normalizer.count"], 1.0))
        x = (observation - t["normalizer.mean"]) / np.maximum(deviation, SMALLEST_DEVIATION)
        x = np.clip(x, -OBSERVATION_LIMIT, OBSERVATION_LIMIT)
        for layer in range(self.layers):
            x = x @ t[f"actor.{layer}.weight"] + t[f"actor.{layer}.bias"]
            x = self.activation(x) if layer + 1 < self.layers else x
        return x

    def targets(self, wanted, action):
        """Control of every actuator: the reference's joint coordinates, ahead by what a drive lags, and the action."""
        model, control, at = self.model, np.zeros(self.model.nu), 0
        for body, parent, axes, actuators, limits in self.joints:
            part = action[at : at + len(axes)] * self.task["actions"]["scale"]
            at += len(axes)
            turn, rate = self.relative(wanted, body, parent)
            joint = model.body_jntadr[body]
            damping = model.dof_damping[model.jnt_dofadr[joint]]
            lag = (damping - model.actuator_biasprm[actuators, 2]) / model.actuator_gainprm[actuators, 0]
            if limits is None:
                control[actuators] = rotation_vector(multiply(turn, quaternion(lag * rate + part)))
            else:
                angle = axes[0] @ rotation_vector(turn) + lag * (axes[0] @ rate) + part
                control[actuators] = np.clip(angle, limits[0] - BEYOND_LIMIT, limits[1] + BEYOND_LIMIT)
        return control

    def contacts(self, data):
        """Bodies that press on the ground."""
        pressed, force = set(), np.zeros(6)
        for number in range(data.ncon):
            mujoco.mj_contactForce(self.model, data, number, force)
            if force[0] > 0.0:
                pressed |= {self.model.geom_bodyid[g] - 1 for g in data.contact[number].geom}
        return pressed - {-1}


def initial(agent, time):
    """MuJoCo in the reference's own state."""
    model, data = agent.model, mujoco.MjData(agent.model)
    bodies = agent.reference.sample(time)[0]
    data.qpos[:3], data.qpos[3:7] = bodies.position[0], bodies.rotation[0]
    data.qvel[:3], data.qvel[3:6] = bodies.linear[0], rotate(inverse(bodies.rotation[0]), bodies.angular[0])
    for body, parent, axes, _, limits in agent.joints:
        turn, rate = agent.relative(bodies, body, parent)
        joint = model.body_jntadr[body]
        q, v = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        data.qpos[q : q + (4 if limits is None else 1)] = turn if limits is None else axes[0] @ rotation_vector(turn)
        data.qvel[v : v + len(axes)] = axes @ rate
    mujoco.mj_forward(model, data)
    return data


def perform(agent, seconds, start, show=None):
    """Seconds survived, mean local body error in metres, and why it ended."""
    reference = agent.reference
    time = begun = start * reference.duration
    data = initial(agent, time)
    touching, errors, servos = list(reference.sample(time)[1]), [], Servos(agent.model)
    end = seconds if reference.loops else min(seconds, reference.duration - begun)
    while time - begun < end - 1e-9:
        wanted, wanted_contacts, phase = reference.sample(time + agent.dt)
        action = agent.act(agent.observe(Bodies.of(agent.model, data), touching, wanted, wanted_contacts, phase))
        data.ctrl[:] = agent.targets(wanted, action)
        goals = servos.goals(data.ctrl)
        for _ in range(SUBSTEPS):
            servos.aim(data, goals)
            mujoco.mj_step(agent.model, data)
        mujoco.mj_forward(agent.model, data)
        time += agent.dt
        if show:
            show(data)
        now, pressed = Bodies.of(agent.model, data).position, agent.contacts(data)
        touching = [body in pressed for body in reference.contact_bodies]
        apart = now - wanted.position
        errors.append(np.linalg.norm(apart - apart[0], axis=1).mean())
        fallen = {body for body in pressed - agent.feet if not reference.may[body]}
        if fallen:
            name = agent.model.body(min(fallen) + 1).name
            return time - begun, np.mean(errors), f"fell on `{name}`"
        if np.linalg.norm(apart, axis=1).mean() > LOST_M:
            return time - begun, np.mean(errors), "lost its reference"
    return time - begun, np.mean(errors), None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--start", type=float, default=0.0, help="share of the motion to start at")
    parser.add_argument("--view", action="store_true", help="watch it in MuJoCo's viewer")
    args = parser.parse_args()
    agent = Agent(args.run)
    show = None
    if args.view:
        import time
        import mujoco.viewer

        window = {}

        def show(data):
            if not window:
                window["viewer"] = mujoco.viewer.launch_passive(agent.model, data)
            window["viewer"].sync()
            time.sleep(agent.dt)

    lasted, error, why = perform(agent, args.seconds, args.start, show)
    print(f"{lasted:.2f} s, local error {1e3 * error:.1f} mm, {why or 'to the end'}")
    sys.exit(1 if why else 0)


if __name__ == "__main__":
    main()
