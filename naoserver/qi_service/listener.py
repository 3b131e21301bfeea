"""Listen over libqi and offer services, and hang up without leaving libqi anything to tidy up."""

from __future__ import annotations

import logging
import threading
import time
import weakref
from collections.abc import Callable, Mapping
from typing import Final

import qi

from naoserver.errors import RobotError
from naoserver.qi_service.libqi import start_libqi

__all__ = ["Listener"]

_logger = logging.getLogger(__name__)

_LONGEST_BREAK: Final = 60.0
_ANSWERING: Final = 0.05
"""Wall seconds in which who asks for a break gets its answer."""
_TIDYING: Final = 2.0
"""Wall seconds for which it waits until libqi has let go of the services."""
_LOOK: Final = 0.005
_GRACE: Final = 0.05
"""Wall seconds that libqi gets to let go of what it let clients have."""


class Listener:
    """Offer services at a URL until it is closed."""

    def __init__(self, url: str, services: Mapping[str, Callable[[], object]]) -> None:
        """Offer what makes each service by its name. Raises RobotError when it cannot listen."""
        start_libqi()
        self.url = url
        """Where it listens, with the port that the system picked."""
        self._services = services
        self._lock = threading.Lock()
        self._session: qi.Session | None = None
        self._offered: list[weakref.ref[object]] = []
        self._break: threading.Thread | None = None
        self._closing = threading.Event()
        self._listen()

    def interrupt(self, seconds: float) -> None:
        """Close every connection soon, and listen again after some wall seconds, at most a minute.

        Does nothing during such a break.
        """
        if not 0.0 <= seconds <= _LONGEST_BREAK:
            raise RobotError(f"seconds is {seconds:g}: it must be from 0 to {_LONGEST_BREAK:g}")
        with self._lock:
            if self._closing.is_set() or (self._break is not None and self._break.is_alive()):
                return
            self._break = threading.Thread(
                target=self._take_a_break, args=(seconds,), name="break", daemon=True
            )
            self._break.start()

    def close(self) -> None:
        """Close every connection; does nothing the second time."""
        with self._lock:
            self._closing.set()
            pause = self._break
        if pause is not None:
            pause.join()
        self._hang_up()

    def _listen(self) -> None:
        session = qi.Session()
        try:
            session.listenStandalone(self.url)
        except RuntimeError as error:
            raise RobotError(f"cannot listen at {self.url}: {error}; give another address") from None
        for name, make in self._services.items():
            service = make()
            self._offered.append(weakref.ref(service))
            session.registerService(name, service)
        self.url = str(session.endpoints()[0])
        self._session = session

    def _hang_up(self) -> None:
        session, self._session = self._session, None
        if session is None:
            return
        session.close()
        del session
        # libqi lets go of the services on a thread of its own. A process that ends meanwhile hangs: that
        # thread waits for Python's lock, which is held while libqi waits for its threads.
        limit = time.monotonic() + _TIDYING
        while any(service() is not None for service in self._offered) and time.monotonic() < limit:
            time.sleep(_LOOK)
        if any(service() is not None for service in self._offered):
            _logger.warning("libqi has not let go of the services within %g s", _TIDYING)
        self._offered = []
        time.sleep(_GRACE)

    def _take_a_break(self, seconds: float) -> None:
        self._closing.wait(_ANSWERING)
        self._hang_up()
        if not self._closing.wait(seconds):
            try:
                self._listen()
            except RobotError:
                _logger.exception("NAOqi is not served any more")
