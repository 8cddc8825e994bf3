"""Links that are left out of the search for contacts could not have touched."""

import mujoco
import numpy as np
import pytest

from wbc_suite.robot import load_robot

FAR = {
    "GR1": {
        ("base_link", "waist_roll_link"),
        ("waist_yaw_link", "left_thigh_roll_link"),
        ("waist_yaw_link", "right_thigh_roll_link"),
        ("torso_link", "head_pitch_link"),
        ("left_upper_arm_pitch_link", "left_upper_arm_yaw_link"),
        ("right_upper_arm_pitch_link", "right_upper_arm_yaw_link"),
        *(
            (f"{side}_{a}_link", f"{side}_{b}_link")
            for side in "RL"
            for a, b in (
                ("index_proximal", "ring_proximal"),
                ("middle_proximal", "pinky_proximal"),
                ("middle_intermediate", "pinky_proximal"),
            )
        ),
    },
    "Tiago": {
        ("torso_lift_link", "head_2_link"),
        ("torso_lift_link", "arm_left_2_link"),
        ("torso_lift_link", "arm_right_2_link"),
        ("arm_left_1_link", "arm_left_3_link"),
        ("arm_right_1_link", "arm_right_3_link"),
    },
}
POSTURES, DISTANCE = 300, 0.01


@pytest.mark.parametrize("name", FAR)
def test_links_left_out_for_speed_stay_a_centimetre_apart(name):
    robot = load_robot(name)
    assert FAR[name] <= set(robot.contacts.exclude)
    model = robot.to_mjspec().compile()
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    geoms = {
        link: np.flatnonzero(
            (model.geom_bodyid == model.body(link).id) & (model.geom_contype > 0)
        )
        for pair in FAR[name]
        for link in pair
    }
    limited = model.jnt_limited.astype(bool)
    where, (low, high) = model.jnt_qposadr[limited], model.jnt_range[limited].T
    for _ in range(POSTURES):  # often at the ends of their ranges
        data.qpos[where] = low + (high - low) * rng.beta(0.5, 0.5, len(where))
        mujoco.mj_kinematics(model, data)
        for pair in FAR[name]:
            for a in geoms[pair[0]]:
                for b in geoms[pair[1]]:
                    gap = mujoco.mj_geomDistance(model, data, a, b, 1.0, None)
                    assert gap > DISTANCE, pair
