"""The walls around a submission's code: bubblewrap, with namespaces and a filter of system calls."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache, lru_cache
from pathlib import Path
from typing import Final

import codegen
from visualhfsm_classes._errors import SandboxUnavailable
from visualhfsm_classes._seccomp import make_filter

_CORE: Final = Path(codegen.__file__).resolve().parents[1]
"""The folder of the packages of the core."""
_INSIDE: Final = Path("/packages")
_OURS: Final = _INSIDE / "ours"
_COMPILER: Final = _INSIDE / "compile.py"
_PACKAGES: Final = ("codegen", "hfsm_runtime", "interfaces", "naoserver", "zenoh_ice")
"""The packages that behaviors import, and that compile them: neither the judge nor behaviors of others."""
_SEAMS: Final = ("codegen.", "hfsm_runtime.")
"""Beginnings of the seams to which plug-ins add what compiles and runs documents."""
_TOO: Final = ("visualhfsm_match", "visualhfsm_ros2", "zenoh_ros2")
"""The names of others that may be there: documents import the localization on a field, too."""
_CONTAINED: Final = f"{__package__}/contained"
"""The program that runs the code."""
_DISTRIBUTIONS: Final = "visualhfsm"
"""How the names of our distributions begin."""
_LIBRARIES: Final = ("/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib")
_FILES: Final = ("/etc/ld.so.cache", "/etc/alternatives", "/etc/localtime", "/usr/share/zoneinfo")
_SYSTEM: Final = (Path("/usr"), Path("/usr/local"))
_DISK: Final = 32 << 20
"""Bytes of its temporary files."""
_SITES: Final = ("site-packages", "dist-packages")
"""Names of folders with installed packages."""
_NUMERIC: Final = ("OPENBLAS_", "NPY_")
"""Beginnings of the variables that choose how NumPy computes: inside it is to compute as it does outside."""
_NOBODY: Final = "65534"
_PROBE_LIMIT: Final = 30.0  # s


class Walls:
    """The command that runs Python behind walls: it sees Python, packages, and an empty folder for its files.

    `include` are folders with packages of interfaces; what is in `hidden` is covered wherever it would be
    seen. With `unsafe` the command runs without walls.
    """

    def __init__(
        self, include: Sequence[Path] = (), hidden: Sequence[Path] = (), *, unsafe: bool = False
    ) -> None:
        self.unsafe: Final = unsafe
        resolved = [folder.resolve() for folder in include]
        self.include: Final = [
            str(folder if unsafe else _INSIDE / f"include{number}") for number, folder in enumerate(resolved)
        ]
        """The folders with packages of interfaces, as its code sees them."""
        self.compiler: Final = str(Path(__file__).with_name("_compile.py") if unsafe else _COMPILER)
        """The program that compiles, as seen from inside."""
        self._command = [sys.executable] if unsafe else _bubblewrap(resolved, hidden)

    def check(self) -> None:
        """Raise SandboxUnavailable if there can be no walls here."""
        if not self.unsafe:
            _probe(tuple(self._command))

    @contextmanager
    def start(self, *arguments: str) -> Iterator[tuple[list[str], Mapping[str, str] | None, Sequence[int]]]:
        """Yield the command that runs Python, its environment, and the files that it inherits."""
        if self.unsafe:
            yield [*self._command, *arguments], {**os.environ, "PYTHONHASHSEED": "0"}, ()
            return
        with ExitStack() as files:
            rules = files.enter_context(tempfile.TemporaryFile())
            rules.write(make_filter())
            rules.seek(0)
            number = rules.fileno()
            head, python = self._command[:-1], self._command[-1]
            command = [*head, "--seccomp", str(number), "--", python, "-S", "-P", *arguments]
            yield command, {}, (number,)


def check_walls() -> None:
    """Raise SandboxUnavailable if the code of submissions cannot be contained here."""
    Walls().check()


def _bubblewrap(include: Sequence[Path], hidden: Sequence[Path]) -> list[str]:
    """Return the command without arguments of Python; the last of it is Python."""
    bwrap = shutil.which("bwrap")
    if bwrap is None:
        raise SandboxUnavailable.because(
            "bubblewrap is missing, so that nothing contains a stranger's program: install it "
            "(apt-get install bubblewrap), or trust the documents and run them with --unsafe"
        )
    python = Path(os.path.realpath(getattr(sys, "_base_executable", sys.executable)))
    seen = _seen(python, include)
    command = [bwrap, "--unshare-all", "--unshare-user", "--uid", _NOBODY, "--gid", _NOBODY]
    command += ["--cap-drop", "ALL", "--new-session", "--die-with-parent", "--clearenv"]
    for source, place in seen.items():
        if source.is_symlink():
            command += ["--symlink", str(source.readlink()), str(place)]
        else:
            command += ["--ro-bind", str(source), str(place)]
    for folder in _outermost(_covered(seen, hidden)):
        command += ["--tmpfs", str(folder), "--remount-ro", str(folder)]
    command += ["--dev", "/dev", "--size", str(_DISK), "--tmpfs", "/tmp"]  # noqa: S108 - its own
    command += ["--remount-ro", "/dev", "--remount-ro", "/", "--chdir", "/tmp"]  # noqa: S108
    sites = [str(place) for place in seen.values() if _is_site(place)]
    environment = {
        **{name: value for name, value in os.environ.items() if name.startswith(_NUMERIC)},
        "HOME": "/tmp",  # noqa: S108
        "LANG": "C.UTF-8",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONHASHSEED": "0",  # the same marks each time
        "PYTHONPATH": os.pathsep.join([str(_OURS), *sites]),
        # One thread each: they would take what address space there is.
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    for name, value in environment.items():
        command += ["--setenv", name, value]
    return [*command, str(python)]


def _seen(python: Path, include: Sequence[Path]) -> dict[Path, Path]:
    """Return the files and folders that are seen, each with its place inside."""
    seen = {Path(name): Path(name) for name in (*_LIBRARIES, *_FILES) if os.path.lexists(name)}
    prefix = Path(sys.base_prefix).resolve()
    if prefix in _SYSTEM:
        seen[python] = python
    else:
        seen[prefix] = prefix
    sites = [Path(each).resolve() for each in sys.path if Path(each).name in _SITES and Path(each).is_dir()]
    for number, site in enumerate(dict.fromkeys([*sites, *_linked(sites)])):
        seen[site] = _INSIDE / f"site{number}"
    seen |= {_CORE / name: _OURS / name for name in _PACKAGES}
    seen[Path(__file__).with_name("contained")] = _OURS / _CONTAINED
    seen |= {folder: _OURS / name for name, folder in _compiling().items()}
    seen[Path(__file__).with_name("_compile.py")] = _COMPILER
    for number, folder in enumerate(include):
        seen[folder] = _INSIDE / f"include{number}"
    return seen


@cache
def _compiling() -> dict[str, Path]:
    """Return the folders of plug-ins that compile or run documents, by their names."""
    groups = (each for each in importlib.metadata.entry_points().groups if each.startswith(_SEAMS))
    points = (point for group in groups for point in importlib.metadata.entry_points(group=group))
    names = sorted({*(point.module.partition(".")[0] for point in points if _is_ours(point.dist)), *_TOO})
    specs = {name: importlib.util.find_spec(name) for name in names}
    return {name: Path(spec.origin).resolve().parent for name, spec in specs.items() if spec and spec.origin}


def _is_ours(distribution: importlib.metadata.Distribution | None) -> bool:
    return distribution is not None and distribution.name.partition("-")[0] == _DISTRIBUTIONS


def _linked(sites: Sequence[Path]) -> Iterator[Path]:
    """Yield other sites, into which links in some sites lead; links into other folders lead nowhere."""
    for site in sites:
        for link in sorted(site.iterdir()):
            if link.is_symlink() and (target := link.resolve().parent).name in _SITES and target.is_dir():
                yield target


def _covered(seen: Mapping[Path, Path], hidden: Sequence[Path]) -> Iterator[Path]:
    """Yield the places of folders that are to be empty: what is hidden, and our distributions in sites.

    What code may import of those has a place of its own.
    """
    sites = [source for source, place in seen.items() if _is_site(place)]
    ours = {site / name for site in sites for name in _distributed()}
    for folder in {*ours, *(path.resolve() for path in hidden)}:
        for source, place in seen.items():
            if folder.is_symlink():
                continue  # it leads nowhere inside
            if folder.is_dir() and folder != source and folder.is_relative_to(source):
                yield place / folder.relative_to(source)


def _outermost(places: Iterable[Path]) -> list[Path]:
    """Return places without those below others, where nothing can be made any more."""
    outer: list[Path] = []
    for place in sorted(places):
        if not outer or not place.is_relative_to(outer[-1]):
            outer.append(place)
    return outer


def _distributed() -> set[str]:
    """Return the folders that our distributions install beside one another, the behaviors among them."""
    ours = [each for each in importlib.metadata.distributions() if _is_ours(each)]
    names = {file.parts[0] for each in ours for file in each.files or () if len(file.parts) > 1}
    return {name for name in names if name.isidentifier()}


def _is_site(place: Path) -> bool:
    return place.parent == _INSIDE and place.name.startswith("site")


@lru_cache
def _probe(command: tuple[str, ...]) -> None:
    """Raise SandboxUnavailable if bubblewrap cannot run a command here."""
    with SandboxUnavailable.in_place_of(
        (OSError, subprocess.TimeoutExpired), "bubblewrap does not run: {reason}"
    ):
        found = subprocess.run(
            [*command[:-1], "--", command[-1], "-S", "-c", "pass"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_PROBE_LIMIT,
            check=False,
        )
    if found.returncode:
        said = " ".join(found.stderr.split())[:300] or f"exit code {found.returncode}"
        raise SandboxUnavailable.because(
            "bubblewrap cannot make walls here ({said}): it needs version 0.8 and user "
            "namespaces, which some containers and systems forbid; or trust the documents and "
            "run them with --unsafe",
            said=said,
        )
