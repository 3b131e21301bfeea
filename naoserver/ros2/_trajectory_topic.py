"""Trajectories from a topic, as ros2_control's controller takes them beside its action.

There is neither a result nor feedback. A newer message replaces an older one without a halt between them, so
that a stream of short ones is smooth; an empty one stops the joints, and so does the end of the publisher.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any, Final

from zenoh_ice import SystemException, UserException
from zenoh_ros2 import Canceled, Sender, Types

from ._trajectory import TYPE, SupersededError, Trajectory, TrajectoryError, TrajectoryFollower

MESSAGE: Final = "trajectory_msgs/msg/JointTrajectory"
_CLOSE_LIMIT: Final = 2.0  # s

_logger = logging.getLogger(__name__)


class TrajectoryTopic:
    """Follows the newest trajectory of a topic on a thread, which runs while there is one."""

    def __init__(self, types: Types, follower: TrajectoryFollower, refuse: Callable[[str], object]) -> None:
        """Take trajectories; `refuse` gets why one was refused or ended early."""
        self._types: Final = types
        self._follower: Final = follower
        self._refuse: Final = refuse
        self._lock: Final = threading.Lock()
        self._current: _Order | None = None
        self._next: tuple[_Order, Trajectory] | None = None
        self._thread: threading.Thread | None = None
        self._closed = False

    def receive(self, message: Any, sender: Sender) -> None:  # noqa: ANN401 - a message's class
        """Follow a message's trajectory from now on; raises TrajectoryError for one that makes no sense."""
        if not message.points:
            self._stop()
            return
        trajectory = self._follower.read(self._types.make(f"{TYPE}_Goal", trajectory=message))
        order = _Order(sender)
        with self._lock:
            if self._closed:
                return
            former = self._current, self._next[0] if self._next else None
            self._follower.claim(order, trajectory, former)
            self._next = order, trajectory
            if self._thread is None:
                thread = threading.Thread(target=self._run, name="trajectories of a topic", daemon=True)
                thread.start()
                self._thread = thread  # not earlier: without a thread the next message tries again

    def close(self) -> None:
        """Stop the joints that it moves."""
        with self._lock:
            self._closed = True
            thread = self._thread
        self._stop()
        if thread is not None:
            thread.join(_CLOSE_LIMIT)

    def _stop(self) -> None:
        with self._lock:
            self._next = None
            if self._current is not None:
                self._current.cancel()

    def _run(self) -> None:
        while True:
            with self._lock:
                if self._next is None:
                    self._current = self._thread = None
                    return
                (order, trajectory), self._next = self._next, None
                self._current = order
            try:
                self._follower.follow(order, trajectory)
            except Canceled:
                if order.abandoned:
                    self._refuse("its publisher is gone: its joints are held")
            except SupersededError as error:
                _logger.debug("a trajectory of a topic: %s", error)
            except (TrajectoryError, UserException, SystemException) as error:
                self._refuse(str(error))
            finally:
                self._follower.release(order)


class _Order:
    """A trajectory that is followed without a client that waits."""

    def __init__(self, sender: Sender) -> None:
        self._sender: Final = sender
        self._canceled: Final = threading.Event()

    @property
    def abandoned(self) -> bool:
        """Return whether its publisher is gone."""
        return self._sender.gone

    @property
    def canceled(self) -> bool:
        """Return whether its joints are to be held."""
        return self._canceled.is_set() or self.abandoned

    def publish_feedback(self, feedback: object) -> None:
        """Report to nobody."""

    def cancel(self) -> None:
        """Hold its joints."""
        self._canceled.set()
