"""Listen as a NAOqi that serves a robot."""

from __future__ import annotations

import logging
import tempfile
import threading
import time
import tomllib
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from importlib import resources
from pathlib import Path
from typing import Final

import msgspec
import qi

from naoserver.assembly import Assembly
from naoserver.errors import HardwareFailure, RobotError
from naoserver.jobs import JobThreads, Periodic
from naoserver.libqi import start_libqi
from naoserver.robot import Robot
from naoserver_qi import expression, memory, motion, postures, sensors, sound, video, vision
from naoserver_qi.access import RENEWAL, Access, Service
from naoserver_qi.calls import Calls, failed
from naoserver_qi.effectors import EffectorMotion
from zenoh_ice import WallClock

_MODULES: Final = (expression, memory, motion, postures, sensors, sound, video, vision)
SERVICES: Final[Mapping[str, tuple[type[Service], ...]]] = {
    **{name: (kind,) for module in _MODULES for name, kind in vars(module).items() if name.startswith("AL")},
    "ALMotion": (motion.ALMotion, EffectorMotion),
}
"""The classes with the operations of each service; a class with a name such as ALLeds is a service."""


class _Refused(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    reason: str
    operations: tuple[str, ...]


REFUSED: Final = msgspec.convert(
    tomllib.loads(resources.files("naoserver_qi").joinpath("refused.toml").read_text("utf-8")),
    dict[str, _Refused],
)
"""The services that this robot cannot offer."""

_logger = logging.getLogger(__name__)

_ANSWERING: Final = 0.05
"""Wall seconds in which the client that requests an interruption gets its answer."""
_RELEASING: Final = 2.0
"""Wall seconds for libqi to release the services."""
_POLL: Final = 0.005
_GRACE: Final = 0.05
"""Wall seconds for libqi to release the objects that it lent to clients."""


@contextmanager
def serve(robot: Robot, assembly: Assembly, url: str, *, disk: Path | None, faults: bool) -> Iterator[str]:
    """Serve a robot as NAOqi in a `with` block, which gets the URL; see `naoserver_qi.serve_as_naoqi`."""
    with ExitStack() as steps:  # all run, the last first, whatever they raise
        folder = disk or Path(steps.enter_context(tempfile.TemporaryDirectory(prefix="nao-disk-")))
        access = Access(robot, assembly, folder, faults=faults)
        calls = Calls(robot.clock, access.faults)
        parts: dict[str, Sequence[object]] = {
            name: [access.service(kind) for kind in kinds] for name, kinds in SERVICES.items()
        }
        parts |= {name: [_refused_service(name)] for name in REFUSED}
        if faults:
            parts["Faults"] = [access.faults]
        listener = _Listener(url, {name: calls.facade(name, own) for name, own in parts.items()})
        access.find, access.faults.interrupt = listener.find, listener.interrupt
        wall, walking, tracker = WallClock(), access.walking, access.service(vision.ALTracker)
        detectors = [each for own in parts.values() for each in own if isinstance(each, vision.Detector)]
        sight = partial(Periodic, clock=robot.clock, period=lambda: vision.LOOKING, thread="NAOqi sight")
        notify = access.service(memory.ALMemory)._notify
        jobs = [
            Periodic("ALMemory", wall, lambda: memory.NOTIFYING, notify, thread="NAOqi"),
            Periodic("the walk", wall, lambda: RENEWAL, walking.renew, thread="NAOqi"),
            *(sight(each.KEY, work=each._look, wanted=each._wanted) for each in detectors),
            sight("ALTracker", work=tracker._follow, wanted=tracker.isActive),
        ]
        steps.callback(walking.stop)
        steps.callback(listener.close)  # no client can walk any more
        steps.callback(tracker.stopTracker)
        steps.callback(calls.close)
        steps.enter_context(JobThreads(jobs))
        yield listener.url


@cache
def _refused_service(name: str) -> object:
    """Return a service each of whose operations raises HardwareFailure."""
    refused = REFUSED[name]

    def refuse(_self: object, *_arguments: object) -> None:
        raise HardwareFailure(f"{name} is not offered: {refused.reason}")

    service: object = type(name, (), dict.fromkeys(refused.operations, refuse))()
    return service


class _Listener:
    """Offer services at a URL until it is closed."""

    def __init__(self, url: str, services: Mapping[str, Callable[[], object]]) -> None:
        """Offer services by their names, each made by a function. Raises RobotError when it cannot listen."""
        start_libqi()
        self.url = url
        """The address it listens on, with the port that the system picked."""
        self._services = services
        self._lock = threading.Lock()
        self._session: qi.Session | None = None
        self._offered: list[weakref.ref[object]] = []
        self._break: threading.Thread | None = None
        self._closing = threading.Event()
        self._listen()

    def interrupt(self, seconds: float) -> None:
        """Close every connection soon, unless already requested, and listen again after some wall seconds."""
        with self._lock:
            if self._closing.is_set() or (self._break is not None and self._break.is_alive()):
                return
            self._break = threading.Timer(_ANSWERING, self._take_a_break, (seconds,))
            self._break.daemon = True
            self._break.start()

    def find(self, name: str) -> qi.Future:
        """Begin to look up a service, also one of a client."""
        session = self._session
        return failed("nobody is connected") if session is None else session.service(name, _async=True)

    def close(self) -> None:
        """Close every connection."""
        with self._lock:
            self._closing.set()
            pause = self._break
        if pause is not None:
            pause.join()
        self._hang_up()

    def _listen(self) -> None:
        session = qi.Session()
        try:
            session.listenStandalone(self.url)
        except RuntimeError as error:
            raise RobotError(f"cannot listen at {self.url}: {error}; give another address") from None
        for name, make in self._services.items():
            service = make()
            self._offered.append(weakref.ref(service))
            session.registerService(name, service)
        self.url = str(session.endpoints()[0])
        self._session = session

    def _hang_up(self) -> None:
        session, self._session = self._session, None
        if session is None:
            return
        session.close()
        del session
        # libqi releases the services on its own thread. A process that ends meanwhile hangs: that
        # thread waits for Python's lock, which is held while libqi waits for its threads.
        limit = time.monotonic() + _RELEASING
        while any(service() is not None for service in self._offered):
            if time.monotonic() > limit:
                _logger.warning("libqi has not released the services within %g s", _RELEASING)
                break
            time.sleep(_POLL)
        self._offered = []
        time.sleep(_GRACE)

    def _take_a_break(self, seconds: float) -> None:
        self._hang_up()
        if not self._closing.wait(seconds):
            try:
                self._listen()
            except RobotError:
                _logger.exception("NAOqi is not served any more")
