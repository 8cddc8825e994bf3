"""robosuite's own demos and scripts with the import changed to this package.

    python benchmarks/robosuite_demos.py            # all; needs `make bench-peers`
    python benchmarks/robosuite_demos.py demo_control

Scripts are those of the wheel in `.venv-robosuite`. They run in
`.venv-robosuite-demos`, which has this package and what they import beside robosuite,
with `wbc_suite.compat.robosuite` as their module `robosuite`. An operator answers
questions and presses keys; sleeping takes no time; endless loops are stopped after some
steps. Without a display they run under Xvfb.
"""

import json
import os
import runpy
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
PEER = ROOT / ".venv-robosuite"
OURS = ROOT / ".venv-robosuite-demos" / "bin" / "python"


wait = time.sleep


@dataclass(frozen=True)
class Run:
    """How a script is run: arguments, answers on the terminal, steps until the end."""

    arguments: tuple[str, ...] = ()
    answers: str = "\n" * 20
    steps: int = 100
    needs: str = ""  # what keeps it from running here


RUNS = {
    "demo_collect_and_playback_data": Run(
        ("--directory", "{folder}", "--timesteps", "40")
    ),
    "demo_composite_robot": Run(("--robot", "Panda", "--base", "OmronMobileBase")),
    "demo_control": Run(answers="3\n4\n0\n", steps=1000),
    "demo_device_control": Run(),
    "demo_domain_randomization": Run(),
    "demo_gripper_interaction": Run(steps=3000),
    "demo_gripper_selection": Run(steps=2000),
    "demo_gym_functionality": Run(steps=1100),
    "demo_multi_camera": Run(answers="13\n0\n4\n4\n"),
    "demo_random_action": Run(answers="13\n2\n0\n"),
    "demo_renderers": Run(),
    "demo_segmentation": Run(("--video-path", "{folder}/video.mp4")),
    "demo_sensor_corruption": Run(),
    "demo_usd_export": Run(("--robots", "Panda")),
    "demo_video_recording": Run(
        ("--video_path", "{folder}/video.mp4", "--timesteps", "20")
    ),
    "browse_mjcf_model": Run(("--filepath", "{folder}/scene.xml")),
    "check_custom_robot_model": Run(("--robot", "Panda")),
    "collect_human_demonstrations": Run(("--directory", "{folder}")),
    "compile_mjcf_model": Run(("{folder}/scene.xml", "{folder}/compiled.xml")),
    "make_reset_video": Run(("--output", "{folder}/reset.mp4")),
    "playback_demonstrations_from_hdf5": Run(("--folder", "{folder}", "--use-actions")),
    "print_robosuite_info": Run(),
    "print_robot_action_info": Run(("--robots", "Baxter")),
    "render_dataset_with_omniverse": Run(needs="Isaac"),
    "setup_macros": Run(),
    "tune_camera": Run(),
    "tune_joints": Run(),
    "view_robot_initialization": Run(
        ("--robots", "Panda", "Baxter", "GR1", "PandaOmron", "SpotWithArm"), steps=1000
    ),
}


class Enough(SystemExit):
    """The script has run for long enough."""


def main() -> None:
    names = [name for name in sys.argv[1:] if not name.startswith("--")]
    for path in scripts():
        if names and path.stem not in names:
            continue
        outcome, seconds, words = run(path)
        print(f"{path.stem:36} {outcome:9} {seconds:6.1f} s  {words}", flush=True)


def scripts() -> list[Path]:
    """Return the demos and scripts of the wheel."""
    [package] = PEER.glob("lib/python*/site-packages/robosuite")
    found = [*package.glob("demos/*.py"), *package.glob("scripts/**/*.py")]
    return sorted(p for p in found if p.stem != "__init__")


