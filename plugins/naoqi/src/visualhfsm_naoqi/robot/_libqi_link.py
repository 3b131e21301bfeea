"""The connection over libqi: alone of what drives the real robot, it imports `qi`."""

from __future__ import annotations

import threading
from typing import Any, Final

import qi

from naoserver.hardware.connection import CallFailed, LinkLost
from visualhfsm_naoqi._libqi import start_libqi
from visualhfsm_naoqi.robot._link import RobotAddress
from visualhfsm_naoqi.robot.calls import CallTimeout, Failure, Reply
from zenoh_ice.data.text import sentence

_FINDING: Final = 2.0
"""Time limit in s for the robot to find a service."""
_GONE: Final = (
    "socket is not connected",
    "session is not connected",
    "session closed",
    "socket disconnected",
)
"""Parts of libqi's messages for calls without a connection."""


def connect(address: RobotAddress, timeout: float) -> LibqiLink:
    """Connect to a robot within some seconds. Raises LinkLost with the reason why it could not."""
    start_libqi()
    session = qi.Session()
    if address.user:
        session.setClientAuthenticatorFactory(_Login(address.user, address.password))
    future = session.connect(address.url, _async=True)
    state = future.wait(round(timeout * 1000))
    if state == qi.FutureState.FinishedWithValue:
        return LibqiLink(session)
    if future.isRunning():
        future.cancel()
        why = sentence(f"no answer within {timeout:g} s")
    else:
        why = str(future.error()) if future.hasError() else "it was cancelled"
    session.close()
    raise LinkLost(f"cannot connect to {address}: {why}; is the robot on, and the address right?")


class LibqiLink:
    """A session of libqi. Implements CallLink."""

    def __init__(self, session: qi.Session) -> None:
        self._session = session
        self.lost: Final = threading.Event()
        self._services: dict[str, Any] = {}
        self._lock = threading.Lock()
        self._watch = session.disconnected.connect(lambda _reason: self.lost.set())
        if not session.isConnected():
            self.lost.set()

    def begin(self, operation: str, *arguments: object) -> Reply:
        service, _, method = operation.partition(".")
        try:
            return _FutureReply(operation, getattr(self._service(service), method)(*arguments, _async=True))
        except AttributeError:
            return Failure(CallFailed(f"{operation}: this robot has no such method"))
        except (CallFailed, CallTimeout, LinkLost) as error:
            return Failure(error)
        except RuntimeError as error:
            return Failure(_failure(operation, str(error)))

    def close(self) -> None:
        with self._lock:
            session, self._session = self._session, None
            self._services = {}
        self.lost.set()
        if session is not None:
            session.disconnected.disconnect(self._watch)
            session.close()

    def _service(self, name: str) -> Any:  # noqa: ANN401 - libqi has no types
        service = self._services.get(name)
        if service is not None:
            return service
        with self._lock:
            session = self._session
        if session is None:
            raise LinkLost(f"{name}: the connection is closed")
        found = _FutureReply(name, session.service(name, _async=True)).result(_FINDING)
        with self._lock:
            if self._session is not None:
                self._services[name] = found
        return found


class _FutureReply:
    """The answer from a future of libqi. Implements Reply."""

    def __init__(self, operation: str, future: qi.Future) -> None:
        self._operation = operation
        self._future = future

    @property
    def done(self) -> bool:
        return not self._future.isRunning()

    def result(self, timeout: float) -> Any:  # noqa: ANN401 - whatever NAOqi answers
        state = self._future.wait(round(timeout * 1000))
        if state == qi.FutureState.FinishedWithValue:
            return self._future.value()
        if state == qi.FutureState.Running:
            raise CallTimeout(sentence(f"{self._operation}: no answer within {timeout:g} s"))
        raise _failure(self._operation, str(self._future.error()) if self._future.hasError() else "cancelled")


class _Login:
    """Gives libqi the login, by the methods that it calls."""

    def __init__(self, user: str, password: str) -> None:
        self._data = {"user": user, "token": password}

    def newAuthenticator(self) -> _Login:
        return self

    def initialAuthData(self) -> dict[str, str]:
        return self._data


def _failure(operation: str, message: str) -> CallFailed | LinkLost:
    message = message.strip().partition("\n")[0] or "it failed without a message"
    named = message.startswith(operation.replace(".", "::"))
    text = message if named else f"{operation}: {message}"
    return LinkLost(text) if any(part in message.lower() for part in _GONE) else CallFailed(text)
