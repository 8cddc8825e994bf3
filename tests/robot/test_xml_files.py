"""XML is read in any encoding that Python knows, or refused in words."""

import codecs

import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.robot import load_robot
from wbc_suite.robot.mjcf_compile import compile_mjcf
from wbc_suite.robot.xml_files import at_line, read_xml

TEXT = '<robot name="{}"><link name="base"/></robot>'
NAMES = {
    "gb2312": "机器人",
    "GB18030": "机器人",
    "big5": "機器人",
    "shift_jis": "ロボット",
    "iso-2022-jp": "ロボット",
    "euc-kr": "로봇",
    "windows-1251": "робот",
    "ISO-8859-15": "Rœboter",
    "us-ascii": "robot",
    "UTF-8": "Röböter",
    "utf-7": "Röböter",
}


@pytest.mark.parametrize("encoding", NAMES)
def test_the_declared_encoding_is_read(encoding, tmp_path):
    path = tmp_path / "x.urdf"
    text = f'<?xml version="1.0" encoding="{encoding}"?>\n' + TEXT
    path.write_bytes(text.format(NAMES[encoding]).encode(encoding))
    assert read_xml(path).get("name") == NAMES[encoding]
    assert load_robot(path).links[0].name == "base"


@pytest.mark.parametrize(
    "data",
    [
        codecs.BOM_UTF8 + TEXT.format("ö").encode(),
        codecs.BOM_UTF16_LE + TEXT.format("ö").encode("utf-16-le"),
        codecs.BOM_UTF16_BE + TEXT.format("ö").encode("utf-16-be"),
        TEXT.format("ö").encode("utf-16-le"),
        TEXT.format("ö").encode("utf-16-be"),
    ],
)
def test_the_first_bytes_may_show_the_encoding(data, tmp_path):
    path = tmp_path / "x.urdf"
    path.write_bytes(data)
    assert read_xml(path).get("name") == "ö"


@pytest.mark.parametrize(
    ("encoding", "content", "reason"),
    [
        ("klingon", b"", "declares the encoding 'klingon', which is unknown"),
        ("rot13", b"", "'rot13', which is unknown"),
        ("punycode", b"", "'punycode', which is unknown"),
        ("idna", b"", "'idna', which is unknown"),
        ("hex", b"", "'hex', which is unknown"),
        ("utf-8", b"\xff", "cannot be read as 'utf-8', the encoding that it declares"),
        ("gb2312", b"\xff", "cannot be read as 'gb2312'"),
        ("utf-16", b"", "cannot be read as 'utf-16', .* another one"),
        ("undefined", b"", "cannot be read as 'undefined'"),
        ("utf-7", b"+2AA-", "cannot be read as 'utf-7'"),  # half a character
    ],
)
def test_what_cannot_be_decoded_says_so(encoding, content, reason, tmp_path):
    path = tmp_path / "x.urdf"
    start = f'<?xml version="1.0" encoding="{encoding}"?>'.encode()
    path.write_bytes(start + b"<robot>" + content + b"</robot>")
    with pytest.raises(ConfigError, match=rf"x\.urdf: it {reason}|x\.urdf.*{reason}"):
        load_robot(path)


def test_a_name_of_the_default_encoding_is_not_called_declared(tmp_path):
    path = tmp_path / "x.urdf"
    path.write_bytes(b"<robot>\xff</robot>")
    with pytest.raises(ConfigError, match="'utf-8', the encoding that it has by def"):
        load_robot(path)


def test_mujoco_gets_only_what_reads_the_same_in_utf8(tmp_path):
    path = tmp_path / "x.xml"
    start = '<?xml version="1.0" encoding="iso-2022-jp"?>'
    body = '<mujoco><worldbody><body name="{}"/></worldbody></mujoco>'
    path.write_bytes((start + body.format("a")).encode("ascii"))
    assert compile_mjcf(path)[0].nbody == 2
    path.write_bytes((start + body.format("口")).encode("iso-2022-jp"))
    with pytest.raises(ConfigError, match=r"x\.xml: it is not in UTF-8, as MuJoCo"):
        compile_mjcf(path)


def test_elements_know_their_line(tmp_path):
    path = tmp_path / "x.urdf"
    path.write_text('\n\n<robot>\n<link\n name="a"/><link/>\n</robot>')
    lines = [at_line(element) for element in read_xml(path).iter()]
    assert lines == [" (line 3)", " (line 4)", " (line 5)"]
    path.write_text("\n<robot>\n<link>\n</robot>")
    with pytest.raises(ConfigError, match=r"mismatched tag \(line 4\)"):
        read_xml(path)
