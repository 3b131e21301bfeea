"""Watch over what a topic set in motion: it ends when the publisher that commanded it is gone.

A velocity ends by itself unless it is renewed, and goals of actions are cancelled; joints on their way to
angles and a walk to a place would go on.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from interfaces.nao import ActionStatus, JointsPrx, WalkPrx
from zenoh_ice import BusyException, SystemException, TimeoutException, UserException
from zenoh_ros2 import Sender

_PERIOD: Final = 0.1
"""Wall seconds between two looks."""
_THERE: Final = 0.001
"""Distance in rad at which a joint's setpoint has arrived."""
_CLOSE_LIMIT: Final = 2.0  # s

_logger = logging.getLogger(__name__)


class Moving(Protocol):
    """Something that moves because of a topic."""

    def poll(self) -> bool:
        """Stop it if its publisher is gone; return whether it still moves and is to be watched."""


class Vigil:
    """Looks after motions on a thread that runs while there are some."""

    def __init__(self) -> None:
        self._lock: Final = threading.Lock()
        self._motions: dict[Moving, int] = {}  # each with how often it was to be watched
        self._thread: threading.Thread | None = None
        self._end: Final = threading.Event()

    def watch(self, motion: Moving) -> None:
        """Look after a motion until it is over."""
        with self._lock:
            self._motions[motion] = self._motions.get(motion, 0) + 1
            if self._thread is None and not self._end.is_set():
                thread = threading.Thread(target=self._run, name="vigil over topics", daemon=True)
                thread.start()
                self._thread = thread  # not earlier: without a thread the next motion tries again

    def close(self) -> None:
        """End the thread; what moves is left to the robot server, which loses this client."""
        self._end.set()
        if (thread := self._thread) is not None:
            thread.join(_CLOSE_LIMIT)

    def _run(self) -> None:
        while not self._end.wait(_PERIOD):
            with self._lock:
                motions = self._motions.copy()
            over = [each for each in motions if not self._poll(each)]
            with self._lock:
                for each in over:
                    if self._motions[each] == motions[each]:  # it did not move again meanwhile
                        del self._motions[each]
                if not self._motions:
                    self._thread = None
                    return

    def _poll(self, motion: Moving) -> bool:
        try:
            return motion.poll()
        except (BusyException, TimeoutException) as error:  # it may still move
            _logger.debug("what a topic set in motion is watched later: %s", error)
            return True
        except (UserException, SystemException) as error:  # refused, or the server is gone
            _logger.warning("what a topic set in motion cannot be watched: %s", error)
            return False
        except BaseException:  # nothing may end the thread: it watches over the others, too
            _logger.exception("what a topic set in motion is watched no more")
            return False


@dataclass(slots=True)
class _Target:
    angle: float
    sender: Sender
    distance: float
    """How far the setpoint was at the last look, in rad."""


class JointMotion:
    """Joints on their way to angles; each belongs to the publisher that commanded it last."""

    def __init__(self, body: JointsPrx, names: tuple[str, ...]) -> None:
        self._body: Final = body
        self._names: Final = names
        self._lock: Final = threading.Lock()
        self._targets: dict[str, _Target] = {}

    def add(self, targets: Mapping[str, float], sender: Sender) -> None:
        """Look after joints that were just sent to some angles in rad."""
        with self._lock:
            self._targets |= {name: _Target(angle, sender, float("inf")) for name, angle in targets.items()}

    def poll(self) -> bool:
        """Hold the joints whose publisher is gone."""
        with self._lock:
            targets = self._targets.copy()
        commands = dict(zip(self._names, self._body.getJointState().commands, strict=True))
        held: dict[str, float] = {}
        over: dict[str, _Target] = {}
        for name, target in targets.items():
            distance = abs(commands[name] - target.angle)
            # A setpoint that moves away is somebody else's.
            if distance < _THERE or distance > target.distance + _THERE:
                over[name] = target
            elif target.sender.gone:
                held[name] = commands[name]
                over[name] = target
            else:
                target.distance = distance
        if held:
            self._body.setJointPositions(held, 1.0)  # if it fails, the next look repeats it
            _logger.warning("/joint_angles: its publisher is gone: %s held", ", ".join(held))
        with self._lock:
            for name, target in over.items():
                if self._targets.get(name) is target:  # not commanded again meanwhile
                    del self._targets[name]
            return bool(self._targets)


class WalkMotion:
    """A walk to a place."""

    def __init__(self, walk: WalkPrx, count: int, sender: Sender) -> None:
        """Look after the walk that has this count."""
        self._walk: Final = walk
        self._count: Final = count
        self._sender: Final = sender

    def poll(self) -> bool:
        """End the walk if the publisher of its goal is gone."""
        state = self._walk.getWalkState()
        if state.count != self._count or state.status is not ActionStatus.Moving:
            return False
        if not self._sender.gone:
            return True
        _logger.warning("the publisher of the goal is gone: the walk ends")
        self._walk.stop()
        return False
