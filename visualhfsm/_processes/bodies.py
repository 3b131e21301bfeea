"""The bodies of robots that can be simulated: those that are installed, and those of the project.

A body of the project is a TOML file in the folder `robots` below the root, for `naoserver-sim --body`.
Nothing of a robot server is imported here.
"""

from __future__ import annotations

import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import msgspec

from codegen.messages import Message
from codegen.reasons import known_text
from visualhfsm._base.errors import VisualHfsmError
from zenoh_ice.data.text import few, printable

FOLDER: Final = "robots"
"""The folder of a project that has the files of its bodies."""
_MOST_FILES: Final = 100
"""Most bodies of a project that are listed."""
_LARGEST_FILE: Final = 1 << 20
_LONGEST_TITLE: Final = 64
_TITLES: Final = (Message("Cart"),)
"""Titles of installed bodies that are words, and no names."""


class KnownBody(msgspec.Struct, frozen=True):
    """A body that can be simulated: its name, or the path of its TOML file below the root, and its title."""

    name: str
    title: Message


def find_bodies(root: Path) -> list[KnownBody]:
    """Return the bodies that can be simulated: those that are installed, then those of the project.

    A file of the project that cannot be read is there, too: the simulation says what is wrong with it.
    """
    spec = find_spec("naoserver")
    found = []
    for place in () if spec is None else spec.submodule_search_locations or ():
        content = tomllib.loads((Path(place) / "bodies" / "bodies.toml").read_text(encoding="utf-8"))
        found += [KnownBody(name, called(body["title"])) for name, body in content.items()]
    own = sorted((root / FOLDER).glob("[!.]*.toml"))[:_MOST_FILES]
    return found + [KnownBody(f"{FOLDER}/{path.name}", Message.verbatim(_title_of(path))) for path in own]


def called(title: str) -> Message:
    """Return the title of a robot as a message."""
    return known_text(title, _TITLES)


def require_body(root: Path, name: str) -> str:
    """Return a name if it is that of one of `find_bodies`, that of the first if it is empty.

    Raises VisualHfsmError for any other name.
    """
    return known_body(root, name).name


def known_body(root: Path, name: str) -> KnownBody:
    """Return the body of a name; see `require_body`."""
    known = {body.name: body for body in find_bodies(root)}
    if name and name not in known:
        raise VisualHfsmError.because(
            "there is no robot {name}; there are {few}", name=printable(name)[:60], few=few([*known], 12)
        )
    return known[name or next(iter(known))]


def body_option(root: Path, name: str) -> str:
    """Return the value of `--body` for a name of `require_body`."""
    return str(root / name) if name.endswith(".toml") else name


def _title_of(path: Path) -> str:
    """Return what a body's file calls it, or else the name of the file."""
    try:
        with path.open("rb") as file:
            content = tomllib.loads(file.read(_LARGEST_FILE).decode("utf-8"))
    except (OSError, ValueError):
        content = {}
    names = (content.get("title"), content.get("name"))
    found = next((name for name in names if isinstance(name, str) and name.strip()), path.stem)
    return printable(found)[:_LONGEST_TITLE]
