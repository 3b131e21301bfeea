"""The surroundings of a component in virtual time: a clock, and the servants and the ROS that it reaches."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

from zenoh_ice import Object

from .._robot import ROBOT, servant_of
from ..component import Component, endpoints_of, proxies_of
from ..kinds import Ends, kinds_of
from ._stubs import StandIns, gives_pictures, make_stub
from .clock import TaskClock
from .errors import UnknownName, says_it_all
from .network import VirtualNetwork

__tracebackhide__ = says_it_all

_logger = logging.getLogger(__name__)


class VirtualWorld:
    """A clock, servants and ROS within the process; `close` ends it.

    Calls of an interface that nobody serves fail, unless there are `stand_ins`: then they return blank
    values, those of a camera black pictures; services of ROS answer with blank values, and goals succeed.
    `kept` is the number of the newest events and calls that the journal keeps; None keeps all.
    """

    def __init__(
        self, clock: TaskClock | None = None, *, stand_ins: bool = False, kept: int | None = None
    ) -> None:
        self.clock: Final = clock or TaskClock()
        self.kept: Final = kept
        self.network: Final = VirtualNetwork(self.clock, kept)
        self.journal: Final = self.network.journal
        self.communicator: Final = self.network.communicator
        self._stand_ins: Final = StandIns(self.network) if stand_ins else None
        self._ends: Final[dict[str, Ends]] = {}
        """The ends of each kind that a component declares."""

    @property
    def ros(self) -> Any:  # noqa: ANN401 - the plug-in's
        """The ROS of a connected component; raises UnknownName if it uses none."""
        if "ros" not in self._ends:
            raise UnknownName("this behavior has no interfaces of ROS")
        return self._ends["ros"]

    def connect(self, component: Component) -> None:
        """Connect what a component declares and that is not connected yet."""
        has_robot = self.network.servant(ROBOT) is not None
        for name, declared in proxies_of(component).items():
            if name in vars(component):
                continue
            identity, interface = declared.identity, declared.type.ice_interface
            servant = self.network.servant(identity)
            if self._stand_ins and (servant is None or interface not in servant.ice_interface.lineage):
                self._stand_ins.serve(identity, interface)
                _logger.warning(
                    "self.%s is a stand-in, %s%s",
                    name,
                    "whose pictures are black"
                    if gives_pictures(interface)
                    else "which answers with zeros and empty texts",
                    f"; this robot does not serve {servant_of(identity, interface)}" if has_robot else "",
                )
            served = self.network.servant(identity) is not None
            # Without a servant only calls fail: a test need not stub interfaces that it does not reach.
            cast = declared.type.checkedCast if served else declared.type.uncheckedCast
            vars(component)[name] = cast(self.communicator.stringToProxy(identity))
        for kind, made in kinds_of(component).items():
            if kind not in self._ends:
                clock, called, stand_ins = self.clock, self.journal.called, self._stand_ins is not None
                self._ends[kind] = made.imitated(clock.now, clock.wait_for, called, stand_ins=stand_ins)
            self._ends[kind].connect(component)
        if self._stand_ins:
            for name, endpoint in endpoints_of(component).items():
                _logger.warning("self.%s is a stand-in for %s", name, endpoint.title)

    def stub(self, component: Component, name: str, stub: Object | Mapping[str, object]) -> None:
        """Serve one of a component's interfaces by a servant, or some of its operations, see `make_stub`.

        `name` is that of the attribute or of the servant; raises UnknownName.
        """
        declared = proxies_of(component)
        found = {proxy.identity: proxy for key, proxy in declared.items() if name in (key, proxy.identity)}
        if not found:
            known = ", ".join(declared) or "none"
            raise UnknownName(f"the component has no interface {name!r}; there are {known}")
        ((identity, proxy),) = found.items()
        if isinstance(stub, Object):
            self.network.serve(identity, stub)
        else:
            below = self.network.servant(identity)
            self.network.serve(identity, *make_stub(identity, proxy.type.ice_interface, stub, below))

    @contextmanager
    def offline(self, *servants: str) -> Iterator[None]:
        """Take some servants, or all, offline in a `with` block: calls fail as if the connection were cut.

        Streams bring nothing meanwhile.
        """
        network = self.network
        before = network.offline
        network.offline = before.union(servants or self.communicator.identities())
        try:
            yield
        finally:
            network.offline = before

    def close(self) -> None:
        """End the servants and the proxies."""
        self.communicator.destroy()
