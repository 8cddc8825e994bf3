"""Composite controllers; those of the package are registered here."""

from collections.abc import Mapping
from typing import Any

from wbc_suite.control.composite.basic import (
    BasicController,
    check_basic,
    default_basic_config,
)
from wbc_suite.control.composite.hybrid import HybridMobileBase, check_hybrid
from wbc_suite.control.composite.registry import register_composite
from wbc_suite.control.ik.config import (
    default_whole_body_config,
    read_whole_body,
)
from wbc_suite.control.ik.whole_body_ik import WholeBodyIK
from wbc_suite.control.state import RobotState
from wbc_suite.control.walking.config import (
    default_dynamics_config,
    read_dynamics,
)
from wbc_suite.control.walking.whole_body_id import WholeBodyID


def _whole_body_mink_ik(config: Mapping[str, Any], state: RobotState) -> WholeBodyIK:
    from wbc_suite.control.ik.mink_backend import MinkBackend

    return WholeBodyIK(config, state, MinkBackend)


register_composite(
    "BASIC",
    BasicController,
    family="basic",
    default=default_basic_config,
    check=check_basic,
)
register_composite(
    "HYBRID_MOBILE_BASE",
    HybridMobileBase,
    family="basic",
    default=default_basic_config,
    check=check_hybrid,
)
for _name, _build in (
    ("WHOLE_BODY_IK", WholeBodyIK),
    ("WHOLE_BODY_MINK_IK", _whole_body_mink_ik),
):
    register_composite(
        _name,
        _build,
        family="whole_body_ik",
        default=default_whole_body_config,
        check=read_whole_body,
    )
register_composite(
    "WHOLE_BODY_ID",
    WholeBodyID,
    family="whole_body_id",
    default=default_dynamics_config,
    check=read_dynamics,
)
