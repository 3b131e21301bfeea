"""Expand xacro, the macros in which ROS writes URDFs, with the package xacrodoc.

Xacro evaluates expressions of Python, so it runs in another process, which may only read files of the model,
within limits of time and memory.
"""

from __future__ import annotations

import contextlib
import errno
import importlib.util
import io
import json
import math
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final

from naoserver.errors import RobotError
from visualhfsm_own_robots._tree import LARGEST_FILE, POINTER, Element, is_pointer, parse_tree

_LONGEST: Final = 5
"""Longest time in s of the processor that an expansion may take."""
_WALL: Final = 50.0
"""Longest time in s that it may take by the clock on the wall, on a busy machine."""
Argument = str | bool | int | float
NO_XACRO: Final = "it has no xacro, so that it takes no arguments"
_MEMORY: Final = 1 << 30
_LEFTOVER: Final = re.compile(r"\$[{(][^})]*[})]?")
_PLAIN: Final = re.compile(r"\$\{\s*\w+\s*\}")
_NAMES: Final = ("name", "link", "joint")
_READ: Final = ("link", "joint", "material")
"""The elements of a URDF that are about the robot; others have texts for other programs."""
_EVALUATED: Final = re.compile(r"when evaluating expression '(.+?)'")
_UNDEFINED: Final = re.compile(r"Undefined substitution argument (\w+)")
_UNFOUND: Final = "Package not found: "
_FOUND_IN: Final = re.compile(r"\$\(find\s+([^\s)]+)\s*\)")
_INCLUDED: Final = re.compile(r"<xacro:include[^>]*?filename\s*=\s*[\"']([^\"']+)[\"']")
_IN_FILE: Final = ", in the file"
_LONGEST_LIST: Final = 200
_FORBIDDEN: Final = ("os.", "subprocess.", "socket.", "ctypes.", "shutil.")
"""Beginnings of events of Python that an expansion does not need."""
_READING: Final = ("os.listdir", "os.scandir", "os.walk", "os.putenv", "os.unsetenv")
_WRITING: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_KEPT_VARIABLES: Final = ("PATH", "PYTHONPATH", "SYSTEMROOT")


def expanded(
    root: Element, path: Path, packages: Mapping[str, Path], arguments: Mapping[str, Argument]
) -> tuple[Element, list[str]]:
    """Return the tree of a URDF without xacro, and notes; `packages` are the folders of ROS packages by name.

    A `${variable}` in the names of a file without definitions is what a launch file would replace: it is
    removed. `arguments` are the values of `$(arg NAME)`. Raises RobotError, with file and line, for xacro
    that cannot be expanded, and for arguments of a file without xacro.
    """
    macros = path.suffix == ".xacro" or any(each.tag.startswith("xacro:") for each in root.all())
    read = [root] if macros else [part for part in root.children if part.tag in _READ]
    found = [leftover for part in read for element in part.all() for leftover in _leftovers(element)]
    if arguments and not found:
        raise RobotError(f"{path}: {NO_XACRO}")
    if not found:
        return root, []
    if not macros and not arguments and all(_PLAIN.fullmatch(text) for *_, text in found):
        named = [(element, name, text) for element, name, text in found if name in _NAMES]
        for element, name, _ in named:
            element.attributes[name] = _PLAIN.sub("", element.attributes[name])
        unknown = "is defined nowhere: the names are read without it"
        return root, [f"{element.at}: {text} {unknown}" for element, _, text in named[:1]]
    if importlib.util.find_spec("xacrodoc") is None:
        element, _, text = found[0]
        remedy = "pip install 'visualhfsm[models]', or run xacro first"
        raise RobotError(f"{element.at}: {text[:60]}: this is xacro; {remedy}")
    note = f"{path}: xacro is expanded; lines are those of the URDF that it gives"
    return parse_tree(_run(root, path, packages, arguments), path), [note]


def _leftovers(element: Element) -> Iterator[tuple[Element, str, str]]:
    """Yield what is xacro in an element: with the name of the attribute, and the text."""
    if element.tag.startswith("xacro:"):
        yield element, "", f"<{element.tag}>"
    for name, value in element.attributes.items():
        for text in _LEFTOVER.findall(value):
            yield element, name, text


