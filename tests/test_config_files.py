"""TOML files become frozen models, or errors that name file, key, value and rule."""

from typing import Annotated, Literal

import numpy as np
import pytest
from pydantic import Field, ValidationError

from wbc_suite import config_files
from wbc_suite.config_files import FrozenModel, load_model, parse_model, parse_toml
from wbc_suite.errors import ConfigError, DescriptionError


class Round(FrozenModel):
    shape: Literal["round"]
    radius: float = Field(gt=0.0)


class Square(FrozenModel):
    shape: Literal["square"]
    size: float


class Item(FrozenModel):
    name: str = Field(default="", alias="title")
    mode: Literal["slow", "fast"] = "slow"
    size: float | tuple[float, float] = 1.0
    form: Annotated[Round | Square, Field(discriminator="shape")] | None = None


class File(FrozenModel):
    format: Literal[1]
    items: tuple[Item, ...] = Field(default=(), alias="item")
    table: dict[str, Item] = {}


def message(text, **options):
    with pytest.raises(ConfigError) as caught:
        parse_model(File, parse_toml(text, source="f"), source="f.toml", **options)
    return str(caught.value)


def test_a_file_becomes_a_frozen_model(tmp_path):
    path = tmp_path / "f.toml"
    path.write_text('format = 1\n[[item]]\ntitle = "a"\nsize = [1, 2]\n')
    file = load_model(File, path)
    assert (file.items[0].name, file.items[0].size) == ("a", (1.0, 2.0))
    with pytest.raises(ValidationError, match="frozen"):
        file.format = 1


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "f.toml: missing key 'format'"),
        ("format = 2", "f.toml: key 'format' = 2: must be 1."),
        (
            "format = 1\nitm = 3",
            "f.toml: unknown key 'itm'. Did you mean 'item'? "
            "Known: format, item, table",
        ),
        (
            'format = 1\n[[item]]\n[[item]]\nmode = "fats"',
            "f.toml: key 'item[1].mode' = 'fats': must be 'slow' or 'fast'. "
            "Did you mean 'fast'?",
        ),
        (
            'format = 1\n[[item]]\ntitel = "x"',
            "f.toml: unknown key 'item[0].titel'. Did you mean 'title'? "
            "Known: form, mode, size, title",
        ),
        (
            'format = 1\n[[item]]\nform = { shape = "round", radius = -1 }',
            "f.toml: key 'item[0].form.radius' = -1: must be greater than 0.",
        ),
        (
            'format = 1\n[[item]]\nform = { shape = "square", size = 1, radius = 2 }',
            "f.toml: unknown key 'item[0].form.radius'. Known: shape, size",
        ),
        (
            'format = 1\n[table.a]\nmode = "slo"',
            "f.toml: key 'table.a.mode' = 'slo': must be 'slow' or 'fast'. "
            "Did you mean 'slow'?",
        ),
    ],
)
def test_each_fault_names_key_value_rule_and_nearest_name(text, expected):
    assert message(text) == expected


def test_a_union_without_tag_names_the_key_for_each_type():
    text = message('format = 1\n[[item]]\nsize = "x"')
    assert text.count("key 'item[0].size' = 'x'") == 2


def test_infinities_are_refused():
    assert "finite" in message("format = 1\n[[item]]\nsize = inf")


def test_many_faults_are_counted():
    text = message("format = 1\n" + "".join(f"wrong_{k} = 1\n" for k in range(12)))
    assert text.endswith(" and 4 more")
    assert text.count("unknown key") == 8


def test_the_class_of_the_error_can_be_chosen():
    with pytest.raises(DescriptionError):
        parse_model(File, {}, source="f", error=DescriptionError)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a = ", "f: not a readable TOML file"),
        ("a = " + "9" * 5000, "f: not a readable TOML file"),
        ("a = " + "[" * 100_000, "nested too deeply|not a readable TOML"),
    ],
)
def test_text_that_is_not_toml_is_refused(text, expected):
    with pytest.raises(ConfigError, match=expected):
        parse_toml(text, source="f")


