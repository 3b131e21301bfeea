"""Commands that report to this process in lines of JSON."""

from __future__ import annotations

from collections.abc import Callable
from typing import BinaryIO, Final, Generic, TypeVar

import msgspec

from zenoh_ice.application.child import ChildProcess

R = TypeVar("R")

_LONGEST_WORDS: Final = 2000  # bytes


class ReportingProcess(ChildProcess, Generic[R]):
    """A `ChildProcess` that writes reports to stdout, each a line of JSON of `longest` bytes at most.

    `receive` gets them on the event loop as `decode` returns them. A process that writes anything else is
    killed. What it writes to stderr goes to `errors`, too, if that is given.
    """

    def __init__(
        self,
        decode: Callable[[bytes], R],
        receive: Callable[[R], object],
        ended: Callable[[int, bool], None],
        longest: int,
        errors: BinaryIO | None = None,
    ) -> None:
        super().__init__(self._read, ended)
        self._decode = decode
        self._report = receive
        self._longest = longest
        self._errors = errors
        self._rest = bytearray()
        self._words = b""
        self.invalid: Exception | None = None
        """Why something that it wrote is no report."""

    @property
    def words(self) -> str:
        """The last that it wrote to stderr."""
        return self._words.decode(errors="replace").strip()

    def _read(self, descriptor: int, data: bytes) -> None:
        if descriptor == 2:
            self._words = (self._words + data)[-_LONGEST_WORDS:]
            if self._errors is not None:
                self._errors.write(data)  # which may end within a character
                self._errors.flush()
        elif self.invalid is None:
            first, *others = data.split(b"\n")
            try:
                self._extend(first)
                for each in others:
                    line, self._rest = bytes(self._rest), bytearray()
                    self._report(self._decode(line))
                    self._extend(each)
            except (msgspec.MsgspecError, RecursionError) as error:
                self.invalid = error
                self.kill()

    def _extend(self, data: bytes) -> None:
        self._rest += data
        if len(self._rest) > self._longest:
            raise msgspec.DecodeError("it is too long")
