"""Read a user's MJCF or URDF: checked and repaired before MuJoCo sees it, with the lines of what is wrong.

MuJoCo refuses masses and inertias that no body can have: those are repaired first.
"""

from __future__ import annotations

import ctypes
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal

import mujoco
import numpy as np

from naoserver.bodies.parts import MOST_POINTS
from naoserver.errors import RobotError
from visualhfsm_own_robots import _mjcf, _urdf
from visualhfsm_own_robots._figure import Array, Figure
from visualhfsm_own_robots._meshes import Files, packages_near
from visualhfsm_own_robots._tree import Element, read_tree, write_tree
from visualhfsm_own_robots._urdf import Sensor
from visualhfsm_own_robots._xacro import NO_XACRO, Argument, expanded

LEAST_MASS: Final = 0.01
"""Mass in kg of a link that moves and of which nothing says a mass."""
_DENSITY: Final = 1000.0
"""Density in kg/m3 of the ball whose inertia a link without one has."""
_FRAME: Final = 1e-3
"""Mass in kg up to which a fixed link without inertia is a mere frame."""
_ROUNDING: Final = 1e-6
"""Share of the largest moment up to which an inertia is that of a rod or a plate, but for rounding."""
_LEAST: Final = 1e-14
"""MuJoCo's smallest mass in kg and moment of inertia in kg m2, with a reserve."""
_MOST_LISTED: Final = 6
"""Links that a note names."""


def balance_inertias(
    spec: mujoco.MjSpec, at: Callable[[mujoco.MjsBody], str], balance: bool | None, *, free: bool
) -> Iterator[str]:
    """Repair masses and inertias that no body can have, and yield notes on it; `at` returns a body's place.

    With `free`, the root moves, too. Raises RobotError for a mass below 0, and with `balance` False for
    inertias that no body can have.
    """
    light = []
    for body in spec.bodies[1:]:
        if body.mass < 0.0:
            raise RobotError(f"{at(body)}: the mass of {body.name!r} is {body.mass:g}: write 0 or more")
        moves = len(body.joints) > 0 or (free and body.parent.name == "world")
        if moves and not _has_mass(body):
            light.append(body.name)
            bound(body, moves=moves)
        if not body.explicitinertial:
            continue
        tensor = _tensor(body)
        moments = np.linalg.eigvalsh(tensor)
        if moments[2] < _LEAST:
            light += [body.name] if body.mass >= _LEAST else []
            bound(body, moves=moves and body.mass >= _LEAST)
        if min(moments[2], body.mass) < _LEAST:
            continue
        off = (moments[2] - moments[0] - moments[1]) / (2.0 * moments[2])
        if off < -_ROUNDING and moments[0] >= _LEAST:
            continue
        _set_tensor(body, _repaired(tensor))
        if off > _ROUNDING and not balance:
            shown, taken = (
                ", ".join(f"{moment:.4g}" for moment in each)
                for each in (moments, np.linalg.eigvalsh(_tensor(body)))
            )
            what = f"{at(body)}: the inertia of {body.name!r} has the moments {shown}, which no body has"
            if balance is False:
                raise RobotError(f"{what}: correct it, or write balance = true")
            yield f"{what}: {taken} is taken (balance = true says that this is right)"
    if light:
        ball = f"taken as a ball, of at least {LEAST_MASS:g} kg where they move"
        yield f"{_listed(light)} without mass or inertia: {ball}"


def bound(body: mujoco.MjsBody, *, moves: bool) -> None:
    """Give a body the inertia of a ball, and if it moves, the least mass; nothing to a frame without mass."""
    given = body.mass if body.explicitinertial else 0.0
    body.mass = max(given, LEAST_MASS) if moves else given if given > _FRAME else 0.0
    radius = (3.0 * body.mass / (4.0 * np.pi * _DENSITY)) ** (1.0 / 3.0)
    if not body.explicitinertial:
        body.ipos = np.zeros(3)
    body.explicitinertial = True
    body.fullinertia[:] = np.nan
    _set_tensor(body, np.eye(3) * 0.4 * body.mass * radius**2)


def _has_mass(body: mujoco.MjsBody) -> bool:
    """Return whether a body has a mass, or one that is fixed to it."""
    fixed = [body]
    for each in fixed:  # grows meanwhile
        weights = [geom.mass if np.isfinite(geom.mass) else geom.density for geom in each.geoms]
        if each.mass >= _LEAST if each.explicitinertial else any(weight > 0.0 for weight in weights):
            return True
        fixed += [child for child in each.bodies if not child.joints]
    return False


