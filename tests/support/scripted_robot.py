"""A robot at the other end of a stop that answers what a test says, over real Zenoh."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

import msgspec
import zenoh

from tests.support.limits import CALL_LIMIT
from zenoh_ice import Settings
from zenoh_ice.carriers.zenoh.session import open_session
from zenoh_ice.data.wire import ERROR_ENCODING

__all__ = ["STOPPED", "Answer", "ScriptedRobot", "error", "joints", "listening", "state"]

STOPPED: Final = b"\x80"

Sent = tuple[str, str, str | None]
Answer = tuple[bool, bytes]


def error(text: str) -> Answer:
    """The answer of a robot that could not stop."""
    encoded = {"exception": "::zenoh_ice::UnknownException", "message": text}
    return False, msgspec.msgpack.encode(encoded)


def joints(*speeds: float) -> Answer:
    """The speeds of the joints in rad/s."""
    return True, msgspec.msgpack.encode({"returnValue": {"velocities": speeds}})


def state(lost: str = "", seconds: float = 0.0) -> Answer:
    """Whether commands reach the robot, or why they do not, and since when."""
    return True, msgspec.msgpack.encode({"returnValue": {"lost": lost, "lostFor": seconds}})


class ScriptedRobot:
    """A robot that answers as another release did, or as a test says: the last answer again and again."""

    def __init__(self, session: zenoh.Session, realm: str = "nao", token: str = "") -> None:
        self.sent: list[Sent] = []
        self.stops: list[Answer] = [(True, STOPPED)]
        self.joints: list[Answer] = [joints(0.0)]
        self.states: list[Answer] = [state()]
        self._declared: list[Any] = [
            session.declare_queryable(f"{realm}/Safety/emergencyStop", self._stop),
            session.declare_queryable(
                f"{realm}/Body/getJointState", lambda query: _reply(query, self.joints)
            ),
            session.declare_queryable(
                f"{realm}/Safety/getSafetyState", lambda query: _reply(query, self.states)
            ),
        ]
        if token:
            self._declared.append(session.liveliness().declare_token(token))

    def _stop(self, query: zenoh.Query) -> None:
        payload, attachment = query.payload, query.attachment
        assert payload is not None
        self.sent.append(
            (
                str(query.selector),
                payload.to_bytes().hex(),
                None if attachment is None else attachment.to_bytes().hex(),
            )
        )
        _reply(query, self.stops)


def _reply(query: zenoh.Query, answers: list[Answer]) -> None:
    with query:
        if not answers:
            return
        ok, payload = answers.pop(0) if len(answers) > 1 else answers[0]
        if ok:
            query.reply(query.key_expr, payload)
        else:
            query.reply_err(payload, encoding=ERROR_ENCODING)


@contextmanager
def listening(endpoint: str) -> Iterator[zenoh.Session]:
    """Open a session that others connect to."""
    with open_session(Settings(listen=(endpoint,), connect=(), lease=CALL_LIMIT)) as session:
        yield session
