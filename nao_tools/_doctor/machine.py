"""Check the machine: what renders, its limits, addresses, clock, walls, robots served on it."""

from __future__ import annotations

import errno
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import msgspec

from nao_tools.findings import Finding, fail, note, ok, warn
from zenoh_ice.application.kept_stop import UNREADABLE, Kept, kept_directory, read_kept
from zenoh_ice.application.processor import IN_PART, is_in_part, lacks_of_mujoco
from zenoh_ice.data.text import printable, signal_name, text_of
from zenoh_ice.plugins import NotInstalledError, optional
from zenoh_ice.settings import LOOPBACK_6, has_address, has_only_ipv6

_LIMIT: Final = 30.0  # s for another process; software rendering takes some to start
_LONGEST: Final = 500  # characters of its last line
_MISSING: Final = "missing "
"""The last words of a program that lacks a package, before the name of that."""
_IMPORT: Final = "import "
"""The last words of a program that cannot import a package, before the error."""

# A picture is taken in another process: a broken driver may crash the one that loads it, and so may MuJoCo.
# It is imported as by naoserver-sim, which renders without a window whatever MUJOCO_GL says.
_GL_PROGRAM: Final = """\
import os, sys
chosen = os.environ.get("MUJOCO_GL", "")
os.environ["MUJOCO_GL"] = "disable"
try:
    import mujoco
    import numpy as np
    from naoserver_sim.cameras import create_context
except ModuleNotFoundError as error:
    sys.exit(f"missing {error.name}")
except Exception as error:
    sys.exit(" ".join(f"import {type(error).__name__}: {error}".split()))
os.environ["MUJOCO_GL"] = chosen
print("imported", flush=True)
ball = "<mujoco><worldbody><geom size='1' rgba='1 1 1 1'/></worldbody></mujoco>"
model = mujoco.MjModel.from_xml_string(ball)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with create_context(64, 64).as_current():
    context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
    scene, camera, everything = mujoco.MjvScene(model, 10), mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, everything, scene)
    viewport, picture = mujoco.MjrRect(0, 0, 64, 64), np.zeros((64, 64, 3), np.uint8)
    mujoco.mjr_render(viewport, scene, context)
    mujoco.mjr_readPixels(picture, None, viewport, context)
    context.free()
if not picture.any():
    sys.exit("the picture of a white ball is black")
print(f"a picture of 64x64 with {os.environ['MUJOCO_GL']}")
"""
_GL: Final = "MUJOCO_GL"
_GL_OFF: Final = ("disable", "disabled", "off", "false", "0")
_GL_RENDERS: Final = ("egl", "osmesa", *_GL_OFF)
"""The values that the simulated cameras obey."""
_GL_WINDOWS: Final = ("", "enable", "enabled", "on", "true", "1", "glfw", "glx")
"""The other values that MuJoCo accepts."""
_GL_PACKAGES: Final = "sudo apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libopengl0"
_SOFTWARE_GL: Final = "render in software: MUJOCO_GL=osmesa, after sudo apt-get install libosmesa6"
_REPAIR: Final = (
    "pip install --force-reinstall 'visualhfsm[sim]', unless a file hides a package, as said above"
)
_OTHER_PROCESSOR: Final = "use another computer; give a virtual machine the processor of its host"

_FEW_FILES: Final = 1024
_OLDEST_TIME: Final = 1_704_067_200.0  # 2024-01-01: a clock before that was never set

_MOST_KEPT: Final = 20  # whose kept stops are listed
_RECORD: Final = bytes(4096)  # larger than any that a server keeps, and a block of a disk
_FULL: Final = (errno.ENOSPC, errno.EDQUOT)
_CANNOT: Final = "no emergency stop can be kept"


def check_machine() -> Iterator[Finding]:
    """Yield findings about the machine, which matter to the programs that run on it."""
    yield from _check_gl_choice()
    yield _check_rendering()
    yield from _check_grading()
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= files < _FEW_FILES:
        text = f"a process may open only {files} files; each link takes one"
        yield warn(text, "ulimit -n 4096, before you start it")
    yield from _check_temporary()
    yield from _check_addresses()
    if time.time() < _OLDEST_TIME:
        date = time.strftime("%Y-%m-%d")
        yield fail(f"the machine's clock says {date}", "set it: sudo timedatectl set-ntp true")


def _check_gl_choice() -> Iterator[Finding]:
    """Yield what becomes of a wish for a GL library that the simulated cameras do not obey."""
    chosen = os.environ.get(_GL, "").lower().strip()
    if chosen not in (*_GL_RENDERS, *_GL_WINDOWS):
        text = f"{_GL}={chosen}: MuJoCo has no such choice, and programs that import it end"
        yield fail(text, f"unset {_GL}")
    elif chosen in _GL_WINDOWS and chosen:
        text = (
            f"{_GL}={chosen}: the simulated cameras render without a window, so naoserver-sim chooses itself"
        )
        yield note(text, f"unset {_GL}, or set it to egl, osmesa or off")