def _tensor(body: mujoco.MjsBody) -> Array:
    """Return the inertia of a body about its center of mass, in the frame that it is given in."""
    if np.isfinite(body.fullinertia[0]):
        xx, yy, zz, xy, xz, yz = body.fullinertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.diag(body.inertia)


def _set_tensor(body: mujoco.MjsBody, tensor: Array) -> None:
    if np.isfinite(body.fullinertia[0]):
        body.fullinertia = np.array([*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]])
    else:
        body.inertia = np.diag(tensor)


def _repaired(tensor: Array) -> Array:
    """Return the inertia nearest to one that no body has: mass has no negative extent along any axis."""
    moments, axes = np.linalg.eigh(tensor)
    extents = moments.sum() / 2.0 - moments
    # More than 0, as MuJoCo compares without a tolerance.
    extents = np.maximum(extents, _ROUNDING * np.abs(moments).max())
    repaired: Array = (axes * (extents.sum() - extents)) @ axes.T
    return repaired


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(map(repr, names[:_MOST_LISTED])) + more


_MOST_READ: Final = 500_000
"""Most elements that MuJoCo reads, in all, to find those that it refuses: it names one at a time."""
_REFUSALS: Final = (ValueError, RuntimeError, mujoco.FatalError)
"""The exceptions of MuJoCo; RuntimeError for want of memory."""
_TAG: Final = re.compile(r"#(\d+)\s*$")
_PLACE: Final = re.compile(r"\s*Element '[^']*', line (\d+)\s*$")
_ATTRIBUTE: Final = re.compile(r"attribute:? '(\w+)'")
_NAMED: Final = re.compile(r"\s*Element name '.*", re.DOTALL)
_NEEDED: Final = ("bodies", "joints", "meshes")
_BESIDE: Final = (
    *("geoms", "sites", "cameras", "lights", "materials", "actuators", "sensors"),
    *("equalities", "tendons", "pairs", "excludes", "keys"),
)
"""The lists in which a model has parts without which a robot is still one."""
_SECTIONS: Final = ("contact", "sensor", "actuator", "tendon", "equality", "keyframe")
"""Elements of an MJCF that have only such parts."""


@dataclass
class ModelFile:
    """A model that MuJoCo has read, and what MuJoCo does not keep of it."""

    spec: mujoco.MjSpec
    speeds: Mapping[str, float] = field(default_factory=dict)
    """The highest speed of each joint that names one, in rad/s or m/s: only a URDF does."""
    left_out: Mapping[str, str] = field(default_factory=dict)
    """The meshes that are not there or cannot be read, with the reason; their shapes are left out."""
    notes: tuple[str, ...] = ()
    """A sentence for each repair, fusion and omission, with file, line and name."""
    lines: Mapping[tuple[str, str], int] = field(default_factory=dict)
    """The line in the file of each ("joint" | "link" | "body", name)."""
    kind: Literal["urdf", "mjcf"] = "mjcf"
    fixed: bool = False
    """True if its root does not move: a URDF's is `world`, an MJCF's has no free joint."""
    actuated: frozenset[str] = frozenset()
    """The joints that a URDF's `<transmission>` or `<ros2_control>` names."""
    sensors: tuple[Sensor, ...] = ()
    """The cameras and inertial units that a URDF names."""
    compiled: mujoco.MjModel = None
    """The compiled `spec`."""
    where: str = ""
    """The path of the file."""

    @cached_property
    def figure(self) -> Figure:
        """How the robot stands."""
        return Figure(self.compiled)

    def at(self, name: str, *kinds: str) -> str:
        """Return the file, and the line if it is known, of a part, as at the beginning of a message."""
        return _place(self.where, self.lines, name, *kinds)


def _place(where: str | Path, lines: Mapping[tuple[str, str], int], name: str, *kinds: str) -> str:
    """Return a file with the line of a part, if that is known."""
    line = next((lines[kind, name] for kind in kinds if (kind, name) in lines), None)
    return f"{where}:{line}" if line else str(where)


