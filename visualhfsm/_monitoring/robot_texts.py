"""The texts of robots, which speak English, as templates: `naoserver` and `naoserver_sim` say them.

A refusal, an error or an event that one of them gives is said in the language of a page (`heard`). The first
template that fits a text counts.
"""

from __future__ import annotations

from typing import Final

from codegen.messages import Message

__all__ = ["OF_ROBOTS", "STANCES"]

_A: Final = "\N{HORIZONTAL ELLIPSIS}"
"""A value of a template that stands for any text."""

STANCES: Final = (
    Message("standing"),
    Message("sitting"),
    Message("lying on its belly"),
    Message("lying on its back"),
    Message("lying on its left side"),
    Message("lying on its right side"),
)
"""How a robot rests: the values `stance` and `needed`."""

_REFUSED: Final = (
    Message("the client of this command is gone: its link to the robot broke"),
    Message("the robot is unreachable: {reason}; wait until it is found again", reason=_A),
    Message("the robot is stopped: {reason}; reset the emergency stop first", reason=_A),
    Message("the robot is held by {holder}; wait until the lease is given back", holder=_A),
    Message("the robot is held by {holder}; wait until it is given back", holder=_A),
    Message("a lease is for a client that keeps a link: this call names none"),
    Message("the robot is not connected"),
    Message("there is no link to the robot: {reason}", reason=_A),
    Message("no servo answers"),
    Message("no servo has answered for {seconds} s", seconds=_A),
    Message("{joint} is not reached: {reason}; command other joints", joint=_A, reason=_A),
    Message("the robot is not connected: it says nothing"),
    Message("the robot is not connected: it plays nothing"),
    Message("{joint} keeps the robot upright: use postures or motions, or make its legs limp", joint=_A),
    Message("{joint} is moved by the walk now: stop it first", joint=_A),
    Message("{joint} is moved by the way into a posture now: stop it first", joint=_A),
    Message("{joint} is moved by the motion {name} now: stop it first", joint=_A, name=_A),
    Message("{joint} is moved by the posture {name} now: stop it first", joint=_A, name=_A),
)
"""Why a robot refuses a command of a client."""

_VALUES: Final = (
    Message("there is no joint {name}; there are {names}", name=_A, names=_A),
    Message("{joint} has no motor: it moves with what touches it", joint=_A),
    Message("there is no light {name}; there are {names}", name=_A, names=_A),
    Message("there is no sound {name}; there are {names}", name=_A, names=_A),
    Message("there is no motion {name}; there are {names}", name=_A, names=_A),
    Message("there is no posture {name}; there are {names}", name=_A, names=_A),
    Message("there is no camera {name}; there are {names}", name=_A, names=_A),
    Message("there is no camera {name}", name=_A),
    Message("there is no object {name}; there are {names}", name=_A, names=_A),
    Message("there is no touch sensor {name}; there are {names}", name=_A, names=_A),
    Message("there is no part {name}; there are {names}", name=_A, names=_A),
    Message("there is no room: {name} is in the way", name=_A),
    Message("{count} pushes are already active: wait until one ends", count=_A),
    Message("{joint}: a target of {value} is not a finite number", joint=_A, value=_A),
    Message("{joint}: a speed of {value} is not a finite number", joint=_A, value=_A),
    Message("{joint}: a velocity of {value} is not a finite number", joint=_A, value=_A),
    Message("{joint}: a stiffness of {value} is not a finite number", joint=_A, value=_A),
    Message("{joint}: a speed of {value} is negative", joint=_A, value=_A),
    Message("{joint}: a stiffness of {value} is not from 0 to 1", joint=_A, value=_A),
    Message("{field} is {value}: it must be a finite number", field=_A, value=_A),
    Message("{field} is {value}: it must be above 0 and at most {upper}", field=_A, value=_A, upper=_A),
    Message("{field} is {value}: it must be from {lower} to {upper}", field=_A, value=_A, lower=_A, upper=_A),
    Message("{field} is {value}: the speed of a position is not negative", field=_A, value=_A),
    Message("seconds is {value}: a lease lasts more than 0 s and at most {upper} s", value=_A, upper=_A),
    Message("holder must be a name of 1 to {count} printable characters", count=_A),
    Message("text is empty: there is nothing to say"),
    Message("text is empty: there is nothing to hear"),
    Message("text has {count} characters: at most {most} are said at a time", count=_A, most=_A),
    Message("{count} texts are already waiting to be said", count=_A),
    Message(
        "{camera} has no format {format}; it has {names}; JPEG needs Pillow where the server runs: "
        "pip install pillow",
        camera=_A,
        format=_A,
        names=_A,
    ),
    Message("{camera} has no format {format}; it has {names}", camera=_A, format=_A, names=_A),
    Message("{camera} has no size {size}; it has {names}", camera=_A, size=_A, names=_A),
    Message("{camera} takes no images of {size}; it takes {names}", camera=_A, size=_A, names=_A),
    Message(
        "{camera} gives no {value} images/s at {size}; it gives more than 0, up to {upper}",
        camera=_A,
        value=_A,
        size=_A,
        upper=_A,
    ),
    Message("{camera} is not on the robot, but beside it", camera=_A),
    Message("{camera}: no image of {size} within {seconds} s", camera=_A, size=_A, seconds=_A),
    Message("{camera} returned no image", camera=_A),
)
"""Which values of a command a robot does not take."""

