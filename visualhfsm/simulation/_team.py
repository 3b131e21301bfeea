"""Several behaviors in virtual time, each with a robot in one world."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Self

from hfsm_runtime import Component
from hfsm_runtime.virtual.errors import BehaviorFailed, UnknownName, says_it_all
from naoserver.bodies import DEFAULT_BODY
from naoserver.body import Body
from naoserver.serving.medium import Membership
from naoserver_sim.named_body import named_body
from zenoh_ice.data.text import sentence

from ._behavior import Behavior, simulate
from ._kinds import CameraKind
from ._medium import VirtualMedium
from ._robot import RobotUnderTest, as_camera
from ._turns import TICK, Turns, catch_up

if TYPE_CHECKING:
    from naoserver_sim.arena import Arena
    from naoserver_sim.world import World

__tracebackhide__ = says_it_all


class Team:
    """Behaviors that run together, each with a robot of one world, and by its own clock: see `Turns`.

    The same documents with the same seed do the same every time. A behavior reaches only its own robot; a
    robot beyond the documents stands where it is. `close`, or the end of a `with` block, ends all.
    """

    def __init__(
        self,
        arena: Arena,
        turns: Turns,
        medium: VirtualMedium,
        simulate: Callable[..., Behavior] = simulate,
    ) -> None:
        self.arena: Final = arena
        """The world, with its `robots`, to look at and to place them."""
        self._turns: Final = turns
        self._medium: Final = medium
        self._simulate: Final = simulate
        self._closing: Final = ExitStack()
        self._closing.callback(arena.close)
        self.behaviors: list[Behavior] = []
        """In the order of the documents, and of the robots."""

    def add(self, document: str | Path | type[Component], camera: CameraKind, **options: Any) -> None:  # noqa: ANN401 - those of Behavior
        """Let another behavior drive the next robot."""
        device = self.arena.robots[len(self.behaviors)]
        clock = self._turns.make_clock()
        member = Membership(device.name)
        if device.team:
            medium = self._medium.at(clock)
            member = Membership(device.name, device.team, medium, session=len(self.behaviors))
        made = partial(RobotUnderTest, as_camera(device, camera), clock, member=member)
        behavior = self._simulate(document, robot=made, clock=clock, **options)
        self._closing.callback(behavior.close)
        self.behaviors.append(behavior)

    def __getitem__(self, robot: str) -> Behavior:
        """Return the behavior of a robot. Raises UnknownName."""
        names = [each.name for each in self.arena.robots][: len(self.behaviors)]
        if robot not in names:
            raise UnknownName(f"no behavior drives a robot {robot!r}; there are {', '.join(names)}")
        return self.behaviors[names.index(robot)]

    @property
    def time(self) -> float:
        """The time of the world in s."""
        return self._turns.clock.now()

    def advance(self, seconds: float) -> None:
        """Let time pass, control tick by control tick. Raises what `Behavior.advance` does."""
        for moment in self._turns.pass_time(seconds):
            for behavior in self.behaviors:
                catch_up(behavior, moment)

    def run_until(self, condition: Callable[[], object], limit: float = 60.0) -> float:
        """Run until a condition holds, and return when. Raises BehaviorFailed after `limit` s."""
        end = self.time + limit
        while not condition():
            if self.time >= end:
                where = "; ".join(behavior.active for behavior in self.behaviors)
                raise BehaviorFailed(sentence(f"it did not happen within {limit:g} s: they are in {where}"))
            self.advance(TICK / 1e9)
        return self.time

    def close(self) -> None:
        """Stop the robots, and release everything."""
        self._closing.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def simulate_team(
    documents: Sequence[str | Path | type[Component]],
    *,
    world: str | World | None = None,
    body: str | Path | Body = DEFAULT_BODY,
    camera: CameraKind = "auto",
    seed: int | None = None,
    noise: bool = False,
    posture: str | None = None,
    parameters: Mapping[str, object] | Sequence[Mapping[str, object]] = MappingProxyType({}),
    simulate: Callable[..., Behavior] = simulate,
    **options: Any,  # noqa: ANN401 - those of Behavior
) -> Team:
    """Return behaviors in virtual time with a robot each in one world; close it, or use a `with` block.

    Without a list of robots in the `world` they stand side by side; `body` is what those are whose place
    names none. `parameters` are those of all behaviors, or a list with those of each. `simulate` makes a
    behavior, with `options` such as `on_error`. Raises ValueError for more documents than robots, and what
    `simulate` and `Arena` raise.
    """
    from naoserver_sim.arena import Arena  # load MuJoCo only when it is used
    from naoserver_sim.world import DEFAULT_WORLD, load_world, side_by_side

    if world is None or isinstance(world, str):
        world = load_world(world or DEFAULT_WORLD)
    if not world.robots:
        world = side_by_side(world, len(documents))
    if len(documents) > len(world.robots):
        raise ValueError(f"there are {len(documents)} documents for {len(world.robots)} robots in the world")
    turns = Turns()
    arena = Arena(
        world,
        body=body if isinstance(body, Body) else named_body(body),
        clock=turns.clock,
        skin=camera != "drawn",
        seed=seed,
        noise=noise,
        posture=posture,
    )
    medium = VirtualMedium.noisy(seed or 0) if noise else VirtualMedium()
    team = Team(arena, turns, medium, simulate)
    each = [parameters] * len(documents) if isinstance(parameters, Mapping) else parameters
    try:
        for document, values in zip(documents, each, strict=True):
            team.add(document, camera, parameters=values, **options)
    except BaseException:
        team.close()
        raise
    return team
