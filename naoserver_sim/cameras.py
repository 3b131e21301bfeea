"""The cameras: a thread that owns the GL context and renders images on request."""

from __future__ import annotations

import contextlib
import copy
import ctypes
import importlib
import logging
import math
import os
import queue
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, wait
from dataclasses import dataclass, field
from functools import partial
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.parts import CameraFacts
from naoserver.errors import HardwareFailure
from naoserver.robot import Frame
from naoserver_sim._image_sensor import ImageSensor
from naoserver_sim._simulator import Snapshot
from naoserver_sim.appearance import VISUAL_GROUP, Lamps
from zenoh_ice.data.text import sentence

_log = logging.getLogger(__name__)

_LIBRARIES: Final = {"egl": ("libEGL.so.1",), "osmesa": ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")}
_CHOICE: Final = "MUJOCO_GL"
_OFF: Final = ("disable", "disabled", "off", "false", "0")
_MISSING: Final = (
    "no GL library to render camera images with: install one with"
    " 'apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libopengl0' (or libosmesa6)"
    " and start again"
)
_FLAT, _SKY, _FIRST_SIDE, _RGB, _BYTES = 0x0DE1, 0x8513, 0x8515, 0x1907, 0x1401  # of OpenGL's gl.h
_PIXELS: Final = 4
"""Pixels of a side of the smallest texture that is scaled down as larger ones are."""


def create_context(width: int, height: int) -> mujoco.GLContext:
    """Make an offscreen GL context: EGL, or OSMesa where there is no EGL.

    The environment variable MUJOCO_GL, set to one of these or to `disable`, overrides the choice.

    Raises HardwareFailure that names the missing package, or what switches rendering off.
    """
    wanted = os.environ.get(_CHOICE, "").lower()
    backends, reasons = _backends()
    for backend in backends:
        try:
            # MuJoCo reads its variable when it looks up GL's functions, PyOpenGL its own when imported.
            os.environ[_CHOICE] = backend
            os.environ.setdefault("PYOPENGL_PLATFORM", backend)
            context = importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
            with context.as_current():
                _compile_shaders()  # it works
        # PyOpenGL and the drivers raise any exception, AttributeError and GLError among them.
        except Exception as error:  # noqa: BLE001
            _log.info("no rendering with %s: %s", backend, error)
            reasons.append(f"{backend} does not work here: {error}")
        else:
            _log.debug("rendering with %s", backend)
            if wanted not in ("", backend):
                _log.warning(
                    "%s=%s is not obeyed: the cameras render without a window, here with %s",
                    *(_CHOICE, wanted, backend),
                )
            return context
    os.environ[_CHOICE] = wanted
    raise HardwareFailure(f"{_MISSING} ({'; '.join(reasons)})")


def _backends() -> tuple[list[str], list[str]]:
    """Return the GL libraries to try, and why not the others. Raises HardwareFailure without any."""
    wanted = os.environ.get(_CHOICE, "").lower()
    if wanted in _OFF:
        raise HardwareFailure(f"rendering is switched off by {_CHOICE}={wanted}: unset it, and start again")
    allowed = [wanted] if wanted in _LIBRARIES else [*_LIBRARIES]
    found = [backend for backend in allowed if _is_installed(backend)]
    lacks = [f"{' or '.join(_LIBRARIES[each])} is not installed" for each in allowed if each not in found]
    if not found:
        raise HardwareFailure(f"{_MISSING} ({'; '.join(lacks)})")
    return found, lacks


def _is_installed(backend: str) -> bool:
    for library in _LIBRARIES[backend]:
        with contextlib.suppress(OSError):
            ctypes.CDLL(library)
            return True
    return False


def _compile_shaders() -> None:
    """Let GL compile what scales a texture down, for 0.2 s without a GPU, in the current context.

    MuJoCo lets no other thread run while it sets up its own textures; ctypes does. Kinds and format are those
    of MuJoCo's textures: flat ones, and skies.
    """
    gl = importlib.import_module("OpenGL.platform").PLATFORM.GL  # not all of PyOpenGL, which takes long
    for kind, sides in ((_FLAT, [_FLAT]), (_SKY, range(_FIRST_SIDE, _FIRST_SIDE + 6))):
        texture = ctypes.c_uint()
        gl.glGenTextures(1, ctypes.byref(texture))
        gl.glBindTexture(kind, texture)
        for side in sides:
            pixels = bytes(3 * _PIXELS**2)
            gl.glTexImage2D(side, 0, _RGB, _PIXELS, _PIXELS, 0, _RGB, _BYTES, pixels)
        gl.glGenerateMipmap(kind)
        gl.glFinish()
        gl.glDeleteTextures(1, ctypes.byref(texture))


_VIRTUAL_WAITS: Final = (1.0,) * 60
"""Waits in s, in virtual time: while the process is stopped, only one of them passes."""
_QUEUE_LENGTH: Final = 16
_MORE_GEOMS: Final = 400
"""Room in a scene for what is drawn besides the geoms of the model."""
_SMALL: Final = (32, 24)
_OUTSIDE_GROUP: Final = 5
"""The group of the geoms that no view meets: the last of MuJoCo's, and never drawn."""
# The passes that camera images omit: without a GPU, they cost more than all others together.
# Shadows are drawn only in worlds whose light casts them.
_FLAGS_OFF: Final = ("REFLECTION", "FOG", "HAZE")


@dataclass(frozen=True, slots=True)
class CameraLimits:
    """How long others wait for the thread of the cameras, in s."""

    frame: float = 1.0
    """For an image, unless time is virtual."""
    setup: float = 10.0
    """For GL, before the first image, unless time is virtual; and for the end of the thread."""


@dataclass(frozen=True, slots=True)
class _Request:
    camera: str
    width: int
    height: int
    frame: Future[Frame] = field(default_factory=Future)


class CameraRenderer:
    """Render what a camera sees, with the present lights; `past` returns the snapshot of some seconds ago.

    With a `sensor`, the pictures of its cameras have the imperfections that it adds, and its latency. In the
    model, names of cameras begin with the `prefix` of the robot.

    Rendering has its own thread and its own copy of the state: neither it nor the physics waits for the
    other. The first image starts it, unless `start` has: GL takes 90 MB. Without a GL library everything but
    `capture` works.

    An image of `virtual` time, which stands still meanwhile, may take as long as a busy machine needs: a
    minute in which the process runs.
    """

    def __init__(
        self,
        mj: mujoco.MjModel,
        cameras: tuple[CameraFacts, ...],
        past: Callable[[float], Snapshot],
        lamps: Lamps,
        sensor: ImageSensor | None = None,
        *,
        prefix: str = "",
        virtual: bool = False,
        limits: CameraLimits = CameraLimits(),
    ) -> None:
        self._limits = limits
        self._mj = mj
        self._cameras: Mapping[str, CameraFacts] = {camera.name: camera for camera in cameras}
        self._past = past
        self._lamps = lamps
        self._sensor = sensor
        self._prefix = prefix
        self._virtual = virtual
        self._requests: queue.Queue[_Request | None] = queue.Queue(_QUEUE_LENGTH)
        self._ready = threading.Event()
        self.failure: str | None = None
        """Why it renders nothing, if it has tried."""
        self._closed = False
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def check(self) -> None:
        """Log that there will be no images, if that is known without GL."""
        try:
            _backends()
        except HardwareFailure as failure:
            _log.warning("the cameras are off: %s", failure)

    def start(self) -> None:
        """Start the thread, and wait until it has set up GL or failed, within the limits.

        Without a thread, the next call tries again.
        """
        with self._lock:
            if self._thread is None and not self._closed:
                thread = threading.Thread(target=self._run, name="cameras", daemon=True)
                self.failure = None
                try:
                    thread.start()
                except RuntimeError as error:  # at a limit of threads or memory
                    self.failure = f"the cameras are off: {error}"
                    _log.warning("%s", self.failure)
                    return
                self._thread = thread
        any(self._ready.wait(limit) for limit in self._waits(self._limits.setup))

    def close(self) -> None:
        """Render the waiting requests, free GL, and wait until the thread has ended."""
        with self._lock:
            self._closed = True
            thread = self._thread
        if thread is not None and thread.is_alive():
            with contextlib.suppress(queue.Full):
                self._requests.put(None, timeout=self._limits.setup)
            thread.join(self._limits.setup)
            if thread.is_alive():
                _log.error("the camera thread did not end within %g s", self._limits.setup)

    def capture(self, camera: str, width: int, height: int) -> Frame:
        """Return an image of the newest state, or with a `sensor` of one that is as old as its latency.

        Waits no longer than the limits, for GL and for the image; in virtual time a minute for each.
        Raises HardwareFailure when there is no such camera or size, no GL library, or no image in time.
        """
        self._check(camera, width, height)
        if self._closed:
            raise HardwareFailure(f"{camera}: the robot was closed")
        self.start()
        if self.failure is not None:
            raise HardwareFailure(self.failure)
        if not self._ready.is_set():
            limit = sum(self._waits(self._limits.setup))
            raise HardwareFailure(f"{camera}: GL was not set up within {limit:g} s")
        request = _Request(camera, width, height)
        deadline = time.monotonic() + self._limits.frame
        with contextlib.suppress(queue.Full):
            self._requests.put(request, timeout=self._limits.frame)
            for limit in self._waits(max(0.0, deadline - time.monotonic())):
                if wait([request.frame], limit).done:
                    return request.frame.result()
        request.frame.cancel()
        limit = sum(self._waits(self._limits.frame))
        size = f"{width}x{height}"
        raise HardwareFailure(sentence(f"{camera}: no image of {size} within {limit:g} s"))

    def _waits(self, limit: float) -> Sequence[float]:
        """Return the waits in s, one after the other, that may take so long, or longer in virtual time."""
        return _VIRTUAL_WAITS if self._virtual else (limit,)

    def _check(self, camera: str, width: int, height: int) -> None:
        facts = self._cameras.get(camera)
        if facts is None:
            raise HardwareFailure(
                sentence(f"there is no camera {camera!r}; there are {', '.join(self._cameras)}")
            )
        if (width, height) not in facts.sizes:
            sizes = ", ".join(f"{w}x{h}" for w, h in facts.sizes)
            size = f"{width}x{height}"
            raise HardwareFailure(sentence(f"{camera} takes no images of {size}; it takes {sizes}"))

    def _run(self) -> None:
        try:
            scene = _Scene(self._mj)
        except Exception as error:  # noqa: BLE001 - reported to every caller of `capture`
            self.failure = f"the cameras are off: {error}"
            _log.warning("%s", self.failure)
            return
        finally:
            self._ready.set()
        try:
            while (request := self._requests.get()) is not None:
                if request.frame.set_running_or_notify_cancel():
                    self._serve(scene, request)
        finally:
            scene.close()

    def _serve(self, scene: _Scene, request: _Request) -> None:
        try:
            camera, seen_by = request.camera, self._prefix + request.camera
            sensor = self._sensor if self._sensor is not None and self._sensor.sees(camera) else None
            snapshot = self._past(sensor.latency(camera) if sensor is not None else 0.0)
            self._lamps.show()
            pixels = scene.render(snapshot.whole_qpos, seen_by, request.width, request.height)
            if sensor is not None:
                turning = scene.turning(snapshot.whole_qvel, seen_by)
                measure = partial(scene.brightness, seen_by)
                pixels = sensor.develop(pixels, camera, snapshot.time, turning, measure)
            request.frame.set_result(Frame(camera, snapshot.time, request.width, request.height, pixels))
        except Exception as error:  # noqa: BLE001 - reported to the caller
            request.frame.set_exception(HardwareFailure(f"{request.camera}: rendering failed: {error}"))


def put_cameras(mj: mujoco.MjModel, data: mujoco.MjData, qpos: NDArray[np.float64]) -> None:
    """Compute the places of bodies, lights and cameras at positions of the joints."""
    data.qpos[:] = qpos
    mujoco.mj_kinematics(mj, data)
    mujoco.mj_comPos(mj, data)
    mujoco.mj_camlight(mj, data)


_MOST_SPARE: Final = 2
_spare: Final[dict[tuple[str, int, int], list[mujoco.GLContext]]] = {}
"""Contexts that are not in use, by GL library and size: a new one compiles its shaders, for 0.3 s."""


@contextlib.contextmanager
def _current_context(width: int, height: int) -> Iterator[None]:
    """Use a GL context in the calling thread, perhaps that of an earlier scene. Raises HardwareFailure."""
    unused = _spare.get((os.environ.get(_CHOICE, "").lower(), width, height))
    try:
        context = unused.pop() if unused else create_context(width, height)
    except IndexError:  # another thread was faster
        context = create_context(width, height)
    kept = False
    try:
        with context.as_current():
            yield
        unused = _spare.setdefault((os.environ[_CHOICE].lower(), width, height), [])
        if kept := len(unused) < _MOST_SPARE:
            unused.append(context)
    finally:
        if not kept:  # after a failure it may be broken
            context.free()


class _Scene:
    """MuJoCo's GL resources. Made, used and closed on one thread."""

    def __init__(self, mj: mujoco.MjModel) -> None:
        """Set up GL. Raises HardwareFailure without GL, and exceptions of MuJoCo if it is unusable."""
        self._lit = mj
        self._mj = copy.copy(mj)  # sonars read the groups of the other one, in which geoms are hidden here
        self._groups = mj.geom_group.copy()
        with contextlib.ExitStack() as made:
            made.enter_context(_current_context(mj.vis.global_.offwidth, mj.vis.global_.offheight))
            self._context = mujoco.MjrContext(mj, mujoco.mjtFontScale.mjFONTSCALE_50)
            made.callback(self._context.free)
            self._made = made.pop_all()
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._data = mujoco.MjData(mj)
        self._options = mujoco.MjvOption()
        self._options.geomgroup[:] = 0
        self._options.geomgroup[[0, VISUAL_GROUP]] = 1
        self._options.sitegroup[:] = 0
        self._perturb = mujoco.MjvPerturb()
        self._scene = mujoco.MjvScene(mj, mj.ngeom + _MORE_GEOMS)
        for name in _FLAGS_OFF:
            self._scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{name}")] = 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = bool(mj.light_castshadow.any())
        self._view = mujoco.MjvCamera()
        self._view.type = mujoco.mjtCamera.mjCAMERA_FIXED

    def render(self, qpos: NDArray[np.float64], camera: str, width: int, height: int) -> NDArray[np.uint8]:
        """Return the view of a camera as (height, width, 3) bytes, row 0 on top."""
        mj, data = self._mj, self._data
        mj.mat_rgba[:], mj.mat_emission[:] = self._lit.mat_rgba, self._lit.mat_emission
        put_cameras(mj, data, qpos)
        self._view.fixedcamid = mj.camera(camera).id
        everything = mujoco.mjtCatBit.mjCAT_ALL
        if not self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW]:  # what is not seen may cast one
            mujoco.mjv_updateCamera(mj, data, self._view, self._scene)
            mj.geom_group[:] = np.where(self._outside(width / height), _OUTSIDE_GROUP, self._groups)
        mujoco.mjv_updateScene(mj, data, self._options, self._perturb, self._view, everything, self._scene)
        viewport = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(viewport, self._scene, self._context)
        bottom_up = np.empty((height, width, 3), np.uint8)
        mujoco.mjr_readPixels(bottom_up, None, viewport, self._context)
        return np.ascontiguousarray(bottom_up[::-1])

    def _outside(self, aspect: float) -> NDArray[np.bool_]:
        """Return which geoms the view does not meet. Without a GPU, each of their triangles costs time."""
        eyes = self._scene.camera
        first = eyes[0]
        forward, up = first.forward.astype(float), first.up.astype(float)
        from_eye = self._data.geom_xpos - (first.pos + eyes[1].pos) / 2.0
        depth = from_eye @ forward
        center, half = first.frustum_center, aspect * (first.frustum_top - first.frustum_bottom) / 2.0
        radius = self._mj.geom_rbound
        outside: NDArray[np.bool_] = depth < -radius
        near, right = first.frustum_near, np.cross(forward, up)
        for axis, low, high in (
            (right, center - half, center + half),
            (up, first.frustum_bottom, first.frustum_top),
        ):
            across = near * (from_eye @ axis)
            outside |= low * depth - across > math.hypot(low, near) * radius
            outside |= across - high * depth > math.hypot(high, near) * radius
        outside &= radius > 0.0  # that of a plane is 0
        return outside

    def turning(self, qvel: NDArray[np.float64], camera: str) -> NDArray[np.float64]:
        """Return the turning rate of a camera, as last drawn, in rad/s about right, up and backwards."""
        velocity = np.zeros(6)
        self._data.qvel[:] = qvel
        mujoco.mj_comVel(self._mj, self._data)
        kind, index = mujoco.mjtObj.mjOBJ_CAMERA, self._mj.camera(camera).id
        mujoco.mj_objectVelocity(self._mj, self._data, kind, index, velocity, 1)
        return velocity[:3]

    def brightness(self, camera: str, qpos: NDArray[np.float64]) -> float:
        """Return the mean value of a view without the robot, whose lamps may have changed since."""
        self._options.geomgroup[VISUAL_GROUP] = 0
        try:
            return float(self.render(qpos, camera, *_SMALL).mean())
        finally:
            self._options.geomgroup[VISUAL_GROUP] = 1

    def close(self) -> None:
        """Free the resources of GL."""
        self._made.close()
