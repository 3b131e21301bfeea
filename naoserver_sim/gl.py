"""The GL library with which the cameras' images are rendered without a display."""

from __future__ import annotations

import ctypes
import importlib
import logging
import os
from typing import Final, Protocol

from naoserver.errors import HardwareFailure

_log = logging.getLogger(__name__)

_LIBRARIES: Final = {"egl": ("libEGL.so.1",), "osmesa": ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")}
_CHOICE: Final = "MUJOCO_GL"
_OFF: Final = ("disable", "disabled", "off", "false", "0")
_MISSING: Final = (
    "no GL library to render camera images with: install one with"
    " 'apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libopengl0' (or libosmesa6)"
    " and start again"
)


class GLContext(Protocol):
    """What MuJoCo's GL contexts offer."""

    def make_current(self) -> None:
        """Make it the context of the calling thread."""

    def free(self) -> None:
        """Give it back."""


def create_context(width: int, height: int) -> GLContext:
    """Make an offscreen GL context for the calling thread: EGL, or OSMesa where there is no EGL.

    The environment variable MUJOCO_GL, set to one of these or to `disable`, leaves no choice.

    Raises HardwareFailure that names the missing package.
    """
    reasons = []
    wanted = os.environ.get(_CHOICE, "").lower()
    for backend in (wanted,) if wanted in _LIBRARIES else tuple(_LIBRARIES):
        if wanted in _OFF:
            reasons.append(f"rendering is switched off by {_CHOICE}={wanted}")
            break
        if not _is_installed(backend):
            reasons.append(f"{' or '.join(_LIBRARIES[backend])} is not installed")
            continue
        try:
            # MuJoCo reads its variable when it looks up GL's functions, PyOpenGL its own when imported.
            os.environ[_CHOICE] = backend
            os.environ.setdefault("PYOPENGL_PLATFORM", backend)
            context: GLContext = importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
            context.make_current()
        # PyOpenGL and the drivers fail with what they like, AttributeError and GLError among it.
        except Exception as error:  # noqa: BLE001
            _log.info("no rendering with %s: %s", backend, error)
            reasons.append(f"{backend} does not work here: {error}")
        else:
            _log.debug("rendering with %s", backend)
            return context
    os.environ[_CHOICE] = wanted
    raise HardwareFailure(f"{_MISSING} ({'; '.join(reasons)})")


def _is_installed(backend: str) -> bool:
    for library in _LIBRARIES[backend]:
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return True
    return False
