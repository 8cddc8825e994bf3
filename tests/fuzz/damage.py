"""Damage to files, seeded: of bytes, of nested values, of XML elements, of HDF5."""

import copy
import json
import math
import re
import struct
import tomllib
import xml.etree.ElementTree as ET
from contextlib import suppress

import h5py
import numpy as np

WORDS = re.compile(rb"(?<=[\s=:,\[(\"'>])-?[\w./-]+")
"""Numbers and names in a text."""
HOSTILE = (
    *(b"1e308", b"-1", b"0", b"nan", b"inf", b"9" * 40, b"9" * 5000, b"true", b"''"),
    *(b"[1, 2]", b"{}", b"[" * 3000, b"{a=" * 3000, b"a." * 3000, b"<a>" * 3000),
    *(b"\x00", b"\xff", "\u202e\U0001f9e8".encode(), b""),
)
NUMBERS = (-1, 0, 2**31 - 1, 2**63 - 1, float("nan"), float("inf"), 1e300)
"""Values in binary files, of four or eight bytes."""
VALUES = (
    *(0, -1, 1e308, -1e308, 10**30, math.nan, math.inf, True, "", "1", "right"),
    *([], {}, [[]], [0.0] * 3, [math.nan] * 6, {"type": "OSC_POSE"}, "x" * 100_000),
)
ENCODINGS = ("utf-16", "utf-32", "latin-1", "gb2312", "utf-7", "cp037", "nonsense")
DEPTH = 5000


def places(node, path=()):
    """List the paths of all values in nested tables and arrays."""
    items = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in items:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))


def parent_of(data, path):
    """Return the table or array that holds the value at a path."""
    for key in path[:-1]:
        data = data[key]
    return data


def dump(value):
    """Write plain data as TOML; inline tables everywhere but at the top."""
    match value:
        case bool():
            return str(value).lower()
        case float():
            return "nan" if np.isnan(value) else repr(value)
        case str():
            escaped = "".join(f"\\U{ord(c):08X}" for c in value)
            return f'"{escaped}"'
        case dict():
            pairs = ", ".join(f"{dump(k)} = {dump(v)}" for k, v in value.items())
            return "{" + pairs + "}"
        case list():
            return "[" + ", ".join(map(dump, value)) + "]"
    return str(value)