def test_files_that_cannot_be_read_are_named(tmp_path):
    path = tmp_path / "f.toml"
    with pytest.raises(ConfigError, match=r"f\.toml: cannot be read \(No such file"):
        load_model(File, path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match=r"f\.toml: is not text in UTF-8"):
        load_model(File, path)


LINES = """format = 1
[[item]]
title = "a"
[[item]]
# [[item]]
title = "b"
siz = 3
[item.form]
shape = "round"
radius = -1.0
[table.x]
mode = "slwo"
"quoted" = 3
"""


def test_every_fault_has_its_line(tmp_path):
    path = tmp_path / "f.toml"
    path.write_text(LINES)
    with pytest.raises(ConfigError) as caught:
        load_model(File, path)
    text = str(caught.value)
    assert "unknown key 'item[1].siz' (line 7). Did you mean 'size'?" in text
    assert "key 'item[1].form.radius' = -1.0 (line 10): " in text
    assert "'table.x.mode' = 'slwo' (line 12): " in text
    assert "Did you mean 'slow'?" in text
    assert "unknown key 'table.x.quoted' (line 13)" in text


def test_a_key_that_is_missing_has_the_line_of_its_table(tmp_path):
    path = tmp_path / "f.toml"
    path.write_text('format = 1\n\n[table.x.form]\nshape = "square"\n')
    with pytest.raises(
        ConfigError, match=r"missing key 'table.x.form.size' \(line 3\)"
    ):
        load_model(File, path)


@pytest.mark.parametrize(
    "text",
    [
        ".".join(["a"] * 20_000) + " = 1",
        "[" + " . ".join(["a"] * 10_000) + "]",
        ".".join(['"a b"'] * 5_000) + " = 1",
    ],
)
def test_a_key_of_many_parts_is_refused_before_it_is_parsed(text, monkeypatch):
    """tomllib takes a time that is quadratic in the parts."""
    monkeypatch.setattr(
        config_files.tomllib, "loads", lambda _: pytest.fail("is parsed")
    )
    with pytest.raises(ConfigError, match="30 parts"):
        parse_toml(text, source="f")


@pytest.mark.parametrize(
    "text", ["\n".join(f"k{i} = 1" for i in range(4_000)), "a" * 40_000 + " = 1"]
)
def test_few_of_many_unknown_keys_are_explained(text, tmp_path, monkeypatch):
    path, explain, explained = tmp_path / "f.toml", config_files._explain, []
    path.write_text(text)
    monkeypatch.setattr(
        config_files, "_explain", lambda *a: explained.append(1) or explain(*a)
    )
    with pytest.raises(ConfigError, match="unknown key"):
        load_model(File, path)
    assert len(explained) <= config_files.SHOWN


def test_dotted_keys_of_a_usual_depth_are_read():
    key = ".".join(["a"] * 20)
    text = f"{key} = 1\n# {'.'.join(['b'] * 25)}\n"
    assert list(parse_toml(text, source="f")) == ["a"]


class Numbers(FrozenModel):
    real: float = 0.0
    whole: int = 0
    truth: bool = False
    pair: tuple[float, int] = (0.0, 0)
    either: float | tuple[float, float] | None = None


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(("real", v) for v in ("1", True, [1.0])),
        *(("whole", v) for v in ("1", True, 1.5, np.True_)),
        *(("truth", v) for v in ("true", 1, 0.0, "yes")),
        *(("pair", v) for v in (["1", 2], [1, "2"], [True, 2])),
        *(("either", v) for v in ("1", True, ["1", 2])),
    ],
)
def test_nothing_is_converted_to_a_number(key, value):
    with pytest.raises(ConfigError, match=rf"key '{key}(\[\d\])?' = "):
        parse_model(Numbers, {key: value}, source="f")
    with pytest.raises(ValidationError):
        Numbers(**{key: value})


def test_numbers_of_numpy_and_whole_ones_are_numbers():
    data = {"real": np.float32(2.0), "whole": np.int64(3), "truth": np.True_}
    found = parse_model(Numbers, data | {"pair": [1, 2.0]}, source="f")
    assert found == Numbers(real=2.0, whole=3, truth=True, pair=(1.0, 2))
    assert parse_model(Numbers, {"either": 1}, source="f").either == 1.0
