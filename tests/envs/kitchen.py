"""A small kitchen as MJCF, written by tests: counter, drawer, door, mug and a robot."""

from pathlib import Path

COUNTER, MIDDLE = 0.9, (2.0, 1.0)  # height and middle of the counter's top, m
DEPTH, WIDTH = 0.6, 1.6  # of the counter, which stands at a wall towards +y

ROBOT = """
    <body name="intruder" pos="-2 0 0">
      <geom type="cylinder" size="0.1 0.2" pos="0 0 0.2"/>
      <body name="link" pos="0 0 0.4">
        <joint name="elbow" type="hinge" axis="0 1 0"/>
        <geom type="capsule" size="0.05 0.2"/>
      </body>
    </body>"""
MOTOR = """
  <actuator><position joint="elbow"/></actuator>
  <sensor><jointpos joint="elbow"/></sensor>"""

SCENE = """<mujoco model="kitchen">
  <compiler angle="degree" meshdir="parts"/>
  <option timestep="0.01" gravity="0 0 -1"/>
  <default><geom friction="0.8 0.005 0.0001"/></default>
  <asset>
    <mesh name="cup" file="cup.obj"/>
    <texture name="wood" type="2d" builtin="checker" rgb1="0.6 0.5 0.4"
             rgb2="0.5 0.4 0.3" width="64" height="64"/>
    <material name="wood" texture="wood"/>
  </asset>
  <worldbody>
    <light pos="0 0 3" dir="0.5 0.2 -1" type="directional" castshadow="true"/>
    <camera name="corner" pos="0.2 -1 2" xyaxes="0.75 -0.66 0 0.3 0.34 0.9"/>
    <geom name="ground" type="plane" size="5 5 0.1" rgba="0.75 0.75 0.7 1"/>
    <geom name="wall" type="box" size="2 0.05 1.2" pos="2 1.35 1.2"
          rgba="0.85 0.85 0.8 1"/>
    <body name="counter" pos="2 1 0">
      <geom name="top" type="box" size="0.8 0.3 0.02" pos="0 0 0.88"
            material="wood"/>
      <geom name="left" type="box" size="0.02 0.28 0.43" pos="-0.78 0 0.43"/>
      <geom type="box" size="0.02 0.28 0.43" pos="0.78 0 0.43"/>
      <body name="drawer" pos="0 0 0.75">
        <joint name="drawer_slide" type="slide" axis="0 -1 0" range="0 0.3"
               damping="2"/>
        <geom type="box" size="0.3 0.25 0.01" pos="0 0 -0.08"/>
        <geom type="box" size="0.3 0.01 0.09" pos="0 -0.29 0"
              rgba="0.8 0.8 0.85 1"/>
      </body>
      <body name="cupboard_door" pos="-0.75 -0.3 0.3">
        <joint name="hinge" type="hinge" axis="0 0 -1" range="0 90" damping="0.5"/>
        <geom type="box" size="0.3 0.01 0.25" pos="0.3 0 0" rgba="0.7 0.4 0.3 1"/>
      </body>
    </body>
    <body name="mug" pos="2.3 0.95 0.95">
      <freejoint/>
      <geom type="mesh" mesh="cup" density="500" rgba="0.2 0.5 0.8 1"/>
    </body>{robot}
  </worldbody>{motor}
</mujoco>
"""


def write_kitchen(folder: Path, *, robot: bool = False, **changes: str) -> Path:
    """Write the scene, with texts replaced, and its mesh; return the file."""
    parts = folder / "parts"
    parts.mkdir(parents=True, exist_ok=True)
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    lines = [f"v {0.03 * x} {0.03 * y} {0.05 * z}" for x, y, z in corners]
    quads = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    lines += [f"f {a} {b} {c}\nf {a} {c} {d}" for a, b, c, d in map(str.split, quads)]
    (parts / "cup.obj").write_text("\n".join(lines))
    text = SCENE.replace("{robot}", ROBOT if robot else "")
    text = text.replace("{motor}", MOTOR if robot else "")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    file = folder / "scene.xml"
    file.write_text(text)
    return file
