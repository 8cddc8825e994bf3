"""Names in MJCF lead to the files that MuJoCo opens, and never out of the folder."""

from pathlib import Path

import pytest

from wbc_suite.errors import ConfigError, DescriptionError
from wbc_suite.robot.mjcf_compile import compile_mjcf, compile_text

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
BALL = '<geom size="1"/>'
USED = '<worldbody><body name="b"><geom type="mesh" mesh="m"/></body></worldbody>'


def mesh(name, compiler=""):
    """Return the text of a model with one mesh."""
    asset = f'<asset><mesh name="m" file="{name}"/></asset>'
    return f"<mujoco><compiler {compiler}/>{asset}{USED}</mujoco>"


def attach(file, compiler=""):
    return (
        f'<mujoco><compiler {compiler}/><asset><model name="x" file="{file}"/></asset>'
        '<worldbody><attach model="x" body="b" prefix="p_"/></worldbody></mujoco>'
    )


def include(file, compiler=""):
    return f'<mujoco><compiler {compiler}/><include file="{file}"/></mujoco>'


def named(tag):
    """Return a model in which an element of this tag names a file outside."""
    other = {
        "texture": '<texture name="t" type="2d" file="{}"/>',
        "cube": '<texture name="t" type="cube" fileleft="{}"/>',
        "hfield": '<hfield name="h" size="1 1 1 1" file="{}"/>',
        "skin": '<skin name="s" file="{}"/>',
        "model": '<model name="x" file="{}"/>',
    }
    if tag == "flexcomp":
        inner = '<flexcomp name="f" type="mesh" file="{}"/>'
        return f"<mujoco><worldbody>{inner}</worldbody></mujoco>"
    if tag in ("include", "INCLUDE"):
        return f'<mujoco><{tag} file="{{}}"/></mujoco>'
    return f"<mujoco><asset>{other[tag]}</asset></mujoco>"


@pytest.fixture
def write(tmp_path):
    """Write files below `pkg`, with a secret mesh beside that folder; return x.xml."""
    (tmp_path / "secret.obj").write_text(TETRAHEDRON)
    (tmp_path / "secret.xml").write_text(mesh("secret.obj"))

    def write_files(**files):
        for name, text in files.items():
            file = tmp_path / "pkg" / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        return tmp_path / "pkg/x.xml"

    return write_files


@pytest.mark.parametrize(
    "files",
    {
        "a folder of its compiler": {"x.xml": mesh("m.obj", 'meshdir="in"')},
        "both from assetdir": {"x.xml": mesh("m.obj", 'assetdir="in/"')},
        "the last compiler": {
            "x.xml": include("sub/y.xml", 'meshdir="no"'),
            "sub/y.xml": mesh("m.obj", 'meshdir="in"'),
        },
        "of an included file": {
            "x.xml": include("sub/y.xml", 'meshdir="no"'),
            "sub/y.xml": mesh("../in/m.obj"),
        },
        "an include of an include": {
            "x.xml": include("sub/y.xml"),
            "sub/y.xml": include("z.xml"),
            "sub/z.xml": mesh("../in/m.obj"),
        },
        "of an attached model": {
            "x.xml": attach("sub/y.xml", 'meshdir="no"'),
            "sub/y.xml": mesh("m.obj", 'meshdir="../in"'),
        },
        "without its path": {"x.xml": mesh("../../no/m.obj", 'strippath="true"')},
        "without its path, attached": {
            "x.xml": attach("sub/y.xml", 'strippath="true"'),
            "sub/y.xml": mesh("../../no/m.obj", 'meshdir="../in"'),
        },
        "backward slashes": {"x.xml": mesh("in\\m.obj")},
        "folders that are left again": {"x.xml": mesh("no/../in/./m.obj")},
    }.items(),
    ids=lambda item: item[0],
)
def test_names_lead_where_mujoco_finds_the_file(files, write, tmp_path):
    path = write(**{"in/m.obj": TETRAHEDRON, "m.obj": TETRAHEDRON}, **files[1])
    model, _ = compile_mjcf(path)
    assert model.nmesh == 1


OUT = {
    "of an attached model": {
        "x.xml": attach("sub/y.xml"),
        "sub/y.xml": mesh("../../secret.obj"),
    },
    "by the compiler of an attached model": {
        "x.xml": attach("sub/y.xml"),
        "sub/y.xml": mesh("secret.obj", 'meshdir="../.."'),
    },
    "of a model that an attached one attaches": {
        "x.xml": attach("sub/y.xml"),
        "sub/y.xml": attach("z.xml"),
        "sub/z.xml": mesh("../../secret.obj"),
    },
    "of an included file": {
        "x.xml": include("sub/y.xml"),
        "sub/y.xml": mesh("../../secret.obj"),
    },
    "of an included file of an attached one": {
        "x.xml": attach("sub/y.xml"),
        "sub/y.xml": include("z.xml"),
        "sub/z.xml": mesh("../../secret.obj"),
    },
    "backward slashes": {"x.xml": mesh("..\\secret.obj")},
    "a compiler in an included file": {
        "x.xml": include("sub/y.xml").replace("<include", "<worldbody/><include"),
        "sub/y.xml": mesh("secret.obj", 'meshdir=".."'),
    },
    "a link below a path that MuJoCo reduces": {"x.xml": mesh("up/../link.obj")},
    "a link to a folder": {"x.xml": mesh("up/secret.obj")},
    "a path with empty parts": {"x.xml": mesh("in//../../link.obj")},
    "an attached model outside": {"x.xml": attach("../secret.xml")},
    **{
        f"<{tag}>": {"x.xml": named(tag).format("../secret.obj")}
        for tag in ("texture", "cube", "hfield", "skin", "flexcomp")
    },
    **{
        f"<{tag}>": {"x.xml": named(tag).format("../secret.xml")}
        for tag in ("model", "include", "INCLUDE")
    },
    "what is not there": {"x.xml": mesh("../no.obj")},
}