def _check_rendering() -> Finding:
    """Check whether the simulated cameras can render."""
    done = _ran(_GL_PROGRAM)
    if done is None:
        return fail(f"GL: no picture within {_LIMIT:g} s", _SOFTWARE_GL)
    last = _last_line(done)
    if done.returncode == 0:
        return ok(f"GL renders {last}")
    if last.startswith(_MISSING):
        return note(f"GL: not checked, {last.removeprefix(_MISSING)} is not installed")
    if is_in_part(last):
        return fail(*IN_PART)
    if last.startswith(_IMPORT):
        return fail(f"the simulator cannot be loaded: {last.removeprefix(_IMPORT)}", _REPAIR)
    if done.returncode > 0:
        remedy = f"unset {_GL}" if os.environ.get(_GL, "").lower() in _GL_OFF else _GL_PACKAGES
        return fail(f"GL: the simulated cameras have no pictures: {last}", remedy)
    name = signal_name(-done.returncode)
    if done.stdout:
        return fail(f"GL: the driver ended the process by {name}", _SOFTWARE_GL)
    if done.returncode == -signal.SIGILL:
        why = lacks_of_mujoco() or "it takes instructions that this processor lacks"
        return fail(f"the simulator cannot be loaded, it ends by {name}: {why}", _OTHER_PROCESSOR)
    return fail(f"the simulator cannot be loaded, it ends by {name}", _REPAIR)


def _check_grading() -> Iterator[Finding]:
    """Yield whether submissions can be graded here, if there is the plug-in that grades."""
    try:
        yield from optional("visualhfsm_classes", "visualhfsm[classes]").check_grading()
    except NotInstalledError:
        return
    except (Exception, SystemExit) as error:  # noqa: BLE001 - whatever a file that hides a package raises
        yield fail(f"grading: it cannot be checked: {' '.join(text_of(error).split())}", _REPAIR)


def _ran(program: str) -> subprocess.CompletedProcess[bytes] | None:
    """Run a Python program to its end; return None at the limit."""
    try:
        return subprocess.run(
            [sys.executable, "-P", "-c", program], capture_output=True, timeout=_LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        return None


def _last_line(done: subprocess.CompletedProcess[bytes]) -> str:
    """Return the last line that a program printed: of its errors, if it failed."""
    output = (done.stderr.strip() if done.returncode else b"") or done.stdout
    return output.decode(errors="replace").strip().rpartition("\n")[2][:_LONGEST]


def _check_temporary() -> Iterator[Finding]:
    """Yield a warning if temporary files cannot be where the user wants them."""
    wanted = os.environ.get("TMPDIR", "")
    try:
        folder = tempfile.gettempdir()
    except OSError as error:
        yield fail(
            f"no temporary files can be written: {error.strerror}", "make room, or set TMPDIR to a folder"
        )
        return
    if wanted and folder != os.path.abspath(wanted):  # noqa: PTH100 - as tempfile compares
        text = f"TMPDIR={wanted}: nothing can be written there, so temporary files are in {folder}"
        yield warn(text, "make that folder, or room in it; or unset TMPDIR")


def _check_addresses() -> Iterator[Finding]:
    """Yield what to do if the default endpoint cannot be one of this machine."""
    if has_only_ipv6():
        text = "this machine has no address 127.0.0.1, only IPv6: the default endpoint is none here"
        yield note(
            text, f"naoserver-sim --listen '{LOOPBACK_6}', and --connect '{LOOPBACK_6}' for all others"
        )
    elif not has_address("127.0.0.1"):
        text = "this machine has neither the address 127.0.0.1 nor ::1: its programs do not reach one another"
        yield fail(text, "sudo ip link set lo up")


def check_robots() -> Iterator[Finding]:
    """Yield a note for each robot whose next server on this machine starts stopped, or may do so.

    Where a server could not keep its stop, and so would not start, there is a failure.
    """
    try:
        folder = kept_directory()
        files = sorted(folder.glob("*.json"))
    except OSError as error:
        yield fail(f"{_CANNOT}: {error}", "set XDG_STATE_HOME to a folder")
        return
    try:
        _write_in(folder)
    except OSError as error:
        text = f"{_CANNOT} in {folder}, so that no robot server starts: {error.strerror}"
        remedy = "make room there" if error.errno in _FULL else "make it yours"
        yield fail(text, f"{remedy}, or set XDG_STATE_HOME to a folder that can be written")
    for path in files[:_MOST_KEPT]:
        realm = printable(path.stem.rpartition("-")[0])
        try:
            kept = read_kept(path)
        except (OSError, msgspec.MsgspecError):
            kept = Kept(stop=UNREADABLE)
        look = f"look at it, then: nao stop --reset --realm {realm}"
        if kept.stop:
            yield note(f"a robot of realm {realm} is stopped: {printable(kept.stop)}", look)
        elif kept.running:
            text = f"a server of realm {realm} runs, or was killed: then the next one starts stopped"
            yield note(text, "look at the robot before you start its server again")
        for body, why in kept.aside.items():
            text = f"the simulated {printable(body)} of realm {realm} is stopped: {printable(why)}"
            yield note(text, f"start it, then: nao stop --reset --realm {realm}")
    if len(files) > _MOST_KEPT:
        yield note(f"{len(files) - _MOST_KEPT} more in {files[0].parent}", "delete those of former robots")
    if not files:
        yield ok("none is stopped")


def _write_in(folder: Path) -> None:
    """Write a record in a folder, or in what there is of it so far, and take it away; raises OSError."""
    while not folder.exists():
        folder = folder.parent
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(_RECORD)
        file.flush()
        os.fsync(file.fileno())
