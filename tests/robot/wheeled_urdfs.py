"""Small URDFs of robots on wheels, and of what turns without being a wheel."""

from collections.abc import Iterable

INERTIA = '<inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/>'


def link(name: str, mass: float, shape: str = "", xyz: str = "0 0 0", rpy="0 0 0"):
    """Return a link with one shape and about its inertia."""
    pose = f'<origin xyz="{xyz}" rpy="{rpy}"/>'
    solid = "".join(
        f"<{use}>{pose}<geometry>{shape}</geometry></{use}>"
        for use in ("visual", "collision")
        if shape
    )
    body = ""
    if mass:
        inertia = INERTIA.format(i=mass * 0.004)
        body = f'<inertial>{pose}<mass value="{mass}"/>{inertia}</inertial>'
    return f'<link name="{name}">{body}{solid}</link>'


def joint(
    name: str,
    parent: str,
    child: str,
    xyz: str,
    *,
    axis: str = "0 1 0",
    kind: str = "continuous",
    rpy: str = "0 0 0",
    limit: str = "",
):
    """Return a joint."""
    limits = f"<limit {limit}/>" if limit else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/>'
        f'<child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/>'
        f'<axis xyz="{axis}"/>{limits}</joint>'
    )


def robot(name: str, *parts: str) -> str:
    """Return a URDF."""
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def box(x: float, y: float, z: float) -> str:
    """Return a box of these edges, m."""
    return f'<box size="{x} {y} {z}"/>'


def drum(radius: float, width: float) -> str:
    """Return a cylinder along z."""
    return f'<cylinder radius="{radius}" length="{width}"/>'


ALONG_Y = "1.5708 0 0"


def wheel(name: str, xyz: str, *, parent: str = "base", radius=0.08, yaw=0.0, w=0.04):
    """Return a wheel about y, turned by `yaw` about z, with its joint."""
    return link(name, 0.5, drum(radius, w), rpy=ALONG_Y) + joint(
        f"{name}_joint", parent, name, xyz, rpy=f"0 0 {yaw}"
    )


def caster(name: str, xyz: str, radius: float = 0.03) -> str:
    """Return a swivel with a wheel that trails behind it, on a base at radius 0.08."""
    x, y = xyz.split()
    return (
        link(f"{name}_fork", 0.1)
        + joint(f"{name}_swivel", "base", f"{name}_fork", f"{x} {y} 0", axis="0 0 1")
        + link(f"{name}_roll", 0.1, drum(radius, 0.02), rpy=ALONG_Y)
        + joint(
            f"{name}_roll_j", f"{name}_fork", f"{name}_roll", f"-0.03 0 {radius - 0.08}"
        )
    )


def differential(x: float = 0.0) -> str:
    """Return two wheels on an axle x m ahead of the base's frame, and two casters."""
    return robot(
        "two_wheeler",
        link("base", 10.0, box(0.4, 0.3, 0.1), "0 0 0.1"),
        wheel("left", f"{x} 0.2 0"),
        wheel("right", f"{x} -0.2 0"),
        caster("front", "0.15 0"),
        caster("back", "-0.15 0"),
    )


def four(name: str, *, names: Iterable[str] = ("fl", "fr", "rl", "rr")) -> str:
    """Return four parallel wheels."""
    places = ("0.2 0.25 0", "0.2 -0.25 0", "-0.2 0.25 0", "-0.2 -0.25 0")
    wheels = [wheel(n, xyz) for n, xyz in zip(names, places, strict=True)]
    return robot(name, link("base", 20.0, box(0.5, 0.4, 0.1), "0 0 0.1"), *wheels)


def omni(count: int = 3) -> str:
    """Return wheels that roll along a circle."""
    from math import cos, pi, sin

    wheels = []
    for k in range(count):
        a = 2.0 * pi * k / count
        xyz = f"{0.2 * cos(a):.6f} {0.2 * sin(a):.6f} 0"
        wheels.append(wheel(f"w{k}", xyz, yaw=a - pi / 2.0))
    return robot("omni", link("base", 8.0, drum(0.15, 0.06), "0 0 0.1"), *wheels)


def car() -> str:
    """Return two steered wheels ahead of two others; the base's frame is between."""
    limit = 'lower="-0.6" upper="0.6" effort="20" velocity="5"'
    parts = [link("base", 15.0, box(0.5, 0.3, 0.1), "0 0 0.1")]
    for side, y in (("left", 0.2), ("right", -0.2)):
        parts += [
            link(f"{side}_hinge", 0.3),
            joint(
                f"{side}_steer",
                "base",
                f"{side}_hinge",
                f"0.2 {y} 0",
                axis="0 0 1",
                kind="revolute",
                limit=limit,
            ),
            wheel(f"front_{side}", "0 0 0", parent=f"{side}_hinge"),
            wheel(f"rear_{side}", f"-0.2 {y} 0"),
        ]
    return robot("car", *parts)


