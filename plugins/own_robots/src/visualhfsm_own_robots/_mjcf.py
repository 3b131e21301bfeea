"""An MJCF that MuJoCo reads, of all its files, and of it the robot alone."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import Final

import mujoco
import numpy as np

from naoserver.bodies.parts import MOST_PARTS
from naoserver.errors import RobotError
from visualhfsm_own_robots._figure import HOME
from visualhfsm_own_robots._meshes import Files, MeshError
from visualhfsm_own_robots._tree import (
    DEEPEST,
    MOST_ELEMENTS,
    Element,
    Fault,
    number,
    numbers,
    read_tree,
    refuse,
)
from visualhfsm_own_robots._urdf import COMPILER, MOUNT, unused

_UNUSED: Final = frozenset(("option", "size", "visual", "statistic", "custom", "texture", "hfield", "skin"))
"""Elements that say nothing of a robot's links: settings of a simulation, pictures and terrain."""
_SOFT: Final = ("flexcomp", "flex", "deformable")
_MOST_INCLUDED: Final = 100
_COUNTS: Final = {"params", "dim", "num", "actdim"}
"""Attributes by which an element takes memory: of meshes that MuJoCo makes, of sensors and actuators."""
_LARGEST_COUNT: Final = 100
_FREE: Final = mujoco.mjtJoint.mjJNT_FREE
_INFO: Final = re.compile(r"line (\d+)")


def prepare(root: Element, files: Files, notes: list[str]) -> None:
    """Change the tree of an MJCF to what MuJoCo reads of a robot, and note what is left out.

    Raises RobotError, with file and line, for faults that have no repair.
    """
    _include(root, files)
    folder = _set_options(root)
    root.remove_where(lambda each: each.tag in _UNUSED)
    soft = root.remove_where(lambda each: each.tag in _SOFT)
    notes += [f"{each.at}: <{each.tag}> {each.name!r} is left out: a robot has rigid links" for each in soft]
    root.remove_where(lambda each: each.tag == "key" and each.name.lower() not in HOME)
    root.remove_where(lambda each: each.tag == "layer" or each.get("type") == "hfield")
    for element in root.all():
        for name in ("texture", "nsample", "delay", "interp"):
            element.attributes.pop(name, None)
    refuse(_faults(root))
    _keep_meshes(root, files, folder)
    for element in root.all():
        if (name := element.get("file")) and name not in files.assets:
            raise RobotError(f"{element.at}: <{element.tag}> names the file {name[:60]!r}, which is not read")


def _include(root: Element, files: Files) -> None:
    """Replace each `<include>` by what its file has."""
    for _ in range(_MOST_INCLUDED):
        parent = next((each for each in root.all() if any(each.within("include"))), None)
        if parent is None:
            return
        include = next(parent.within("include"))
        try:
            part = read_tree(files.find(include.get("file"), include.source))
        except MeshError as problem:
            raise RobotError(f"{include.at}: <include> of {include.get('file')[:60]!r}: {problem}") from None
        place = parent.children.index(include)
        parent.children[place : place + 1] = part.children
        if sum(1 for _ in root.all()) > MOST_ELEMENTS:
            raise RobotError(f"{include.at}: more than {MOST_ELEMENTS} elements")
    raise RobotError(f"{include.at}: more than {_MOST_INCLUDED} files are included, or one includes itself")


def _set_options(root: Element) -> str:
    """Leave the options that are about links; return the folder in which they say that meshes are."""
    folder = ""
    for compiler in root.all("compiler"):
        folder = compiler.get("meshdir") or compiler.get("assetdir") or folder
        kept = compiler.attributes.items()
        compiler.attributes = {name: value for name, value in kept if COMPILER.fullmatch(name)}
        compiler.children.clear()
    return folder


def _faults(root: Element) -> Iterator[Fault]:
    """Yield what no robot has, or what MuJoCo should not be asked for."""
    level = [root]
    for _ in range(DEEPEST):
        level = [child for element in level for child in element.children]
    for element in level:
        yield element, f"more than {DEEPEST} elements within each other, with all files"
    for element in root.all():
        for name in _COUNTS & element.attributes.keys():
            if max(map(abs, numbers(element, name))) > _LARGEST_COUNT:
                found = f"{name} of <{element.tag}> is {element.get(name)[:60]!r}"
                yield element, f"{found}: write at most {_LARGEST_COUNT}"
    bodies, parts = _count(root)
    if bodies > MOST_PARTS:
        yield root, f"{bodies:.0f} links; a robot has at most {MOST_PARTS}"
    if parts > MOST_ELEMENTS:
        yield root, f"more than {MOST_ELEMENTS} elements, with all replicas"


