"""Expressions that users of robosuite write on an environment, evaluated by one script.

Run as a script, it prints for each expression the type of the value, and the value, as
JSON: by an interpreter with robosuite, or with `--here` by ours through the alias.
"""

import json
import sys

import numpy as np

EXPRESSIONS = (
    # the simulation
    "env.sim.data.time",
    "env.sim.get_state().time",
    "env.sim.get_state().qpos.ndim",
    "env.sim.get_state().qvel.dtype",
    "env.sim.get_state().flatten()",
    "env.sim.set_state(env.sim.get_state())",
    "env.sim.set_state_from_flattened(env.sim.get_state().flatten())",
    "env.sim.forward()",
    "env.sim.model.get_xml()",
    "env.sim.model.get_joint_qpos_addr('cube_joint0')",
    "env.sim.model.get_joint_qvel_addr('cube_joint0')",
    "env.sim.model.get_joint_qpos_addr('robot0_joint1')",
    "env.sim.model.body_name2id('cube_main')",
    "env.sim.model.site_name2id('gripper0_right_grip_site')",
    "env.sim.model.joint_name2id('robot0_joint1')",
    "env.sim.model.actuator_name2id('robot0_torq_j1')",
    "env.sim.model.camera_name2id('agentview')",
    "env.sim.model.camera_name2id('robot0_eye_in_hand')",
    "env.sim.model.sensor_name2id('gripper0_right_force_ee')",
    "env.sim.model.geom_id2name(0)",
    "env.sim.model.body_names",
    "env.sim.model.opt.timestep",
    "env.sim.model.opt.gravity",
    "env.sim.model.nu",
    "env.sim.data.body_xpos[env.sim.model.body_name2id('cube_main')]",
    "env.sim.data.body_xquat[env.sim.model.body_name2id('cube_main')]",
    "env.sim.data.get_body_xpos('cube_main')",
    "env.sim.data.get_body_xmat('cube_main')",
    "env.sim.data.get_site_xpos('gripper0_right_grip_site')",
    "env.sim.data.get_site_xmat('gripper0_right_grip_site')",
    "env.sim.data.get_joint_qpos('cube_joint0')[:3]",
    "env.sim.data.get_joint_qpos('robot0_joint1')",
    "env.sim.data.get_camera_xpos('agentview')",
    "env.sim.data.get_site_jacp('gripper0_right_grip_site')",
    "env.sim.data.qpos[env.robots[0]._ref_joint_pos_indexes]",
    "env.sim.data.set_joint_qpos('robot0_joint1', 0.0)",
    # robots
    "len(env.robots)",
    "env.robots[0].name",
    "env.robots[0].arms[0]",
    "env.robots[0].dof",
    "env.robots[0].action_dim",
    "env.robots[0].action_limits",
    "env.robots[0]._joint_positions",
    "env.robots[0]._joint_velocities",
    "env.robots[0]._hand_pos",
    "env.robots[0]._hand_quat",
    "env.robots[0]._hand_orn",
    "env.robots[0]._hand_pose",
    "env.robots[0]._hand_vel",
    "env.robots[0]._hand_ang_vel",
    "env.robots[0]._hand_total_velocity",
    "env.robots[0].ee_force",
    "env.robots[0].ee_torque",
    "env.robots[0].eef_site_id",
    "env.robots[0].base_pos",
    "env.robots[0].base_ori",
    "env.robots[0].torque_limits",
    "env.robots[0].is_mobile",
    "env.robots[0].check_q_limits()",
    "env.robots[0].joint_indexes",
    "env.robots[0].init_qpos",
    "env.robots[0].robot_model.naming_prefix",
    "env.robots[0].robot_model.name",
    "env.robots[0].robot_model.eef_name",
    "env.robots[0].robot_model.joints",
    "env.robots[0].robot_model.contact_geoms",
    "env.robots[0].robot_model.root_body",
    "env.robots[0].gripper['right'].dof",
    "env.robots[0].gripper['right'].contact_geoms",
    "env.robots[0].gripper['right'].important_geoms['left_fingerpad']",
    "env.robots[0].gripper['right'].important_geoms['right_finger']",
    "env.robots[0].gripper['right'].important_sites['grip_site']",
    "env.robots[0].gripper['right'].important_sensors['force_ee']",
    "env.robots[0].gripper['right'].joints",
    "env.robots[0].part_controllers['right'].control_dim",
    "env.robots[0].part_controllers['right'].kp",
    "env.robots[0].part_controllers['right'].kd",
    "env.robots[0].part_controllers['right'].control_limits",
    "env.robots[0].part_controllers['right'].ref_pos",
    "env.robots[0].part_controllers['right'].goal_pos",
    "env.robots[0].composite_controller.name",
    "env.robots[0].composite_controller._action_split_indexes",
    "env.robots[0].create_action_vector({'right': [0.1] * 6})",
    "env.robots[0].set_robot_joint_positions(env.robots[0].init_qpos)",
    "env.robots[0].robot_model.actuators",
    "env.robots[0].robot_model.default_gripper",
    "env.robots[0].robot_model.default_base",
    "env.robots[0].robot_model.default_controller_config",
    "type(env.robots[0].gripper['right']).__name__",
    "sorted(env.robots[0].part_controller_config)",
    "env.robots[0].part_controller_config['right']['type']",
    "env.robots[0].part_controller_config['right']['kp']",
    "env.robots[0].part_controllers['right'].output_max",
    "env.robots[0].part_controllers['right'].input_min",
    "env.robots[0].part_controllers['right'].torques",
    # the environment
    "env.camera_names",
    "env.camera_heights",
    "env.num_cameras",
    "env.use_object_obs",
    "env.reward_shaping",
    "env.env_configuration",
    "env.cube_body_id",
    "env.sim.model.body_id2name(env.cube_body_id)",
    "env.sim.model.geom_name2id('cube_g0_vis')",
    "env.sim.model.camera_id2name(env.sim.model.camera_name2id('agentview'))",
    "'robot0_eye_in_hand' in env.sim.model.camera_names",
    "[n for n in env.sim.model.joint_names if n.startswith('robot0')]",
    "sorted({env.sim.model.geom_id2name(g) for c in env.sim.data.contact "
    "for g in (c.geom1, c.geom2)})",
    "env.action_spec",
    "env.action_dim",
    "env.control_freq",
    "env.control_timestep",
    "env.model_timestep",
    "env.cur_time",
    "env.horizon",
    "env.reward_scale",
    "env.reward()",
    "env._check_success()",
    "env._check_grasp(env.robots[0].gripper, env.cube)",
    "env.check_contact(env.cube)",
    "env.check_contact(env.robots[0].gripper['right'], env.cube)",
    "env.get_contacts(env.cube)",
    "env._gripper_to_target(env.robots[0].gripper['right'], 'cube_main', 'body')",
    "env._gripper_to_target(env.robots[0].gripper, env.cube.root_body, 'body', "
    "return_distance=True)",
    "env.cube.root_body",
    "env.observation_spec()",
    "env.active_observables",
    "env.enabled_observables",
    "env.observation_names",
    "env.observation_modalities",
    "env.modify_observable('cube_pos', 'active', True)",
    "env._get_observations()['robot0_gripper_qpos']",
    "env._get_observations()['object-state']",
    "env._get_observations()['agentview_image']",
    "env._get_observations()['agentview_depth']",
    "env._get_observations()['agentview_segmentation_instance']",
)

CUBE = (0.02, -0.01, 0.82, 0.8, 0.0, 0.0, 0.6)
"""Pose of the cube, of which both draw place and size at random: m, w x y z."""


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
    env.sim.data.set_joint_qpos("cube_joint0", CUBE)
    env.sim.data.set_joint_qvel("cube_joint0", np.zeros(6))
    env.sim.forward()
    env._get_observations(force_update=True)
    found = {}
    for expression in EXPRESSIONS:
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
