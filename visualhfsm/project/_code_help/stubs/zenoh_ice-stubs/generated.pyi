"""Operations of proxies as jedi understands them: `F` is the method that declares one."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any, Generic, TypeVar

from zenoh_ice.objects.proxy import ObjectPrx as ObjectPrx

F = TypeVar("F")

def operation(**options: object) -> Callable[[F], Call[F]]: ...
def stream(**options: object) -> Callable[[F], StreamedCall[F]]: ...

class Call(Generic[F]):
    __call__: F

    def begin(self, *args: object, **kwargs: object) -> Future[Any]:
        """Call the operation without waiting; the future has its outcome."""

class Sample(Generic[F]):
    _read: F
    age: float
    time: float
    wall_time: float
    sequence: int
    lost: int
    stream: str

    @property
    def value(self):  # noqa: ANN201 - what jedi finds in the body
        return self._read()

    def follows(self, other: Sample[F] | None) -> bool:
        """Return whether it is newer than another one, or of another start of the servant."""

class StreamedCall(Call[F]):
    def latest(self) -> Sample[F]:
        """Return the newest sample without a round trip, or None before the first."""

    def wait(self, after: Sample[F] | None = None, timeout: float | None = None) -> Sample[F]:
        """Return the next sample newer than `after`, or the newest at once without `after`."""

    def samples(self, timeout: float | None = None, *, rate: float | None = None) -> Iterator[Sample[F]]:
        """Yield sample after sample, always the newest."""

    def subscribe(
        self, callback: Callable[[Sample[F]], Any], *, rate: float | None = None, queue: int = 1
    ) -> object:
        """Call a function with sample after sample, on its own thread."""
