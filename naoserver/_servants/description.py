"""The servant that describes the robot to programs that know none of its parts."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

from interfaces.nao import Description
from naoserver.body import Body, write_body
from zenoh_ice import Current


class DescriptionI(Description):
    """Report a body, and its looks: `looks` returns them as JSON, or an empty text."""

    def __init__(self, body: Body, looks: Callable[[], str]) -> None:
        self._of = body
        self._read_looks = looks

    def getBody(self, current: Current) -> str:
        return self._body

    def getLooks(self, current: Current) -> str:
        return self._looks

    @cached_property
    def _body(self) -> str:
        return write_body(self._of)

    @cached_property
    def _looks(self) -> str:
        return self._read_looks()
