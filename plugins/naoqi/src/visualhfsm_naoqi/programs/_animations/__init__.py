"""Our own animations under names of NAOqi's: gestures of arms and head for a robot that stands.

Each is a file of key frames below this folder, as `naoserver.moves.motion_file` reads it, and ends with
the way back to where its joints were. NAOqi numbers the variants of an animation; those without a file are
played as one that has.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Final

from naoserver.bodies.nao import H25
from naoserver.bodies.parts import Stance
from naoserver.moves.motion_file import Key, Motion, MotionError, parse_motion
from naoserver.moves.routes import MotionRoute, RouteError, Situation, stance_of
from zenoh_ice.data.toml_file import read_text

_BACK: Final = 1.5
"""Seconds of the way back."""
_NUMBER: Final = re.compile(r"_\d{1,2}\Z")
"""The number of a variant at the end of a name."""
_STAND: Final = "animations/Stand/"
TAGS: Final[Mapping[str, str]] = {
    tag: f"{_STAND}{animation}"
    for tag, animation in {
        "affirmative": "Gestures/Yes_1",
        "bow": "Gestures/BowShort_1",
        "calm down": "Gestures/CalmDown_1",
        "confused": "Gestures/IDontKnow_1",
        "enthusiastic": "Gestures/Enthusiastic_4",
        "explain": "Gestures/Explain_1",
        "far": "Gestures/Far_1",
        "happy": "Emotions/Positive/Happy_1",
        "hello": "Gestures/Hey_1",
        "me": "Gestures/Me_1",
        "negative": "Gestures/No_3",
        "no": "Gestures/No_3",
        "please": "Gestures/Please_1",
        "sad": "Emotions/Negative/Sad_1",
        "yes": "Gestures/Yes_1",
        "you": "Gestures/You_1",
    }.items()
}
"""An animation for each tag."""


@cache
def load_animations() -> Mapping[str, Motion]:
    """Return the animations by name: read when they are first used. Raises MotionError."""
    found = {}
    with resources.as_file(resources.files("visualhfsm_naoqi.programs._animations")) as folder:
        for path in sorted(folder.glob("*/**/*.toml")):
            name = f"animations/{path.relative_to(folder).with_suffix('').as_posix()}"
            found[name] = _returning(parse_motion(read_text(path, MotionError), name, str(path), H25))
    return MappingProxyType(found)


def find_animation(name: str) -> Motion | None:
    """Return the animation of a name, or another variant of it; None when there is none."""
    animations = load_animations()
    if name in animations or not _NUMBER.search(name):
        return animations.get(name)
    kind = _NUMBER.sub("_", name)
    return next((animations[each] for each in animations if _NUMBER.sub("_", each) == kind), None)


def _returning(motion: Motion) -> Motion:
    """Return a motion that ends where each of its joints began."""
    end = motion.duration + _BACK
    return replace(motion, keys={joint: (*keys, Key(end, None)) for joint, keys in motion.keys.items()})


class AnimationRoute(MotionRoute):
    """An animation of a robot that stands, in whichever posture."""

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the animation, then None. Raises RouteError unless the robot stands."""
        stance = stance_of(self._body, situation)
        if self._legs and stance is not Stance.STANDING:
            raise RouteError(f"{self._legs[0].name} needs a robot that stands, and it is {stance}")
        return super().next_leg(situation, commands)
