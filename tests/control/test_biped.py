"""The default whole-body controller on a robot that stands on two feet."""

import numpy as np
from scipy.spatial.transform import Rotation

import wbc_suite


def test_default_controller_keeps_a_biped_on_its_soles():
    """Feet as points carry no torque: GR1, 10 mm ahead of them, then falls in 0.3 s."""
    env = wbc_suite.make(
        "Lift",
        robots="GR1FreeBody",
        controller_configs="WHOLE_BODY_IK",
        initialization_noise=None,
    )
    env.reset(seed=0)
    data, layout = env.unwrapped.simulation.data, env.unwrapped.action_layout
    targets = {s.name: np.zeros(s.stop - s.start) for s in layout.slices}
    for side in ("right", "left"):
        hand = data.site(f"robot0_{side}_tcp")
        turn = Rotation.from_matrix(hand.xmat.reshape(3, 3)).as_rotvec()
        targets[f"{side}_hand"] = np.concatenate([hand.xpos, turn])
    start = data.body("robot0_base_link").xpos.copy()
    for _ in range(20):  # 1 s
        env.step(layout.pack(targets).astype(env.action_space.dtype))
    pelvis = data.body("robot0_base_link")
    np.testing.assert_allclose(pelvis.xpos, start, atol=2e-3)
    assert pelvis.xmat[8] > np.cos(np.radians(0.5))
