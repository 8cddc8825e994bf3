"""The JSON Schemas agree with the models."""

import json

import pytest

from wbc_suite.catalogue import Catalogue
from wbc_suite.config_files import read_toml
from wbc_suite.robot.robot_file import Assembly, Component, robot_schema

CATALOGUE = Catalogue()
FOLDERS = ("robots", "robots/arm", "robots/base", "robots/body", "robots/gripper")
FILES = [path for folder in FOLDERS for path in CATALOGUE.files(folder)]


TYPES = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "number": (int, float),
    "integer": int,
    "null": type(None),
}


def faults(value, schema, definitions, where=""):
    """Check the part of JSON Schema that editors use: keys, types and choices."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].rsplit("/", 1)[1]]
    options = schema.get("anyOf") or schema.get("oneOf")
    if options:
        fitting = [o for o in options if o.get("type") != "null"]  # TOML has no null
        tried = [faults(value, option, definitions, where) for option in fitting]
        return [] if [] in tried else min(tried, key=len)
    if not isinstance(value, TYPES.get(schema.get("type"), object)):
        return [f"{where} is no {schema['type']}"]
    if value != schema.get("const", value):
        return [f"{where} is not {schema['const']}"]
    if value not in schema.get("enum", [value]):
        return [f"{where} is none of {schema['enum']}"]
    if isinstance(value, dict):
        return table_faults(value, schema, definitions, where)
    if isinstance(value, list) and "items" in schema:
        own = schema["items"]
        return [f for v in value for f in faults(v, own, definitions, f"{where}[]")]
    return []


def table_faults(value, schema, definitions, where):
    known = schema.get("properties", {})
    others = schema.get("additionalProperties", True)
    found = [
        f"{where}.{k} missing" for k in schema.get("required", ()) if k not in value
    ]
    for key, item in value.items():
        own = known.get(key, others)
        if own is False:
            found.append(f"{where}.{key} is unknown")
        elif own is not True:
            found += faults(item, own, definitions, f"{where}.{key}")
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_file_of_the_catalogue_fits_its_schema(path):
    data = read_toml(path)
    schema = robot_schema("component" if "component" in data else "assembly")
    assert faults(data, schema, schema["$defs"]) == []


def test_a_typo_does_not_fit():
    data = read_toml(CATALOGUE.find("robots/arm", "panda", kind="arm"))
    data["link"][1]["joint"]["efort"] = 3
    data["link"][1]["joint"]["type"] = "hing"
    schema = robot_schema("component")
    found = faults(data, schema, schema["$defs"])
    assert any("joint.efort is unknown" in fault for fault in found)
    assert any("joint.type is none of" in fault for fault in found)


@pytest.mark.parametrize(
    ("kind", "model"), [("component", Component), ("assembly", Assembly)]
)
def test_schemas_are_json_and_know_every_table(kind, model):
    schema = json.loads(json.dumps(robot_schema(kind)))
    names = {field.alias or name for name, field in model.model_fields.items()}
    assert set(schema["properties"]) == names
    assert "rpy" in schema["$defs"]["Frame"]["properties"]
