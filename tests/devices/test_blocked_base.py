"""A base that a device drives against something does not throw its arm."""

import numpy as np

import wbc_suite
from wbc_suite.devices import DeviceState, LimbInput, Pipeline, PipelineConfig

RATE = 50.0


def test_a_hand_stays_over_a_base_that_is_driven_into_the_table():
    env = wbc_suite.make(
        "Lift",
        robots="PandaOmron",
        controller_configs="HYBRID_MOBILE_BASE",
        control_freq=RATE,
        horizon=1000,
    )
    env.reset(seed=0)
    pipeline = Pipeline(env, PipelineConfig(ramp=0.0))
    robot, limb = env.unwrapped.simulation.robots[0], pipeline.limbs["right"]
    base, hand = robot.root_pose.translation, limb.port.measure().translation
    still, leads = LimbInput(twist=np.zeros(6)), []
    for k in range(100):
        state = DeviceState(
            time=(k + 1) / RATE,
            limbs={"right": still},
            base=np.array([0.4, 0.0, 0.0]),
        )
        env.step(pipeline.update(state))
        ridden = limb.port.measure().translation - hand
        leads.append(np.linalg.norm(ridden - (robot.root_pose.translation - base)))
    driven = robot.root_pose.translation[0] - base[0]
    assert 0.1 < driven < 0.2, "the table is in the way"
    assert max(leads) < 0.03  # it was 0.39; the rest is the push of a stopped base
    env.close()
