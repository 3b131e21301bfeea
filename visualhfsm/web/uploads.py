"""Recordings that a window sends in parts, as they lie where only its browser reaches them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from visualhfsm.errors import VisualHfsmError
from visualhfsm.scratch import ScratchDirectory

from .paths import RECORDING_SUFFIX
from .work import Workers

__all__ = ["LARGEST", "Upload"]

LARGEST: Final = 256 << 20
"""Bytes of the largest recording that is taken; larger ones are opened where they lie."""


class Upload:
    """What one window sends: one file at a time, which is gone once it was read."""

    def __init__(self, workers: Workers, largest: int = LARGEST) -> None:
        self._workers = workers
        self._largest = largest
        self._folder: ScratchDirectory | None = None
        self._file: Path | None = None
        self._size = 0

    async def add(self, name: str, data: bytes, *, begins: bool) -> None:
        """Take a part of a file; the first one gives up what was sent before. Raises VisualHfsmError."""
        if begins:
            self.close()
        elif self._file is None:
            raise VisualHfsmError(f"Cannot take {name}: its beginning was not sent")
        self._size += len(data)
        if self._size > self._largest:
            self.close()
            raise VisualHfsmError(
                f"Cannot take {name}: it is larger than {self._largest >> 20} MiB; "
                "put it into the folder of the editor and open it there (Alt+R)"
            )
        try:
            await self._workers.do(lambda: self._write(name, data))
        except OSError as error:
            self.close()
            raise VisualHfsmError(f"Cannot take {name}: {error.strerror}") from error

    @contextmanager
    def whole(self) -> Iterator[Path]:
        """Give the file that was sent; it is gone afterwards. Raises VisualHfsmError."""
        if self._file is None:
            raise VisualHfsmError("no recording was sent")
        try:
            yield self._file
        finally:
            self.close()

    def close(self) -> None:
        """Give up what was sent."""
        folder, self._folder, self._file, self._size = self._folder, None, None, 0
        if folder is not None:
            folder.close()

    def _write(self, name: str, data: bytes) -> None:
        if self._file is None:
            self._folder = ScratchDirectory()
            self._file = self._folder.path / _file_name(name)
        with self._file.open("ab") as stream:
            stream.write(data)


def _file_name(name: str) -> str:
    stem = "".join(each if each.isalnum() or each in "-_." else "_" for each in Path(name).stem)
    return f"{stem[:100] or 'recording'}{RECORDING_SUFFIX}"
