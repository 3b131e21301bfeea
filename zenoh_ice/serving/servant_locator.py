"""Where servants come from that are made, or looked up, when they are called."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..object import Current, Object

__all__ = ["ServantLocator"]


class ServantLocator(ABC):
    """Find the servant of a call; add one to an adapter with `addServantLocator`.

    It is asked about the identities of its category that have no servant of their own, from several threads.
    """

    @abstractmethod
    def locate(self, current: Current) -> Object | tuple[Object, Any] | None:
        """Return the servant of a call, with something for `finished` where that needs it; None for none.

        What it raises the caller gets, as from a servant.
        """

    def finished(self, current: Current, servant: Object, cookie: Any) -> None:  # noqa: ANN401, B027
        """Take note that a call was answered; `cookie` is what `locate` returned with the servant."""

    def deactivate(self, category: str) -> None:  # noqa: B027
        """Take note that the locator serves a category no longer."""
