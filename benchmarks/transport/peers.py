"""What all peers of the benchmark serve and call, and how a process becomes one of them."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import AbstractContextManager
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

SLICE: Final = Path(__file__).with_name("robot.ice")
REPOSITORY: Final = SLICE.parents[2]
PACKAGE: Final = "bench_generated"
IDENTITY: Final = "Robot"
POSE: Final = (0.1, 0.2, 0.3, 0.4)
SMALL_IMAGE: Final = (320, 240)
LARGE_IMAGE: Final = (1280, 960)


class Kind(NamedTuple):
    """What is compared: a peer, the source tree that it uses, and its environment."""

    name: str
    peer: str = "ours"
    tree: Path = REPOSITORY
    environment: Mapping[str, str] = MappingProxyType({})

    @property
    def python(self) -> str:
        """The interpreter of its tree."""
        return sys.executable if self.tree == REPOSITORY else str(self.tree / ".venv" / "bin" / "python")


class Server(Protocol):
    """Serves `Robot`."""

    def send_image(self, stamp: int, pixels: bytes) -> None:
        """Send an image to all that follow."""


class Client(Protocol):
    """Calls `Robot`."""

    def step(self) -> object:
        """Call with four doubles there and back."""

    def begin_step(self) -> Future[Any]:
        """Call without waiting."""

    def image(self, width: int, height: int) -> bytes:
        """Call for the pixels of an image."""

    def follow(self, take: Callable[[Any], object]) -> AbstractContextManager[object]:
        """Give the newest image that the server sends to a function."""


def serve(peer: str, endpoint: str, folder: Path) -> AbstractContextManager[Server]:
    """Serve on an endpoint, `tcp/127.0.0.1:PORT`, as `ours` or `ice`."""
    server: AbstractContextManager[Server] = _peer(peer, folder).serve(endpoint)
    return server


def connect(peer: str, endpoint: str, folder: Path) -> AbstractContextManager[Client]:
    """Connect to a server."""
    client: AbstractContextManager[Client] = _peer(peer, folder).connect(endpoint)
    return client


def _peer(peer: str, folder: Path) -> Any:  # noqa: ANN401
    # A process imports only its own peer, without the libraries of the other.
    sys.path.insert(0, str(folder))
    return importlib.import_module(f".{peer}_peer", __package__)


def generate(kind: Kind, folder: Path) -> None:
    """Generate the package of a kind in a folder, once for all its processes."""
    folder.mkdir()
    source = folder / "robot.idl"
    shutil.copy(SLICE, source)
    command = [kind.python, "-m", "codegen", str(source), "-o", str(folder / PACKAGE)]
    subprocess.run(command, cwd=kind.tree, check=True, capture_output=True, timeout=60)


@cache
def frame(width: int, height: int) -> Any:  # noqa: ANN401
    """Return an image as an array, like a camera; the sender copies its bytes each time."""
    return np.random.default_rng(width).integers(0, 256, (height, width, 3), np.uint8)


def pixels(width: int, height: int) -> bytes:
    """Return a copy of the bytes of an image."""
    copied: bytes = frame(width, height).tobytes()
    return copied