class Damage:
    """Damages files; `outside` are names of files that no command may open."""

    def __init__(self, rng, outside):
        self.rng, self.outside = rng, tuple(outside)

    def file(self, path):
        """Damage a file: what it holds, or only its bytes."""
        content = path.read_bytes()
        if self.rng.random() < 0.4:
            path.write_bytes(self.of_bytes(content))
        elif path.suffix in (".hdf5", ".h5"):
            self.of_hdf5(path)
        elif path.suffix in (".xml", ".urdf", ".dae"):
            path.write_bytes(self.of_xml(content.decode()))
        elif path.suffix == ".json":
            path.write_bytes(
                self._encoded(json.dumps(self.of_data(json.loads(content))))
            )
        elif path.suffix == ".toml":
            data = self.of_data(tomllib.loads(content.decode()))
            text = "\n".join(f"{dump(k)} = {dump(v)}" for k, v in data.items())
            path.write_bytes(self._encoded(text))
        else:
            path.write_bytes(self.of_bytes(content))

    def of_bytes(self, content):
        """Change words, numbers, bytes; cut a part out, repeat one, cut the end."""
        rng, content = self.rng, bytearray(content)
        hostile = (*HOSTILE, *(name.encode() for name in self.outside))
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(content) + 1)
            part = rng.randrange(1, 200)
            match rng.choice(
                ["word", "word", "number", "bit", "cut", "repeat", "noise", "end"]
            ):
                case "word" if word := WORDS.search(content, at):
                    content[slice(*word.span())] = rng.choice(hostile)
                case "number" if b"\x00" in content:
                    number = rng.choice(NUMBERS)
                    whole = "<q" if number == 2**63 - 1 else rng.choice(["<i", "<q"])
                    form = "<d" if number == 1e300 else rng.choice(["<f", "<d"])
                    form = whole if isinstance(number, int) else form
                    packed = struct.pack(form, number)
                    content[at & ~3 : (at & ~3) + len(packed)] = packed
                case "bit" if at < len(content):
                    flipped = rng.choice([1 << rng.randrange(8), rng.randrange(256)])
                    content[at] ^= flipped
                case "cut":
                    del content[at : at + part]
                case "repeat":
                    content[at:at] = content[at : at + part] * rng.randint(1, 20)
                case "noise":
                    content[at : at + part] = rng.randbytes(part)
                case "end" if rng.random() < 0.3:
                    del content[at:]
        return bytes(content)

    def of_data(self, data):
        """Replace, rename, remove, repeat, exchange or nest values."""
        rng, data = self.rng, copy.deepcopy(data)
        for _ in range(rng.randint(1, 3)):
            every = list(places(data))
            if not every:
                break
            path = self._place(data, every)
            holder, key = parent_of(data, path), path[-1]
            change = rng.choice(["value", "value", "name", "rename", "remove", "copy"])
            match rng.choice([change, "repeat", "deep"]):
                case "value":
                    holder[key] = copy.deepcopy(rng.choice(VALUES))
                case "name":
                    holder[key] = rng.choice(self.outside)
                case "rename" if isinstance(holder, dict):
                    new = rng.choice([*every, ("",), ("a.b",), ("\u202e",)])[-1]
                    holder[str(new)] = holder.pop(key)
                case "copy":
                    other = rng.choice(every)
                    holder[key] = copy.deepcopy(parent_of(data, other)[other[-1]])
                case "repeat" if isinstance(holder, list):
                    holder[key:key] = holder[key : key + 1] * rng.choice([1, 2, 300])
                case "deep":
                    for _ in range(rng.choice([1, 30, 200])):
                        holder[key] = [holder[key]]
                case _:
                    del holder[key]
        return data

    def _place(self, data, every):
        """Return the path of a value, one in two of those that may name a file."""
        texts = [p for p in every if isinstance(parent_of(data, p)[p[-1]], str)]
        return self.rng.choice(texts if texts and self.rng.random() < 0.5 else every)

    def of_xml(self, text):
        """Remove, repeat, nest or exchange elements, and change their attributes."""
        rng, root = self.rng, ET.fromstring(text)
        for _ in range(rng.randint(1, 3)):
            every = list(root.iter())
            parents = {child: parent for parent in every for child in parent}
            if not parents:
                break
            one = rng.choice(list(parents))
            match rng.choice(
                ["remove", "repeat", "nest", "exchange", "tag", *["attribute"] * 4]
            ):
                case "remove":
                    parents[one].remove(one)
                case "repeat":
                    for _ in range(rng.choice([1, 2, 40])):
                        parents[one].append(copy.deepcopy(one))
                case "nest":
                    rng.choice(every).append(copy.deepcopy(one))
                case "exchange":
                    other = rng.choice(list(parents))
                    one.attrib, other.attrib = other.attrib, one.attrib
                case "tag":
                    one.tag = rng.choice(every).tag
                case _:
                    self._change_attribute(rng.choice(every), every)
        return self._encoded(ET.tostring(root, encoding="unicode"), xml=True)

    def _change_attribute(self, element, every):
        rng = self.rng
        if rng.random() < 0.4:  # of what names a file
            named = [e for e in every if {"file", "filename"} & {*e.attrib}]
            element = rng.choice(named) if named else element
        other = rng.choice(every)
        names = sorted(element.attrib) or sorted(other.attrib) or ["name"]
        name = rng.choice([*names, *(n for n in names if n.startswith("file"))])
        match rng.choice(["text", "file", "file", "other", "add", "remove"]):
            case "text":
                word = rng.choice(HOSTILE[:10]).decode()
                element.set(name, rng.choice([word, f"{word} {word} {word}", "", "x"]))
            case "file":
                element.set(name, rng.choice(self.outside))
            case "other" | "add" if other.attrib:
                key = rng.choice(sorted(other.attrib))
                element.set(name if rng.random() < 0.5 else key, other.attrib[key])
            case _:
                element.attrib.pop(name, None)

    def _encoded(self, text, *, xml=False):
        """Return the bytes of a text, one in eight in an encoding that is not UTF-8."""
        if self.rng.random() > 1 / 8:
            return text.encode()
        encoding = self.rng.choice(ENCODINGS)
        said = f'<?xml version="1.0" encoding="{encoding}"?>\n' if xml else ""
        if encoding == "nonsense":
            return (said + text).encode()
        return (said + text).encode(encoding, errors="replace")

    def of_hdf5(self, path):
        """Change links, attributes, types and shapes in a file."""
        with h5py.File(path, "r+") as file:
            nodes = [file]
            file.visititems(lambda _, node: nodes.append(node))
            for node in self.rng.sample(nodes, min(self.rng.randint(1, 3), len(nodes))):
                with suppress(ValueError, KeyError):  # it was removed with a group
                    self._change_node(file, node)

    def _change_node(self, file, node):
        rng, parent = self.rng, node.parent
        name = node.name.rpartition("/")[2] or "data"
        attributes = sorted(node.attrs)
        kinds = ["dataset", "link", "move", "group"]
        match rng.choice(kinds + ["attribute"] * 4 * bool(attributes)):
            case "attribute":
                self._change_attributes(node, rng.choice(attributes))
            case "dataset" if isinstance(node, h5py.Dataset):
                del parent[name]
                self._add_dataset(parent, name, node)
            case "link":
                outside = rng.choice(self.outside)
                del parent[name]
                parent[name] = rng.choice(
                    [
                        h5py.ExternalLink(outside, rng.choice(["/", "/data"])),
                        h5py.SoftLink(rng.choice(["/", name, "/data", "/nope"])),
                        parent,
                    ]
                )
            case "move":
                parent.move(name, rng.choice(["../x", "demo_99999", "a" * 300, "é"]))
            case _:
                del parent[name]
                if rng.random() < 0.5:
                    parent.create_group(name)

    def _change_attributes(self, node, key):
        rng, value = self.rng, node.attrs[key]
        if isinstance(value, str) and value.startswith("{") and rng.random() < 0.8:
            node.attrs[key] = json.dumps(self.of_data(json.loads(value)))
            return
        del node.attrs[key]
        wrong = [*NUMBERS, "", "x", b"\xff\xfe", np.zeros(3), "[" * 3000]
        wrong += [h5py.Empty("f8"), node.ref, "9" * 5000, rng.choice(self.outside)]
        if rng.random() < 0.8:
            node.attrs[key] = rng.choice(wrong)

    def _add_dataset(self, parent, name, old):
        """Put another dataset in the place of one that is removed."""
        rng, shape = self.rng, old.shape
        match rng.choice(
            ["values", "type", "shape", "large", "raw", "virtual", "text"]
        ):
            case "values":
                value = rng.choice([np.nan, np.inf, 1e300, -1])
                with np.errstate(all="ignore"):
                    parent[name] = np.full(shape, value).astype(old.dtype)
            case "type":
                kinds = ["f2", "i1", "u8", "c16", "S3", "?", [("a", "f8")]]
                parent[name] = np.zeros(shape, rng.choice(kinds))
            case "shape":
                other = rng.choice(
                    [(), (0,), shape[:1], (*shape, 2), shape[::-1], (1, 1)]
                )
                parent[name] = np.zeros(other, old.dtype)
            case "large":
                large = rng.choice([(2**40,), (2**31, 2**20), (10**6, 10**6)])
                parent.create_dataset(name, large, "f8", chunks=True)
            case "raw":
                external = [(rng.choice(self.outside), 0, 8 * math.prod(shape))]
                parent.create_dataset(name, shape, "f8", external=external)
            case "virtual" if 0 not in shape and shape:
                layout = h5py.VirtualLayout(shape, "f8")
                source = h5py.VirtualSource(rng.choice(self.outside), "data", shape)
                layout[...] = source
                parent.create_virtual_dataset(name, layout)
            case _:
                parent.create_dataset(name, data=["demo_0", "é" * 300, ""])
