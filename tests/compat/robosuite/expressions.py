"""Expressions that users of robosuite write on an environment, evaluated by one script.

Run as a script, it prints for each expression the type of the value, and the value, as
JSON: by an interpreter with robosuite, or with `--here` by ours through the alias.
"""

import json
import sys

import numpy as np

# (expression, tolerance): with a tolerance values must agree to it; `None`: types only.
EXPRESSIONS = (
    # the simulation
    ("env.sim.data.time", 1e-9),
    ("env.sim.get_state().time", 1e-9),
    ("env.sim.get_state().qpos.ndim", 0),
    ("env.sim.get_state().qvel.dtype", None),
    ("env.sim.get_state().flatten()", None),
    ("env.sim.set_state(env.sim.get_state())", None),
    ("env.sim.set_state_from_flattened(env.sim.get_state().flatten())", None),
    ("env.sim.forward()", None),
    ("env.sim.model.get_xml()", None),
    ("env.sim.model.get_joint_qpos_addr('cube_joint0')", None),
    ("env.sim.model.get_joint_qvel_addr('cube_joint0')", None),
    ("env.sim.model.get_joint_qpos_addr('robot0_joint1')", None),
    ("env.sim.model.body_name2id('cube_main')", None),
    ("env.sim.model.site_name2id('gripper0_right_grip_site')", None),
    ("env.sim.model.joint_name2id('robot0_joint1')", None),
    ("env.sim.model.actuator_name2id('robot0_torq_j1')", None),
    ("env.sim.model.camera_name2id('agentview')", None),
    ("env.sim.model.camera_name2id('robot0_eye_in_hand')", None),
    ("env.sim.model.sensor_name2id('gripper0_right_force_ee')", None),
    ("env.sim.model.geom_id2name(0)", None),
    ("env.sim.model.body_names", None),
    ("env.sim.model.opt.timestep", 1e-9),
    ("env.sim.model.opt.gravity", 1e-9),
    ("env.sim.model.nu", None),
    ("env.sim.data.body_xpos[env.sim.model.body_name2id('cube_main')]", 0.05),
    ("env.sim.data.body_xquat[env.sim.model.body_name2id('cube_main')]", None),
    ("env.sim.data.get_body_xpos('cube_main')", 0.05),
    ("env.sim.data.get_body_xmat('cube_main')", None),
    ("env.sim.data.get_site_xpos('gripper0_right_grip_site')", 0.02),
    ("env.sim.data.get_site_xmat('gripper0_right_grip_site')", None),
    ("env.sim.data.get_joint_qpos('cube_joint0')[:3]", 0.05),
    ("env.sim.data.get_joint_qpos('robot0_joint1')", 0.01),
    ("env.sim.data.get_camera_xpos('agentview')", None),
    ("env.sim.data.get_site_jacp('gripper0_right_grip_site')", None),
    ("env.sim.data.qpos[env.robots[0]._ref_joint_pos_indexes]", 0.01),
    ("env.sim.data.set_joint_qpos('robot0_joint1', 0.0)", None),
    # robots
    ("len(env.robots)", 0),
    ("env.robots[0].name", 0),
    ("env.robots[0].arms[0]", 0),
    ("env.robots[0].dof", 0),
    ("env.robots[0].action_dim", 0),
    ("env.robots[0].action_limits", 1e-9),
    ("env.robots[0]._joint_positions", 0.01),
    ("env.robots[0]._joint_velocities", 0.02),
    ("env.robots[0]._hand_pos", 1e-5),
    ("env.robots[0]._hand_quat", 1e-5),
    ("env.robots[0]._hand_orn", 1e-5),
    ("env.robots[0]._hand_pose", 1e-5),
    ("env.robots[0]._hand_vel", 0.02),
    ("env.robots[0]._hand_ang_vel", 0.05),
    ("env.robots[0]._hand_total_velocity", 0.05),
    ("env.robots[0].ee_force", 0.02),
    ("env.robots[0].ee_torque", 0.002),
    ("env.robots[0].eef_site_id", None),
    ("env.robots[0].base_pos", None),
    ("env.robots[0].base_ori", 1e-6),
    ("env.robots[0].torque_limits", None),
    ("env.robots[0].is_mobile", 0),
    ("env.robots[0].check_q_limits()", 0),
    ("env.robots[0].joint_indexes", None),
    ("env.robots[0].init_qpos", 0.01),
    ("env.robots[0].robot_model.naming_prefix", 0),
    ("env.robots[0].robot_model.name", 0),
    ("env.robots[0].robot_model.eef_name", 0),
    ("env.robots[0].robot_model.joints", 0),
    ("env.robots[0].robot_model.contact_geoms", None),
    ("env.robots[0].robot_model.root_body", 0),
    ("env.robots[0].gripper['right'].dof", 0),
    ("env.robots[0].gripper['right'].contact_geoms", None),
    ("env.robots[0].gripper['right'].important_geoms['left_fingerpad']", 0),
    ("env.robots[0].gripper['right'].important_geoms['right_finger']", None),
    ("env.robots[0].gripper['right'].important_sites['grip_site']", 0),
    ("env.robots[0].gripper['right'].important_sensors['force_ee']", 0),
    ("env.robots[0].gripper['right'].joints", 0),
    ("env.robots[0].part_controllers['right'].control_dim", 0),
    ("env.robots[0].part_controllers['right'].kp", 1e-6),
    ("env.robots[0].part_controllers['right'].kd", 1e-6),
    ("env.robots[0].part_controllers['right'].control_limits", 1e-9),
    ("env.robots[0].part_controllers['right'].ref_pos", 0.02),
    ("env.robots[0].part_controllers['right'].goal_pos", None),
    ("env.robots[0].composite_controller.name", 0),
    ("env.robots[0].composite_controller._action_split_indexes", 0),
    ("env.robots[0].create_action_vector({'right': [0.1] * 6})", 1e-9),
    ("env.robots[0].set_robot_joint_positions(env.robots[0].init_qpos)", None),
    ("env.robots[0].robot_model.actuators", 0),
    ("env.robots[0].robot_model.default_gripper", 0),
    ("env.robots[0].robot_model.default_base", 0),
    ("env.robots[0].robot_model.default_controller_config", 0),
    ("type(env.robots[0].gripper['right']).__name__", 0),
    ("sorted(env.robots[0].part_controller_config)", 0),
    ("env.robots[0].part_controller_config['right']['type']", 0),
    ("env.robots[0].part_controller_config['right']['kp']", 0),
    ("env.robots[0].part_controllers['right'].output_max", 1e-9),
    ("env.robots[0].part_controllers['right'].input_min", 1e-9),
    ("env.robots[0].part_controllers['right'].torques", 0.005),
    # the environment
    ("env.camera_names", 0),
    ("env.camera_heights", 0),
    ("env.num_cameras", 0),
    ("env.use_object_obs", 0),
    ("env.reward_shaping", 0),
    ("env.env_configuration", 0),
    ("env.cube_body_id", None),
    ("env.sim.model.body_id2name(env.cube_body_id)", 0),
    ("env.sim.model.geom_name2id('cube_g0_vis')", None),
    ("env.sim.model.camera_id2name(env.sim.model.camera_name2id('agentview'))", 0),
    ("'robot0_eye_in_hand' in env.sim.model.camera_names", 0),
    ("[n for n in env.sim.model.joint_names if n.startswith('robot0')]", 0),
    (
        "sorted({env.sim.model.geom_id2name(g) for c in env.sim.data.contact "
        "for g in (c.geom1, c.geom2)})",
        0,
    ),
    ("env.action_spec", 1e-9),
    ("env.action_dim", 0),
    ("env.control_freq", 0),
    ("env.control_timestep", 1e-9),
    ("env.model_timestep", 1e-9),
    ("env.cur_time", 1e-6),
    ("env.horizon", 0),
    ("env.reward_scale", 1e-9),
    ("env.reward()", 1e-6),
    ("env._check_success()", 0),
    ("env._check_grasp(env.robots[0].gripper, env.cube)", 0),
    ("env.check_contact(env.cube)", 0),
    ("env.check_contact(env.robots[0].gripper['right'], env.cube)", 0),
    ("env.get_contacts(env.cube)", 0),
    (
        "env._gripper_to_target(env.robots[0].gripper['right'], 'cube_main', 'body')",
        0.06,
    ),
    (
        "env._gripper_to_target(env.robots[0].gripper, env.cube.root_body, 'body', "
        "return_distance=True)",
        0.06,
    ),
    ("env.cube.root_body", 0),
    ("env.observation_spec()", None),
    ("env.active_observables", None),
    ("env.enabled_observables", None),
    ("env.observation_names", None),
    ("env.observation_modalities", 0),
    ("env.modify_observable('cube_pos', 'active', True)", None),
    ("env._get_observations()['robot0_gripper_qpos']", 0.01),
    ("env._get_observations()['object-state']", None),
    ("env._get_observations()['agentview_image']", None),
    ("env._get_observations()['agentview_depth']", None),
    ("env._get_observations()['agentview_segmentation_instance']", None),
)


