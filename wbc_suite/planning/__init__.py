"""Motion planning for any `pin.Model`: collision checks, paths, timing, tracking."""

from wbc_suite.planning.collision_checker import (
    Clearance,
    LimitChecker,
    SceneCollisionChecker,
)
from wbc_suite.planning.goal_search import GoalProblem, GoalSearch
from wbc_suite.planning.motion_planner import MotionPlanner, plan_motion
from wbc_suite.planning.rrt_connect import RRTConnect
from wbc_suite.planning.shortcutting import shorten_path, shorten_trajectory
from wbc_suite.planning.time_parameterisation import ProfileGenerator, retrace_scales
from wbc_suite.planning.trajectory import Motion, Segment, TimedState, Trajectory
from wbc_suite.planning.waypoint_tracking import track_waypoints

__all__ = [
    "Clearance",
    "GoalProblem",
    "GoalSearch",
    "LimitChecker",
    "Motion",
    "MotionPlanner",
    "ProfileGenerator",
    "RRTConnect",
    "SceneCollisionChecker",
    "Segment",
    "TimedState",
    "Trajectory",
    "plan_motion",
    "retrace_scales",
    "shorten_path",
    "shorten_trajectory",
    "track_waypoints",
]