def _run(root: Element, path: Path, packages: Mapping[str, Path], arguments: Mapping[str, Argument]) -> bytes:
    """Return the text of an expanded file."""
    folders = {name: str(folder) for name, folder in packages.items()}
    given = {name: each if isinstance(each, str) else json.dumps(each) for name, each in arguments.items()}
    asked = json.dumps([path.name, folders, given, _LONGEST]).encode()
    command = [sys.executable, "-P", "-m", "visualhfsm_own_robots._xacro"]
    kept = {name: os.environ[name] for name in _KEPT_VARIABLES if name in os.environ}
    try:
        done = subprocess.run(
            command, input=asked, cwd=path.parent, env=kept, timeout=_WALL, capture_output=True, check=False
        )
    except subprocess.TimeoutExpired:
        raise RobotError(f"{path}: xacro is not expanded within {_WALL:g} s") from None
    if done.returncode == 0:
        return done.stdout
    if done.returncode == -signal.SIGXCPU:
        raise RobotError(f"{path}: xacro is not expanded within {_LONGEST} s of the processor")
    why = " ".join(done.stderr.decode(errors="replace").split())[-300:] or "it takes too much memory"
    if names := _UNDEFINED.findall(why) or [each.name for each in root.all("xacro:arg")]:
        known = ", ".join(names)[:_LONGEST_LIST]
        why += f"; an argument is given by --xacro {names[0]}:=VALUE, or in [xacro] of a TOML file: {known}"
    place = str(path)
    if (expression := _EVALUATED.search(why)) and _IN_FILE not in why:
        said = (each for each in root.all() for text in each.attributes.values() if expression[1] in text)
        place = next((each.at for each in said if any(_leftovers(each))), place)
    raise RobotError(f"{place}: xacro cannot be expanded: {why}")


def _guard(folders: Iterable[Path], seconds: int) -> list[Path]:
    """Let this process from now on only read files in some folders and those of Python; return what it opens.

    It may take some more seconds of the processor.
    """
    last = math.ceil(time.process_time()) + seconds
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (last, last + 1))
    opened: list[Path] = []
    allowed = [*folders, *(Path(entry).resolve() for entry in sys.path if entry), Path(sys.base_prefix)]

    def watch(event: str, arguments: tuple[object, ...]) -> None:
        if event == "open":
            name, _, flags = arguments
            if isinstance(name, int):
                return
            path = Path(os.fsdecode(name)).resolve()  # type: ignore[arg-type]  # a path, then
            writes = isinstance(flags, int) and flags & _WRITING
            if writes or not any(map(path.is_relative_to, allowed)):
                why = "outside the folders of the model and of its ROS package"
                raise PermissionError(errno.EACCES, why, str(path))
            opened.append(path)
        elif event.startswith(_FORBIDDEN) and event not in _READING:
            raise PermissionError(errno.EACCES, "nothing that xacro needs", event)

    sys.addaudithook(watch)
    return opened


def _missing(model: Path, folders: Mapping[str, str]) -> str:
    """Say which ROS packages that a file and what it includes name are not here, and what helps."""
    missing: dict[str, None] = {}
    files = [model]
    for file in files:  # which grow meanwhile
        try:
            text = file.read_text(encoding="utf-8-sig")
        except OSError:
            continue  # the packages that it names are asked for once it can be read
        missing |= dict.fromkeys(name for name in _FOUND_IN.findall(text) if name not in folders)
        for name in _INCLUDED.findall(text):
            path = (file.parent / _FOUND_IN.sub(lambda of: folders.get(of[1], of[0]), name)).resolve()
            if path not in files:
                files.append(path)
    around = [folder for folder in map(Path, folders.values()) if model.is_relative_to(folder)]
    beside = around[0].name if around else "that of the model, which needs a package.xml, too"
    them = ("package {} is", "its folder") if len(missing) == 1 else ("packages {} are", "their folders")
    named = them[0].format(", ".join(missing))
    return f"the ROS {named} missing: put {them[1]} beside {beside}"


def _main() -> int:
    """Print a file of this folder, expanded, as stdin asks for it."""
    import xacro
    import xacrodoc

    name, folders, arguments, seconds = json.load(sys.stdin)
    xacrodoc.packages.update_package_cache(folders)
    allowed = [Path.cwd().resolve(), *(Path(folder).resolve() for folder in folders.values())]
    opened = _guard(allowed, seconds)
    try:
        # What xacro prints are warnings about old spellings.
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            text = Path(name).read_text(encoding="utf-8-sig")
            document = xacrodoc.XacroDoc.from_string(text, arguments, resolve_packages=False).dom
            content = document.toprettyxml(indent=" ").encode()
    except Exception as problem:  # noqa: BLE001 - whatever an expression raises is the user's to know
        known = [path for path in dict.fromkeys(opened) if path.is_file()]
        pointers = [path for path in known if is_pointer(path.read_bytes())]
        within = [f", in the macro {each.body.getAttribute('name')}" for each in xacro.macrostack or ()]
        within += [f"{_IN_FILE} {name}" for name in xacro.filestack or () if name]
        why = f"{problem or type(problem).__name__}{''.join(reversed(within))}"
        if _UNFOUND in why:
            why = _missing(Path(name).resolve(), folders)
        sys.stderr.write(f"{pointers[-1]} {POINTER}" if pointers else why)
        return 1
    if len(content) > LARGEST_FILE:
        sys.stderr.write(f"it gives more than {LARGEST_FILE >> 20} MB")
        return 1
    sys.stdout.buffer.write(content)
    return 0


if __name__ == "__main__":
    raise SystemExit(_main())
