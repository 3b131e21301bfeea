"""Check the machine: rendering, shared memory, limits, and its clock."""

from __future__ import annotations

import contextlib
import os
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from deploy.nao.doctor.finding import Finding, fail, note, ok, warn
from deploy.nao.quantities import bytes_text, count_text
from zenoh_ice.wire.shared_memory import may_lock_enough

__all__ = ["check_machine"]

_GL_LIMIT: Final = 30.0  # s; software rendering takes some to start
_GL_PROGRAM: Final = """\
import sys
try:
    import mujoco
    from naoserver_sim.gl import create_context
except ModuleNotFoundError as error:
    sys.exit(f"missing {error.name}")
context = create_context(16, 16)
import os
from OpenGL import GL
print(os.environ.get("MUJOCO_GL", ""), GL.glGetString(GL.GL_RENDERER).decode(), sep="; ")
context.free()
"""
"""Renders in a process of its own: a broken driver may end the process that loads it."""
_GL_PACKAGES: Final = "sudo apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libopengl0"
_SHARED_MEMORY: Final = Path("/dev/shm")  # noqa: S108 - where the system has it
_SEGMENTS: Final = "*.zenoh"
_SMALL: Final = 128 << 20  # bytes of shared memory that a camera, its readers and their pools need
_MUCH_LEFT: Final = 1 << 20  # bytes of it; every process leaves some kilobytes, which the next takes away
_FEW_FILES: Final = 1024
_OLDEST_TIME: Final = 1_704_067_200.0  # 2024-01-01: a clock before that was never set


def check_machine() -> Iterator[Finding]:
    """Yield what is found about the machine."""
    yield from _check_rendering()
    yield from _check_shared_memory()
    yield from _check_limits()
    yield from _check_clock()


def _check_rendering() -> Iterator[Finding]:
    """Yield whether the simulated cameras can render."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", _GL_PROGRAM],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_GL_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        yield fail(f"GL: no picture within {_GL_LIMIT:g} s", "try software rendering: MUJOCO_GL=osmesa")
        return
    last = (done.stderr.strip() or done.stdout.strip()).rpartition("\n")[2][:300]
    if done.returncode == 0:
        yield ok(f"GL renders: {done.stdout.strip()}")
    elif last.startswith("missing "):
        yield note(f"GL: not looked at, {last.removeprefix('missing ')} is not installed")
    elif done.returncode < 0:
        yield fail(
            f"GL: the driver ended the process by signal {-done.returncode}",
            "render in software: MUJOCO_GL=osmesa, after sudo apt-get install libosmesa6",
        )
    else:
        yield fail(f"GL: the simulated cameras have no pictures: {last}", _GL_PACKAGES)


def _check_shared_memory() -> Iterator[Finding]:
    """Yield how much shared memory there is, and what processes that are gone left in it."""
    if not _SHARED_MEMORY.is_dir():
        yield note("shared memory: there is no /dev/shm; images are copied instead")
        return
    left = _left_behind()
    size = sum(size for _, size in left)
    if size >= _MUCH_LEFT:
        yield note(
            f"shared memory: {count_text(len(left), 'segment')} of {bytes_text(size)} left behind",
            f"the next process of ours that starts takes them away; or now: rm {_SHARED_MEMORY}/{left[0][0]}"
            + (" ..." if len(left) > 1 else ""),
        )
    if not may_lock_enough():
        limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
        yield note(
            f"shared memory: not used, as a process may lock only {bytes_text(limit)}; images are copied",
            "if they are large: LimitMEMLOCK=infinity in systemd, ulimits: {memlock: -1} in compose, or a"
            " line 'USER - memlock unlimited' in /etc/security/limits.conf, and a new login",
        )
        return
    usage = shutil.disk_usage(_SHARED_MEMORY)
    if usage.free < _SMALL:
        yield warn(
            f"shared memory: only {bytes_text(usage.free)} of {bytes_text(usage.total)} are free,"
            " images will be copied instead",
            "close what fills it; in a container start that with --shm-size=1g",
        )
    else:
        yield ok(f"shared memory: {bytes_text(usage.free)} of {bytes_text(usage.total)} are free")


def _left_behind() -> list[tuple[str, int]]:
    """Return name and size of our user's segments that no process has."""
    # Before the processes: a segment that is made meanwhile does not count.
    mine = {}
    for path in _SHARED_MEMORY.glob(_SEGMENTS):
        with contextlib.suppress(OSError):
            found = path.stat()
            if found.st_uid == os.getuid():
                mine[path.name] = found.st_size
    for maps in Path("/proc").glob("[0-9]*/maps") if mine else ():
        try:
            text = maps.read_text(errors="replace")
        except OSError:  # another user's, or gone
            continue
        mine = {name: size for name, size in mine.items() if f"/{name}" not in text}
    return sorted(mine.items())


def _check_limits() -> Iterator[Finding]:
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= files < _FEW_FILES:
        yield warn(
            f"a process may open only {files} files; each link takes one",
            "ulimit -n 4096, before you start it",
        )


def _check_clock() -> Iterator[Finding]:
    if time.time() < _OLDEST_TIME:
        yield fail(
            f"the machine's clock says {time.strftime('%Y-%m-%d')}", "set it: sudo timedatectl set-ntp true"
        )
