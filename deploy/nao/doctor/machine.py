"""Check the machine: rendering, shared memory, limits, and its clock."""

from __future__ import annotations

import contextlib
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from deploy.nao.doctor import Finding, fail, note, ok, warn
from deploy.nao.quantities import bytes_text, count_text
from zenoh_ice._zenoh.shared_memory import SharedMemory, memory_space
from zenoh_ice.transport import Pieces

__all__ = ["check_machine"]

_LIMIT: Final = 30.0  # s that a process may take; software rendering takes some to start
_GL_PROGRAM: Final = """\
import sys
try:
    import mujoco
    from naoserver_sim.cameras import create_context
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
_READER_PROGRAM: Final = """\
import sys
import zenoh
from zenoh_ice import ZenohIceError
from zenoh_ice._zenoh.shared_memory import SharedMemory
memory = SharedMemory(enabled=True)
try:
    came = memory.read(zenoh.ZBytes(sys.stdin.buffer.read()), 1 << 30, "an image")
except ZenohIceError as error:
    sys.exit(str(error))
sys.stdout.buffer.write(came.large[0])
"""
_IMAGE_SIZE: Final = 640 * 480 * 3  # bytes
_SEGMENT_FOLDER: Final = Path("/dev/shm")  # noqa: S108 - where the system has it
_SEGMENTS: Final = "*.zenoh"
_MUCH_LEFT: Final = 1 << 20  # bytes
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
    done = _run(_GL_PROGRAM)
    if done is None:
        yield fail(f"GL: no picture within {_LIMIT:g} s", "try software rendering: MUJOCO_GL=osmesa")
        return
    last = _last_line(done.stderr.strip() or done.stdout)
    if done.returncode == 0:
        yield ok(f"GL renders: {_last_line(done.stdout)}")
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
    """Yield whether images can be shared, and what processes of Zenoh that are gone left in /dev/shm."""
    left = _left_behind()
    size = sum(size for _, size in left)
    if size >= _MUCH_LEFT:
        segments = f"{_SEGMENT_FOLDER}/{left[0][0]}" + (" ..." if len(left) > 1 else "")
        yield note(
            f"{_SEGMENT_FOLDER}: {count_text(len(left), 'segment')} of {bytes_text(size)} left behind",
            f"no process has them open: rm {segments}",
        )
    if not Path("/proc/self/fd").is_dir():
        yield note("shared memory: there is no /proc to find it by; images go over the network")
        return
    if not memory_space():
        yield note(
            "shared memory: others may not look into this process, which has capabilities of its own; images"
            " go over the network",
            f"sudo setcap -r {Path(sys.executable).resolve()}, and AmbientCapabilities= in systemd instead,"
            " for all that share images",
        )
        return
    with contextlib.closing(SharedMemory(enabled=True)) as memory:
        yield _share_image(memory)


def _share_image(memory: SharedMemory) -> Finding:
    """Write an image into memory, have another process read it, and return how that went."""
    image = os.urandom(_IMAGE_SIZE)
    reference = memory.lender.place(Pieces((b"", b""), (image,), (0,)))
    if reference is None:
        return warn(
            "shared memory: there is no room for it; images go over the network",
            "see what limits it: free -m, ulimit -f, ulimit -n, the limits of the container",
        )
    done = _run(_READER_PROGRAM, reference)
    if done is not None and done.stdout == image:
        return ok("shared memory works")
    why = f"not within {_LIMIT:g} s" if done is None else _last_line(done.stderr)
    return warn(
        f"shared memory: another process cannot read it: {why}",
        "shared_memory = false in the settings sends images over the network",
    )


def _left_behind() -> list[tuple[str, int]]:
    """Return name and size of our user's segments that no process has."""
    # Before the processes: a segment that is made meanwhile does not count.
    mine = {}
    for path in _SEGMENT_FOLDER.glob(_SEGMENTS):
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


def _run(program: str, given: bytes = b"") -> subprocess.CompletedProcess[bytes] | None:
    """Run a program in Python in a process of its own; return None if it takes too long."""
    try:
        return subprocess.run(
            [sys.executable, "-c", program], input=given, capture_output=True, timeout=_LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        return None


def _last_line(output: bytes) -> str:
    return output.decode(errors="replace").strip().rpartition("\n")[2][:300]


def _check_limits() -> Iterator[Finding]:
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= files < _FEW_FILES:
        text = f"a process may open only {files} files; each link takes one"
        yield warn(text, "ulimit -n 4096, before you start it")


def _check_clock() -> Iterator[Finding]:
    if time.time() < _OLDEST_TIME:
        date = time.strftime("%Y-%m-%d")
        yield fail(f"the machine's clock says {date}", "set it: sudo timedatectl set-ntp true")
