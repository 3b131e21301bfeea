"""The texts of robots, which speak English, as templates: `naoserver` and `naoserver_sim` say them.

A refusal, an error or an event that one of them gives is translated for a page (`translation`). The first
template that fits a text counts.
"""

from __future__ import annotations

from typing import Final

from codegen.messages import Message, template

__all__ = ["SAID"]

STANCES: Final = (
    Message("standing"),
    Message("sitting"),
    Message("lying on its belly"),
    Message("lying on its back"),
    Message("lying on its left side"),
    Message("lying on its right side"),
)
"""The ways in which a robot rests: the values `stance` and `needed`."""

_REFUSED: Final = (
    Message("the client of this command is gone: its link to the robot broke"),
    template("the robot is unreachable: {reason}; wait until it is found again"),
    template("the robot is stopped: {reason}; reset the emergency stop first"),
    template("the robot is held by {holder}; wait until the lease is given back"),
    template(
        "commands of {clients} went on during the emergency stop, and are refused until they pause for "
        "{seconds} s; or let them go on: nao stop --reset --resume"
    ),
    Message("the robot was stopped"),
    template("the robot is held by {holder}; wait until it is given back"),
    Message("a lease is for a client that keeps a link: this call names none"),
    Message("the robot is not connected"),
    template("there is no link to the robot: {reason}"),
    Message("no servo answers"),
    template("no servo has answered for {seconds} s"),
    template("{joint} is not reached: {reason}; command other joints"),
    Message("the robot is not connected: it says nothing"),
    Message("the robot is not connected: it plays nothing"),
    Message("this loudspeaker plays tones, not samples"),
    Message("the robot would fall: its center of mass would leave its soles, or they the floor"),
    template("{joint} keeps the robot upright: use postures or motions, or make its legs limp"),
    template("{joint} is moved by the walk now: stop it first"),
    template("{joint} is moved by the way into a posture now: stop it first"),
    template("{joint} is moved by the motion {name} now: stop it first"),
    template("{joint} is moved by the posture {name} now: stop it first"),
    template("{joint} is moved by commands with gains now: stop it first"),
)
"""Why a robot refuses a command of a client."""

_VALUES: Final = (
    template("there is no joint {name}; there are {names}"),
    template("{joint} has no motor: it moves with what touches it"),
    template("there is no light {name}; there are {names}"),
    template("there is no sound {name}; there are {names}"),
    template("there is no motion {name}; there are {names}"),
    template("there is no posture {name}; there are {names}"),
    template("there is no camera {name}; there are {names}"),
    template("there is no camera {name}"),
    template("there is no object {name}; there are {names}"),
    template("there is no touch sensor {name}; there are {names}"),
    template("there is no part {name}; there are {names}"),
    template("there is no room: {name} is in the way"),
    template("{count} pushes are already active: wait until one ends"),
    template("{joint}: a target of {value} is not a finite number"),
    template("{joint}: a speed of {value} is not a finite number"),
    template("{joint}: a velocity of {value} is not a finite number"),
    template("{joint}: a stiffness of {value} is not a finite number"),
    template("{joint}: a speed of {value} is negative"),
    template("{joint}: a stiffness of {value} is not from 0 to 1"),
    template("{field} is {value}: it must be a finite number"),
    template("{field} is {value}: it must be above 0 and at most {upper}"),
    template("{field} is {value}: it must be from {lower} to {upper}"),
    template("{field} is {value}: the speed of a position is not negative"),
    template("seconds is {value}: a lease lasts more than 0 s and at most {upper} s"),
    template("holder must be a name of 1 to {count} printable characters"),
    Message("text is empty: there is nothing to say"),
    Message("text is empty: there is nothing to hear"),
    template("text has {count} characters: at most {most} are said at a time"),
    template("{count} texts are already waiting to be said"),
    template("samples have 2 bytes each, and at most {most} bytes wait"),
    template(
        "{camera} has no format {format}; it has {names}; JPEG needs Pillow where the server runs: pip "
        "install pillow"
    ),
    template("{camera} has no format {format}; it has {names}"),
    template("{camera} has no size {size}; it has {names}"),
    template("{camera} takes no images of {size}; it takes {names}"),
    template("{camera} gives no {value} images/s at {size}; it gives more than 0, up to {upper}"),
    template("{camera} is not on the robot, but beside it"),
    template("{camera}: no image of {size} within {seconds} s"),
    template("{camera} returned no image"),
)
"""Which values of a command a robot does not take."""

_UNABLE: Final = (
    template("the robot cannot walk: {reason}"),
    template("the robot cannot drive: {reason}"),
    Message("it does not get on: a wall, an edge, a slope or a push holds it back"),
    Message("it lies, or it falls; make it stand up first"),
    Message("it does not stand on its feet"),
    template("its legs are limp; make them stiff, {value} at least"),
    Message("it has toppled over; put it on its wheels first"),
    template("its wheels are limp; make them stiff, {value} at least"),
    Message("the robot cannot turn, so it cannot go to a place"),
    Message("the robot cannot drive forwards, so it cannot go to a place"),
    Message("the robot is mounted where it is"),
    Message("the robot has wheels: it cannot drive sideways"),
    Message("the walk was stopped"),
    template("another command of the walk ended it, of {clients}"),
    Message("it fell, its motors became limp, or it was moved"),
    Message("the robot was moved"),
    Message("the robot was lost"),
    Message("it has fallen"),
    template("it refused to walk: {reason}"),
    Message("NAOqi stopped it, and does not say why"),
    template("it did not get there within {seconds} s"),
    Message("the robot has fallen"),
    Message("the robot has fallen: make it stand up first"),
    Message("the robot has fallen, and has no inertial unit that measures how it lies"),
    template("{joint} has gone limp"),
    template("{joint} shares its motor with another joint: command that one"),
    template("{joint} follows another client's commands: stop it first"),
    template("{joint} keeps the robot upright: command also {others}, or none"),
    template("{joint} could hit what {other} moves: command also {other}"),
    template("{joint} is limp: make the legs stiff, and let the robot stand, first"),
    template("{joint} is at {degrees} degrees: let it cool below {upper}"),
    template("it is still {stance} after {count} motions"),
    template("it is {stance}, and no motions lead from there to {posture}"),
    template("{name} begins {needed}, in {posture}, but the robot is {stance} now"),
    template("{name} cannot look anywhere: it has no neck, or no camera"),
    template("the physics stopped: {reason}"),
)
"""Why a robot cannot do what it is commanded, or does not end it."""