@pytest.mark.parametrize("files", OUT.items(), ids=lambda item: item[0])
def test_names_never_lead_out_of_the_folder(files, write, tmp_path, monkeypatch):
    path = write(**{"in/m.obj": TETRAHEDRON}, **files[1])
    (path.parent / "up").symlink_to(tmp_path, target_is_directory=True)
    (path.parent / "link.obj").symlink_to(tmp_path / "secret.obj")
    monkeypatch.setattr("mujoco.MjSpec.from_file", None)  # opens nothing
    with pytest.raises(ConfigError, match="lies outside the folder") as raised:
        compile_mjcf(path)
    wider = str(raised.value).partition("--mesh-root ")[2].removesuffix(".")
    assert not wider or Path(wider) in (tmp_path, *tmp_path.parents)


@pytest.mark.parametrize(
    "name", ["a.zip/m.obj", "A.MJZ", "file:/m.obj", "C:\\m.obj", "x.zip"]
)
def test_archives_and_addresses_are_refused(name, write):
    for text in (mesh(name), attach(name), include(name)):
        with pytest.raises(ConfigError, match="no plain file"):
            compile_mjcf(write(**{"x.xml": text}))


CYCLES = {
    "itself": {"x.xml": attach("x.xml")},
    "each other": {"x.xml": attach("y.xml"), "y.xml": attach("x.xml")},
    "an include of itself": {"x.xml": include("y.xml"), "y.xml": include("y.xml")},
    "its includer": {"x.xml": attach("y.xml"), "y.xml": include("x.xml")},
    "a body in itself": {
        "x.xml": '<mujoco><worldbody><body name="b"><attach body="b" prefix="p"/>'
        f"{BALL}</body></worldbody></mujoco>"
    },
}


@pytest.mark.parametrize("files", CYCLES.values(), ids=CYCLES)
def test_cycles_are_refused(files, write, monkeypatch):
    monkeypatch.setattr("mujoco.MjSpec.from_file", None)
    with pytest.raises(ConfigError, match=r"attaches itself|holds itself"):
        compile_mjcf(write(**files))


def doubled(levels):
    """Return bodies of which each copies the one before it twice."""
    bodies = "".join(
        f'<body name="b{k}"><attach body="b{k - 1}" prefix="l{k}"/>'
        f'<attach body="b{k - 1}" prefix="r{k}"/></body>'
        for k in range(1, levels)
    )
    return f'<body name="b0">{BALL}</body>{bodies}'


MANY = {
    "ten models on each of four levels": {
        f"{'xyzuv'[k]}.xml": "<mujoco><asset>"
        + "".join(
            f'<model name="m{i}" file="{"xyzuv"[k + 1]}.xml"/>' for i in range(10)
        )
        + "</asset></mujoco>"
        for k in range(4)
    }
    | {"v.xml": f"<mujoco><worldbody>{BALL}</worldbody></mujoco>"},
    "a model that is attached often": {
        "x.xml": attach("y.xml")
        .replace("<attach", '<replicate count="500"><attach', 1)
        .replace('"p_"/>', '"p_"/></replicate>'),
        "y.xml": f'<mujoco><worldbody><body name="b">{BALL * 50}</body></worldbody>'
        "</mujoco>",
    },
    "an included file that is replicated": {
        "x.xml": '<mujoco><worldbody><replicate count="500"><include file="y.xml"/>'
        "</replicate></worldbody></mujoco>",
        "y.xml": f"<mujoco>{BALL * 50}</mujoco>",
    },
    "bodies that are copied": {
        "x.xml": f"<mujoco><worldbody>{doubled(15)}</worldbody></mujoco>"
    },
    "depth over several files": {
        f"{name}.xml": "<mujoco><worldbody>"
        + '<body name="b">' * 300
        + (f'<include file="{below}.xml"/>' if below else BALL)
        + "</body>" * 300
        + "</worldbody></mujoco>"
        for name, below in (("x", "y"), ("y", ""))
    },
}


@pytest.mark.parametrize("files", MANY.values(), ids=MANY)
def test_what_is_attached_or_included_counts_each_time(files, write, monkeypatch):
    monkeypatch.setattr("mujoco.MjSpec.from_file", None)
    with pytest.raises(ConfigError, match=r"more than 50|at most 20000|deeper than"):
        compile_mjcf(write(**files))


def test_a_few_copies_are_compiled(write):
    text = f"<mujoco><worldbody>{doubled(5)}</worldbody></mujoco>"
    model, _ = compile_mjcf(write(**{"x.xml": text}))
    assert model.ngeom == 2**5 - 1


def test_a_body_that_another_copy_made_is_not_copied(write):
    twice = '<attach body="b0" prefix="p"/><attach body="pb0" prefix="q"/>'
    text = f"<mujoco><worldbody>{doubled(1)}<body>{twice}</body></worldbody></mujoco>"
    with pytest.raises(DescriptionError, match="'pb0', which is no body or frame"):
        compile_mjcf(write(**{"x.xml": text}))


def test_text_that_names_a_file_is_refused():
    text = f"<mujoco><worldbody>{BALL}</worldbody></mujoco>"
    assert compile_text(text, source="a scene").ngeom == 1
    for wrong in (mesh("m.obj"), include("x.xml"), attach("x.xml")):
        with pytest.raises(
            ConfigError, match=r"a scene: <\w+> \(line 1\) names a file"
        ):
            compile_text(wrong, source="a scene")
