"""What the gallery shows: behaviors, exercises and ready states, each with where and when it is filmed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from interfaces.nao import TouchReading
from visualhfsm.simulation import Behavior

ROOT: Final = Path(__file__).parents[2]
HALF_LEFT: Final = (215.0, -12.0)
FROM_BEHIND: Final = (30.0, -22.0)
AT_GOAL: Final = (62.0, -16.0)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A run in virtual time, of which some seconds are shown.

    They begin after `skip` s, or end `after` s after a state that is waited for, `until`. `robot` and `ball`
    are places in m, the ball's in the world `soccer`. `side` is where the camera is seen from the robot:
    azimuth and elevation in degrees; it is `distance` m away, and looks at a height in m. `acts` happen at
    their times in s. `faster` is the pace of the picture.
    """

    body: str = "H25"
    world: str = "balls"
    seconds: float = 4.0
    skip: float = 0.0
    until: str = ""
    after: float = 1.5
    seed: int = 2
    robot: tuple[float, float] = (0.0, 0.0)
    ball: tuple[float, float] | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    posture: str | None = None
    values: Mapping[str, object] = field(default_factory=dict)
    """What the variables of the root are set to at the start."""
    acts: Mapping[float, Callable[[Behavior], object]] = field(default_factory=dict)
    side: tuple[float, float] = HALF_LEFT
    height: float = 0.3
    distance: float = 1.15
    faster: float = 1.0
    others: tuple[str, ...] = ()
    """Documents in the repository that drive the other robots of the world."""


def moves_ball(pan: float) -> Callable[[Behavior], object]:
    """Return what moves the green ball, to a bearing in rad."""
    return lambda run: run.robot.ball("green").place(pan=pan, distance=1.0, height=0.6)


def freezes(run: Behavior) -> None:
    """Let the upper camera of a Nao show one picture for some seconds."""
    run.robot.fail("Camera", "frozen", seconds=3.0)


def hears(sentence: str) -> Callable[[Behavior], object]:
    """Return what says a sentence to the robot."""
    return lambda run: run.robot.hear(sentence)


def touch(run: Behavior) -> None:
    """Touch the robot's head."""
    run.stub("Touch", getTouchReading=TouchReading(time=1.0, touched=["HeadFront"]))


def goal(body: str, seed: int, distance: float, height: float) -> Scene:
    """Return a goal of a humanoid, which begins before its ball."""
    return Scene(
        body=body,
        world="soccer",
        seed=seed,
        robot=(2.9, 0.0),
        ball=(3.5, 0.1),
        parameters={"start_x": 2.9},
        until="scored",
        after=1.0,
        seconds=9.0,
        faster=2.0,
        side=AT_GOAL,
        height=height,
        distance=distance,
    )


BEHAVIORS: Final[Mapping[str, Scene]] = {
    "dance": Scene(seconds=5.0),
    "dance_and_follow": Scene(body="T1", skip=7.0, seconds=6.0, height=0.6, distance=2.2),
    "drive_to_ball": Scene(
        body="Cart", world="soccer", ball=(1.2, 0.5), seconds=6.0, distance=1.8, height=0.15
    ),
    "follow_ball": Scene(
        body="G1", seconds=5.0, height=0.64, distance=2.4, acts={2.0: moves_ball(-0.5), 3.5: moves_ball(0.5)}
    ),
    "get_up": Scene(posture="LyingBelly", seconds=26.0, faster=4.0, distance=1.3),
    "score": goal("H25", 1, 2.3, 0.3),
    "team_score": goal("H25", 3, 2.3, 0.3),
}
GOALS: Final[Mapping[str, Scene]] = {"T1": goal("T1", 1, 3.2, 0.45), "G1": goal("G1", 2, 3.2, 0.45)}
"""Of the other humanoids."""
EXERCISES: Final[Mapping[str, Scene]] = {
    "look": Scene(seconds=5.0),
    "nod": Scene(seconds=5.0, parameters={"times": 3}),
    "wake_up": Scene(seconds=6.0, acts={0.0: moves_ball(3.1), 1.5: moves_ball(0.0), 4.5: moves_ball(3.1)}),
    "walk": Scene(world="empty", skip=1.0, seconds=12.0, faster=3.0, distance=1.9),
    "ball": Scene(world="soccer", ball=(0.95, 0.15), seconds=9.0, faster=2.0, distance=1.7),
    "notice": Scene(
        seconds=7.5,
        faster=1.5,
        distance=1.9,
        acts={0.0: moves_ball(0.0), 2.0: freezes, 4.0: moves_ball(0.15)},
    ),
    "goal": Scene(
        world="soccer",
        robot=(3.2, 0.0),
        ball=(3.8, 0.05),
        parameters={"goal_x": 1.3},
        until="scored",
        seconds=8.0,
        faster=2.0,
        side=AT_GOAL,
        distance=2.2,
    ),
    "match": Scene(
        world=str(ROOT / "exercises/match/duel.toml"),
        robot=(3.0, 0.0),
        ball=(3.5, 0.05),
        parameters={"goal_x": 1.5},
        others=("exercises/match/rival.xml",),
        until="scored",
        seconds=9.0,
        faster=2.0,
        side=AT_GOAL,
        distance=2.4,
    ),
}
SHELF: Final[Mapping[str, Scene]] = {
    "kick": Scene(world="soccer", ball=(0.17, -0.05), seconds=5.0, skip=0.5, distance=1.5),
    "lights": Scene(seconds=2.5, height=0.42, distance=0.8),
    "look_at": Scene(seconds=2.5, values={"left": 40.0, "up": 10.0}),
    "look_for_a_ball": Scene(
        seconds=4.0, values={"color": "green"}, acts={0.0: moves_ball(0.2)}, distance=1.8
    ),
    "one_at_a_time": Scene(seconds=2.0),
    "play_a_motion": Scene(seconds=5.0),
    "play_a_sound": Scene(seconds=2.0),
    "say": Scene(seconds=2.5),
    "sit": Scene(seconds=6.0, faster=1.5),
    "stand": Scene(posture="LyingBack", seconds=26.0, faster=4.0, distance=1.3),
    "turn": Scene(world="empty", seconds=7.0, faster=2.0),
    "wait_for_a_word": Scene(seconds=3.0, acts={1.5: hears("Please go on")}, values={"word": "go"}),
    "wait_for_touch": Scene(seconds=3.0, acts={1.5: touch}),
    "walk_to": Scene(world="empty", seconds=8.0, faster=2.0, distance=1.6),
    "wave_a_hand": Scene(seconds=5.0),
}