def quadruped() -> str:
    """Return a trunk on four legs of three joints that end in wheels."""
    parts = [link("trunk", 12.0, box(0.5, 0.2, 0.12))]
    for end, x in (("front", 0.2), ("rear", -0.2)):
        for side, y in (("left", 0.12), ("right", -0.12)):
            n, out = f"{end}_{side}", 0.06 if y > 0 else -0.06
            hip = 'lower="-0.8" upper="0.8" effort="40" velocity="20"'
            thigh = 'lower="-1.5" upper="3.0" effort="40" velocity="20"'
            calf = 'lower="-2.7" upper="-0.5" effort="60" velocity="20"'
            parts += [
                link(f"{n}_hip", 0.5, '<sphere radius="0.04"/>'),
                joint(
                    f"{n}_hip_joint",
                    "trunk",
                    f"{n}_hip",
                    f"{x} {y} 0",
                    axis="1 0 0",
                    kind="revolute",
                    limit=hip,
                ),
                link(f"{n}_thigh", 0.8, box(0.04, 0.03, 0.2), "0 0 -0.1"),
                joint(
                    f"{n}_thigh_joint",
                    f"{n}_hip",
                    f"{n}_thigh",
                    f"0 {out} 0",
                    kind="revolute",
                    limit=thigh,
                ),
                link(f"{n}_calf", 0.3, box(0.03, 0.02, 0.2), "0 0 -0.1"),
                joint(
                    f"{n}_calf_joint",
                    f"{n}_thigh",
                    f"{n}_calf",
                    "0 0 -0.22",
                    kind="revolute",
                    limit=calf,
                ),
                link(f"{n}_disc", 0.5, drum(0.07, 0.03), rpy=ALONG_Y),
                joint(f"{n}_disc_joint", f"{n}_calf", f"{n}_disc", "0 0 -0.22"),
            ]
    return robot("roller_dog", *parts)


def _arm() -> str:
    parts = [link("base", 5.0, box(0.2, 0.2, 0.1), "0 0 0.05")]
    above, z = "base", 0.12
    for k, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "0 0 1")):
        rpy = ALONG_Y if axis == "0 1 0" else "0 0 0"
        parts += [
            link(f"part{k}", 1.0, drum(0.05, 0.1), rpy=rpy),
            joint(f"turn{k}", above, f"part{k}", f"0 0 {z}", axis=axis),
        ]
        above, z = f"part{k}", 0.15
    return robot("endless_arm", *parts)


def _gripper() -> str:
    parts = [link("palm", 1.0, box(0.1, 0.1, 0.04))]
    for side, y in (("left", 0.04), ("right", -0.04)):
        limit = 'lower="0" upper="0.03" effort="10" velocity="1"'
        parts += [
            link(f"{side}_finger", 0.1, box(0.02, 0.01, 0.08), "0 0 -0.06"),
            joint(
                f"{side}_slide",
                "palm",
                f"{side}_finger",
                f"0 {y} 0",
                kind="prismatic",
                limit=limit,
            ),
            link(f"{side}_roller", 0.05, drum(0.015, 0.02), rpy="0 1.5708 0"),
            joint(
                f"{side}_spin",
                f"{side}_finger",
                f"{side}_roller",
                "0 0 -0.11",
                axis="1 0 0",
            ),
        ]
    return robot("roller_gripper", *parts)


NO_WHEELS = {
    "arm": _arm(),
    "gripper": _gripper(),
    "turntable": robot(
        "turntable",
        link("base", 5.0, box(0.3, 0.3, 0.1), "0 0 0.05"),
        link("plate", 2.0, drum(0.2, 0.02)),
        joint("spin", "base", "plate", "0 0 0.11", axis="0 0 1"),
    ),
    "drone": robot(
        "drone",
        link("body", 1.0, box(0.2, 0.2, 0.05)),
        *(
            link(f"rotor{k}", 0.05, drum(0.1, 0.01))
            + joint(f"spin{k}", "body", f"rotor{k}", xyz, axis="0 0 1")
            for k, xyz in enumerate(
                ("0.2 0.2 0", "0.2 -0.2 0", "-0.2 0.2 0", "-0.2 -0.2 0")
            )
        ),
    ),
    "lidar": robot(
        "scanner",
        link("base", 5.0, box(0.3, 0.3, 0.2), "0 0 0.1"),
        link("head", 0.3, drum(0.05, 0.05), rpy=ALONG_Y),
        joint("scan", "base", "head", "0 0 0.3"),
    ),
    "square wheels": four("cart").replace(drum(0.08, 0.04), box(0.13, 0.13, 0.04)),
    "a cart that is not on its wheels": four("cart").replace('0 0 0.1"', '0 0 -0.1"'),
}