def _count(element: Element) -> tuple[float, float]:
    """Return how many bodies and elements an element is, with all replicas."""
    inner = [_count(child) for child in element.children]
    times = abs(number(element.get("count")) or 1.0) if element.tag == "replicate" else 1.0
    bodies = times * sum(few for few, _ in inner) + (element.tag == "body")
    return bodies, times * (1 + sum(parts for _, parts in inner))


def _keep_meshes(root: Element, files: Files, folder: str) -> None:
    """Give the meshes the names that MuJoCo gets; those left out go with their shapes."""
    gone: set[str] = set()
    for mesh in [each for each in root.all("mesh") if each.get("file")]:
        mesh.attributes.setdefault("name", PurePosixPath(mesh.get("file")).stem)
        mesh.attributes.pop("content_type", None)
        found = files.mesh(mesh.get("file"), mesh.source, folder)
        mesh.attributes["file"] = found[0] if found else ""
        gone |= set() if found else {mesh.name}
    root.remove_where(lambda each: each.attributes.get("file") == "" or each.get("mesh") in gone)


def choose_robot(spec: mujoco.MjSpec, root: Element, order: list[Element], notes: list[str]) -> bool:
    """Remove from a model what is no part of its robot, and note it; return False if that needs another read.

    The robot is the tree with the most joints; those that stand on the ground are one robot, on a mount. It
    is put into `root`, of which `spec` is to be read again. `order` are the elements by their lines.
    """
    trees = list(spec.worldbody.bodies)
    joints = {tree: sum(joint.type != _FREE for joint in tree.find_all("joint")) for tree in trees}
    main = max(trees, key=lambda tree: joints[tree], default=None)
    if main is None or not joints[main]:
        return True
    robot = [main] if _floats(main) else [tree for tree in trees if joints[tree] and not _floats(tree)]
    if len(robot) > 1 or (main.joints and not _floats(main)):
        _mount(root, [element_of(tree, order) or root for tree in robot])
        return False
    for tree in trees:
        if tree is not main:
            what = "it moves by itself" if _floats(tree) else "no joint of the robot moves it"
            at = (element_of(tree, order) or root).at
            notes.append(f"{at}: body {tree.name!r} beside the robot is left out: {what}")
            spec.delete(tree)
    return True


def _floats(tree: mujoco.MjsBody) -> bool:
    return tree.mocap or any(joint.type == _FREE for joint in tree.joints)


def element_of(part: mujoco.MjsElement, order: list[Element]) -> Element | None:
    """Return the element from which MuJoCo read a part, out of those in the `order` of their lines."""
    line = _INFO.search(part.info or "")
    return order[int(line[1]) - 1] if line else None


def _mount(root: Element, bodies: list[Element]) -> None:
    """Put what has some bodies on a link that stands on the ground."""
    worlds = list(root.within("worldbody"))
    children = [child for world in worlds for child in world.children]
    moved = [child for child in children if any(body in bodies for body in child.all("body"))]
    mount = Element("body", {"name": unused(MOUNT, root)}, root.source, root.line, moved)
    for world in worlds:
        world.children = [child for child in world.children if child not in moved]
    worlds[0].children.append(mount)


def split_balls(spec: mujoco.MjSpec, at: str) -> list[str]:
    """Replace each ball joint by three hinges, and return notes on them."""
    notes = []
    for ball in [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_BALL]:
        body, name, kept = ball.parent, ball.name, {"pos": ball.pos.copy(), "armature": ball.armature}
        kept |= {"type": mujoco.mjtJoint.mjJNT_HINGE, "range": (-ball.range[1], ball.range[1])}
        kept["limited"] = ball.limited if ball.range[1] > 0.0 else False
        spec.delete(ball)
        for axis in range(3):
            body.add_joint(name=f"{name} {'xyz'[axis]}", axis=np.eye(3)[axis], **kept)
        notes.append(
            f"{at}: the ball joint {name!r} becomes three hinges, without what drives or measures it"
        )
    return notes
