"""Put hands where a test wants them."""

import mujoco
import numpy as np

DOWN = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]])
"""R of a hand that looks down, its x axis along the world's."""


def reach(env, arm, position, rotation):
    """Bring a hand somewhere, to within 1 um, from where it is or a place nearby."""
    model, data = env.simulation.model, env.simulation.data
    site = env.benchmark.hands[arm].site
    root = model.body_rootid[model.site_bodyid[site]]
    mine = np.flatnonzero(model.body_rootid[model.dof_bodyid] == root)
    address = model.jnt_qposadr[model.dof_jntid[mine]]
    start, rng = data.qpos[address].copy(), np.random.default_rng(0)
    for attempt in range(20):
        data.qpos[address] = start + rng.normal(0.0, 0.5, len(mine)) * (attempt > 0)
        if _solve(model, data, site, mine, address, position, rotation):
            mujoco.mj_forward(model, data)
            return
    raise AssertionError(f"hand {arm} does not reach {position}")


def _solve(model, data, site, mine, address, position, rotation):
    """Take damped least squares steps; return whether they arrive."""
    low, high = model.jnt_range[model.dof_jntid[mine]].T
    J = np.zeros((6, model.nv))
    quat, error = np.empty(4), np.empty(6)
    for _ in range(100):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSite(model, data, J[:3], J[3:], site)
        turn = rotation @ data.site_xmat[site].reshape(3, 3).T
        mujoco.mju_mat2Quat(quat, turn.ravel())
        mujoco.mju_quat2Vel(error[3:], quat, 1.0)
        error[:3] = position - data.site_xpos[site]
        if np.abs(error).max() < 1e-6:
            return True
        own = J[:, mine]
        step = own.T @ np.linalg.solve(own @ own.T + 1e-3 * np.eye(6), error)
        data.qpos[address] = np.clip(data.qpos[address] + step, low, high)
    return False


def fingers(env, arm, opening):
    """Set how far a Panda's fingers are from the middle of its hand, m."""
    model, data = env.simulation.model, env.simulation.data
    for joint in ("panda_finger_joint1", "panda_finger_joint2"):
        data.joint(f"robot{arm}_{joint}").qpos[0] = opening
    mujoco.mj_forward(model, data)


def act_at_random(env, steps, *, seed=1):
    """Take random actions; all that is seen must stay inside what is declared."""
    env.action_space.seed(seed)
    for _ in range(steps):
        observation, reward, _, _, info = env.step(env.action_space.sample())
        assert "physics_error" not in info
        assert 0.0 <= reward <= 1.0
        assert env.observation_space.contains(observation)
