"""Where a controller's knowledge of its robot comes from: the simulation, or sensors.

Laws read a second MuJoCo state, the believed one. In each step it is written from
readings of encoders and an IMU, with noise and delay, and from an estimate of the root.
"""

from typing import Literal, NamedTuple, TypeAlias

import mujoco
import numpy as np
from pydantic import NonNegativeFloat

from wbc_suite.compiling import compiled, inner, record_type, struct
from wbc_suite.config_files import FrozenModel
from wbc_suite.control.contact.arrays import (
    QpStage,
    WholeBodyDynamics,
    for_plain_python,
)
from wbc_suite.control.ground.rigid_body import rotated, rotation
from wbc_suite.control.memory import Parts
from wbc_suite.locomotion.base_estimator import (
    BaseEstimate,
    EstimatorNoise,
    begin_estimate,
    correct,
    make_base_estimate,
    propagate,
)
from wbc_suite.qp.lie import log3
from wbc_suite.typing import Indices, Matrix, Records, Vector

ROWS = 4096
"""Readings after which the noise repeats."""

_SOLVED = int(QpStage.SOLVED)


class StateSourceConfig(FrozenModel):
    """Where the state of the robot comes from.

    Noise is white, one draw for each physics step.

    Attributes:
        source: `simulation`: pose and twist of the root are MuJoCo's; `estimator`: they
            are estimated from the IMU in the root and the feet that stand.
        delay: Age of all readings, s; rounded to physics steps.
        position_noise: Standard deviation of joint positions, rad.
        velocity_noise: Standard deviation of joint velocities, rad/s.
        gyro_noise: Standard deviation of angular velocities, rad/s.
        acceleration_noise: Standard deviation of the accelerometer, m/s^2.
        seed: Of the noise; an episode begins with the same noise each time.
    """

    source: Literal["simulation", "estimator"] = "simulation"
    delay: NonNegativeFloat = 0.0
    position_noise: NonNegativeFloat = 0.0
    velocity_noise: NonNegativeFloat = 0.0
    gyro_noise: NonNegativeFloat = 0.0
    acceleration_noise: NonNegativeFloat = 0.0
    seed: int = 0

    @property
    def is_exact(self) -> bool:
        """Whether the believed state is MuJoCo's own."""
        return self == StateSourceConfig(seed=self.seed)


STATE = record_type(
    ("estimates", "i8"),  # 1: the root is estimated
    ("delay", "i8"),  # steps
    ("count", "i8"),  # steps since the start
    ("dt", "f8"),  # s
    ("root_qpos", "i8"),  # index of the free root in qpos
    ("root_dof", "i8"),  # and in qvel
)

QPOS, QVEL, FORCE, JOINTS = 0, 7, 13, 16
"""First columns of a reading: pose of the root, its twist, specific force, joints."""


@struct
class StateSource(NamedTuple):
    """Sensors of one robot with n joints and f feet.

    Attributes:
        state: `STATE` record, shape (1,).
        true_qpos: Of the simulation, as all names with `true_`.
        qpos: Of the believed state, as the next four.
        gravity: World axes, m/s^2, shape (3,).
        joint_qpos: Index of each joint in qpos, shape (n,).
        joint_dof: And in qvel, shape (n,).
        noise: Standard deviations of a reading's columns, shape (16 + 2 n,).
        draws: Standard normal numbers, shape (ROWS, 16 + 2 n).
        readings: Ring of the last readings, shape (delay + 1, 16 + 2 n).
        last_v: Linear velocity of the root in the last step, m/s, shape (3,).
        last_R: Its orientation then, shape (3, 3).
        foot: Feet in the axes of the base, m, shape (f, 3).
        stands: Whether each foot stands, shape (f,).
        body: Robot, feet and plan.
        link: Link of each foot, shape (f,).
        estimate: The filter.
    """

    state: Records
    true_qpos: Vector
    true_qvel: Vector
    true_xmat: Matrix
    true_ctrl: Vector
    qpos: Vector
    qvel: Vector
    cvel: Matrix
    site_xpos: Matrix
    site_xmat: Matrix
    gravity: Vector
    joint_qpos: Indices
    joint_dof: Indices
    noise: Vector
    draws: Matrix
    readings: Matrix
    last_v: Vector
    last_R: Matrix
    foot: Matrix
    stands: Indices
    body: WholeBodyDynamics
    link: Indices
    estimate: BaseEstimate


