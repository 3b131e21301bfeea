"""The sonar, which measures only while somebody has subscribed to it."""

from __future__ import annotations

import logging
from typing import Final

from naoserver.errors import HardwareFailure
from naoserver_naoqi.link import CallFailed, Link, call

__all__ = ["NaoqiSonar"]

_logger = logging.getLogger(__name__)

_NAME: Final = "naoserver-naoqi"


class NaoqiSonar:
    """Turn the sonar on, and off again."""

    def open(self, link: Link) -> None:
        """Turn it on; a robot without one has nothing near."""
        try:
            call(link, "ALSonar.subscribe", _NAME)
        except CallFailed as error:
            _logger.info("the sonar stays off: %s", error)

    def close(self, link: Link | None) -> None:
        """Turn it off, unless somebody else wants it."""
        if link is None:
            return
        try:
            call(link, "ALSonar.unsubscribe", _NAME, timeout=1.0)
        except HardwareFailure as error:
            _logger.debug("the sonar stays as it is: %s", error)
