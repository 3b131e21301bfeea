"""Find the meshes that a model names, and bring them into a format that MuJoCo reads.

Only files in the folders of the model, of its ROS package and of its meshes are read, within limits.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import os
import re
from codecs import BOM_UTF8
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from visualhfsm_own_robots._tree import LARGEST_FILE, POINTER, is_pointer

LARGEST_MESH: Final = 3 * LARGEST_FILE
"""Largest size of a mesh in bytes."""
_MOST_USED: Final = 10 * LARGEST_FILE
"""Most bytes of all meshes if each counts as often as it is used: MuJoCo reads it again each time."""
_MOST_TRIANGLES: Final = 200_000
"""Most triangles of a mesh in MuJoCo."""
_MOST_FILES: Final = 1000
"""Most files that a model names."""
_MOST_FOLDERS: Final = 16
"""Most folders of a file's name in a model that are looked for."""
_LEVELS: Final = 5
"""The most folders up from the model in which ROS packages are looked for."""
_MOST_SIBLINGS: Final = 500
_BESIDE: Final = frozenset(("meshes", "mesh", "assets", "dae", "stl", "obj", "visual", "collision", "common"))
"""Folders beside that of the model which are read, too."""
_SCHEME: Final = re.compile(r"(?:(package|model|file):/*)?(.*)", re.DOTALL)
_PACKAGE: Final = re.compile(rb"<name>\s*([\w.-]+)\s*</name>")
_UNIT: Final = re.compile(rb"<unit[^>]{0,200}?\bmeter\s*=\s*[\"']\s*([\d.eE+-]{1,30})\s*[\"']")
_MATERIALS: Final = re.compile(rb"<bind_material>.*?</bind_material>", re.DOTALL)
"""What gives a part of a COLLADA file its materials."""
_OBJECTS: Final = re.compile(rb"^[ \t]*[og]\b.*", re.MULTILINE)
"""The beginnings of objects and groups in an OBJ, of which MuJoCo reads the first one."""
_VERTEX: Final = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_TRIANGLE: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])


class MeshError(Exception):
    """A mesh cannot be used: why, as the end of a sentence."""


class MeshFile(NamedTuple):
    """A mesh in a format of MuJoCo; its color, if it has one, is red, green, blue and opacity."""

    ending: str
    content: bytes
    color: tuple[float, float, float, float] | None = None


def packages_near(model: Path) -> dict[str, Path]:
    """Return the folders of ROS packages by name: the one in which a model is, and those beside it."""
    own = _home(model)
    if own is None:
        return {}
    beside: list[Path] = []
    with contextlib.suppress(OSError):  # a folder that is not ours to read
        beside += itertools.islice(own.parent.iterdir(), _MOST_SIBLINGS)
    folders = [folder for folder in (*beside, own) if not folder.is_symlink()]
    named = {name: folder for folder in folders if (name := _package_name(folder))}
    named |= {folder.name: folder for folder in named.values()}
    return named


def _home(model: Path) -> Path | None:
    """Return the folder of the ROS package in which a model is."""
    return next((folder for folder in model.resolve().parents[:_LEVELS] if _package_name(folder)), None)


def _package_name(folder: Path) -> str:
    """Return the name of the ROS package in a folder; empty if there is none."""
    path = folder / "package.xml"
    try:
        if not path.is_file():  # none, or a pipe, which would not end
            return ""
        with path.open("rb") as file:
            name = _PACKAGE.search(file.read(100_000))
    except OSError:  # not ours to read
        return ""
    return name[1].decode() if name else folder.name


def _has_home(folder: Path) -> bool:
    """Return whether the user's home folder is this one or in it: nothing there is beside a model."""
    return Path(os.path.expanduser("~")).resolve().is_relative_to(folder)  # noqa: PTH111 - without a home, too


def _is_mesh_in(folder: Path, path: Path, depth: int | None = None) -> bool:
    """Return whether a file is in a folder of meshes within a folder, so many levels down at most."""
    if _has_home(folder) or not path.is_relative_to(folder):
        return False
    return any(
        part in _BESIDE or part.startswith("mesh") for part in path.relative_to(folder).parts[:-1][:depth]
    )