Sources: TypeAlias = tuple[StateSource, ...]
"""One for each robot with sensors."""


def make_state_source(
    config: StateSourceConfig,
    body: WholeBodyDynamics,
    *,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    believed: mujoco.MjData,
) -> StateSource:
    """Return the sensors of a robot; `begin_source` starts them.

    Args:
        config: Their numbers.
        body: The robot.
        model: The scene.
        data: Its state.
        believed: The state that laws read.
    """
    n, feet = len(body.qpos), len(body.site)
    columns, delay = JOINTS + 2 * n, round(config.delay / model.opt.timestep)
    noise = np.zeros(columns)
    noise[QVEL + 3 : QVEL + 6] = config.gyro_noise
    noise[FORCE:JOINTS] = config.acceleration_noise
    noise[JOINTS : JOINTS + n] = config.position_noise
    noise[JOINTS + n :] = config.velocity_noise
    state = np.zeros(1, STATE)
    state["estimates"], state["delay"] = config.source == "estimator", delay
    state["dt"] = model.opt.timestep
    state["root_qpos"], state["root_dof"] = (
        body.state["root_qpos"],
        body.state["root_dof"],
    )
    rng, step = np.random.default_rng(config.seed), np.sqrt(model.opt.timestep)
    assumed = EstimatorNoise(
        acceleration=max(
            EstimatorNoise().acceleration, config.acceleration_noise * step
        ),
        gyro=max(EstimatorNoise().gyro, config.gyro_noise * step),
        foot=max(EstimatorNoise().foot, config.position_noise),
    )
    return StateSource(
        state=state,
        true_qpos=data.qpos,
        true_qvel=data.qvel,
        true_xmat=data.xmat,
        true_ctrl=data.ctrl,
        qpos=believed.qpos,
        qvel=believed.qvel,
        cvel=believed.cvel,
        site_xpos=believed.site_xpos,
        site_xmat=believed.site_xmat,
        gravity=model.opt.gravity,
        joint_qpos=body.qpos,
        joint_dof=body.dofs[6:].copy(),
        noise=noise,
        draws=rng.standard_normal((ROWS, columns)),
        readings=np.zeros((delay + 1, columns)),
        last_v=np.zeros(3),
        last_R=np.eye(3),
        foot=np.zeros((feet, 3)),
        stands=np.zeros(feet, dtype=np.int64),
        body=body,
        link=model.site_bodyid[body.site].astype(np.int64),
        estimate=make_base_estimate(feet, assumed),
    )


def begin_source(source: StateSource, data: mujoco.MjData) -> None:
    """Start from the true state."""
    state = source.state[0]
    state["count"] = 0
    root = data.xmat[int(source.body.state["body"][0])].reshape(3, 3)
    at, dof = int(state["root_qpos"]), int(state["root_dof"])
    source.last_v[:], source.last_R[:] = data.qvel[dof : dof + 3], root
    begin_estimate(source.estimate, data.qpos[at : at + 3], root, source.last_v)


def source_memory(source: StateSource) -> Parts:
    """Return what outlives a step; views."""
    filtered = source.estimate._asdict()
    for name in ("noise", "F", "H", "work"):
        del filtered[name]
    own = source.state["count"], source.readings, source.last_v, source.last_R
    return *own, *filtered.values()


def source_for_plain_python(source: StateSource) -> StateSource:
    """Return the same arrays, with a robot for plain Python."""
    return source._replace(body=for_plain_python(source.body))


@compiled
def read_all_sensors(sources: Sources) -> None:
    """Take the readings of a step; runs after `mj_step1` of the simulation."""
    first = sources[0]
    first.qpos[:], first.qvel[:] = first.true_qpos, first.true_qvel
    for source in sources:
        _read_sensors(source)


@compiled
def use_all_feet(sources: Sources) -> None:
    """Correct estimated roots; runs after `mj_kinematics` of the believed state."""
    for source in sources:
        _use_feet(source)


