"""robosuite's modules and names are importable, and are the same objects."""

import importlib
import subprocess
import sys

import pytest

MODULES = (
    *("robosuite.models", "robosuite.models.robots", "robosuite.models.grippers"),
    *("robosuite.models.bases", "robosuite.models.arenas", "robosuite.models.objects"),
    *(
        "robosuite.models.tasks",
        "robosuite.environments",
        "robosuite.environments.base",
    ),
    *("robosuite.environments.manipulation.manipulation_env", "robosuite.controllers"),
    *("robosuite.controllers.composite", "robosuite.controllers.parts"),
    *("robosuite.robots", "robosuite.wrappers", "robosuite.devices"),
    *("robosuite.utils.transform_utils", "robosuite.utils.camera_utils"),
    *("robosuite.utils.placement_samplers", "robosuite.utils.observables"),
    *("robosuite.utils.mjcf_utils", "robosuite.utils.input_utils"),
    *("robosuite.utils.robot_composition_utils", "robosuite.utils.binding_utils"),
    *("robosuite.renderers", "robosuite.macros"),
    *("robosuite.environments.manipulation.lift", "robosuite.models.objects.primitive"),
    *("robosuite.models.tasks.manipulation_task", "robosuite.utils.sim_utils"),
)

NAMES = (
    ("environments.base", "register_env MujocoEnv make REGISTERED_ENVS"),
    ("environments.manipulation.two_arm_env", "TwoArmEnv"),
    ("environments.manipulation.pick_place", "PickPlace PickPlaceCan"),
    ("models.arenas", "Arena TableArena EmptyArena MultiTableArena"),
    ("models.objects", "BoxObject BallObject CylinderObject CapsuleObject"),
    ("models.objects", "MujocoXMLObject MujocoGeneratedObject MujocoObject"),
    ("models.robots", "Panda Sawyer Baxter GR1 ManipulatorModel create_robot"),
    ("models.grippers", "PandaGripper GripperModel gripper_factory ALL_GRIPPERS"),
    ("models.bases", "RethinkMount OmronMobileBase BASE_MAPPING ALL_BASES"),
    ("robots", "ROBOT_CLASS_MAPPING register_robot_class FixedBaseRobot LeggedRobot"),
    ("controllers.composite.composite_controller", "register_composite_controller"),
    ("wrappers", "GymWrapper Wrapper VisualizationWrapper DataCollectionWrapper"),
    ("wrappers", "DomainRandomizationWrapper DemoSamplerWrapper"),
    ("devices", "Device Keyboard SpaceMouse"),
    ("utils.observables", "Observable sensor create_gaussian_noise_corrupter"),
    ("utils.placement_samplers", "UniformRandomSampler SequentialCompositeSampler"),
    ("utils.mjcf_utils", "CustomMaterial array_to_string xml_path_completion new_geom"),
    ("macros", "IMAGE_CONVENTION SIMULATION_TIMESTEP"),
)


@pytest.mark.parametrize("name", MODULES)
def test_module_imports_through_the_alias(suite, name):
    module = importlib.import_module(name)
    ours = importlib.import_module(f"wbc_suite.compat.{name}")
    assert module is ours
    assert module.__spec__.name.startswith("wbc_suite.")


@pytest.mark.parametrize(("module", "names"), NAMES)
def test_names_are_where_they_were(suite, module, names):
    found = importlib.import_module(f"robosuite.{module}")
    for name in names.split():
        assert getattr(found, name) is not None


@pytest.mark.parametrize(
    ("package", "name"),
    [
        ("wrappers", "GymWrapper"),
        ("controllers", "load_part_controller_config"),
        ("models.objects", "BoxObject"),
        ("environments", "MujocoEnv"),
    ],
)
def test_packages_list_the_names_of_their_modules(suite, package, name):
    names = {}
    exec(f"from robosuite.{package} import *", names)
    assert name in names
    assert name in dir(importlib.import_module(f"robosuite.{package}"))


def test_calls_without_an_effect_take_any_arguments_and_say_why(suite):
    viewer = importlib.import_module("robosuite.renderers").Viewer()
    assert viewer.set_camera(camera_id=0, width=64) is None
    assert viewer.set_camera.__doc__.startswith("Do nothing: ")


def test_statement_imports_need_only_the_alias():
    script = (
        "import sys, wbc_suite.compat.robosuite as r; sys.modules['robosuite'] = r\n"
        "import robosuite as suite\n"
        "import robosuite.utils.transform_utils as T\n"
        "from robosuite.models.arenas.table_arena import TableArena\n"
        "from robosuite.environments.manipulation.lift import Lift\n"
        "import robosuite.models\n"
        "assert suite.environments.REGISTERED_ENVS['Lift'] is Lift\n"
        "assert robosuite.models.arenas.TableArena is TableArena\n"
        "assert list(T.convert_quat([1, 0, 0, 0])) == [0, 0, 0, 1]\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_unknown_modules_are_not_found(suite):
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("robosuite.models.nothing")
    with pytest.raises(AttributeError, match="nothing"):
        suite.nothing  # noqa: B018 - the access is what is tested


def test_the_core_does_not_import_it():
    script = (
        "import sys, wbc_suite; env = wbc_suite.make('Lift'); "
        "found = [n for n in sys.modules if '.compat.robosuite' in n];"
        "assert set(found) <= {'wbc_suite.compat.robosuite', "
        "'wbc_suite.compat.robosuite.alias', 'wbc_suite.compat.robosuite.json_configs'}"
        ", found"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