@dataclass
class Files:
    """The files that a model may name, and the contents of those that it does."""

    model: Path
    meshes: Path
    """The folder that the user names for meshes."""
    packages: Mapping[str, Path] = field(default_factory=dict)
    assets: dict[str, bytes] = field(default_factory=dict)
    """The contents by the names that MuJoCo gets."""
    names: dict[str, str] = field(default_factory=dict)
    """The model's names of these files."""
    left_out: dict[str, str] = field(default_factory=dict)
    """The meshes that cannot be used, as the model calls them, with the reason."""
    _read: dict[Path, tuple[str, MeshFile]] = field(default_factory=dict)
    _used: int = 0
    _failed: int = 0

    def __post_init__(self) -> None:
        folder = self.model.parent.resolve()
        home = _home(self.model) or folder
        inside = [up / "meshes" for up in (folder, home)]
        beside = [folder.parent / name for name in sorted(_BESIDE) if not _has_home(folder.parent)]
        self._folders = list(dict.fromkeys((self.meshes.resolve(), folder, *inside, home, *beside)))
        self._allowed = [self.meshes.resolve(), folder, home, *beside, *self.packages.values()]

    def find(self, name: str, source: Path, folder: str = "") -> Path:
        """Return the file that is called `name` in a file `source`, whose names begin in `folder`.

        Raises MeshError when there is none in the folders that may be read.
        """
        scheme, rest = _SCHEME.fullmatch(name).groups()  # type: ignore[union-attr]  # all texts match
        parts = PurePosixPath(rest.replace("\\", "/")).parts
        named: list[Path] = []
        exact = [file.parent.joinpath(folder, *parts) for file in (self.model, source)]
        if scheme in ("package", "model") and parts:
            around = {up.name: up for up in reversed(self.model.resolve().parents[:_LEVELS])}
            named = [of[parts[0]] for of in (self.packages, around) if parts[0] in of]
            exact = [package.joinpath(*parts[1:]) for package in named] or exact
        elif scheme == "file":
            exact.append(Path("/", *parts))
        known = [part for part in (*PurePosixPath(folder).parts, *parts) if part not in ("/", "//", "..")]
        known = known[-_MOST_FOLDERS:]
        tails = (each.joinpath(*known[n:]) for each in self._folders for n in range(len(known)))
        outside = False
        for path in (*exact, *tails):
            try:
                real = path.resolve(strict=True)
                if real.is_file() and (
                    any(map(real.is_relative_to, self._allowed))
                    or _is_mesh_in(self.model.resolve().parent.parent, real)
                    or any(_is_mesh_in(up, real, depth=1) for up in named)
                ):
                    return real
                outside = outside or (path in exact and real.is_file())
            except (OSError, RuntimeError, ValueError):  # no such file, too long a name, a circle of links
                continue
        raise MeshError("it lies outside the folder of the model" if outside else "there is no such file")

    def mesh(self, name: str, source: Path, folder: str = "") -> tuple[str, MeshFile] | None:
        """Return the name by which MuJoCo gets a mesh, and the mesh; None if it is left out."""
        try:
            if self._failed >= _MOST_FILES:
                raise MeshError(f"it comes after {_MOST_FILES} that cannot be used")
            path = self.find(name, source, folder)
            if path not in self._read:
                self._add(path, name)
            self._used += len(self._read[path][1].content)
            if self._used > _MOST_USED:
                raise MeshError(
                    f"all meshes together, each as often as it is used, have more than {_MOST_USED >> 20} MB"
                )
            return self._read[path]
        except MeshError as problem:
            self._failed += 1
            self.left_out[name] = str(problem)
            return None

    def _add(self, path: Path, name: str) -> None:
        if len(self._read) == _MOST_FILES:
            raise MeshError(f"it is one of more than {_MOST_FILES} files")
        mesh = read_mesh(path)
        asset = f"{len(self._read)}{mesh.ending}"
        self._read[path] = asset, mesh
        self.assets[asset], self.names[asset] = mesh.content, name


