"""The servants of a robot, the safety layer below them and their periodic jobs: no threads, no network."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Final

from naoserver.body import H25
from naoserver.capabilities import Lights, Senses, Stage, Voice, Walker
from naoserver.errors import RobotError
from naoserver.event_log import EventLog
from naoserver.gate import Gate
from naoserver.guarded_device import GuardedDevice
from naoserver.hinges import HINGES, Hinge, ball_hinge
from naoserver.jobs import Job, Periodic
from naoserver.motions.library import load_motions
from naoserver.motions.player import PERIOD, MotionPlayer
from naoserver.motions.postures import situation_of
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.robot import JointDevice, Robot
from naoserver.safety import Safety
from naoserver.servants.battery import BatteryI
from naoserver.servants.body import JointsI
from naoserver.servants.camera import CameraI
from naoserver.servants.clock import ClockI
from naoserver.servants.encoders import EncodersI
from naoserver.servants.feet import FootPressureI
from naoserver.servants.ground_truth import GroundTruthI
from naoserver.servants.head import PoseHeadI
from naoserver.servants.health import HealthI
from naoserver.servants.hinge import Pose3DEncodersI, Pose3DMotorsI
from naoserver.servants.inertial import InertialUnitI
from naoserver.servants.leds import LedsI
from naoserver.servants.motions import MotionsI
from naoserver.servants.motors import MotorsI
from naoserver.servants.neck_speed import NeckSpeedI
from naoserver.servants.postures import KeyFramePosturesI, OwnPosturesI, PosturesI
from naoserver.servants.safety import SafetyI
from naoserver.servants.scene import SceneI
from naoserver.servants.sonar import SonarI
from naoserver.servants.speech import SpeechI
from naoserver.servants.streaming import StateSource, StreamsState
from naoserver.servants.touch import TouchI
from naoserver.walk_guard import WalkGuard
from naoserver.watchdog import Watchdog, Watched
from zenoh_ice import Clock, Object


class Assembly:
    """What stands between a robot and its clients: the servants of what the robot has.

    `wall` is the steady clock of the safety deadlines and the reports. Raises RobotError when the options ask
    for what the robot cannot do.
    """

    def __init__(self, robot: Robot, options: ServerOptions, wall: Clock) -> None:
        self._robot = robot
        self._options = options
        self._wall = wall
        wall_time = wall.now
        self.on_wake: Callable[[], None] = _nothing
        """Called when a job may be due earlier than it was; the driver of the jobs sets it."""
        self._watchdog = Watchdog(wall, self._wake)
        self.servants: Final[dict[str, Object]] = {}
        """Every servant by its identity."""
        self._streams: list[StreamsState] = []
        self.watched: Final[list[Watched]] = self._watchdog.watched
        """What moves and is checked by the watchdog."""
        self.events: Final = EventLog(robot.clock.now, wall_time)
        """What an operator should know, as the health report tells it."""
        self.gate: Final = Gate(self.events, wall_time)
        """Emergency stop and lease in front of every command of the robot."""

        self._clock = ClockI(robot.clock)
        self.servants["Clock"] = self._clock
        self._safety = self._add_safety()
        self.body: Final = self._add_body()
        """The robot's joints behind the safety layer."""
        if robot.walker is not None:
            self._add_walk(robot.walker)
        if robot.senses is not None:
            self._add_senses(robot.senses)
        if robot.stage is not None:
            self._add_stage(robot.stage)
        for mechanism in robot.mechanisms:
            self._add_mechanism(mechanism)
        self._cameras = self._add_cameras()
        if robot.lights is not None:
            self._add_lights(robot.lights)
        if robot.voice is not None:
            self._add_voice(robot.voice)
        self.player: Final = self._add_motions()
        """What plays motions."""
        self.health: Final = self._add_health()
        self.jobs: Final[list[Job]] = self._jobs()
        """What is to be done periodically."""

    def drop_client(self, client: str) -> None:
        """Stop what a lost client drives or streams, and take its lease back."""
        with ExitStack() as steps:  # each whatever the others raise
            steps.callback(self._safety.drop_client, client)
            for camera in self.cameras:
                steps.callback(camera.drop_client, client)
            for watched in self.watched:
                steps.callback(watched.drop_client, client)

    # -- the servants of each part -----------------------------------------------------------------------

    def _add_safety(self) -> SafetyI:
        safety = SafetyI(self.gate, self._robot.clock.now)
        self.servants["Safety"] = safety
        return safety

    def _add_body(self) -> GuardedDevice:
        body = self._guard(self._robot, self._options.safety, self.gate)
        self.gate.on_stop(body.hold)
        for hinge in HINGES:
            self._add_hinge(body, hinge)
        self.servants["NeckSpeed"] = NeckSpeedI(body)
        head, joints = PoseHeadI(body), JointsI(body)
        self.servants.update({"Head": head, "Body": joints})
        self._streams.extend((head, joints))
        return body

    def _add_walk(self, walker: Walker) -> None:
        walk = WalkGuard(
            walker,
            self.body,
            self.gate,
            self.events,
            self._options.safety,
            wall_time=self._wall.now,
            look_within=self._watchdog.look_within,
        )
        self.gate.on_stop(walk.stop)
        self.watched.append(walk)
        encoders = EncodersI(walk)
        self.servants.update({"Motors": MotorsI(walk), "Encoders": encoders})
        self._streams.append(encoders)

    def _add_senses(self, senses: Senses) -> None:
        inertial, feet, sonar = InertialUnitI(senses), FootPressureI(senses), SonarI(senses)
        touch, battery = TouchI(senses), BatteryI(senses)
        self.servants.update(
            {
                "InertialUnit": inertial,
                "FootPressure": feet,
                "Sonar": sonar,
                "Touch": touch,
                "Battery": battery,
            }
        )
        self._streams.extend((inertial, feet, sonar, touch, battery))

    def _add_stage(self, stage: Stage) -> None:
        truth = GroundTruthI(stage)
        self.servants.update({"GroundTruth": truth, "Scene": SceneI(stage, self.body.hold)})
        self._streams.append(truth)

    def _add_mechanism(self, mechanism: JointDevice) -> None:
        # A gate of its own that nobody shuts: what carries a ball is no part of the robot.
        gate = Gate(self.events, self._wall.now)
        device = self._guard(mechanism, self._options.mechanism_safety, gate)
        self._add_hinge(device, ball_hinge(mechanism.name, tuple(j.name for j in mechanism.joints)))

    def _add_hinge(self, device: GuardedDevice, hinge: Hinge) -> None:
        self.servants[f"{hinge.name}Motors"] = Pose3DMotorsI(device, hinge)
        encoders = Pose3DEncodersI(device, hinge)
        self.servants[f"{hinge.name}Encoders"] = encoders
        self._streams.append(encoders)

    def _add_cameras(self) -> list[CameraI]:
        robot, options = self._robot, self._options
        unknown = options.cameras.keys() - {facts.name for facts in robot.cameras}
        if unknown:
            names = ", ".join(facts.name for facts in robot.cameras)
            raise RobotError(f"there is no camera {sorted(unknown)[0]!r}; there are {names}")
        cameras = [
            CameraI(robot, facts, options.cameras.get(facts.name, options.camera), self.events)
            for facts in robot.cameras
        ]
        self.servants.update({camera.facts.name: camera for camera in cameras})
        return cameras

    def _add_lights(self, lights: Lights) -> None:
        leds = LedsI(lights, self._robot.clock.now)
        self.servants["Leds"] = leds
        self._streams.append(leds)

    def _add_voice(self, voice: Voice) -> None:
        speech = SpeechI(voice, self._robot.clock.now)
        self.servants["Speech"] = speech
        self._streams.append(speech)

    def _add_motions(self) -> MotionPlayer:
        robot, time = self._robot, self._robot.clock.now
        player = MotionPlayer(self.body, time, lambda: situation_of(robot), self.events)
        player.on_begin = self._wake
        self.watched.append(player)
        motions = load_motions()
        moving = MotionsI(player, motions, time)
        postures: PosturesI
        if robot.postures is None:
            postures = KeyFramePosturesI(player, motions, time)
        else:
            postures = OwnPosturesI(robot.postures, self.body, time, self._watchdog.look_within)
            self.gate.on_stop(robot.postures.stop)
            self.watched.append(postures)
        self.servants.update({"Motions": moving, "Postures": postures})
        self._streams.extend((moving, postures))
        return player

    def _add_health(self) -> HealthI:
        health = HealthI(
            self._robot,
            self.events,
            lambda: {camera.facts.name: camera.delivered_rate for camera in self._cameras},
            self._wall.now,
        )
        self.servants["Health"] = health
        return health

    def _wake(self) -> None:
        self.on_wake()

    def _jobs(self) -> list[Job]:
        """Return what is done periodically: no camera can delay anything else, nothing the watchdog."""
        robot, options, player = self._robot, self._options, self.player
        by_device: dict[StateSource, list[StreamsState]] = {}
        for servant in self._streams:
            by_device.setdefault(servant.device, []).append(servant)

        def report() -> None:
            self._safety.publish()
            self.health.publish()

        def listening() -> bool:
            return self._clock.getTimePublisher.listening

        return [
            self._watchdog,
            *(self._state_job(device, servants) for device, servants in by_device.items()),
            Periodic(
                "motions",
                robot.clock,
                lambda: PERIOD,
                player.tick,
                thread="state",
                wanted=lambda: player.busy,
            ),
            Periodic(
                "clock",
                self._wall,
                lambda: 1.0 / options.clock_rate,
                self._clock.publish,
                thread="reports",
                wanted=listening,
            ),
            Periodic("reports", self._wall, lambda: 1.0 / options.health_rate, report),
            *(self._camera_job(camera) for camera in self._cameras),
        ]

    def _state_job(self, device: StateSource, servants: Sequence[StreamsState]) -> Job:
        """Return the job that streams readings of a device; none is sent twice, by its time."""
        sent = math.nan

        def publish() -> None:
            nonlocal sent
            reading = device.read()
            if reading.time != sent:
                sent = reading.time
                for servant in servants:
                    if servant.listening:
                        servant.publish(reading)

        clock, options = self._robot.clock, self._options
        return Periodic(
            "state",
            clock,
            lambda: 1.0 / options.state_rate,
            publish,
            wanted=lambda: any(servant.listening for servant in servants),
            gap=lambda: clock.rate / options.state_wall_rate,
        )

    def _camera_job(self, camera: CameraI) -> Job:
        name = f"images of {camera.facts.name}"
        return Periodic(
            name, self._robot.clock, lambda: camera.period, camera.publish, wanted=lambda: camera.wanted
        )

    def _guard(self, device: JointDevice, options: SafetyOptions, gate: Gate) -> GuardedDevice:
        own = {joint.name for joint in device.joints}
        safety = Safety(
            device.joints,
            options,
            [table for table in H25.anticollision if {table.independent, table.dependent} <= own],
            [pair for pair in H25.couplings if {pair.leader, pair.follower} <= own],
        )
        guarded = GuardedDevice(
            device,
            safety,
            gate,
            self.events,
            wall_time=self._wall.now,
            look_within=self._watchdog.look_within,
        )
        self.watched.append(guarded)
        return guarded


def _nothing() -> None:
    pass
