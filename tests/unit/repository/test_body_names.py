"""Only the description of a body, and what is made for it, spell the names of its joints and links."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

import pytest

from naoserver.bodies import BODY_NAMES, find_body
from tests.support.places import ROOT

GENERATED: Final = {ROOT / "behaviors", ROOT / "interfaces", ROOT / "tests"}
SUFFIXES: Final = frozenset({".html", ".js", ".json", ".py", ".toml", ".xml"})
FREE: Final = (
    "naoserver/bodies",  # descriptions, motions and looks of each body
    "naoserver/naoqi",  # NAOqi runs on Naos only, and its names are theirs
    "plugins/visualhfsm_naoqi_programs",
)
"""Folders in which bodies have names."""
WORD: Final = re.compile(r"\w+")
TEXT: Final = re.compile(r"""["'](\w+)["']""")
COMPOUND: Final = re.compile(r"_|[a-z0-9][A-Z]")
"""What makes a name more than a word of the language; others, such as `torso`, count as whole strings only."""
COMMON: Final = frozenset({"base", "head"})
"""Names of links that every robot may use: a group of joints is a `head`, and what carries a model is its `base`."""

SPELLED: Final = {
    "naoserver/moves/motion_file.py": "an example",
    "plugins/visualhfsm_learning/_environment.py": "the name of a part of an observation",
    "naoserver_sim/self_collision.py": "an example",
    "visualhfsm/_monitor/realm/run_log.py": "an example",
    "visualhfsm/_commands/template/tests/test_blinker.py": "a user's test, for the default body",
    "visualhfsm/_commands/template_hardware/bust.toml": "a user's robot",
    "zenoh_ice/data/exceptions.py": "an example",
}
"""Files that name joints or links, and why they may."""
NAMED: Final = {
    "plugins/visualhfsm_learning/_environment.py": "a Nao learns",
    "plugins/visualhfsm_learning/_tasks.py": "a Nao learns",
    "naoserver_sim/robot.py": "the default",
    "visualhfsm/testing/_plugin.py": "an example",
}
"""Files that name the bodies of a Nao, and why they may."""


def sources() -> Iterator[Path]:
    packages = {path.parent for folder in (ROOT, ROOT / "plugins") for path in folder.glob("*/__init__.py")}
    for package in packages - GENERATED:
        for path in package.rglob("*"):
            if path.suffix in SUFFIXES and not path.relative_to(ROOT).as_posix().startswith(FREE):
                yield path


@cache
def parts() -> frozenset[str]:
    """Return the names of the joints and links of all bodies."""
    names: set[str] = set()
    for body in map(find_body, BODY_NAMES):
        names.update(joint.name for joint in (*body.joints, *body.fixed_joints))
        names.update(link.name for link in body.links)
    return frozenset(names - COMMON)


def spelled(text: str) -> frozenset[str]:
    """Return the names of joints and links that a text spells."""
    compounds = {word for word in WORD.findall(text) if COMPOUND.search(word)}
    return parts() & (compounds | set(TEXT.findall(text)))


@cache
def found() -> tuple[dict[str, frozenset[str]], dict[str, set[str]]]:
    """Return the names of joints and links, and those of the Nao's bodies, in each file that has any."""
    of_parts: dict[str, frozenset[str]] = {}
    of_bodies: dict[str, set[str]] = {}
    for path in sources():
        text, file = path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()
        if names := spelled(text):
            of_parts[file] = names
        if bodies := {"H25", "H21"} & set(WORD.findall(text)):
            of_bodies[file] = bodies
    return of_parts, of_bodies


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "known"), [(0, SPELLED), (1, NAMED)], ids=["joints and links", "bodies"])
def test_no_other_file_names_the_parts_of_a_body_or_the_bodies_of_a_nao(kind, known):
    unknown = {file: sorted(names)[:5] for file, names in found()[kind].items() if file not in known}
    assert unknown == {}, "take what they need from the robot's Body"


@pytest.mark.parametrize(("kind", "known"), [(0, SPELLED), (1, NAMED)], ids=["joints and links", "bodies"])
def test_every_exception_is_still_needed(kind, known):
    assert sorted(known.keys() - found()[kind].keys()) == [], "strike them off the list"


def test_it_finds_names():
    assert spelled('angles["HeadYaw"]') == spelled("the joint HeadYaw") == {"HeadYaw"}
    assert spelled('place_of("torso")') == {"torso"}
    assert spelled("the head turns") == set()
