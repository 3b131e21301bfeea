"""What of a body can fail, and how: data for a simulation and a fake robot, which let it happen.

PX4 calls such things failures of units; NASA and ArduPilot inject them, too. A part is what a person would
point at: a joint (with its motor, gear and encoder), a sensor, a camera, a link, the robot as a whole, its
server, the network.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from naoserver.bodies.body import Body
from zenoh_ice.data.text import sentence


class FaultKind(NamedTuple):
    """A way to fail; the fields are those of `nao::FaultKind`."""

    name: str
    text: str
    unit: str = ""
    least: float = 0.0
    greatest: float = 0.0
    usual: float = 0.0


ROBOT: Final = "Robot"
"""The part that stands for the robot as a whole."""
INERTIAL: Final = "InertialUnit"
FEET: Final = "FootPressure"
SONAR: Final = "Sonar"
BATTERY: Final = "Battery"
SPEECH: Final = "Speech"
SOUNDS: Final = "Sounds"
LEDS: Final = "Leds"
SERVER: Final = "Server"
"""The part that stands for the robot's server, and the one for the network between it and its clients."""
LINK: Final = "Link"
RESTARTED: Final = "restarted"

_JOINT: Final = (
    FaultKind("stuck", sentence("it does not turn any more, whatever its motor does")),
    FaultKind("limp", sentence("its motor gives no torque; only the gear's friction holds it")),
    FaultKind("weak", sentence("its motor gives only a share of its torque"), "share", 0.0, 1.0, 0.3),
    FaultKind("slow", sentence("it follows at only a share of its highest speed"), "share", 0.01, 1.0, 0.2),
    FaultKind("backlash", sentence("its gear has so much play"), "rad", 0.0, 0.5, 0.1),
    FaultKind("frozen", sentence("its encoder reports the same angle again and again")),
    FaultKind("offset", sentence("its encoder is wrong by so much"), "rad", -0.5, 0.5, 0.1),
    FaultKind("noisy", sentence("its encoder scatters by so much"), "rad", 0.0, 0.2, 0.03),
)
_DEAD: Final = sentence("it reports nothing but zeros")
_STUCK: Final = sentence("it reports what it felt last")
_INERTIAL: Final = (
    FaultKind("dead", _DEAD),
    FaultKind("drifting", sentence("its pitch runs away at so much in a second"), "rad/s", -0.5, 0.5, 0.05),
)
_FEELS: Final = (FaultKind("dead", _DEAD), FaultKind("stuck", _STUCK))
_SONAR: Final = (
    FaultKind("dead", sentence("it hears no echo")),
    FaultKind("stuck", sentence("it reports what it heard last")),
)
_TOUCH: Final = (
    FaultKind("dead", sentence("it feels nothing")),
    FaultKind("stuck", sentence("it stays pressed")),
)
_CAMERA: Final = (
    FaultKind("black", sentence("its pictures are black")),
    FaultKind("frozen", sentence("its last picture is all that comes, with its time")),
    FaultKind(
        "blurred", sentence("its pictures are out of focus by so many pixels"), "pixels", 0.5, 20.0, 4.0
    ),
    FaultKind("late", sentence("its pictures come so much later"), "s", 0.0, 10.0, 0.5),
    FaultKind("halved", sentence("pictures come at only a share of its rate"), "share", 0.01, 1.0, 0.5),
)
_ROBOT: Final = FaultKind("held", sentence("somebody holds it by its trunk"))
_LOADED: Final = FaultKind("loaded", sentence("it carries so much more"), "kg", 0.0, 5.0, 0.5)
_SERVER: Final = (
    FaultKind("hung", sentence("it answers no call and publishes nothing, for 5 s if no time is given")),
    FaultKind(RESTARTED, sentence("it ends, and starts again as the same command")),
)
_NETWORK: Final = (
    FaultKind("late", sentence("each message arrives so much later"), "s", 0.0, 10.0, 0.2),
    FaultKind("lossy", sentence("so large a share of messages is lost"), "share", 0.0, 1.0, 0.2),
    FaultKind("deaf", sentence("what is sent to the robot does not arrive")),
    FaultKind("mute", sentence("what the robot sends does not arrive")),
)


