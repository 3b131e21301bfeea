"""Listen to a component and its robot, and keep the data of the lines and the report."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Self

from codegen.hfsm.document import Document
from interfaces.hfsm import ComponentSnapshot, Mark
from interfaces.jderobot import CameraPrx
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.automata import Automata
from visualhfsm._monitor.realm.body import STALE
from visualhfsm._monitor.realm.follower import Follower
from visualhfsm._monitor.realm.pictures import Pictures, encode_jpeg
from visualhfsm._monitor.realm.realm import Newest, PolledValue, has_interface
from visualhfsm._monitor.realm.robot import RobotMonitor, RobotState
from visualhfsm._monitor.realm.run_log import RunLog
from visualhfsm._monitor.run_page import MOST_PICTURES, Figure, Run
from zenoh_ice import Communicator

CAMERA: Final = "Camera"
"""The camera that is shown as long as no mark is on another one."""
IMAGE_SIZE: Final = (320, 240)


@dataclass(frozen=True, slots=True)
class WatchState:
    """A component and its robot at one moment; what has not arrived yet is None or empty.

    Ages are wall seconds since the last sample; `image_size` is that of `camera` in pixels.
    """

    component: str
    endpoint: str
    automata: Automata | None = None
    snapshot: ComponentSnapshot | None = None
    snapshot_age: float = math.inf
    robot: RobotState = field(default_factory=RobotState)
    robot_age: float = math.inf
    robot_lost: bool = False
    """True while the robot's server does not reach it: only a real one can be lost."""
    camera: str = CAMERA
    image_size: tuple[int, int] = IMAGE_SIZE

    @property
    def marks(self) -> Sequence[Mark]:
        """The marks of the component on the picture of the camera; none once it is lost."""
        if self.snapshot is None or self.snapshot_age > STALE:
            return ()
        return [mark for mark in self.snapshot.marks if mark.camera == self.camera]

    @property
    def trouble(self) -> str:
        """Who does not answer, and what to do about it; empty when all is well."""
        if self.robot_age == math.inf:
            return f"Waiting for a robot server at {self.endpoint}; naoserver-sim starts one"
        if self.robot_age > STALE:
            return (
                f"Robot server lost {self.robot_age:.0f} s ago; going on when it is back at {self.endpoint}"
            )
        if self.automata is None or self.snapshot is None:
            return f"Waiting for {self.component}; start it, such as by python {self.component}.py"
        if self.snapshot_age > STALE:
            return f"{self.component} lost {self.snapshot_age:.0f} s ago; going on when it is back"
        return ""


class Telemetry:
    """The data of a component and its robot; `update` them about ten times a second.

    Both may be missing at the start, and are found again after they were lost. A component that is restarted
    begins a new log; one that is reloaded continues the same log.
    """

    def __init__(self, communicator: Communicator, component: str, *, pictures: bool) -> None:
        self._communicator = communicator
        self._endpoint = ", ".join(communicator.settings.connect)
        self._robot = RobotMonitor(communicator)
        self._follower = Follower(communicator, component, self._robot)
        self._log = self._follower.log
        self.automata: Automata | None = None
        """The automata, None before the component has sent its structure."""
        self._takes_pictures = pictures
        self._pictures = Pictures()
        self._look_through(CAMERA)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._follower.close()

    @property
    def log(self) -> RunLog:
        """The log of the component's run."""
        return self._follower.log

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height in pixels of the camera's image; those of a Nao until the robot has sent them."""
        image = self._image_description.value
        return (image.width, image.height) if image and image.width > 0 < image.height else IMAGE_SIZE

    def exported(self, document: Document | None, figures: Sequence[Figure]) -> Run:
        """Return the run with its pictures; its structure must be known."""
        live = self._follower.structure
        if live is None:
            raise VisualHfsmError.because(
                "the automata of {component} are not known yet", component=self._follower.component
            )
        return Run(
            name=self._follower.component,
            structure=live.structure,
            log=self.log,
            document=document,
            world=self._robot.world.shapes,
            pictures=self._pictures.spread(MOST_PICTURES, *self.log.wall_times()),
            figures=figures,
        )

    def update(self) -> WatchState:
        """Request missing data and return the present state."""
        self._robot.update()
        self._follower.update()
        self._image_description.poll()
        self._update_run()
        snapshot = self._snapshot()
        if snapshot is not None:
            self._choose_camera(snapshot)
        if self._takes_pictures and snapshot is not None:
            self._take_picture()
        return WatchState(
            component=self._follower.component,
            endpoint=self._endpoint,
            automata=self.automata,
            snapshot=snapshot,
            snapshot_age=self._follower.age,
            robot=self._robot.read(stale=self._robot.age() > STALE),
            robot_age=self._robot.age(),
            robot_lost=not self._robot.presence().present,
            camera=self.camera,
            image_size=self.image_size,
        )

    def _update_run(self) -> None:
        live = self._follower.structure
        if live is not None and (self.automata is None or self.automata.structure is not live.structure):
            self.automata = Automata(live.structure)
        if self.log is not self._log:
            self._log = self.log
            self._pictures = Pictures()

    def _snapshot(self) -> ComponentSnapshot | None:
        """Return the newest snapshot, unless its automata are not known yet, as after a reload."""
        newest = self.log.newest
        known = newest is not None and self.automata is not None and self.automata.fit(newest.component)
        return newest.component if newest is not None and known else None

    def _choose_camera(self, snapshot: ComponentSnapshot) -> None:
        """Show a camera on which the component marks something."""
        marked = [mark.camera for mark in snapshot.marks]
        type_id = CameraPrx.ice_interface.type_id
        if marked and self.camera not in marked and has_interface(self._communicator, marked[-1], type_id):
            self._look_through(marked[-1])

    def _look_through(self, camera: str) -> None:
        self.camera = camera
        proxy = CameraPrx.uncheckedCast(self._communicator.stringToProxy(camera))
        self._image = Newest(proxy.getImageData.latest, STALE)
        self._image_description = PolledValue(proxy.getImageDescription.begin)

    def _take_picture(self) -> None:
        """Keep the present image of the camera, if one is due."""
        now = time.time()
        image = self._image() if self._pictures.due(self.camera, now) else None
        if image is None:
            return
        shape = image.value.description
        with contextlib.suppress(VisualHfsmError):  # the image's size does not fit its data
            self._pictures.add(
                self.camera, now, encode_jpeg(shape.width, shape.height, image.value.pixelData)
            )
