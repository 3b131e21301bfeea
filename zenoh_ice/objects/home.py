"""The communicator as its proxies, servants and adapters know it, which are made before it and below it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import Any, Protocol

from zenoh_ice.data.keys import Target
from zenoh_ice.data.status import ProcessStatus
from zenoh_ice.objects._presence import ClientWatch, Presence, ServantInfo
from zenoh_ice.objects.streams import Streams
from zenoh_ice.routes._given_up import GivenUpCalls
from zenoh_ice.settings import Settings
from zenoh_ice.threads.clock import Clock
from zenoh_ice.threads.limits import Limits
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Transport


class Home(Protocol):
    """A communicator; `Communicator` describes its methods."""

    settings: Settings
    realm: str
    client_id: str
    limits: Limits
    destroyed: bool
    sends_only_stops: bool
    pool: Pool
    transport: Transport
    presence: Presence
    streams: Streams
    client_watches: tuple[ClientWatch, ...]
    given_up: GivenUpCalls

    @property
    def clock(self) -> Clock: ...

    # The results of two are above this: an `ObjectPrx` and an `ObjectAdapter`.

    def stringToProxy(self, text: str) -> Any: ...  # noqa: ANN401
    def createObjectAdapter(self, name: str) -> Any: ...  # noqa: ANN401
    def target(self, identity: str) -> Target: ...
    def find(
        self, target: Target, type_id: str | None, timeout: float, *, since: float | None = None
    ) -> Mapping[str, str]: ...
    def knows(self, target: Target) -> bool: ...
    def new_future(self) -> Future[Any]: ...
    def identities(self, realm: str | None = None) -> list[str]: ...
    def servants(self, realm: str | None = None) -> list[ServantInfo]: ...
    def processStatus(
        self, process: str, *, realm: str | None = None, timeout: float | None = None
    ) -> ProcessStatus: ...
    def onClientLost(self, callback: Callable[[str], Any]) -> ClientWatch: ...
    def check(self) -> None: ...
    def shutdown(self) -> None: ...
    def waitForShutdown(self, timeout: float | None = None) -> bool: ...
    def destroy(self) -> None: ...