_LIMITED: Final = (
    template("shares its motor with {joint}, whose {value} it takes"),
    template("speed {value} is too fast, limited to {upper}"),
    template("speed {value} leaves {joint} no time to make way, limited to {upper}"),
    template("{kind} velocity {value} is too high, limited to {upper}"),
    template(
        "{kind} velocity {value} is of no use: the robot cannot go forwards or backwards, limited to {upper}"
    ),
    template("{kind} velocity {value} is of no use: the robot cannot go sideways, limited to {upper}"),
    template("{kind} velocity {value} is of no use: the robot cannot turn, limited to {upper}"),
    template("{value} is out of range, limited to {upper}"),
    template("{value} would hit at this {joint}, limited to {upper}"),
    template("kept at {value}, clear of what {joint} brings near"),
    template("stopped at its limit {value}"),
)
"""Why a robot obeys a command within limits."""

_EVENTS: Final = (
    Message("refused a command: its client is gone"),
    template("refused a command: the robot is unreachable: {reason}"),
    template("refused a command: the robot is stopped: {reason}"),
    template("refused a command: the robot is held by {holder}"),
    template(
        "refused a command: commands of {clients} went on during the emergency stop, and are refused until "
        "they pause for {seconds} s"
    ),
    template("does not follow: {value} {unit} behind for {seconds} s"),
    template("does not follow: {value} {unit} behind for {seconds} s, at its limit {upper}"),
    template("follows again: {value} {unit} behind"),
    Message("is no longer stiff"),
    Message("found again"),
    Message("its motor reports no fault any more"),
    Message("emergency stop"),
    template("emergency stop: {reason}"),
    Message("the emergency stop was reset"),
    template("still stopped: {reason}; reset the emergency stop before the robot may move"),
    template(
        "the emergency stop cannot be kept in {path}: {reason}; after a restart the robot is stopped in "
        "any case"
    ),
    Message("STOP was pressed in the editor"),
    template("{holder} holds the robot"),
    template("{holder} no longer holds the robot"),
    template("fallen: the torso tilts by {degrees} deg"),
    template("upright again: the torso tilts by {degrees} deg"),
    Message("limp: no motor holds until it is made stiff again"),
    Message("no longer limp: motors hold again"),
    template("under the floor: its root is at {value} m, since no shape of a link holds it"),
    Message("above the floor again"),
    template("flung away: its root is at {value} m, at {upper} m/s, as if its shapes burst apart"),
    Message("no longer flung away"),
    template("hot: its motor has {degrees} degrees Celsius and gives less torque"),
    template("cool again: its motor has {degrees} degrees Celsius"),
    Message("unknown: the robot does not report its charge"),
    Message("known: its charge is reported again"),
    template("low: {share} of its charge are left"),
    template("stopped: its velocity was not renewed within {seconds} s"),
    template("stopped ({what}): its velocity was not renewed in time"),
    template("stopped ({what}): the client that drove it is gone"),
    template("stopped {what}: the client that commanded it is gone"),
    template("the motion {name} stopped: the client that commanded it is gone"),
    template("the posture {name} stopped: the client that commanded it is gone"),
    template(
        "the motion {name} will end in the safest posture that it reaches: the client that commanded it "
        "is gone"
    ),
    template(
        "the posture {name} will end in the safest posture that it reaches: the client that commanded it "
        "is gone"
    ),
    template("the motion {name} ended: {reason}"),
    template("the posture {name} ended: {reason}"),
    template("the way of {effector} ended: {reason}"),
    template("answered a program with error {code}: {reason}"),
    template("ignored a low command: {reason}"),
    template("ignored a program's command of joints: {reason}"),
    template("limited a low command to {joints}"),
    template("limited to 0 until it is stopped: {reason}"),
    template("the robot ended the walk: {reason}"),
    template("lost the robot: {reason}; trying to find it again"),
    template("the robot is still lost: {reason}"),
    Message("the connection broke"),
    template("checking it failed: {reason}"),
    template("{call}: no answer within {seconds} s"),
    template("{call}: the connection is closed"),
    template(
        "cannot connect to {address}: no answer within {seconds} s; is the robot on, and the address right?"
    ),
    template("cannot connect to {address}: {reason}; is the robot on, and the address right?"),
    Message("found the robot again"),
    Message("the robot is still stopped: it stays as it is"),
    Message("the robot is lost: it stays as it is"),
    Message("the robot is stopped: it stays as it is"),
)
"""The events of a robot."""

OF_ROBOTS: Final = tuple(
    sorted(
        (*_REFUSED, *_VALUES, *_UNABLE, *_LIMITED, *_EVENTS),
        key=lambda each: each.startswith("\N{HORIZONTAL ELLIPSIS}"),
    )
)
"""All of them; those that begin with a value are last, as they might take the beginning of others for it."""

SAID: Final = (*OF_ROBOTS, *STANCES)
