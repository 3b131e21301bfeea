"""Look at the newest of a stream that may be old, missing, or of another interface."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Generic, TypeVar

from zenoh_ice import MarshalException, Sample

__all__ = ["Newest"]

T = TypeVar("T")

_logger = logging.getLogger(__name__)


class Newest(Generic[T]):
    """The newest sample of a stream, or None when it is older than `oldest` s or does not fit the interface.

    What does not fit is logged once, until something fits again: it is looked at many times a second.
    """

    def __init__(self, read: Callable[[], Sample[T] | None], oldest: float = math.inf) -> None:
        self._read = read
        self._oldest = oldest
        self.trouble = ""
        """Why what came last does not fit."""

    def __call__(self) -> Sample[T] | None:
        """Look, without waiting."""
        try:
            sample = self._read()
        except MarshalException as error:
            if not self.trouble:
                _logger.warning("%s", error)
            self.trouble = str(error)
            return None
        self.trouble = ""
        return sample if sample is not None and sample.age <= self._oldest else None
