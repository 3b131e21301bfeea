"""Listen as a NAOqi that serves a robot."""

from __future__ import annotations

import itertools
import logging
import secrets
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from importlib import import_module, resources
from pathlib import Path
from pkgutil import iter_modules
from typing import Final
from weakref import WeakSet

import msgspec
import qi

from naoserver.errors import HardwareFailure
from naoserver.protocol.jobs import JobThreads, Periodic
from naoserver.protocol.robot import Robot
from naoserver.serving.assembly import Assembly
from naoserver.serving.lasting_walk import RENEWAL
from visualhfsm_naoqi._libqi import start_libqi
from visualhfsm_naoqi.programs._access import Access, Service
from visualhfsm_naoqi.programs._calls import Calls
from visualhfsm_naoqi.programs._clients import Client
from visualhfsm_naoqi.programs._connections import Connections, Offer
from visualhfsm_naoqi.programs._effectors import EffectorMotion
from visualhfsm_naoqi.programs._memory import NOTIFYING, ALMemory
from visualhfsm_naoqi.programs._motion import ALMotion
from visualhfsm_naoqi.programs._tracker import ALTracker
from visualhfsm_naoqi.programs._vision import LOOKING, Detector
from visualhfsm_naoqi.programs._whole_body import WholeBody
from zenoh_ice import WallClock
from zenoh_ice.data import typed

_MODULES: Final = [
    import_module(f"{__package__}.{module.name}")
    for module in iter_modules([str(Path(__file__).parent)])
    if module.name != "__main__"
]
SERVICES: Final[Mapping[str, tuple[type[Service], ...]]] = {
    **{name: (kind,) for module in _MODULES for name, kind in vars(module).items() if name.startswith("AL")},
    "ALMotion": (ALMotion, EffectorMotion, WholeBody),
}
"""The classes with the operations of each service; a class with a name such as ALLeds is a service."""


