"""Log records of Python on /rosout, where ROS looks for the logs of all nodes."""

from __future__ import annotations

import logging
import threading
from typing import Final

from ._node import Node
from ._wire import QoS

_QOS: Final = QoS(durability="transient_local", depth=1000)  # rclcpp's, without its lifespan of 10 s
_LEVELS: Final = ((logging.CRITICAL, 50), (logging.ERROR, 40), (logging.WARNING, 30), (logging.INFO, 20))
_DEBUG: Final = 10
_LONGEST_MESSAGE: Final = 10_000  # characters of a message


class RosoutHandler(logging.Handler):
    """Publishes log records as rcl_interfaces/msg/Log."""

    def __init__(self, node: Node, level: int = logging.INFO) -> None:
        """Announce the topic; the node's end withdraws it."""
        super().__init__(level)
        self._node: Final = node
        self._publisher: Final = node.create_publisher("rcl_interfaces/msg/Log", "/rosout", _QOS)
        self._inside: Final = threading.local()  # logging while publishing would never end

    def emit(self, record: logging.LogRecord) -> None:
        """Publish a record."""
        if getattr(self._inside, "emits", False):
            return
        self._inside.emits = True
        try:
            self._publisher.publish(
                stamp=self._node.now(),
                level=next((number for least, number in _LEVELS if record.levelno >= least), _DEBUG),
                name=record.name,
                msg=self.format(record).replace("\0", "")[:_LONGEST_MESSAGE],
                file=record.pathname,
                function=record.funcName or "",
                line=record.lineno,
            )
        except Exception:  # noqa: BLE001 - as in every handler: logging must not fail the caller
            self.handleError(record)
        finally:
            self._inside.emits = False

    def close(self) -> None:
        """Withdraw the topic."""
        self._publisher.close()
        super().close()
