"""JSON Schemas of the robot files, with which editors complete and check TOML."""

from typing import Any, Literal

from wbc_suite.robot.component import Assembly, Component

__all__ = ["robot_schema"]

RPY: dict[str, Any] = {
    "type": "array",
    "items": {"type": "number"},
    "minItems": 3,
    "maxItems": 3,
    "title": "Rpy",
    "description": "Roll, pitch, yaw in radians about fixed axes, instead of 'quat'.",
}


def robot_schema(kind: Literal["component", "assembly"]) -> dict[str, Any]:
    """Return the JSON Schema of a robot file.

    It knows names, types, choices and simple bounds; what takes the whole robot to
    judge (references, the tree, physics) is found by `wbc-suite check`.
    """
    model = Component if kind == "component" else Assembly
    schema = model.model_json_schema(by_alias=True)
    if kind == "component":  # one that extends another may take over its links
        schema["required"].remove("link")
    for table in (schema, *schema.get("$defs", {}).values()):
        properties = table.get("properties", {})
        if "quat" in properties:
            properties["rpy"] = RPY
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
