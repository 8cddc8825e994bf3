"""`wbc-suite view`: a robot in the browser, with its joints to turn."""

from wbc_suite.cli.options import (
    BaseOption,
    CatalogueOption,
    GripperOption,
    RobotArgument,
    SkinOption,
    chosen,
)
from wbc_suite.cli.serving import HostOption, PortOption, serve_until_interrupted

__all__ = ["view"]


def view(
    robot: RobotArgument,
    gripper: GripperOption = None,
    base: BaseOption = None,
    skin: SkinOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    catalogue: CatalogueOption = None,
) -> None:
    """Look at a robot: joints, frames, collision shapes, centre of mass, inertia."""
    from wbc_suite.robot import load_robot
    from wbc_suite.viewers.robot_page import RobotPage
    from wbc_suite.viewers.site import Site

    description = load_robot(robot, gripper=chosen(gripper), base=base, skin=skin)
    page = RobotPage(description, Site(host, port))
    serve_until_interrupted(page.site, description.title or description.name)
    page.stop()
