"""The scene of a trial: the settings of its robot, made from the values of the plan's quantities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import msgspec

from codegen.messages import Message
from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.errors import RobotError

from ._errors import TrialsError
from ._plan import CARRIED, Plan
from ._quantities import Quantity, Value, Values, draw_all

if TYPE_CHECKING:
    from naoserver_sim.world import World
    from visualhfsm.simulation import Behavior

_SETTINGS: Final[Mapping[str, type]] = {"body": str, "posture": str, "world": str, "noise": bool}
_THINGS: Final = {
    "carried_balls": (CARRIED, ()),
    "balls": ("xy", ()),
    "boxes": ("xy", ("heading",)),
    "robots": ("xy", ("heading",)),
}
"""The axes of the things of a world, and what else they have."""
_FAKE: Final = frozenset({"body"})
"""Settings that the fake robot has, too."""


def check_scene(plan: Plan) -> None:
    """Raise TrialsError for a robot, a posture, a world or a switch that some trial may have and none can.

    The first trials may have others, and the series would end in its midst.
    """
    bodies = _choices(plan.scene.get("body", DEFAULT_BODY))
    for body in bodies:
        with TrialsError.in_place_of(RobotError, "body = {value!r}: {reason}", value=body):
            postures = find_body(body).postures
        for posture in _choices(plan.scene.get("posture")):
            if posture not in postures:
                raise TrialsError.because(
                    "posture = {value!r}: the body {body} has {postures}",
                    value=posture,
                    body=body,
                    postures=", ".join(postures),
                )
    drawn = {name: each for name, each in draw_all(plan.quantities, "").items() if name in plan.scene}
    for name, quantity in plan.scene.items():
        if isinstance(quantity, tuple) and any(isinstance(each, str | bool) for each in quantity):
            for each in dict.fromkeys(quantity):
                scene_of(plan, {**drawn, name: each}, Path(plan.document).parent)


def _choices(quantity: Quantity | None) -> list[str]:
    """Return the names among which a quantity is chosen, without those of files."""
    names = quantity if isinstance(quantity, tuple) else (quantity,)
    return [each for each in names if isinstance(each, str) and not each.endswith(".toml")]


def scene_of(plan: Plan, values: Values, folder: Path) -> Scene:
    """Return the scene of a trial with some values; a world that is a file stands in a folder.

    Raises TrialsError.
    """
    world = values.get("world")
    if isinstance(world, str) and world.endswith(".toml"):
        values = {**values, "world": str(folder / world)}
    return Scene(values, plan.robot)


class Scene:
    """The values of one trial, sorted by what they set. Raises TrialsError for a name that sets nothing."""

    def __init__(self, values: Values, robot: str) -> None:
        self._robot = robot
        self.settings: dict[str, Any] = {}
        """Settings for `simulate`."""
        self._places: dict[str, dict[str, float]] = {}
        for name, value in values.items():
            self._apply(name, value)
        if robot == "sim" and (self._places or "world" in self.settings):
            self.settings["world"] = self._world()

    def set_up(self, behavior: Behavior) -> None:
        """Place carried balls: the fake robot has no world, and in the simulation the seed scatters them."""
        if self._robot == "fake":
            for thing, place in self._places.items():
                behavior.robot.ball(thing).place(**place)
        elif self._places:
            for ball in self.settings["world"].carried_balls:
                if ball.name in self._places:
                    behavior.robot.ball(ball.name).place(*ball.start)

    def _apply(self, name: str, value: Value) -> None:
        thing, dot, coordinate = name.rpartition(".")
        if self._robot == "none":
            raise TrialsError.because(
                '{name}: these trials have no robot; write robot = "sim" or "fake"', name=name
            )
        if not dot:
            kind = _SETTINGS.get(name)
            if kind is None or (self._robot == "fake" and name not in _FAKE):
                known = ", ".join(each for each in _SETTINGS if self._robot == "sim" or each in _FAKE)
                raise TrialsError.because(
                    "{name}: there is no such quantity of a scene; there are {known}, and places",
                    name=name,
                    known=known,
                )
            if not isinstance(value, kind):
                wanted = Message("true or false") if kind is bool else Message("a text")
                raise TrialsError.because(
                    "{name} = {value!r}: write {wanted}", name=name, value=value, wanted=wanted
                )
            self.settings[name] = value
            return
        if isinstance(value, bool | str):
            raise TrialsError.because("{name} = {value!r}: write a number", name=name, value=value)
        if self._robot == "fake" and coordinate not in CARRIED:
            raise TrialsError.because(
                "{name}: the fake robot has balls with {carried}, and nothing else",
                name=name,
                carried=", ".join(CARRIED),
            )
        self._places.setdefault(thing, {})[coordinate] = float(value)

    def _world(self) -> World:
        from naoserver_sim.world import DEFAULT_WORLD, Light, load_world  # needs the package MuJoCo

        with TrialsError.in_place_of((RobotError, ValueError), "the scene is not possible: {reason}"):
            world = load_world(self.settings.get("world", DEFAULT_WORLD))
            for thing, place in self._places.items():
                if thing == "robot" and not world.robots:
                    world = _with(world, robot=_moved(thing, world.robot, place, "xy", ("heading",)))
                elif thing == "light":
                    light = world.light or Light()
                    world = _with(world, light=_moved(thing, light, place, (), ("brightness", "ambient")))
                else:
                    own = world.robots[0].name if thing == "robot" else thing
                    world = _with_thing(world, own, place)
            return world


def _with(world: World, **fields: object) -> World:
    return msgspec.structs.replace(world, **fields)


def _with_thing(world: World, name: str, place: Mapping[str, float]) -> World:
    """Return a world in which a ball or a box is elsewhere."""
    for kind, keys in _THINGS.items():
        things = list(getattr(world, kind))
        for index, thing in enumerate(things):
            if thing.name == name:
                things[index] = _moved(name, thing, place, *keys)
                return _with(world, **{kind: tuple(things)})
    robots = (robot.name for robot in world.robots)
    known = ", ".join(("robot", "light", *world.names, *robots))
    raise TrialsError.because(
        "{name}: there is no such thing in the world; there are {known}", name=name, known=known
    )


def _moved(
    name: str,
    thing: Any,  # noqa: ANN401 - a part of a world
    place: Mapping[str, float],
    axes: Sequence[str],
    others: Sequence[str],
) -> Any:  # noqa: ANN401
    """Return a part of a world elsewhere, by the axes of its position or of its start, and other fields."""
    fields: dict[str, Any] = {}
    where = "start" if axes == CARRIED else "position"
    for key, value in place.items():
        if key in axes:
            at = list(fields.get(where, getattr(thing, where)))
            at[axes.index(key)] = value
            fields[where] = tuple(at)
        elif key in others:
            fields[key] = value
        elif axes == CARRIED:
            raise TrialsError.because(
                "{ball}.{key}: it is carried, and has {carried}", ball=name, key=key, carried=", ".join(axes)
            )
        else:
            raise TrialsError.because(
                "{name}.{key}: there is {value}", name=name, key=key, value=", ".join((*axes, *others))
            )
    return msgspec.structs.replace(thing, **fields)
