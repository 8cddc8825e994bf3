"""The hand's path over 20 equal actions for one part controller, as JSON.

`python hand_paths.py [--here]` runs every case with the same config and actions.
"""

import json
import sys

import numpy as np

ARM = [0.4, -0.3, 0.2, 0.1, -0.2, 0.3]
JOINTS = [0.3, -0.2, 0.1, 0.2, -0.3, 0.2, 0.1]
KP, RATIO = [200.0, 120.0, 160.0, 90.0, 250.0, 150.0, 100.0], [0.8, 1.2, 1.0] * 3
STIFF = {"impedance_mode": "variable_kp"}
BOTH = {"impedance_mode": "variable", "damping_ratio_limits": [0, 1.1]}
CASES = {
    "OSC_POSE": (ARM, {}),
    "OSC_POSE one axis": ([0.0, 0.5, 0.0, 0.0, 0.0, 0.0], {}),
    "OSC_POSE world": (ARM, {"input_ref_frame": "world"}),
    "OSC_POSE coupled": (ARM, {"uncouple_pos_ori": False}),
    "OSC_POSE kp 300": (ARM, {"kp": 300, "damping_ratio": 0.7}),
    "OSC_POSE variable_kp": ([*KP[:6], *ARM], STIFF),
    "OSC_POSE variable": ([*RATIO[:6], *KP[:6], *ARM], BOTH),
    "OSC_POSITION": (ARM[:3], {}),
    "OSC_POSITION variable": ([*RATIO[:6], *KP[:6], *ARM[:3]], BOTH),
    "JOINT_POSITION": (JOINTS, {}),
    "JOINT_POSITION variable_kp": ([*KP, *JOINTS], STIFF),
    "JOINT_POSITION variable": ([*RATIO[:7], *KP, *JOINTS], BOTH),
    "JOINT_POSITION kp 120": ([0.3] * 7, {"kp": 120, "output_max": 0.1}),
    "JOINT_POSITION ramp": ([0.3] * 7, {"interpolation": "linear"}),
    "JOINT_TORQUE": (
        [0.5, -0.4, 0.3, 0.4, 0.2, -0.2, 0.1],
        {"output_max": 4.0, "output_min": -4.0},
    ),
}


def path(suite, case):
    """Return the positions of the grip site, shape (21, 3), m."""
    action, changes = CASES[case]
    part = suite.load_part_controller_config(default_controller=case.split()[0])
    part.update(changes)
    if "output_max" in changes:
        part["output_min"] = -changes["output_max"]
    part["gripper"] = {"type": "GRIP"}
    config = suite.load_composite_controller_config(controller="BASIC", robot="Panda")
    config["body_parts"]["right"] = part
    env = suite.make(
        "Lift",
        robots="Panda",
        controller_configs=config,
        initialization_noise=None,
        use_camera_obs=False,
        has_offscreen_renderer=False,
        seed=0,
    )
    env.reset()
    site = env.sim.model.site_name2id("gripper0_right_grip_site")
    found = [env.sim.data.site_xpos[site].copy()]
    for _ in range(20):
        env.step(np.array([*action, 0.0]))
        found.append(env.sim.data.site_xpos[site].copy())
    env.close()
    return np.array(found).tolist()


if __name__ == "__main__":
    if "--here" in sys.argv:
        import wbc_suite.compat.robosuite as here

        here.install_alias()
    import robosuite

    print("FOUND" + json.dumps({case: path(robosuite, case) for case in CASES}))
