"""Only the description of a body, and what is made for it, spell the names of its joints and links."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

from naoserver.bodies import BODY_NAMES, find_body
from tools.lint.sources import ROOT
from tools.workspace import DISTRIBUTIONS

GENERATED: Final = {ROOT / "behaviors", ROOT / "interfaces", ROOT / "tests"}
SUFFIXES: Final = frozenset({".html", ".js", ".json", ".py", ".toml", ".xml"})
FREE: Final = (
    "naoserver/bodies",  # descriptions, motions and looks of each body
    "plugins/naoqi/src/visualhfsm_naoqi",  # NAOqi runs on Naos only, and its names are theirs
)
"""Folders in which bodies have names."""
WORD: Final = re.compile(r"\w+")
TEXT: Final = re.compile(r"""["'](\w+)["']""")
COMPOUND: Final = re.compile(r"_|[a-z0-9][A-Z]")
"""What makes a name more than a word of the language; others, such as `torso`, count as whole texts."""
COMMON: Final = frozenset({"base", "head"})
"""Names of links that any robot may use: some joints are a `head`, and what carries a model is its `base`."""

SPELLED: Final = {
    "naoserver/moves/motion_file.py": "an example",
    "plugins/learning/src/visualhfsm_learning/_environment.py": "the name of a part of an observation",
    "naoserver_sim/self_collision.py": "an example",
    "visualhfsm/_monitor/realm/run_log.py": "an example",
    "visualhfsm/_commands/template/tests/test_blinker.py": "a user's test, for the default body",
    "visualhfsm/_commands/template_hardware/bust.toml": "a user's robot",
    "zenoh_ice/data/exceptions.py": "an example",
}
"""Files that name joints or links, and why they may."""
NAMED: Final = {
    "plugins/learning/src/visualhfsm_learning/_environment.py": "a Nao learns",
    "plugins/learning/src/visualhfsm_learning/_tasks.py": "a Nao learns",
    "naoserver_sim/robot.py": "the default",
    "visualhfsm/testing/_plugin.py": "an example",
}
"""Files that name the bodies of a Nao, and why they may."""


def _sources() -> Iterator[Path]:
    packages = {path for each in DISTRIBUTIONS for path in each.packages}
    for package in packages - GENERATED:
        for path in package.rglob("*"):
            if path.suffix in SUFFIXES and not path.relative_to(ROOT).as_posix().startswith(FREE):
                yield path


@cache
def _parts() -> frozenset[str]:
    """Return the names of the joints and links of all bodies."""
    names: set[str] = set()
    for body in map(find_body, BODY_NAMES):
        names.update(joint.name for joint in (*body.joints, *body.fixed_joints))
        names.update(link.name for link in body.links)
    return frozenset(names - COMMON)


def _spelled(text: str) -> frozenset[str]:
    """Return the names of joints and links that a text spells."""
    compounds = {word for word in WORD.findall(text) if COMPOUND.search(word)}
    return _parts() & (compounds | set(TEXT.findall(text)))


def mistakes() -> Iterator[str]:
    """Yield files that name parts of a body or the bodies of a Nao, and exceptions that are none any more."""
    parts, bodies = {}, {}
    for path in _sources():
        text, file = path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()
        parts[file] = _spelled(text)
        bodies[file] = {"H25", "H21"} & set(WORD.findall(text))
    for found, known in ((parts, SPELLED), (bodies, NAMED)):
        for file, names in sorted(found.items()):
            if names and file not in known:
                yield f"{file}: take {', '.join(sorted(names)[:5])} from the robot's Body"
        for file in known:
            if not found.get(file):
                yield f"{Path(__file__).relative_to(ROOT)}: {file} names none: strike it off"