def read_mesh(path: Path) -> MeshFile:
    """Return a mesh in a format that MuJoCo reads. Raises MeshError when it cannot be used."""
    ending = path.suffix.lower()
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_MESH + 1)
    except OSError as problem:
        raise MeshError(f"it cannot be read: {problem.strerror}") from None
    if len(content) > LARGEST_MESH:
        raise MeshError(f"it is larger than {LARGEST_MESH >> 20} MB")
    if not content:
        raise MeshError("it is empty")
    if is_pointer(content):
        raise MeshError(f"it {POINTER}")
    if ending == ".stl":
        return MeshFile(ending, _stl(content))
    if ending == ".obj":
        return MeshFile(ending, _OBJECTS.sub(b"", content.removeprefix(BOM_UTF8)))
    if ending == ".msh":
        return MeshFile(ending, content)
    if ending in (".dae", ".ply", ".off", ".glb"):
        return _by_trimesh(content, ending)
    raise MeshError(f"{ending or 'a file without an ending'} is no format of meshes that is read")


def _stl(content: bytes) -> bytes:
    """Return a binary STL; one that is text is turned into it."""
    count = int.from_bytes(content[80:84], "little")
    size = 84 + _TRIANGLE.itemsize * count
    text = content.lstrip()[:5].lower() == b"solid"
    if count and (len(content) == size or (len(content) > size and not text)):
        return _written(np.frombuffer(content, _TRIANGLE, count, 84)["corners"])
    if not text:
        raise MeshError("it is cut off" if count else "it has no triangles")
    try:
        return _written([[float(word) for word in found.groups()] for found in _VERTEX.finditer(content)])
    except ValueError:
        raise MeshError("it is cut off, or has a vertex that is no number") from None


def _written(corners: ArrayLike) -> bytes:
    """Return the binary STL of triangles, three corners each."""
    points = np.asarray(corners, np.float32).reshape(-1, 3, 3)
    if not 0 < len(points) <= _MOST_TRIANGLES:
        raise MeshError(f"it has {len(points)} triangles; MuJoCo takes 1 to {_MOST_TRIANGLES}")
    triangles = np.zeros(len(points), _TRIANGLE)
    triangles["corners"] = points
    return bytes(80) + len(points).to_bytes(4, "little") + triangles.tobytes()


def _by_trimesh(content: bytes, ending: str) -> MeshFile:
    """Return what the library trimesh reads as an STL."""
    try:
        import collada  # noqa: F401 - by which trimesh reads .dae
        import trimesh
    except ImportError:
        raise MeshError(f"for {ending} files, pip install 'visualhfsm[models]'") from None
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise MeshError("it has a document type, which a mesh does not need")
    try:
        scene = trimesh.load_scene(io.BytesIO(content), file_type=ending[1:], process=False)
        if not scene.geometry and ending == ".dae":  # a material that is not there takes its part with it
            plain = _MATERIALS.sub(b"", content)
            scene = trimesh.load_scene(io.BytesIO(plain), file_type="dae", process=False)
        parts: list[Any] = [part for part in scene.dump() if hasattr(part, "faces")]
        if not parts:
            raise MeshError("it has no triangles")
        corners = np.concatenate([part.vertices[part.faces] for part in parts])
        unit = _UNIT.search(content[:100_000]) if ending == ".dae" else None
        return MeshFile(".stl", _written(corners * (float(unit[1]) if unit else 1.0)), _color(parts))
    except MeshError:
        raise
    except Exception as problem:  # noqa: BLE001 - these readers raise whatever a broken file leads to
        raise MeshError(f"it is broken: {type(problem).__name__} {str(problem)[:100]}") from None


def _color(parts: list[Any]) -> tuple[float, float, float, float] | None:
    """Return the mean color of a mesh's parts, by their triangles; None if they have none."""
    colored = [part for part in parts if hasattr(getattr(part, "visual", None), "material")]
    if not colored:
        return None
    colors = [np.asarray(part.visual.material.main_color, np.float64) / 255.0 for part in colored]
    mean = np.average(colors, axis=0, weights=[len(part.faces) for part in colored])
    red, green, blue, opacity = mean.round(4).tolist()
    return red, green, blue, opacity