_SIDES: Final = (("L", "R"), ("Left", "Right"), ("left", "right"), ("l_", "r_"))
"""How the names of parts on both sides begin."""


def kinds_of(body: Body, *, physics: bool) -> dict[str, tuple[FaultKind, ...]]:
    """Return how each part of a body can fail; without `physics` no force matters, on it or in it."""
    found: dict[str, tuple[FaultKind, ...]] = {}
    for part, kinds in _each(body, physics=physics):
        known = {kind.name for kind in found.get(part, ())}
        found[part] = (*found.get(part, ()), *(kind for kind in kinds if kind.name not in known))
    return found


def _each(body: Body, *, physics: bool) -> Iterator[tuple[str, tuple[FaultKind, ...]]]:
    joint_kinds = tuple(kind for kind in _JOINT if physics or kind.name != "weak")
    if (heat := body.motor_heat) is not None:
        usual = (heat.hot + heat.too_hot) / 2
        hot = FaultKind(
            "hot", sentence("its motor is so hot, and gives less torque"), "°C", 25.0, 150.0, usual
        )
        joint_kinds += (hot,)
    yield from ((joint.name, joint_kinds) for joint in body.joints if not joint.passive)
    yield from ((camera.name, _CAMERA) for camera in body.cameras)
    yield from ((name, _TOUCH) for name in body.touch_sensors)
    if body.inertial_unit is not None:
        yield INERTIAL, _INERTIAL
    if any(sole.pressure for sole in body.soles):
        yield FEET, _FEELS
    if body.sonar is not None:
        yield SONAR, _SONAR
    if body.battery is not None:
        yield BATTERY, (FaultKind("low", sentence("its charge is so low"), "share", 0.0, 1.0, 0.05),)
    if body.lights:
        yield LEDS, (FaultKind("dark", sentence("none of its lights shines")),)
    if body.voice:
        yield SPEECH, (FaultKind("silent", sentence("nobody hears what it says")),)
        yield SOUNDS, (FaultKind("silent", sentence("nobody hears its sounds")),)
    if physics:
        yield ROBOT, () if body.mounted else (_ROBOT,)
        yield from ((link.name, (_LOADED,)) for link in body.links)
    yield SERVER, _SERVER
    yield LINK, _NETWORK


def failures_of(
    kinds: Mapping[str, Sequence[FaultKind]], only: Collection[str] = (), *, both_sides: bool = False
) -> Iterator[str]:
    """Yield what a sweep lets fail, such as `Camera black`: of links the first, of two sides the left.

    `kinds` are those of `kinds_of`. `only` are the parts that are wanted, whatever their side.
    """
    loads = 0
    for part, each in kinds.items():
        if only and part not in only:
            continue
        if not only and not both_sides and left_of(part) in kinds:
            continue
        for kind in each:
            if kind.name == RESTARTED:  # its process is that of the trial
                continue
            loads += kind.name == "loaded"
            if kind.name != "loaded" or loads == 1 or only:
                yield f"{part} {kind.name}"


def left_of(part: str) -> str:
    """Return the name on the left of a part whose name begins as one on the right; else an empty text."""
    return next((left + part.removeprefix(right) for left, right in _SIDES if part.startswith(right)), "")


class Fault(NamedTuple):
    """A failure that was injected."""

    part: str
    kind: str
    amount: float
    """In the unit of its kind; 0 for one without."""
    begin: float
    """Robot time in s."""
    end: float = math.inf


Present = Mapping[tuple[str, str], Fault]
"""The failures of a moment, by part and kind: another object once they change."""