class _Refused(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    reason: str
    operations: tuple[str, ...]
    off: tuple[str, ...] = ()
    """Further operations, which switch it on or off, or ask whether it is on: it stays off."""


REFUSED: Final = typed.convert(
    tomllib.loads(resources.files("visualhfsm_naoqi.programs").joinpath("refused.toml").read_text("utf-8")),
    dict[str, _Refused],
)
"""The services that this robot cannot offer, and what it cannot of those that it does."""

_logger = logging.getLogger(__name__)

_RELEASING: Final = 2.0
"""Wall seconds for libqi to release the services."""
_CHECK_PERIOD: Final = 0.005  # s
_GRACE: Final = 0.05
"""Wall seconds for libqi to release the objects that it lent to clients."""


@contextmanager
def serve(robot: Robot, assembly: Assembly, url: str, *, disk: Path | None) -> Iterator[str]:
    """Serve a robot as NAOqi in a `with` block, which gets the URL."""
    with ExitStack() as steps:  # all run, the last first, whatever they raise
        folder = disk or Path(steps.enter_context(tempfile.TemporaryDirectory(prefix="nao-disk-")))
        access = Access(robot, assembly, folder)
        calls = Calls(access.calls)
        parts: dict[str, Sequence[object]] = {
            name: [access.service(kind) for kind in kinds] for name, kinds in SERVICES.items()
        }
        parts |= {name: [*parts.get(name, ()), _refused_service(name)] for name in REFUSED}
        libqi = _Libqi({name: calls.facade(name, own) for name, own in parts.items()})
        steps.callback(libqi.close)
        access.find, access.lend = libqi.find, libqi.lend

        def lose(client: Client) -> None:
            libqi.shut_out(client)
            access.lose(client)

        connections = Connections(url, libqi.offer, lose)
        wall = WallClock()
        walking = access.walking
        follower = access.service(ALTracker)
        detectors = [each for own in parts.values() for each in own if isinstance(each, Detector)]
        sight = partial(Periodic, clock=robot.clock, period=lambda: LOOKING, thread="NAOqi sight")
        notify = access.service(ALMemory)._notify
        jobs = [
            Periodic("ALMemory", wall, lambda: NOTIFYING, notify, thread="NAOqi"),
            Periodic("the walk", wall, lambda: RENEWAL, walking.renew, thread="NAOqi"),
            *(sight(each.KEY, work=each._look, wanted=each._wanted) for each in detectors),
            sight("ALTracker", work=follower._follow, wanted=follower.isActive),
        ]
        steps.callback(walking.stop)
        steps.callback(connections.close)  # no client can walk any more
        steps.callback(calls.close)
        steps.callback(follower.stopTracker)
        steps.enter_context(JobThreads(jobs))
        yield connections.url


@cache
def _refused_service(name: str) -> object:
    """Return a service, or part of one, whose operations raise HardwareFailure, but for those under `off`."""
    refused = REFUSED[name]
    what = "this operation" if name in SERVICES else name

    def refuse(_self: object, *_arguments: object) -> None:
        raise HardwareFailure(f"{what} is not offered: {refused.reason}")

    def stay_off(_self: object, *_arguments: object) -> bool:
        return False

    reason = refuse.__doc__ = f"Refused: {refused.reason}."
    stay_off.__doc__ = f"Do nothing but return False: {refused.reason}."
    operations = dict.fromkeys(refused.operations, refuse) | dict.fromkeys(refused.off, stay_off)
    service: object = type(name, (), {"__doc__": reason, **operations})()
    return service


class _Libqi:
    """The services in libqi, at a private address on the loopback interface, until it is closed.

    Another service, the door, lends each client its own objects; see `_connections`.
    """

    def __init__(self, facades: Mapping[str, Callable[[Client], object]]) -> None:
        start_libqi()
        self._facades = facades
        self._clients: dict[str, Client] = {}  # those to whom the door lends objects, by their secrets
        self._given: WeakSet[object] = WeakSet()  # to libqi
        self._numbers = itertools.count(1)
        self._session, self._workshop = self._opened(), self._opened()
        # What is called here is the door alone: a program's calls of a service reach an object that it lent.
        services = {self._register(name, type(name, (), {})()): name for name in facades}
        door = self._register("_Door", self._door())
        url = str(self._session.endpoints()[0])
        self.offer: Final = Offer(url, services, door, self._admit)

    def shut_out(self, client: Client) -> None:
        """Lend a client nothing more."""
        for key in [key for key, known in self._clients.items() if known is client]:
            del self._clients[key]

    def lend(self, lent: object) -> object:
        """Return an object as one that libqi lends to clients, and releases when they are gone.

        It is a service for a moment, in a separate session: libqi never releases an object that an
        operation in Python returns as it is.
        """
        self._given.add(lent)
        name = str(next(self._numbers))
        number = self._workshop.registerService(name, lent)
        result: object = self._workshop.service(name)
        self._workshop.unregisterService(number)
        return result

    def find(self, name: str) -> qi.Future:
        """Begin to look up a service of a client."""
        return self._session.service(name, _async=True)

    def close(self) -> None:
        """End the services."""
        for session in (self._session, self._workshop):
            session.close()
        del self._session, self._workshop, session
        # libqi releases the services on its own thread. A process that ends meanwhile hangs: that
        # thread waits for Python's lock, which is held while libqi waits for its threads.
        limit = time.monotonic() + _RELEASING
        while self._given:
            if time.monotonic() > limit:
                _logger.warning("libqi has not released the services within %g s", _RELEASING)
                break
            time.sleep(_CHECK_PERIOD)
        time.sleep(_GRACE)

    def _admit(self, client: Client) -> str:
        """Admit a client; return its secret."""
        key = secrets.token_hex(16)
        self._clients[key] = client
        return key

    def _door(self) -> object:
        """Return the object for libqi whose only method lends objects."""

        def borrow(_self: object, key_and_name: str) -> object:
            key, _, name = key_and_name.partition(" ")
            return self.lend(self._facades[name](self._clients[key]))

        borrow.__qi_signature__, borrow.__qi_return_signature__ = "(s)", "o"  # type: ignore[attr-defined]
        made: object = qi.multiThreaded()(type("_Door", (), {"borrow": borrow}))()
        return made

    def _register(self, name: str, service: object) -> int:
        self._given.add(service)
        number: int = self._session.registerService(name, service)
        return number

    @staticmethod
    def _opened() -> qi.Session:
        session = qi.Session()
        session.listenStandalone("tcp://127.0.0.1:0")
        return session