def kind_of(value):
    """Return the type of a value: shapes of arrays, keys of dictionaries."""
    if isinstance(value, np.ndarray) and value.ndim:
        return f"array{list(value.shape)}{value.dtype.kind}"
    if isinstance(value, bool | np.bool_):
        return "bool"
    if isinstance(value, int | np.integer):
        return "int"
    if isinstance(value, float | np.floating | np.ndarray):
        return "float"
    if isinstance(value, dict):
        return "dict"
    return type(value).__name__


def plain(value):
    """Return a value as JSON has it, or nothing where that says nothing."""
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return value.tolist() if value.size < 100 else None
    if isinstance(value, set):
        return sorted(map(str, value))
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return value.item()
    return value if isinstance(value, str | int | float | bool) else None


def evaluate(suite):
    """Return type and value of each expression after three actions."""
    env = suite.make(
        "Lift",
        robots="Panda",
        use_camera_obs=True,
        camera_names="agentview",
        camera_heights=24,
        camera_widths=24,
        camera_depths=True,
        camera_segmentations="instance",
        initialization_noise=None,
        horizon=50,
        seed=0,
    )
    env.reset()
    for _ in range(3):
        env.step(np.zeros(env.action_dim))
    found = {}
    for expression, _ in EXPRESSIONS:
        try:
            value = eval(expression, {"env": env, "np": np})
            found[expression] = [kind_of(value), plain(value)]
        except Exception as error:  # noqa: BLE001 - told as the answer
            found[expression] = ["error", f"{type(error).__name__}: {error}"]
    env.close()
    return found


if __name__ == "__main__":
    if "--here" in sys.argv:
        import wbc_suite.compat.robosuite as here

        here.install_alias()
    import robosuite

    print("FOUND" + json.dumps(evaluate(robosuite)))
