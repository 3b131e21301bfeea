"""Read a user's MJCF or URDF: checked before MuJoCo sees it, with the lines of what is wrong."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Final, NamedTuple
from xml.etree import ElementTree as ET
from xml.parsers import expat

import mujoco

from naoserver.errors import RobotError

LARGEST_FILE: Final = 10 << 20
"""Largest size of a model's file in bytes; of all its meshes and textures together, ten times that."""
MOST_ELEMENTS: Final = 50_000
_NUMBERS: Final = re.compile(r"[-+\d.eE\s]*(?:[-+]?(?:nan|inf|infinity)\b[-+\d.eE\s]*)+", re.IGNORECASE)
_TREE: Final = ("body", "joint", "link", "geom", "site", "camera")
"""Elements whose names are unique within a model."""
_MESHES: Final = (".stl", ".obj", ".msh")
"""The formats of meshes that MuJoCo reads."""
_KEEP_ALL: Final = '<mujoco><compiler fusestatic="false" discardvisual="false"/></mujoco>'


class Element(NamedTuple):
    """An element of the file, with its line."""

    tag: str
    line: int
    path: tuple[str, ...]
    """The tags of the elements around it, the outermost first."""
    attributes: Mapping[str, str]


@dataclass
class ModelFile:
    """A model that MuJoCo has read, and what MuJoCo does not keep of it."""

    spec: mujoco.MjSpec
    speeds: Mapping[str, float] = field(default_factory=dict)
    """The highest speed of each joint that names one, in rad/s or m/s: only a URDF does."""
    missing: tuple[str, ...] = ()
    """The meshes that are not there, or that MuJoCo cannot read; their shapes are left out."""


def read_model(path: Path, meshes: Path) -> ModelFile:
    """Return the model of an MJCF or URDF; `meshes` is the folder of its meshes.

    Nothing in it is executed or fetched, and only files in the folders of the model and of its meshes are
    read. Raises RobotError, with file and line, for a file that is too large or malformed, has names twice,
    links in a circle or numbers that are not finite.
    """
    text = _text(path)
    elements = list(_elements(text, path))
    root = elements[0].tag
    if root not in ("mujoco", "robot"):
        raise RobotError(f"{path}: its root is <{root}>; an MJCF begins with <mujoco>, a URDF with <robot>")
    _require_finite(elements, path)
    _require_distinct(elements, path)
    if root == "robot":
        _require_tree(elements, path)
    present, missing = _files(elements, path.parent, meshes)
    if missing:
        text = _without(text, missing)
    try:
        if root == "robot":
            text = re.sub(r"(<robot\b[^>]*>)", rf"\1{_KEEP_ALL}", text, count=1)
        spec = mujoco.MjSpec.from_string(text, assets=present)
    except (ValueError, mujoco.FatalError) as problem:
        raise RobotError(f"{path}: {' '.join(str(problem).split())}") from None
    return ModelFile(spec, _speeds(elements), tuple(missing))


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as problem:
        raise RobotError(f"{path}: cannot be read: {problem.strerror}") from None
    if len(content) > LARGEST_FILE:
        raise RobotError(f"{path}: larger than {LARGEST_FILE >> 20} MB")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise RobotError(f"{path}: not UTF-8 text") from None


def _elements(text: str, path: Path) -> Iterator[Element]:
    """Yield the elements of an XML text in order. Raises RobotError when it is malformed or too large."""
    found: list[Element] = []
    around: list[str] = []
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        if len(found) >= MOST_ELEMENTS:
            raise RobotError(f"{path}: more than {MOST_ELEMENTS} elements")
        found.append(Element(tag, parser.CurrentLineNumber, tuple(around), attributes))
        around.append(tag)

    def declare(*_: object) -> None:
        raise RobotError(f"{path}:{parser.CurrentLineNumber}: a document type, which a model does not need")

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda _: around.pop()
    parser.StartDoctypeDeclHandler = declare
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError as problem:
        raise RobotError(f"{path}:{problem.lineno}: not XML: {expat.ErrorString(problem.code)}") from None
    yield from found


def _require_finite(elements: list[Element], path: Path) -> None:
    for element in elements:
        for name, value in element.attributes.items():
            if name != "name" and _NUMBERS.fullmatch(value):
                at = f"{path}:{element.line}"
                raise RobotError(f"{at}: {name} of <{element.tag}> is {value[:60]!r}: it must be finite")


