"""Check what is installed: versions, extras, and files that hide it."""

from __future__ import annotations

import os
import pkgutil
import platform
import re
import site
import sys
from collections.abc import Iterable, Iterator, Mapping
from importlib.machinery import FrozenImporter, PathFinder
from importlib.metadata import PackageNotFoundError, distributions, requires
from pathlib import Path
from typing import Final

from nao_tools.findings import Finding, fail, note, ok
from zenoh_ice.application import hidden_interfaces
from zenoh_ice.data.status import version_of

_DISTRIBUTION: Final = "visualhfsm"
_EXTRAS: Final[Mapping[str, str]] = {
    "": "needed by every command",
    "sim": "the simulated robot, naoserver-sim",
    "vision": "behaviors that see",
    "web": "the editor, visualhfsm edit",
    "naoqi": "the real robot, naoserver-naoqi",
    "ros2": "ROS 2, naoserver-ros2",
}
# A line such as `mujoco>=4.0; extra == 'sim'`: name, oldest version, and extra.
_REQUIREMENT: Final = re.compile(r"([\w.-]+)[^;>]*(?:>=([\d.]+))?[^;]*(?:;.*extra *== *['\"]([\w-]+))?")
_IMPORTED: Final[Mapping[str, str]] = {
    "eclipse-zenoh": "zenoh",
    "opencv-python-headless": "cv2",
    "pillow": "PIL",
}
"""The packages that are not imported by the names of their distributions."""


def check_installation() -> Iterator[Finding]:
    """Yield findings about the installation: versions, extras, and files that hide packages."""
    try:
        lines = requires(_DISTRIBUTION) or []
    except PackageNotFoundError:
        lines = []
        yield note(f"{_DISTRIBUTION} is not installed; running from a source tree")
    lacking: dict[str, list[str]] = {extra: [] for extra in _EXTRAS}
    needed: dict[str, str] = {}
    for match in filter(None, map(_REQUIREMENT.match, lines)):
        name, oldest, extra = match.groups("")
        if extra not in lacking:
            continue
        needed[_IMPORTED.get(name, name)] = name
        installed = version_of(name, "")
        if not installed:
            lacking[extra].append(f"{name} is not installed")
        elif _numbers(installed) < _numbers(oldest):
            lacking[extra].append(f"{name} {installed} is older than {oldest}")
    if lacking[""]:
        yield fail("; ".join(lacking.pop("")), f"pip install --upgrade {_DISTRIBUTION}")
    versions = ", ".join(f"{name} {version_of(name)}" for name in (_DISTRIBUTION, "eclipse-zenoh"))
    yield ok(f"Python {platform.python_version()}, {versions}")
    for extra, problems in lacking.items():
        if problems:
            install = f"optional: pip install --upgrade '{_DISTRIBUTION}[{extra}]'"
            if extra == "naoqi" and sys.version_info >= (3, 13):
                install = "optional: use Python 3.11 or 3.12, as qi is not built for newer ones"
            yield note(f"{_EXTRAS[extra]}: {'; '.join(problems)}", install)
    if ready := [_EXTRAS[extra] for extra, problems in lacking.items() if not problems]:
        yield ok(f"installed: {'; '.join(ready)}")
    yield from _check_hidden(needed)
    yield from _check_paths()


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text)[:3])


def _check_hidden(needed: Mapping[str, str]) -> Iterator[Finding]:
    """Yield the user's files that hide our interfaces, or packages and parts of Python that we use."""
    # The folders that Python searches before those of installed packages.
    listed = (".", *os.environ.get("PYTHONPATH", "").split(os.pathsep))
    folders = list(dict.fromkeys(str(Path(each).resolve()) for each in listed if each))
    hidden = hidden_interfaces(folders)
    if hidden:
        yield fail(*hidden.rsplit(": ", 1))
    for file, name in _hiding(folders, needed):
        hidden = file
        whose = f"the package {name}, which VisualHFSM needs" if name in needed else f"Python's own {name}"
        yield fail(f"{file} hides {whose}", "rename it, or take its folder from PYTHONPATH")
    if not hidden:
        yield ok("no module hides our interfaces, nor what they need")


def _hiding(folders: Iterable[str], needed: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the files in folders that hide a module, and its name; `needed` has distributions by imports."""
    others = [each for each in sys.path if each and str(Path(each).resolve()) not in folders]
    ours = {*needed, *(sys.stdlib_module_names & sys.modules.keys())}
    for folder in folders:
        for module in pkgutil.iter_modules([folder]):
            name = module.name
            if name not in ours or FrozenImporter.find_spec(name) is not None:
                continue
            hiding, hidden = PathFinder.find_spec(name, [folder]), PathFinder.find_spec(name, others)
            if hiding and hiding.origin and hidden and hidden.origin:
                # One that was installed in a folder of PYTHONPATH has its facts beside it.
                installed = name in needed and any(distributions(name=needed[name], path=[folder]))
                if not installed:
                    yield hiding.origin, name


def _check_paths() -> Iterator[Finding]:
    """Yield a note if Python does not start where only ASCII is known.

    It reads the files that name the folders of packages before any program begins, in the locale's encoding.
    """
    for folder in site.getsitepackages():
        for file in sorted(Path(folder).glob("*.pth")):
            if not file.read_bytes().isascii():
                text = (
                    f"{file} names a folder with letters beyond ASCII: with LC_ALL=C, Python does not start"
                )
                yield note(text, "where LC_ALL=C is set, set LC_ALL=C.UTF-8, or install in another folder")
