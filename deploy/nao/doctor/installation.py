"""Check what is installed: versions, extras, and modules that stand in for others."""

from __future__ import annotations

import importlib.util
import os
import platform
import re
import sys
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, packages_distributions, requires, version
from pathlib import Path
from typing import Final

from deploy.nao.doctor import Finding, fail, note, ok, warn

__all__ = ["check_installation", "installed_version"]

_DISTRIBUTION: Final = "visualhfsm"
_OLDEST_PYTHON: Final = (3, 11)
_PACKAGES: Final = (
    "ballmover", "behaviors", "codegen", "deploy", "hfsm_pytest", "hfsm_recording", "hfsm_runtime",
    "interfaces", "naoserver", "naoserver_naoqi", "naoserver_sim", "startup", "visualhfsm", "zenoh_ice",
)  # fmt: skip
"""The packages of the distribution; most of their names are common words."""
_OTHERS: Final = ("cv2", "mcap", "msgpack", "msgspec", "mujoco", "numpy", "qi", "rich", "typer", "zenoh")
"""What a file of one's own is easily named like, and what then is not found."""
_EXTRAS: Final[Mapping[str, str]] = {
    "sim": "the simulated robot, naoserver-sim",
    "vision": "behaviors that see",
    "web": "the editor, visualhfsm edit",
    "naoqi": "the real robot, naoserver-naoqi",
}
_REQUIREMENT: Final = re.compile(r"([A-Za-z0-9_.\-]+)(?:\[[^]]*\])?\s*(?:>=\s*([\d.]+))?")
_EXTRA: Final = re.compile(r"""extra\s*==\s*['"]([\w\-]+)['"]""")


def check_installation() -> Iterator[Finding]:
    """Yield what is found about the installation."""
    yield from _check_versions()
    yield from _check_extras()
    yield from _check_names()


def _check_versions() -> Iterator[Finding]:
    python = platform.python_version()
    if sys.version_info < _OLDEST_PYTHON:
        yield fail(f"Python {python} is too old", "install Python 3.11 or newer, and this program with it")
    installed = {name: (installed_version(name), wanted) for name, wanted in _requirements("")}
    wrong = [
        f"{name} is missing" if found is None else f"{name} {found} is older than {wanted}"
        for name, (found, wanted) in installed.items()
        if found is None or _numbers(found) < _numbers(wanted)
    ]
    if wrong:
        yield fail("; ".join(wrong), f"pip install --upgrade {_DISTRIBUTION}")
        return
    own = installed_version(_DISTRIBUTION)
    if own is None:
        yield note(f"{_DISTRIBUTION} is not installed; this runs from a copy of its sources")
    zenoh = installed_version("eclipse-zenoh")
    yield ok(f"Python {python}, {_DISTRIBUTION} {own or 'of the sources'}, zenoh {zenoh}")


def _check_extras() -> Iterator[Finding]:
    ready = []
    for extra, purpose in _EXTRAS.items():
        missing = ", ".join(name for name, _ in _requirements(extra) if installed_version(name) is None)
        if missing:
            install = f"if you want it: pip install '{_DISTRIBUTION}[{extra}]'"
            yield note(f"{purpose}: not installed ({missing})", install)
        else:
            ready.append(purpose)
    if ready:
        yield ok(f"installed: {'; '.join(ready)}")


def _check_names() -> Iterator[Finding]:
    """Yield modules that are imported, or would be, in place of those that are meant."""
    found = list(_hiding_names())
    yield from found or [ok("no module hides one of ours")]


def _hiding_names() -> Iterator[Finding]:
    root = Path(__file__).resolve().parents[3]
    places: dict[Path | None, list[str]] = {}
    for name in _PACKAGES:
        places.setdefault(_place_of(name), []).append(name)
    for place, names in places.items():
        if place is None:
            yield fail(f"missing: {', '.join(names)}", f"pip install --force-reinstall {_DISTRIBUTION}")
        elif place != root:
            yield fail(
                f"imported from {place} instead of ours: {', '.join(names)}",
                f"rename them, or take {place} out of PYTHONPATH",
            )
    distributions = packages_distributions()
    for name in _PACKAGES:
        for owner in set(distributions.get(name, ())) - {_DISTRIBUTION}:
            yield fail(f"{owner} has a package {name} as well", f"pip uninstall {owner}, or use a virtualenv")
    # The folders that Python looks into before those of installed packages.
    listed = (".", *os.environ.get("PYTHONPATH", "").split(os.pathsep))
    for folder in dict.fromkeys(Path(each).resolve() for each in listed if each):
        files = [each for name in (*_PACKAGES, *_OTHERS) for each in (f"{name}.py", f"{name}/__init__.py")]
        found = [each for each in sorted(files) if (folder / each).is_file()]
        if found and folder != root:
            yield warn(
                f"programs that start here import from {folder} what is not meant: {', '.join(found)}",
                "rename those, or start elsewhere",
            )


def _place_of(name: str) -> Path | None:
    """Return the folder from which a package is imported."""
    spec = importlib.util.find_spec(name)
    locations = list(spec.submodule_search_locations or ()) if spec else []
    return Path(locations[0]).resolve().parent if locations else None


def _requirements(extra: str) -> Iterator[tuple[str, str]]:
    """Yield name and oldest version of what the distribution requires, without extra or for one."""
    try:
        lines = requires(_DISTRIBUTION) or []
    except PackageNotFoundError:
        return
    for line in lines:
        wanted, _, marker = line.partition(";")
        in_extra = _EXTRA.search(marker)
        match = _REQUIREMENT.match(wanted.strip())
        if match and (in_extra[1] if in_extra else "") == extra and match[1] != _DISTRIBUTION:
            yield match[1], match[2] or "0"


def installed_version(name: str) -> str | None:
    """Return the version of a distribution, or None when it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text)[:3])
