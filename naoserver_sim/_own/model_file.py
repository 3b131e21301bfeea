"""Read a user's MJCF or URDF: checked before MuJoCo sees it, with the lines of what is wrong."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Final, Literal, NamedTuple
from xml.etree import ElementTree as ET
from xml.parsers import expat

import mujoco

from naoserver.errors import RobotError

LARGEST_FILE: Final = 10 << 20
"""Largest size of a model's file and of a mesh in bytes; of all meshes and textures, ten times that."""
MOST_ELEMENTS: Final = 50_000
_NUMBERS: Final = re.compile(r"[-+\d.eE\s]*(?:[-+]?(?:nan|inf|infinity)\b[-+\d.eE\s]*)+", re.IGNORECASE)
_TREE: Final = ("body", "joint", "link", "geom", "site", "camera")
"""Elements whose names are unique within a model."""
_MESHES: Final = (".stl", ".obj", ".msh")
"""The formats of meshes that MuJoCo reads."""
_FILE: Final = re.compile("file(right|left|up|down|front|back)?")
"""The attributes of an MJCF that name files."""
_MOST_FILES: Final = 1000
"""Most files that a model names."""
_MOST_FOLDERS: Final = 16
"""Most folders of a file's name in a model that are looked for."""
_KEEP_ALL: Final = '<mujoco><compiler fusestatic="false" discardvisual="false"/></mujoco>'


class Sensor(NamedTuple):
    """A camera or an inertial unit that a URDF's `<gazebo>` or `<sensor>` elements name."""

    kind: Literal["camera", "imu"]
    name: str
    link: str
    pose: tuple[float, float, float, float, float, float] = (0.0,) * 6
    """Place in m, and roll, pitch and yaw in rad, in the link's frame."""
    horizontal_fov: float | None = None
    """Of a camera, in rad; None where the file does not say it."""


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
    left_out: Mapping[str, str] = field(default_factory=dict)
    """The meshes that are not there or cannot be read, with the reason; their shapes are left out."""
    notes: tuple[str, ...] = ()
    """What was repaired, fused or left out, a sentence each, with file, line and name."""
    lines: Mapping[tuple[str, str], int] = field(default_factory=dict)
    """The line in the file of each ("joint" | "link" | "body", name)."""
    kind: Literal["urdf", "mjcf"] = "mjcf"
    actuated: frozenset[str] = frozenset()
    """The joints that a URDF's `<transmission>` or `<ros2_control>` names."""
    sensors: tuple[Sensor, ...] = ()
    """The cameras and inertial units that a URDF names."""


def read_model(path: Path, meshes: Path, *, balance: bool | None = None) -> ModelFile:
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
    files = _files(elements, path, meshes)
    if files.left_out:
        text = _without(text, files.left_out)
    try:
        if root == "robot":
            text = re.sub(r"(<robot\b[^>]*>)", rf"\1{_KEEP_ALL}", text, count=1)
        spec = mujoco.MjSpec.from_string(text, include=files.included, assets=files.assets)
    except (ValueError, mujoco.FatalError) as problem:
        raise RobotError(f"{path}: {' '.join(str(problem).split())}") from None
    # The names in the model are those of `files`.
    spec.meshdir = spec.texturedir = ""
    kind: Literal["urdf", "mjcf"] = "urdf" if root == "robot" else "mjcf"
    lines = {
        (element.tag, element.attributes["name"]): element.line
        for element in elements
        if element.tag in ("joint", "link", "body") and "name" in element.attributes
    }
    return ModelFile(spec, _speeds(elements), files.left_out, lines=lines, kind=kind)


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


@dataclass(frozen=True)
class _Files:
    """The files that a model names, by these names."""

    included: dict[str, bytes] = field(default_factory=dict)
    """The contents of other parts of the model."""
    assets: dict[str, bytes] = field(default_factory=dict)
    """The contents of meshes and textures."""
    left_out: dict[str, str] = field(default_factory=dict)
    """Why meshes are left out."""

    def __contains__(self, name: str) -> bool:
        return name in self.included or name in self.assets or name in self.left_out

    def __len__(self) -> int:
        return len(self.included) + len(self.assets) + len(self.left_out)


def _files(elements: list[Element], model: Path, meshes: Path) -> _Files:
    """Return the files that a model names. Raises RobotError for one that is not in its folder."""
    files = _Files()
    folders: dict[str, str] = {}
    size = 0
    # First what says where files are; files that are included add their elements.
    waiting = [(model, element) for element in sorted(elements, key=lambda each: each.tag != "compiler")]
    for source, element in waiting:
        if element.tag == "compiler":
            folders |= element.attributes
        for name in _named_files(element):
            if name in files:
                continue
            at = f"{source}:{element.line}"
            if len(files) == _MOST_FILES:
                raise RobotError(f"{at}: more than {_MOST_FILES} files")
            if element.tag == "model":
                raise RobotError(f"{at}: a model within a model: write its links into {model.name}")
            kind = "texturedir" if element.tag == "texture" else "meshdir"
            path = _found(f"{folders.get(kind, folders.get('assetdir', ''))}/{name}", (meshes, model.parent))
            if source == model and element.tag == "mesh" and (why := _fault(path, name)):
                files.left_out[name] = why
                continue
            if path is None:
                raise RobotError(f"{at}: there is no file {name[:60]!r} in the folder of the model")
            size += path.stat().st_size
            if size > 10 * LARGEST_FILE:
                raise RobotError(f"{model}: its files have more than {10 * LARGEST_FILE >> 20} MB")
            if element.tag == "include":
                files.included[name] = _content(path)
                part = list(_elements(_text(path), path))
                _require_finite(part, path)
                waiting += [(path, each) for each in part]
            else:
                files.assets[name] = _content(path)
    return files


def _named_files(element: Element) -> Iterator[str]:
    """Yield the files that an element names; in a URDF, those of meshes."""
    if element.path[:1] == ("robot",):
        names = [element.attributes.get("filename", "")] if element.tag == "mesh" else []
    else:
        names = [value for name, value in element.attributes.items() if _FILE.fullmatch(name)]
    yield from filter(None, names)


def _found(name: str, folders: Iterable[Path]) -> Path | None:
    """Return the file in one of the folders with as many of the last parts of a name as possible."""
    parts = [part for part in PurePosixPath(name).parts if part not in ("/", "//", "..")][-_MOST_FOLDERS:]
    for folder in folders:
        for first in range(len(parts)):
            try:
                path = folder.joinpath(*parts[first:]).resolve(strict=True)
            except (OSError, RuntimeError):  # a name that is too long, a circle of links
                continue
            if path.is_file() and path.is_relative_to(folder.resolve()):
                return path
    return None


def _fault(mesh: Path | None, name: str) -> str:
    """Return why a mesh cannot be used; empty if it can."""
    if PurePosixPath(name).suffix.lower() not in _MESHES:
        return f"MuJoCo reads only {', '.join(_MESHES)}"
    if mesh is None:
        return "there is no such file"
    return f"larger than {LARGEST_FILE >> 20} MB" if mesh.stat().st_size > LARGEST_FILE else ""


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as problem:
        raise RobotError(f"{path}: cannot be read: {problem.strerror}") from None