_UNABLE: Final = (
    Message("the robot cannot walk: {reason}", reason=_A),
    Message("the robot cannot drive: {reason}", reason=_A),
    Message("it does not get on: a wall, an edge, a slope or a push holds it back"),
    Message("it lies, or it falls; make it stand up first"),
    Message("it does not stand on its feet"),
    Message("its legs are limp; make them stiff, {value} at least", value=_A),
    Message("it has toppled over; put it on its wheels first"),
    Message("its wheels are limp; make them stiff, {value} at least", value=_A),
    Message("the robot cannot turn, so it cannot go to a place"),
    Message("the robot cannot drive forwards, so it cannot go to a place"),
    Message("the robot is mounted where it is"),
    Message("the robot has wheels: it cannot drive sideways"),
    Message("the walk was stopped, or walks by another command now"),
    Message("it fell, its motors became limp, or it was moved"),
    Message("the robot was moved"),
    Message("the robot was lost"),
    Message("it has fallen"),
    Message("it refused to walk: {reason}", reason=_A),
    Message("NAOqi stopped it, and does not say why"),
    Message("it did not get there within {seconds} s", seconds=_A),
    Message("the robot has fallen"),
    Message("the robot has fallen: make it stand up first"),
    Message("the robot has fallen, and has no inertial unit that measures how it lies"),
    Message("{joint} has gone limp", joint=_A),
    Message("{joint} is limp: make the legs stiff, and let the robot stand, first", joint=_A),
    Message("{joint} is at {degrees} degrees: let it cool below {upper}", joint=_A, degrees=_A, upper=_A),
    Message("it is still {stance} after {count} motions", stance=_A, count=_A),
    Message("it is {stance}, and no motions lead from there to {posture}", stance=_A, posture=_A),
    Message(
        "{name} begins {needed}, in {posture}, but the robot is {stance} now",
        name=_A,
        needed=_A,
        posture=_A,
        stance=_A,
    ),
    Message("{name} cannot look anywhere: it has no neck, or no camera", name=_A),
    Message("the physics stopped: {reason}", reason=_A),
)
"""Why a robot cannot do what it is commanded, or does not end it."""

_LIMITED: Final = (
    Message("shares its motor with {joint}, whose {value} it takes", joint=_A, value=_A),
    Message("speed {value} is too fast, limited to {upper}", value=_A, upper=_A),
    Message(
        "speed {value} leaves {joint} no time to make way, limited to {upper}", value=_A, joint=_A, upper=_A
    ),
    Message("{kind} velocity {value} is too high, limited to {upper}", kind=_A, value=_A, upper=_A),
    Message(
        "{kind} velocity {value} is of no use: the robot cannot go forwards or backwards, limited to {upper}",
        kind=_A,
        value=_A,
        upper=_A,
    ),
    Message(
        "{kind} velocity {value} is of no use: the robot cannot go sideways, limited to {upper}",
        kind=_A,
        value=_A,
        upper=_A,
    ),
    Message(
        "{kind} velocity {value} is of no use: the robot cannot turn, limited to {upper}",
        kind=_A,
        value=_A,
        upper=_A,
    ),
    Message("{value} is out of range, limited to {upper}", value=_A, upper=_A),
    Message("{value} would hit at this {joint}, limited to {upper}", value=_A, joint=_A, upper=_A),
    Message("kept at {value}, clear of what {joint} brings near", value=_A, joint=_A),
    Message("stopped at its limit {value}", value=_A),
)
"""Why a robot obeys a command within limits."""

