"""Keep the bodies that large models were taken for.

At the second start, an arm of eight STL files with 800,000 triangles is read in 0.09 s and 124 MB; without
what is kept, as at the first, in 1.7 to 1.9 s and 980 MB (three processes each, Python 3.11 on x86-64).
"""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Final, NamedTuple

import msgspec
import mujoco
import numpy as np

import naoserver.bodies
from naoserver.bodies.looks import Looks, Mesh, Skin
from naoserver.body import Body, read_body, write_body
from naoserver.errors import RobotError
from naoserver_sim._own.cache import kept
from naoserver_sim._own.model_file import FoundModel
from zenoh_ice.data import typed

WORTH_KEEPING: Final = 1 << 20
"""Bytes of meshes from which a body is kept: one with fewer is read in an instant."""


class Described(NamedTuple):
    """A body, notes on what is not kept of its model, and lines on what the model was taken for."""

    body: Body
    notes: list[str]
    said: list[str]


class _Mesh(msgspec.Struct, array_like=True):
    vertices: bytes
    faces: bytes
    smooth: bool


class _Kept(msgspec.Struct, array_like=True):
    """What is kept of a body."""

    body: str
    skin: Skin | None
    meshes: dict[str, _Mesh]
    notes: list[str]
    said: list[str]


def kept_body(model: FoundModel, texts: Iterable[str], make: Callable[[], Described]) -> Described:
    """Return what `make` makes of a model and texts, or has made before of the same ones."""
    if sum(map(len, model.files.assets.values())) < WORTH_KEEPING:
        return make()
    of = (_code(), *(text.encode() for text in texts), *model.content())
    described = kept(of, lambda: _packed(make()), _unpacked)
    _give_back_memory()
    return described


def _give_back_memory() -> None:
    """Give back what reading took, some 700 MB: MuJoCo keeps meshes, and glibc what was freed."""
    mujoco.mj_clearCache(mujoco.mj_getCache())
    with suppress(AttributeError):  # another C library
        ctypes.CDLL(None).malloc_trim(0)


@cache
def _code() -> bytes:
    """Return a hash of the code that reads models, which may make something else of one."""
    folders = Path(__file__).parents[1], *map(Path, naoserver.bodies.__path__)
    files = sorted(file for folder in folders for file in folder.rglob("*.py"))
    code = hashlib.sha256(f"{mujoco.mj_versionString()} {version('numpy')}".encode())
    for file in files:
        code.update(file.read_bytes())
    return code.digest()


def _packed(described: Described) -> bytes:
    body, notes, said = described
    skin, meshes = body.looks or (None, {})
    packed = {
        name: _Mesh(mesh.vertices.astype("<f8").tobytes(), mesh.faces.astype("<i4").tobytes(), mesh.smooth)
        for name, mesh in meshes.items()
    }
    return msgspec.msgpack.encode(_Kept(write_body(body), skin, packed, notes, said))


def _unpacked(content: bytes) -> Described:
    """Return what was packed. Raises ValueError for anything else."""
    try:
        found = typed.from_msgpack(content, _Kept)
        body = read_body(found.body, "a robot of the cache")
    except (msgspec.MsgspecError, RobotError) as problem:
        raise ValueError(str(problem)) from None
    if found.skin is not None:
        meshes = {name: _mesh(each) for name, each in found.meshes.items()}
        body = msgspec.structs.replace(body, looks=Looks(found.skin, meshes))
    return Described(body, found.notes, found.said)


def _mesh(packed: _Mesh) -> Mesh:
    vertices = np.frombuffer(packed.vertices, "<f8").reshape(-1, 3)
    faces = np.frombuffer(packed.faces, "<i4").reshape(-1, 3)
    if not (np.isfinite(vertices).all() and faces.size and 0 <= faces.min() <= faces.max() < len(vertices)):
        raise ValueError("a mesh has corners that are nowhere")
    return Mesh(vertices, faces, packed.smooth)