@inner
def _read_sensors(source: StateSource) -> None:
    """Take a reading, and write the believed joints and the root as predicted.

    Not again where the QP of this step was solved in Python meanwhile.
    """
    state = source.state[0]
    if source.body.state[0].stage == _SOLVED:
        return
    _take_reading(source)
    age = state.count - state.delay
    reading = source.readings[max(age, 0) % source.readings.shape[0]]
    n = source.joint_qpos.shape[0]
    for j in range(n):
        source.qpos[source.joint_qpos[j]] = reading[JOINTS + j]
        source.qvel[source.joint_dof[j]] = reading[JOINTS + n + j]
    root = source.qpos[state.root_qpos : state.root_qpos + 7]
    twist = source.qvel[state.root_dof : state.root_dof + 6]
    root[:] = reading[QPOS : QPOS + 7]
    twist[:] = reading[QVEL : QVEL + 6]
    if state.estimates == 1:
        if age > 0:
            propagate(
                source.estimate,
                reading[FORCE : FORCE + 3],
                reading[QVEL + 3 : QVEL + 6],
                source.gravity,
                state.dt,
            )
        _write_root(source)


@inner
def _use_feet(source: StateSource) -> None:
    """Correct the estimated root by the feet that stand."""
    state, body = source.state[0], source.body
    if body.state[0].stage == _SOLVED:
        return
    if state.estimates == 1:
        for k in range(source.foot.shape[0]):
            _observe_foot(source, k)
        correct(source.estimate, source.foot, source.stands, state.dt)
        _write_root(source)
    state.count += 1


@inner
def _observe_foot(source: StateSource, k: int) -> None:
    """Write where a foot is in the base; a ball rolls on while it stands."""
    body, estimate = source.body, source.estimate
    site, R = body.site[k], estimate.R
    way = source.site_xpos[site] - estimate.p
    if body.is_sole[k] == 1:
        way += rotated(rotation(source.site_xmat, site), body.middle[k])
    else:
        spin = source.cvel[source.link[k]]
        step = -source.state[0].dt * body.middle[k, 2]
        estimate.feet[k, 0] += step * spin[1]
        estimate.feet[k, 1] -= step * spin[0]
    for i in range(3):
        source.foot[k, i] = R[0, i] * way[0] + R[1, i] * way[1] + R[2, i] * way[2]
    source.stands[k] = 1 if body.plan.load[k] > 0.0 else 0


@inner
def _take_reading(source: StateSource) -> None:
    """Write what the sensors read in this step."""
    state, qpos, qvel = source.state[0], source.true_qpos, source.true_qvel
    row = source.readings[state.count % source.readings.shape[0]]
    root, dof, n = state.root_qpos, state.root_dof, source.joint_qpos.shape[0]
    row[QPOS : QPOS + 7] = qpos[root : root + 7]
    row[QVEL : QVEL + 6] = qvel[dof : dof + 6]
    change = np.empty(3)
    for i in range(3):
        rate = (qvel[dof + i] - source.last_v[i]) / state.dt
        change[i] = rate - source.gravity[i]
        source.last_v[i] = qvel[dof + i]
    for i in range(3):
        row[FORCE + i] = (
            source.last_R[0, i] * change[0]
            + source.last_R[1, i] * change[1]
            + source.last_R[2, i] * change[2]
        )
    for j in range(n):
        row[JOINTS + j] = qpos[source.joint_qpos[j]]
        row[JOINTS + n + j] = qvel[source.joint_dof[j]]
    draw = source.draws[state.count % ROWS]
    for i in range(row.shape[0]):
        row[i] += source.noise[i] * draw[i]
    source.last_R[:] = rotation(source.true_xmat, source.body.state[0].body)


@inner
def _write_root(source: StateSource) -> None:
    """Write the estimated root into the believed state; its spin is the gyroscope's."""
    state, estimate = source.state[0], source.estimate
    root, dof, r = state.root_qpos, state.root_dof, np.empty(3)
    angle = log3(estimate.R, r)
    share = np.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    source.qpos[root + 3] = np.cos(0.5 * angle)
    for i in range(3):
        source.qpos[root + i] = estimate.p[i]
        source.qpos[root + 4 + i] = share * r[i]
        source.qvel[dof + i] = estimate.v[i]
    age = max(state.count - state.delay, 0)
    row = source.readings[age % source.readings.shape[0]]
    for i in range(3):
        source.qvel[dof + 3 + i] = row[QVEL + 3 + i] - estimate.gyro_bias[i]
