"""The operations of all peers of the benchmark."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final, Protocol

KINDS: Final = ("socket", "bare", "bare on ours", "ours", "ice")
"""`bare on ours` is only a client: the cost of our servant without our proxy."""

Got = Callable[[Any], object]
"""Takes a JointState or a Picture."""


class Server(Protocol):
    """Serves `Robot`."""

    def send(self, stream: str, stamp: int, number: int, content: Any) -> None:  # noqa: ANN401
        """Send to all subscribers of a stream: the positions of `joints`, or the array of `video`."""


class Client(Protocol):
    """Calls `Robot` and follows its streams."""

    def step(self) -> object:
        """Call with four doubles there and back."""

    def stepAsync(self) -> Future[Any]:
        """Call without waiting."""

    def image(self, width: int, height: int) -> bytes:
        """Call for the pixels of an image."""

    def joints(self) -> object:
        """Call for the joint state."""

    def latest(self) -> object:
        """Return the newest joint state, without a round trip if the peer has streams."""

    def follow(self, stream: str, got: Got) -> AbstractContextManager[object]:
        """Call a function with the values of a stream: all of `joints`, the newest of `video`."""


# Each kind is imported only by the processes that need it, without the libraries of the others.


def serve(kind: str, endpoint: str, package: Path) -> AbstractContextManager[Any]:
    """Serve on an endpoint, `tcp/127.0.0.1:PORT`; yields a Server if the peer has streams."""
    if kind == "socket":
        from .socket_peer import serve as serve_socket

        return serve_socket(endpoint)
    if kind == "bare":
        from .bare_peer import serve as serve_bare

        return serve_bare(endpoint)
    if kind == "ice":
        from .ice_peer import serve as serve_ice

        return serve_ice(endpoint)
    from .our_peer import serve as serve_ours

    return serve_ours(endpoint, package)


def connect(kind: str, endpoints: Sequence[str], package: Path) -> AbstractContextManager[Any]:
    """Connect to a server; yields a Client, which can only `step` unless it is ours or Ice's."""
    if kind == "socket":
        from .socket_peer import connect as connect_socket

        return connect_socket(endpoints[0])
    if kind == "bare":
        from .bare_peer import connect as connect_bare

        return connect_bare(endpoints[0])
    if kind == "bare on ours":
        from .bare_peer import connect_to_ours

        return connect_to_ours(endpoints[0], package)
    if kind == "ice":
        from .ice_peer import connect as connect_ice

        return connect_ice(endpoints[0])
    from .our_peer import connect as connect_ours

    return connect_ours(endpoints, package)
