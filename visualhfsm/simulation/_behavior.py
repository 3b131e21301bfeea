"""A behavior in virtual time: the component of a document, with a robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from codegen.hfsm.document import Document
from hfsm_runtime import Component
from hfsm_runtime.virtual.clock import TaskClock
from hfsm_runtime.virtual.errors import UnknownName, says_it_all
from hfsm_runtime.virtual.execution import Execution
from hfsm_runtime.virtual.network import VirtualNetwork
from hfsm_runtime.virtual.world import VirtualWorld
from zenoh_ice import Object

from ._loading import document_of, forget, load_component

if TYPE_CHECKING:
    from ._kinds import CameraKind, RobotKind
    from ._robot import RobotUnderTest

__tracebackhide__ = says_it_all


class Behavior(Execution):
    """An execution of a behavior, perhaps with a robot; `simulate` and the fixture `behavior` make it.

    `robot` is `fake`, without physics, `sim` for the simulation, or None; `camera` and `settings` are those
    of `RobotUnderTest`. It may also be a function that makes one, which moves by the same `clock`.
    `surroundings` have their own clock and servants, and end with it. With `stand_ins`, calls that nobody
    serves return blank values. `document` is the file of the document, if it is known. With `unload` the
    module of the component is forgotten at the end.
    """

    def __init__(
        self,
        component: Component,
        *,
        robot: RobotKind | Callable[[VirtualNetwork], RobotUnderTest] | None = None,
        clock: TaskClock | None = None,
        surroundings: VirtualWorld | None = None,
        parameters: Mapping[str, object] | None = None,
        stubs: Mapping[str, Object | Mapping[str, object]] | None = None,
        on_error: str | None = None,
        stand_ins: bool = False,
        camera: CameraKind = "auto",
        document: Path | None = None,
        unload: bool = False,
        **settings: Any,  # noqa: ANN401 - those of the robot
    ) -> None:
        self.document = document
        """The file of the document, if it is known."""
        self._unload = unload
        self._robot: RobotUnderTest | None = None
        world = surroundings or VirtualWorld(clock, stand_ins=stand_ins)
        if robot is not None:
            from ._robot import RobotUnderTest  # only behaviors with a robot need its libraries

            try:
                if callable(robot):
                    self._robot = robot(world.network)
                else:
                    self._robot = RobotUnderTest(robot, world.clock, world.network, camera=camera, **settings)
            except BaseException:
                world.close()
                raise
        super().__init__(component, world, parameters=parameters, stubs=stubs, on_error=on_error)

    @property
    def has_robot(self) -> bool:
        """Whether it has a robot."""
        return self._robot is not None

    @property
    def robot(self) -> RobotUnderTest:
        """The robot, to place balls, read joints, and get camera images; raises UnknownName without one."""
        if self._robot is None:
            raise UnknownName("this behavior has no robot: pass robot='fake' or robot='sim'")
        return self._robot

    def reload(self, document: str | Path) -> tuple[str, ...]:
        """Continue with another version of the document, as a running component does after a reload.

        A relative path starts at the folder of the present document. Returns what could not be kept. Raises
        DocumentInvalid without changing anything.
        """
        path = (self.document or Path()).parent / document
        former, loaded = type(self.component), load_component(path)
        try:
            not_kept = self.exchange(loaded())
        except BaseException:
            forget(loaded)
            raise
        if self._unload:
            forget(former)
        self._unload = True
        self.document = path
        self._journal.note(f"reloads {path.name}")
        return not_kept

    def close(self) -> None:
        """Stop the robot, and release everything."""
        try:
            if self._robot is not None:
                self._robot.close()
        finally:
            super().close()
            if self._unload and "component" in vars(self):
                forget(type(self.component))


def simulate(
    document: str | Path | type[Component],
    *,
    include: Sequence[Path] = (),
    content: Document | None = None,
    **options: Any,  # noqa: ANN401 - those of Behavior
) -> Behavior:
    """Return a behavior in virtual time, of a document or a component; close it, or use a `with` block.

    The document is compiled in memory; `content` is its parsed content if that has not been saved yet, and
    `include` are directories with packages of interfaces that are neither beside it nor in the project's
    folder `interfaces`. `robot` is `fake`, `sim` or None, and `settings` are the robot's, such as `seed`,
    `world` or `body`. `stubs` answer interfaces by hand, and with `stand_ins` all others answer with blank
    values. Raises DocumentInvalid, UnknownName, and what the component's code raises.
    """
    if isinstance(document, type):
        return Behavior(document(), document=document_of(document), **options)
    path = Path(document)
    component = load_component(path, include, content=content)
    try:
        return Behavior(component(), document=path, unload=True, **options)
    except BaseException:
        forget(component)
        raise