def read_model(
    path: Path, meshes: Path, *, balance: bool | None = None, arguments: Mapping[str, Argument] | None = None
) -> ModelFile:
    """Return the model of an MJCF, URDF or xacro with `arguments`; `meshes` is the folder of its meshes.

    Only files in the folders of the model, of its ROS package and of its meshes are read, and nothing is
    fetched. What MuJoCo refuses or a robot cannot have is repaired or left out, where there is a sensible
    way, and noted. With `balance` True, inertias that no body can have are repaired without a word; with
    False they are refused. Raises RobotError, with file and line, for other faults.
    """
    root = read_tree(path)
    if root.tag not in ("mujoco", "robot"):
        found = f"{path}: its root is <{root.tag[:60]}>"
        raise RobotError(f"{found}; an MJCF begins with <mujoco>, a URDF with <robot>")
    packages = packages_near(path)
    files = Files(path, meshes, packages)
    notes: list[str] = []
    facts: dict[str, Any] = {}
    if root.tag == "robot":
        root, notes = expanded(root, path, packages, arguments or {})
        facts |= {"kind": "urdf", "fixed": _urdf.is_fixed(root), "speeds": _urdf.speeds_of(root)}
        facts |= {"actuated": _urdf.actuated_in(root), "sensors": tuple(_urdf.sensors_in(root))}
        _urdf.prepare(root, files, notes)
    elif arguments:
        raise RobotError(f"{path}: {NO_XACRO}")
    else:
        _mjcf.prepare(root, files, notes)
    try:
        model = _Reading(root, files, notes, balance).read()
    except ValueError as problem:
        if "repeated name" not in str(problem):
            raise
        # That of a part of a planar joint or of a ball.
        why = str(problem).removeprefix("Error:").strip()
        raise RobotError(f"{path}: MuJoCo refuses it: {why}: choose another there") from None
    return replace(model, **facts, left_out=files.left_out, notes=tuple(notes), where=str(path))


def give_back_memory() -> None:
    """Give back what reading took, some 700 MB: MuJoCo keeps meshes, and glibc what was freed."""
    mujoco.mj_clearCache(mujoco.mj_getCache())
    with suppress(AttributeError):  # another C library
        ctypes.CDLL(None).malloc_trim(0)


