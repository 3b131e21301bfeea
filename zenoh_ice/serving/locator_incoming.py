"""The server's side of calls of servants that a servant locator finds."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, Final

import msgspec

from ..exceptions import (
    ObjectNotExistException,
    UserException,
)
from ..identity import Target
from ..object import OBJECT_INTERFACE, Current, Object
from ..wire.errors import unknown_exception
from ..wire.pieces import Pieces
from .answer_memory import Answer
from .default_incoming import DefaultIncoming
from .skeleton import Skeleton, runs_a_call
from .upcalls import Arrived

if TYPE_CHECKING:
    from ..adapter import ObjectAdapter
    from ..communicator import Communicator
    from .servant_locator import ServantLocator

__all__ = ["LocatorIncoming"]

_CONCURRENT_CALLS: Final = 4

_logger = logging.getLogger(__name__)


class LocatorIncoming(DefaultIncoming):
    """Serve a category by the servants that a locator finds."""

    def __init__(
        self,
        communicator: Communicator,
        category: str,
        locator: ServantLocator,
        adapter: ObjectAdapter | None,
    ) -> None:
        super().__init__(communicator, category, OBJECT_INTERFACE, adapter, _CONCURRENT_CALLS)
        self.locator: Final = locator

    def drain(self, timeout: float) -> bool:
        """Wait for the calls that run, as every registration does, and tell the locator."""
        ended = super().drain(timeout)
        if not self.served:  # somebody else serves the category
            return ended
        try:
            self.locator.deactivate(self.category)
        except Exception:
            _logger.exception("the servant locator of %s failed to deactivate", self.target.identity)
        return ended

    def _execute(self, target: Target, name: str, call: Arrived) -> Answer | None:
        current = call.current
        servant, cookie = self._locate(current)

        def finish() -> None:
            try:
                self.locator.finished(current, servant, cookie)
            except Exception:
                _logger.exception("the servant locator of %s failed to finish", self.target.identity)

        def finish_later(ok: bool, answer: bytes | Pieces) -> None:
            try:
                call.later(ok, answer)
            finally:
                finish()

        try:
            skeleton = Skeleton(self._communicator, servant)
            call_located = msgspec.structs.replace(call, later=finish_later)
            answer = self._execute_method(skeleton, target, name, call_located)
        except BaseException:
            finish()
            raise
        if answer is not None:
            finish()
        return answer

    def _locate(self, current: Current) -> tuple[Object, Any]:
        try:
            found = self.locator.locate(current)
        except (UserException, ObjectNotExistException):
            raise
        except Exception as error:
            _logger.exception(
                "the servant locator of %s failed for %s", self.target.identity, current.identity
            )
            raise unknown_exception(error) from error
        if found is None:
            raise ObjectNotExistException(
                f"no servant {current.identity!r}: the servant locator of its category knows none"
            )
        return found if isinstance(found, tuple) else (found, None)

    def _limit_of(self, target: Target, name: str) -> int:  # noqa: ARG002
        # More than the servant may take: that is known when it was located.
        return self._communicator.settings.max_bulk_size

    def _runs_here(self) -> bool:
        return runs_a_call()  # perhaps of a servant that it would locate
