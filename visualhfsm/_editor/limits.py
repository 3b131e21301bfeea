"""The limits that keep one client from exhausting the server."""

from __future__ import annotations

from dataclasses import dataclass

from visualhfsm._monitor.messages import RecentLines
from visualhfsm.project._editing.undo_stack import MERGE_WITHIN


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits for the clients; requests beyond them are refused or wait."""

    message_bytes: int = 4 * 1024 * 1024
    """Largest message on the websocket; a larger one closes it."""

    connections: int = 256
    """Connections at a time, websockets included; the requests of further ones get the status 503."""

    viewers: int = 64
    """Websockets of viewers at a time; the others are for the editor and its STOP."""

    viewer_requests: float = 50.0
    """Requests of a viewer in a second; further ones are read later."""

    unsent_answers: int = 256
    """Answers of a window that wait until it reads; while more do, its requests are not read."""

    concurrent_operations: int = 16
    """Requests of one connection that are under way at a time; help with code and stops are counted apart."""

    waiting_bytes: int = 16 * 1024 * 1024
    """Size of the requests of one connection that wait for earlier ones; further ones are refused."""

    tabs: int = 32
    """Documents open at a time."""

    threads: int = 4
    """Threads that do the work that takes long."""

    operation_seconds: float = 15.0
    """Longest duration of an operation, after which it is answered with an error."""

    output_lines: int = 2000
    """Lines of a component's output that are kept."""

    output_characters: int = 200_000
    """Characters of these lines."""

    quiet_seconds: float = 0.03
    """The time for which a document must be unchanged before it is checked."""

    file_check_seconds: float = 1.0
    """Seconds between two checks of the open files for changes by other programs."""

    component_end_seconds: float = 4.0
    """The time that components have to end at STOP before their processes are ended."""

    component_leaving_seconds: float = 1.0
    """The time for which a component that has ended may still be listed as running."""

    return_seconds: float = 30.0
    """The time for which a run that no window follows is kept: a page that is loaded again wants its past."""

    merge_seconds: float = MERGE_WITHIN
    """The time after a change in which another one of the same kind belongs to the same step."""

    def room_for_output(self) -> RecentLines:
        """Return room for the output of a component."""
        return RecentLines(self.output_lines, self.output_characters)