@dataclass
class _Reading:
    """What MuJoCo makes of a prepared tree, without what it refuses."""

    root: Element
    files: Files
    notes: list[str]
    balance: bool | None
    order: list[Element] = field(default_factory=list)
    """The elements by their lines in what MuJoCo reads."""

    def __post_init__(self) -> None:
        self.path = self.files.model
        self.lines = {
            (element.tag.removeprefix("free"), element.name): element.line
            for element in self.root.all("body", "joint", "freejoint", "link")
            if element.name
        }

    def read(self) -> ModelFile:
        with _warnings() as texts:
            spec = self._parsed()
            if self.root.tag == "mujoco":
                while not _mjcf.choose_robot(spec, self.root, self.order, self.notes):
                    spec = self._parsed()
            for kind, parts in (("link", spec.bodies[1:]), ("joint", spec.joints)):
                for number, part in enumerate(parts, 1):
                    part.name = part.name or f"{kind} {number}"
            self.notes += _mjcf.split_balls(spec, str(self.path))
            self.notes += balance_inertias(spec, self._at, self.balance, free=self.root.tag == "robot")
            for mesh in spec.meshes:
                mesh.maxhullvert = MOST_POINTS
            compiled = self._compiled(spec)
        self.notes += self._full_of_water(spec, compiled)
        said = {" ".join(text.split()) for text in texts if "texture coordinate" not in text}  # not read
        self.notes += [f"{self.path}: MuJoCo says: {text}" for text in said]
        fixed = not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in spec.joints)
        return ModelFile(spec, lines=self.lines, fixed=fixed, compiled=compiled)

    def _full_of_water(self, spec: mujoco.MjSpec, compiled: mujoco.MjModel) -> Iterator[str]:
        """Yield a note on the links of a URDF that weigh what their shapes do; in an MJCF it is said so."""
        unsaid = {link.name for link in self.root.within("link") if not any(link.within("inertial"))}
        if names := [each.name for each in spec.bodies if each.name in unsaid and not each.explicitinertial]:
            heaviest = max(compiled.body(name).mass[0] for name in names)
            guess = f"taken as their shapes full of water, up to {heaviest:.3g} kg each"
            yield f"{self.path}: {_listed(names)} without mass: {guess}"

    def _parsed(self) -> mujoco.MjSpec:
        """Return what MuJoCo reads of the tree, without the parts beside a robot that it refuses."""
        for _ in range(self._tries()):
            text, self.order = write_tree(self.root)
            try:
                return mujoco.MjSpec.from_string(text, assets=self.files.assets)
            except _REFUSALS as problem:
                why = str(problem).strip()
            place = _PLACE.search(why)
            element = self.order[int(place[1]) - 1] if place else self.root
            why = " ".join(_PLACE.sub("", why).rpartition("Error:")[2].split())
            sections = (each for each in self.root.children if each.tag in _SECTIONS)
            section = [each for each in sections if element in each.children]
            name = f" {element.name!r}" if element.name else ""
            if not section:
                value = element.get(named[1]) if (named := _ATTRIBUTE.search(why)) else ""
                found = f", which is {value[:60]!r}" if value else ""
                raise RobotError(f"{element.at}: <{element.tag}>{name} cannot be read: {why}{found}")
            section[0].children.remove(element)
            self.notes.append(f"{element.at}: <{element.tag}>{name} is left out: {why}")
        raise RobotError(f"{self.path}: MuJoCo refuses {self._tries()} and more of its elements")

    def _tries(self) -> int:
        return _MOST_READ // sum(1 for _ in self.root.all()) + 1

    def _compiled(self, spec: mujoco.MjSpec) -> mujoco.MjModel:
        """Return the compiled model, without the parts beside a robot that MuJoCo refuses."""
        parts = [(of, part) for of in (*_NEEDED, *_BESIDE) for part in getattr(spec, of)]
        places = [self._at(part) for _, part in parts]
        for number, (_, part) in enumerate(parts):
            part.info += f" #{number}"
        for _ in range(self._tries()):
            try:
                return spec.compile()
            except _REFUSALS as problem:
                why = str(problem).strip()
            tag = _TAG.search(why)
            if why.startswith("Error: keyframe"):
                self.notes.append(f"{self.path}: its keyframes are left out: they do not fit its joints")
                for key in list(spec.keys):
                    spec.delete(key)
                continue
            why = " ".join(_NAMED.sub("", why).removeprefix("Error:").split())
            if tag is None:
                raise RobotError(f"{self.path}: MuJoCo refuses it: {why}")
            of, part = parts[int(tag[1])]
            holder = getattr(part, "parent", None)
            named = repr(part.name) if part.name or holder is None else f"of link {holder.name!r}"
            what = f"{places[int(tag[1])]}: {type(part).__name__[3:].lower()} {named}"
            if of == "bodies" and "mjMINVAL" in why:
                self.notes.append(f"{what} has no mass: it is taken as a small ball")
                bound(part, moves=True)
            elif of == "meshes":
                self._without(spec, part, why)
            elif of in _BESIDE:
                self.notes.append(f"{what} is left out: {why}")
                spec.delete(part)
            else:
                raise RobotError(f"{what} is refused by MuJoCo: {why}: correct it there")
        raise RobotError(f"{self.path}: MuJoCo refuses {self._tries()} and more of its parts")

    def _without(self, spec: mujoco.MjSpec, mesh: mujoco.MjsMesh, why: str) -> None:
        """Take a mesh that MuJoCo refuses as a shell; one that already is leaves the model."""
        shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        if mesh.inertia != shell and "volume" in why:
            mesh.inertia = shell
            return
        name = self.files.names.get(mesh.file, mesh.file or mesh.name)
        self.files.left_out[name] = f"MuJoCo cannot use it: {why}"
        for geom in [geom for geom in spec.geoms if geom.meshname == mesh.name]:
            spec.delete(geom)
        spec.delete(mesh)

    def _at(self, part: mujoco.MjsElement) -> str:
        """Return the file and, if it is known, the line of a part."""
        element = _mjcf.element_of(part, self.order)
        known = part.name or getattr(part, "parent", part).name  # of a shape
        return element.at if element else _place(self.path, self.lines, known, "link", "body", "joint")


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Collect the warnings that MuJoCo would print."""
    texts: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(texts.append)
    try:
        with warnings.catch_warnings(record=True, action="always") as caught:
            yield texts
        texts += [str(each.message) for each in caught]
    finally:
        mujoco.set_mju_user_warning(before)
