"""What a match looked like: where everything was, ten times a second, for a page to show."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any, BinaryIO, Final

import msgspec

from naoserver.body import write_body
from naoserver_sim.arena import Arena
from visualhfsm.plugins import describe
from visualhfsm_match._referee import Event

_DIGITS: Final = 3


class Film:
    """The places of the ball and of all links of the robots; `look` takes a picture of them.

    What is seen is also written to a file, line by line, for those who watch, if there is one.
    """

    def __init__(self, ball: str, live: BinaryIO | None = None) -> None:
        self._ball: Final = ball
        self._live: Final = live
        self._told = 0
        self._arena: Arena | None = None
        self._names: Sequence[str] = ()
        self._shirts: dict[str, Sequence[float]] = {}
        """Of the teams."""
        self._frames: list[list[float]] = []
        self._joints: list[list[str]] = []
        self._states: Final = hashlib.sha256()

    def begin(
        self,
        arena: Arena,
        names: Sequence[str],
        shirts: Sequence[Sequence[float]],
        teams: Sequence[str],
    ) -> None:
        """See what there is, before the match begins."""
        self._arena, self._names = arena, names
        self._shirts = dict(zip(teams, shirts, strict=True))
        self._joints = [[joint.name for joint in robot.joints] for robot in arena.robots]
        if self._live is not None:
            self._write({**self.content(), "teams": teams})
        self.look(0.0)

    def look(self, time: float, events: Sequence[Event] = ()) -> None:
        """Note where everything is at a time in s; the events are all until then."""
        assert self._arena is not None
        frame = [time, *self._arena.truth().objects[self._ball].position]
        for robot in self._arena.robots:
            torso = robot.stage.truth().torso
            w, x, y, z = torso.orientation
            frame += (*torso.position, x, y, z, w, *robot.read().positions)
        self._states.update(msgspec.msgpack.encode(frame))
        self._frames.append([round(value, _DIGITS) for value in frame])
        if self._live is not None:
            self._write({"frame": self._frames[-1], "news": events[self._told :]})
            self._told = len(events)

    def _write(self, line: dict[str, Any]) -> None:
        assert self._live is not None
        self._live.write(msgspec.json.encode(line) + b"\n")
        self._live.flush()

    @property
    def digest(self) -> str:
        """A digest of all that was seen, to the last bit."""
        return self._states.hexdigest()

    def content(self) -> dict[str, Any]:
        """Return what the page needs: the bodies and their looks, the world, and the frames."""
        assert self._arena is not None
        bodies = {robot.body.name: robot for robot in self._arena.robots}
        pages = [msgspec.Raw(describe(write_body(each.body), each.looks()).page) for each in bodies.values()]
        robots = [
            {
                "name": name,
                "shirt": self._shirts[robot.team],
                "body": [*bodies].index(robot.body.name),
                "joints": joints,
            }
            for name, joints, robot in zip(self._names, self._joints, self._arena.robots, strict=True)
        ]
        shapes = [
            {
                "object": shape.object,
                "kind": shape.kind.lower(),
                "size": shape.size,
                "at": [*shape.pose.position, *shape.pose.orientation[1:], shape.pose.orientation[0]],
                "color": shape.color,
                "opacity": shape.opacity,
            }
            for shape in self._arena.robots[0].stage.shapes
            if shape.object in ("", self._ball)
        ]
        return {
            "ball": self._ball,
            "bodies": pages,
            "robots": robots,
            "world": shapes,
            "frames": self._frames,
        }