def run(path: Path) -> tuple[str, float, str]:
    """Run one script; return `runs`, `fails` or `left out`, seconds and a remark."""
    how = RUNS.get(path.stem, Run())
    if how.needs:
        return "left out", 0.0, f"needs {how.needs}"
    command = [str(OURS), __file__, "--child", str(path)]
    if "DISPLAY" not in os.environ and shutil.which("xvfb-run"):
        command = ["xvfb-run", "-a", *command]
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            command,
            input=how.answers,
            capture_output=True,
            text=True,
            check=False,
            timeout=600,
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT), "FOLDER": folder},
        )
    seconds = time.perf_counter() - start
    if done.returncode == 0:
        return "runs", seconds, ""
    lines = done.stderr.strip().splitlines()
    if "--verbose" in sys.argv:
        print(done.stdout[-3000:], done.stderr[-5000:])
    return "fails", seconds, lines[-1] if lines else f"code {done.returncode}"


def child(path: Path, how: Run) -> None:
    """Be the script."""
    import wbc_suite.compat.robosuite as robosuite

    folder = os.environ["FOLDER"]
    robosuite.install_alias()
    prepare(robosuite, Path(folder), path.stem)
    operate(robosuite, how.steps)
    time.sleep = lambda seconds: None
    sys.argv = [str(path), *(a.format(folder=folder) for a in how.arguments)]
    try:
        runpy.run_path(str(path), run_name="__main__")
    except Enough:
        print("stopped after enough steps")
    os._exit(0)  # threads of listeners and pages may live on


def prepare(robosuite, folder: Path, name: str) -> None:
    """Write what a script reads: a scene, or a recorded episode."""
    (folder / "scene.xml").write_text(
        "<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody>"
        "</mujoco>"
    )
    if name != "playback_demonstrations_from_hdf5":
        return
    import h5py
    import numpy as np

    made = {"env_name": "Lift", "robots": ["Panda"]}
    env = robosuite.make(**made, use_camera_obs=False)
    env.reset()
    text, states, actions = env.sim.model.get_xml(), [], []
    for _ in range(10):
        states.append(env.sim.get_state().flatten())
        actions.append(np.full(env.action_dim, 0.1))
        env.step(actions[-1])
    with h5py.File(folder / "demo.hdf5", "w") as file:
        demo = file.create_group("data/demo_1")
        demo.attrs["model_file"] = text
        demo["states"], demo["actions"] = states, actions
        file["data"].attrs["env"] = "Lift"
        file["data"].attrs["env_info"] = json.dumps(made)


def operate(robosuite, steps: int) -> None:
    """Press keys, of a keyboard that a script reads, and stop it after some steps."""
    from wbc_suite.compat.robosuite.devices import Keyboard
    from wbc_suite.compat.robosuite.environments.base import MujocoEnv
    from wbc_suite.compat.robosuite.utils.binding_utils import MjSim

    left, read = [steps], Keyboard.get_controller_state
    pressed_at = []

    def counted(step):
        def wrapped(*arguments, **kwargs):
            left[0] -= 1
            if left[0] < 0:
                raise Enough(0)
            return step(*arguments, **kwargs)

        return wrapped

    def pressed(self):
        self.on_press("up")
        if left[0] == steps // 2 and not pressed_at:
            pressed_at.append(left[0])
            self.on_release("space")
            self.on_release("q")
        return read(self)

    MujocoEnv.step, MjSim.step = counted(MujocoEnv.step), counted(MjSim.step)
    Keyboard.get_controller_state = pressed
    threading.Thread(target=_type_on_screen, daemon=True).start()


def _type_on_screen() -> None:
    """Press keys on the display again and again, for listeners and windows."""
    wait(4.0)
    from pynput.keyboard import Controller, Key

    while True:  # a listener may start late
        for key in (Key.up, "1", "r", "w", Key.esc):
            Controller().tap(key)
            wait(0.5)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        child(Path(sys.argv[2]), RUNS.get(Path(sys.argv[2]).stem, Run()))
    else:
        main()