_EVENTS: Final = (
    Message("refused a command: its client is gone"),
    Message("refused a command: the robot is unreachable: {reason}", reason=_A),
    Message("refused a command: the robot is stopped: {reason}", reason=_A),
    Message("refused a command: the robot is held by {holder}", holder=_A),
    Message("does not follow: {value} {unit} behind for {seconds} s", value=_A, unit=_A, seconds=_A),
    Message(
        "does not follow: {value} {unit} behind for {seconds} s, at its limit {upper}",
        value=_A,
        unit=_A,
        seconds=_A,
        upper=_A,
    ),
    Message("follows again: {value} {unit} behind", value=_A, unit=_A),
    Message("is no longer stiff"),
    Message("found again"),
    Message("its motor reports no fault any more"),
    Message("emergency stop"),
    Message("emergency stop: {reason}", reason=_A),
    Message("the emergency stop was reset"),
    Message(
        "still stopped: {reason}; reset the emergency stop before the robot may move",
        reason=_A,
    ),
    Message(
        "the emergency stop cannot be kept in {path}: {reason}; after a restart the robot is stopped in any "
        "case",
        path=_A,
        reason=_A,
    ),
    Message("STOP was pressed in the editor"),
    Message("{holder} holds the robot", holder=_A),
    Message("{holder} no longer holds the robot", holder=_A),
    Message("fallen: the torso tilts by {degrees} deg", degrees=_A),
    Message("upright again: the torso tilts by {degrees} deg", degrees=_A),
    Message("limp: no motor holds until it is made stiff again"),
    Message("no longer limp: motors hold again"),
    Message(
        "under the floor: its root is at {value} m, since no shape of a link holds it",
        value=_A,
    ),
    Message("above the floor again"),
    Message(
        "flung away: its root is at {value} m, at {upper} m/s, as if its shapes burst apart",
        value=_A,
        upper=_A,
    ),
    Message("no longer flung away"),
    Message("hot: its motor has {degrees} degrees Celsius and gives less torque", degrees=_A),
    Message("cool again: its motor has {degrees} degrees Celsius", degrees=_A),
    Message("unknown: the robot does not report its charge"),
    Message("known: its charge is reported again"),
    Message("low: {share} of its charge are left", share=_A),
    Message("stopped: its velocity was not renewed within {seconds} s", seconds=_A),
    Message("stopped ({what}): its velocity was not renewed in time", what=_A),
    Message("stopped ({what}): the client that drove it is gone", what=_A),
    Message("stopped {what}: the client that commanded it is gone", what=_A),
    Message("the motion {name} stopped: the client that commanded it is gone", name=_A),
    Message("the posture {name} stopped: the client that commanded it is gone", name=_A),
    Message(
        "the motion {name} will end in the safest posture that it reaches: the client that commanded it is "
        "gone",
        name=_A,
    ),
    Message(
        "the posture {name} will end in the safest posture that it reaches: the client that commanded it is "
        "gone",
        name=_A,
    ),
    Message("the motion {name} ended: {reason}", name=_A, reason=_A),
    Message("the posture {name} ended: {reason}", name=_A, reason=_A),
    Message("limited to 0 until it is stopped: {reason}", reason=_A),
    Message("the robot ended the walk: {reason}", reason=_A),
    Message("lost the robot: {reason}; trying to find it again", reason=_A),
    Message("the robot is still lost: {reason}", reason=_A),
    Message("the connection broke"),
    Message("checking it failed: {reason}", reason=_A),
    Message("{call}: no answer within {seconds} s", call=_A, seconds=_A),
    Message("{call}: the connection is closed", call=_A),
    Message(
        "cannot connect to {address}: no answer within {seconds} s; is the robot on, and the address right?",
        address=_A,
        seconds=_A,
    ),
    Message(
        "cannot connect to {address}: {reason}; is the robot on, and the address right?",
        address=_A,
        reason=_A,
    ),
    Message("found the robot again"),
    Message("the robot is still stopped: it stays as it is"),
    Message("the robot is lost: it stays as it is"),
    Message("the robot is stopped: it stays as it is"),
)
"""What a robot has met with."""

OF_ROBOTS: Final = tuple(
    sorted((*_REFUSED, *_VALUES, *_UNABLE, *_LIMITED, *_EVENTS), key=lambda each: each.startswith(_A))
)
"""All of them; those that begin with a value are last, as they might take the beginning of others for it."""
