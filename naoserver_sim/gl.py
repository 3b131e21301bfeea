"""The GL library with which the cameras' images are rendered without a display."""

from __future__ import annotations

import ctypes
import importlib
import logging
import os
from types import ModuleType
from typing import Final, Protocol

from naoserver.errors import HardwareFailure

_log = logging.getLogger(__name__)

_LIBRARIES: Final = {"egl": ("libEGL.so.1",), "osmesa": ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")}
_MISSING: Final = (
    "no GL library to render camera images with: install one with"
    " 'apt-get install libegl1 libgl1-mesa-dri' (or libosmesa6) and start again"
)


class GLContext(Protocol):
    """What MuJoCo's GL contexts offer."""

    def make_current(self) -> None:
        """Make it the context of the calling thread."""

    def free(self) -> None:
        """Give it back."""


def create_context(width: int, height: int) -> GLContext:
    """Make an offscreen GL context for the calling thread: EGL, or OSMesa where there is no EGL.

    The environment variable MUJOCO_GL, when set to one of these, leaves no choice.

    Raises HardwareFailure that names the missing package.
    """
    reasons = []
    for backend in _candidates():
        if not _is_installed(backend):
            reasons.append(f"{' or '.join(_LIBRARIES[backend])} is not installed")
            continue
        try:
            context: GLContext = _load(backend).GLContext(width, height)
            context.make_current()
        # PyOpenGL and the drivers fail with what they like, AttributeError and GLError among it.
        except Exception as error:  # noqa: BLE001
            _log.info("no rendering with %s: %s", backend, error)
            reasons.append(f"{backend} does not work here ({error})")
        else:
            _log.debug("rendering with %s", backend)
            return context
    raise HardwareFailure(f"{_MISSING} ({'; '.join(reasons)})")


def _candidates() -> tuple[str, ...]:
    wanted = os.environ.get("MUJOCO_GL", "").lower()
    if wanted in _LIBRARIES:
        return (wanted,)
    return tuple(_LIBRARIES)


def _is_installed(backend: str) -> bool:
    for library in _LIBRARIES[backend]:
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return True
    return False


def _load(backend: str) -> ModuleType:
    # MuJoCo reads MUJOCO_GL when it looks up GL's functions, PyOpenGL its own variable when it is imported.
    os.environ["MUJOCO_GL"] = backend
    os.environ.setdefault("PYOPENGL_PLATFORM", backend)
    return importlib.import_module(f"mujoco.{backend}")