def _require_distinct(elements: list[Element], path: Path) -> None:
    """Raise RobotError when two parts of the tree of links have one name."""
    seen: dict[tuple[str, str], int] = {}
    for element in elements:
        name = element.attributes.get("name")
        in_tree = element.path == ("robot",) or "worldbody" in element.path
        if element.tag not in _TREE or not in_tree or not name:
            continue
        first = seen.setdefault((element.tag, name), element.line)
        if first != element.line:
            raise RobotError(
                f"{path}:{element.line}: a second {element.tag} {name!r}; the first is in line {first}"
            )


def _require_tree(elements: list[Element], path: Path) -> None:
    """Raise RobotError unless the joints of a URDF connect its links to one tree."""
    links = {element.attributes.get("name", "") for element in elements if _is_part(element, "link")}
    carried: dict[str, tuple[str, str, int]] = {}
    ends: dict[str, str] = {}
    joint = Element("joint", 0, (), {})
    for element in elements:
        if _is_part(element, "joint"):
            joint, ends = element, {}
        if element.path != ("robot", "joint") or element.tag not in ("parent", "child"):
            continue
        name, link = joint.attributes.get("name", ""), element.attributes.get("link", "")
        if link not in links:
            raise RobotError(f"{path}:{element.line}: joint {name!r}: there is no link {link!r}")
        ends[element.tag] = link
        if len(ends) == 2:
            if ends["child"] in carried:
                other = carried[ends["child"]][1]
                raise RobotError(
                    f"{path}:{element.line}: {ends['child']!r} is moved by {other!r} and by {name!r}"
                )
            carried[ends["child"]] = (ends["parent"], name, joint.line)
    for link in carried:
        seen = {link}
        at = link
        while at in carried:
            at, name, line = carried[at]
            if at in seen:
                raise RobotError(f"{path}:{line}: joint {name!r} closes a circle of links")
            seen.add(at)


def _without(text: str, meshes: Collection[str]) -> str:
    """Return a model's text without the shapes of some meshes."""
    root = ET.fromstring(text)  # noqa: S314 - without a document type, as `_elements` has checked
    gone = {
        mesh.get("name") or PurePosixPath(mesh.get("file", "")).stem
        for mesh in root.iter("mesh")
        if mesh.get("file") in meshes
    }
    for parent in list(root.iter()):
        for shape in list(parent):
            of_urdf = any(mesh.get("filename") in meshes for mesh in shape.iterfind("geometry/mesh"))
            of_mjcf = shape.get("mesh") in gone or (shape.tag == "mesh" and shape.get("file") in meshes)
            if of_urdf or of_mjcf:
                parent.remove(shape)
    return ET.tostring(root, encoding="unicode")


def _is_part(element: Element, tag: str) -> bool:
    return element.tag == tag and element.path == ("robot",)


def _speeds(elements: list[Element]) -> dict[str, float]:
    """Return the highest speed of each joint of a URDF that gives one above 0."""
    speeds: dict[str, float] = {}
    joint = ""
    for element in elements:
        if _is_part(element, "joint"):
            joint = element.attributes.get("name", "")
        elif element.tag == "limit" and element.path == ("robot", "joint"):
            speed = float(element.attributes.get("velocity", "0") or 0)
            if speed > 0.0 and math.isfinite(speed):
                speeds[joint] = speed
    return speeds


def _files(elements: list[Element], folder: Path, meshes: Path) -> tuple[dict[str, bytes], list[str]]:
    """Return the contents of a model's files, by their names, and the names of those that are not there."""
    present: dict[str, bytes] = {}
    missing: list[str] = []
    size = 0
    for element in elements:
        name = element.attributes.get("filename" if element.path[:1] == ("robot",) else "file", "")
        if not name or element.tag not in ("mesh", "texture", "include", "hfield"):
            continue
        for place in (meshes, folder):
            path = place / PurePosixPath(name.removeprefix("package://")).name
            if path.is_file() and (element.tag != "mesh" or path.suffix.lower() in _MESHES):
                size += path.stat().st_size
                if size > 10 * LARGEST_FILE:
                    raise RobotError(
                        f"{folder}: meshes and textures of more than {10 * LARGEST_FILE >> 20} MB"
                    )
                present[path.name] = path.read_bytes()
                break
        else:
            missing.append(name)
    return present, missing
