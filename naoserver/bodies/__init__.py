"""The bodies that are known by name: a folder for each robot, with its facts, its motions and its looks.

`bodies.toml` lists them, also for programs that choose among them without reading any. Each figure in a facts
file has its source. Besides these folders, no module spells the name of a joint or of a link
(`tools/lint/body_names.py`).

`parts` are frozen structs, and `body` the whole, read by `facts` and checked by `checks`; `looks` is what
robots look like, `description` both as JSON, for pages and tools that draw and name any robot, `capabilities`
what robots can do, `footsteps` the figures of a walk, and `kinematics` computes with a body.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Final

from msgspec import Struct

from naoserver.bodies.body import Body, read_body
from naoserver.errors import RobotError
from zenoh_ice.data import typed
from zenoh_ice.data.toml_file import parse_toml, read_text


class _Known(Struct, frozen=True, forbid_unknown_fields=True):
    """An entry of `bodies.toml`: a body by its facts, or by another one without some of its parts."""

    folder: str
    title: str
    facts: str = ""
    of: str = ""
    fixed: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()


_HERE: Final = resources.files(__name__)
_KNOWN: Final[Mapping[str, _Known]] = typed.convert(
    tomllib.loads((_HERE / "bodies.toml").read_text(encoding="utf-8")), dict[str, _Known]
)
BODY_NAMES: Final = tuple(_KNOWN)
"""The names of the bodies; the first is that of a server without `--body`."""
DEFAULT_BODY: Final = BODY_NAMES[0]
_MODELS: Final = (".urdf", ".xacro", ".xml", ".mjcf")
_FILES: Final = (".toml", ".json", *_MODELS)
"""The endings of files that describe a body of one's own."""


def find_body(name: str) -> Body:
    """Return a body by its name, read when it is first used. Raises RobotError when there is no such body."""
    if name not in _KNOWN:
        known = f"there are {', '.join(BODY_NAMES)}, and files that end in {', '.join(_FILES)}"
        raise RobotError(f"there is no body {name[:40]!r}; {known}")
    return _read(name)


def is_body_file(name: str | Path) -> bool:
    """Return whether a body is named by a file of one's own: TOML, facts in JSON, or a model."""
    return Path(name).suffix.lower() in _FILES


@cache
def _read(name: str) -> Body:
    known = _KNOWN[name]
    if known.of:
        return _read(known.of).without(name, known.title, known.fixed, known.missing)
    path = _HERE / known.folder / known.facts
    return read_body(path.read_bytes(), str(path))


def is_of_model(path: Path, text: str | None = None) -> bool:
    """Return whether the parts of a user's body come from a model: its file is one, or TOML that names one.

    `text` is what the file is to have, if not what it has. Raises RobotError when it cannot be read.
    """
    if path.suffix.lower() != ".toml":
        return path.suffix.lower() in _MODELS
    try:
        return bool(tomllib.loads(read_text(path, RobotError) if text is None else text).get("model"))
    except (ValueError, RecursionError):
        return False  # parse_toml says what is wrong


def read_body_file(path: Path, text: str | None = None) -> Body:
    """Return the body that a user's file describes, JSON or TOML, without MuJoCo: for a robot's own computer.

    `text` is what the file is to have, if not what it has. Raises RobotError with file and entry, also for a
    file whose parts come from a model.
    """
    if is_of_model(path, text):
        written = f"naoserver-sim --body {path} --write-body {path.with_suffix('.json')}"
        raise RobotError(
            f"{path}: its parts come from a model, which needs MuJoCo: write them once, {written}"
        )
    text = read_text(path, RobotError) if text is None else text
    if path.suffix.lower() != ".toml":
        return read_body(text, str(path))
    return parse_toml(text, Body, str(path), RobotError)


def folder_of(body: Body) -> str:
    """Return the name of a body's folder; empty for a body that is not known by name."""
    return _KNOWN[body.name].folder if body.name in _KNOWN else ""


def family_of(body: Body) -> tuple[Traversable, Body] | None:
    """Return a body's folder, and the first body in it; None for a body without a folder.

    The first body has all joints that the others have: the motions of a folder are written for it.
    """
    folder = folder_of(body)
    if not folder:
        return None
    first = find_body(next(name for name, known in _KNOWN.items() if known.folder == folder))
    return (_HERE / folder, first) if first.joint.keys() >= body.joint.keys() else None


def require_family(body: Body, first: str, what: str) -> None:
    """Raise RobotError, which begins with `what`, unless a body is of the family of the body `first`."""
    family = family_of(body)
    if family is None or family[1] is not find_body(first):
        raise RobotError(f"{what}; this robot is a {body.title or body.name}")
