"""The servants of a robot, the safety layer below them and their periodic jobs: no threads, no network.

What the robot's body lacks has no servant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Any, Final

from naoserver.bodies.capabilities import Senses, Walker
from naoserver.bodies.parts import Axis, Hinge, HingeAxis
from naoserver.errors import RobotError
from naoserver.moves._player import PERIOD, MotionPlayer
from naoserver.moves.joint_paths import PERIOD as PATH_PERIOD
from naoserver.moves.joint_paths import JointPaths
from naoserver.moves.routes import situation_of
from naoserver.moves.walk import PERIOD as WALK_PERIOD
from naoserver.moves.walk import WalkGuard, WalkTo
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.protocol.expression import Hearing
from naoserver.protocol.jobs import Job, Periodic, Watchdog, Watched
from naoserver.protocol.robot import JointDevice, Robot
from naoserver.safety._event_log import EventLog
from naoserver.safety._gate import Gate
from naoserver.safety._guarded_device import GuardedDevice
from naoserver.safety._limits import JointSafety
from naoserver.safety.gain_guard import GainGuard
from naoserver.safety.latch import Latch
from naoserver.serving import _sensors as sensors
from naoserver.serving import moves
from naoserver.serving._description import ClockI, DescriptionI, HealthI, SafetyI
from naoserver.serving._expression import HearingI, LedsI, SoundsI, SpeechI
from naoserver.serving._faults import FaultsI
from naoserver.serving._joints import JointsI, NeckSpeedI, Pose3DEncodersI, Pose3DMotorsI, PoseHeadI
from naoserver.serving._link import LinkFailures
from naoserver.serving._shared import StateStream
from naoserver.serving._sight import SightI
from naoserver.serving._team import TeamI
from naoserver.serving.camera import BodyHistory, CameraI, usual_settings
from naoserver.serving.medium import Membership
from zenoh_ice import Clock, Object

_STATE_PERIOD: Final = 0.02
"""Robot seconds between two samples of state."""
_STATE_GAP: Final = 0.005
"""Minimum wall seconds between two samples of state, however fast a simulation runs."""
_BALL_AXES: Final = (Axis.PAN, Axis.X, Axis.Z)
"""The axes of a ball's three joints in their order: round the robot in rad, distance in m, height in m."""
_TICK: Final = 0.02  # wall s between two times that clients hear
_HEALTH_PERIOD: Final = 0.5  # wall s
_ALONE: Final = "nao"
"""The name of a robot in a team of one, where nobody says its realm."""


class Assembly:
    """The server's parts between a robot and its clients: a servant for each device.

    `wall` is the steady clock of the safety deadlines and the reports; `latch`, which is open, keeps the
    emergency stop. A robot on a stage hears what is typed, another if it `hears`. `member` says who it is in
    its team. Raises RobotError for options that the robot does not support, and for parts of the same name.
    """

    def __init__(
        self,
        robot: Robot,
        options: ServerOptions,
        wall: Clock,
        latch: Latch | None = None,
        *,
        hears: bool = False,
        member: Membership | None = None,
    ) -> None:
        self._robot = robot
        self.options: Final = options
        """Options of the server."""
        self._wall = wall
        self.on_wake: Callable[[], None] = lambda: None
        """Called when a job may be due earlier than before; the driver of the jobs sets it."""
        self.hanging: Callable[[], list[str]] = list
        """Returns the names of the jobs' threads that hang; the driver of the jobs sets it."""
        self._watchdog = Watchdog(wall, self._wake)
        self.servants: Final[dict[str, Object]] = {}
        """Every servant by its identity."""
        self._streams: list[StateStream[Any, Any]] = []
        self.watched: Final[list[Watched]] = self._watchdog.watched
        """Moving devices that the watchdog checks."""
        self.events: Final = EventLog(robot.clock.now, wall.now)
        """Events of the health report."""
        self.gate: Final = Gate(self.events, latch, resumes=self.options.resume_after_reset)
        """Emergency stop and lease in front of every command of the robot."""
        self.hearing: Final = Hearing()
        """Passes on what is said to the robot, as text."""

        time = robot.clock.now
        self._clock = ClockI(robot.clock)
        self._safety = SafetyI(self.gate, self.moves_for)
        self._team = TeamI(member or Membership(_ALONE), time, self._is_ready, self.events, self._wake)
        description = DescriptionI(robot.body, robot.looks)
        self._add(Clock=self._clock, Safety=self._safety, Description=description, Team=self._team)
        self.gains: GainGuard | None = None
        """What lets joints follow commands with gains; None when its motors take none."""
        self.body: Final = self._add_body()
        """The robot's joints behind the safety layer."""
        self.walk_to: Final = None if robot.walker is None else self._add_walk(robot.walker)
        """Its walk to a place; None when it does not walk."""
        self.walk: Final = None if self.walk_to is None else self.walk_to.guard
        """Its walk behind the safety layer."""
        if robot.senses is not None:
            self._add_senses(robot.senses)
        self._add_surroundings()
        self._history = BodyHistory(robot, self._wake)
        self._cameras = self._add_cameras()
        if robot.eyes is not None and options.sight:
            self._add(Sight=SightI(robot.eyes))
        self._add_expression(hears=hears or robot.stage is not None)
        self.player: Final = self._add_motions()
        """The player of motions."""
        self.postures: Final = self._add_postures(self.player)
        """Its ways into postures; None when it knows none."""
        self.health: Final = HealthI(robot, self.gate, self._cameras)
        self._add(Health=self.health)
        self.jobs: Final[list[Job]] = self._jobs()
        """Periodic jobs, except those that the robot's own control loop does."""
        self.link: LinkFailures | None = None
        """What lets its server and the link fail; None for a real robot."""
        if robot.faults is not None:
            self.link = LinkFailures(robot.faults, self.servants, wall, self._wake)
            self.jobs.append(self.link)
        self.paths: Final = JointPaths(self.body, robot.clock, self._wake)
        """What moves joints along curves."""
        self._moves: Final = self._add_moves()
        """The jobs that move the robot along a path, for as long as it lasts."""
        self.gate.stop_again()  # a former server may have left the robot on its way somewhere

    def drop_client(self, client: str) -> None:
        """Stop everything that a lost client moves or streams, and take its lease back."""
        with ExitStack() as steps:  # each whatever the others raise
            steps.callback(self._safety.drop_client, client)
            steps.callback(self._team.drop_client, client)
            for camera in self._cameras:
                steps.callback(camera.drop_client, client)
            for watched in self.watched:
                steps.callback(watched.drop_client, client)
            steps.callback(self.player.drop_client, client)
            steps.callback(self.paths.stop, client)

    def moves_for(self, client: str) -> bool:
        """Return whether anything still moves because a client commanded it."""
        return self.player.moves_for(client) or any(each.moves_for(client) for each in self.watched)

    def close(self) -> None:
        """Stop all motion, and refuse further commands."""
        with ExitStack() as steps:  # each whatever the others raise
            for watched in self.watched:
                steps.callback(watched.close)
            steps.callback(self.player.close)
            steps.callback(self._team.close)
            if self._robot.control_loop is not None:
                for job in self._moves:
                    steps.callback(self._robot.control_loop.remove, job)

    # -- the servants of each part -----------------------------------------------------------------------

    def _add(self, **servants: Object) -> None:
        """Serve servants by their identities, and publish their streams.

        Raises RobotError when a part is called like another one: no camera takes the place of `Safety`.
        """
        if taken := sorted(servants.keys() & self.servants.keys()):
            name, what = self._robot.name, " and ".join(taken)
            raise RobotError(f"two parts of the robot {name} would be served as {what}: rename one of them")
        self.servants.update(servants)
        for servant in servants.values():
            self._streams.extend(each for each in vars(servant).values() if isinstance(each, StateStream))

    def _add_body(self) -> GuardedDevice:
        body = self._guard(self._robot, self.options.safety, self.gate)
        self.gate.on_stop(body.hold)
        facts = self._robot.body
        for name, axes in facts.hinges.items():
            self._add_hinge(body, Hinge(name, axes))
        if (neck := facts.neck) is not None:
            self._add(NeckSpeed=NeckSpeedI(body, neck), Head=PoseHeadI(body, neck))
        if self._robot.gains is not None and facts.gains is not None:
            self.gains = GainGuard(self._robot.gains, body, facts, facts.gains, self.options.safety)
            self.watched.append(self.gains)
        self._add(Body=JointsI(body, self.gains))
        return body

    def _add_walk(self, walker: Walker) -> WalkTo:
        walk = WalkGuard(walker, self.body, self.options.safety)
        self.gate.on_stop(walk.stop)
        self.watched.append(walk)
        walk_to = WalkTo(walk, self._robot.clock.now, self._wake)
        self._add(Motors=moves.MotorsI(walk), Encoders=moves.EncodersI(walk), Walk=moves.WalkI(walk, walk_to))
        return walk_to

    def _add_senses(self, senses: Senses) -> None:
        body = self._robot.body
        if body.inertial_unit is not None:
            self._add(InertialUnit=sensors.InertialUnitI(senses))
        if any(sole.pressure for sole in body.soles):
            self._add(FootPressure=sensors.FootPressureI(senses, body))
        if senses.touch_names:
            self._add(Touch=sensors.TouchI(senses))
        if body.battery is not None:
            self._add(Battery=sensors.BatteryI(senses))
        if senses.sonar_range is not None:
            self._add(Sonar=sensors.SonarI(senses))

    def _add_surroundings(self) -> None:
        if (faults := self._robot.faults) is not None:
            self._add(Faults=FaultsI(faults, self.gate))
        if (stage := self._robot.stage) is not None:
            heal = faults.heal if faults is not None else lambda: None
            scene = sensors.SceneI(stage, self.gate, self.end_motion, self.hearing.hear, heal)
            self._add(GroundTruth=sensors.GroundTruthI(stage), Scene=scene)
        for mechanism in self._robot.mechanisms:
            # Its gate is never shut: the mechanism of a ball is not part of the robot.
            device = self._guard(mechanism, self.options.mechanism_safety, Gate(self.events))
            axes = (HingeAxis(joint.name) for joint in mechanism.joints)
            self._add_hinge(device, Hinge(mechanism.name, dict(zip(_BALL_AXES, axes, strict=True))))

    def _add_expression(self, *, hears: bool) -> None:
        robot, time = self._robot, self._robot.clock.now
        if hears:
            ears = HearingI(time)
            self.hearing.listen(ears.hear)
            self._add(Hearing=ears)
        if robot.lights is not None and robot.lights.names:
            self._add(Leds=LedsI(robot.lights, time))
        if robot.voice is not None:
            self._add(Speech=SpeechI(robot.voice, time))
        if robot.loudspeaker is not None:
            self._add(Sounds=SoundsI(robot.loudspeaker, time))

    def _add_hinge(self, device: GuardedDevice, hinge: Hinge) -> None:
        motors, encoders = Pose3DMotorsI(device, hinge), Pose3DEncodersI(device, hinge)
        self._add(**{f"{hinge.name}Motors": motors, f"{hinge.name}Encoders": encoders})

    def _add_cameras(self) -> list[CameraI]:
        robot, given = self._robot, self.options.cameras
        if unknown := given.keys() - {facts.name for facts in robot.cameras}:
            names = ", ".join(facts.name for facts in robot.cameras)
            raise RobotError(f"there is no camera {sorted(unknown)[0]!r}; there are {names}")
        cameras = [
            CameraI(robot, facts, given.get(facts.name) or usual_settings(facts), self.events, self._history)
            for facts in robot.cameras
        ]
        self._add(**{camera.facts.name: camera for camera in cameras})
        return cameras

    def _add_motions(self) -> MotionPlayer:
        robot = self._robot
        player = MotionPlayer(robot.body, self.body, lambda: situation_of(robot), self._begin_motion)
        if player.motions:
            self._add(Motions=moves.MotionsI(player))
        return player

    def _add_postures(self, player: MotionPlayer) -> moves.PosturesI | None:
        postures: moves.PosturesI | None = None
        if (own := self._robot.postures) is not None:
            postures = way = moves.OwnPosturesI(own, self.body)
            self.gate.on_stop(own.stop)
            self.watched.append(way)
        elif self._robot.body.postures:
            postures = moves.KeyFramePosturesI(player)
        if postures is not None:
            self._add(Postures=postures)
        return postures

    def end_motion(self) -> None:
        """End all motion of a robot that is put elsewhere, and forget where its joints were to be."""
        self.body.hold()
        for joint in self.body.joints:
            self.body.forget(joint.name)

    def _begin_motion(self) -> None:
        """Play a motion as it is: it may also use hands and knees."""
        if self._robot.balancer is not None:
            self._robot.balancer.command(None)
        self._wake()

    def _wake(self) -> None:
        self.on_wake()

    def _is_ready(self) -> bool:
        """Return whether the robot can do anything: for its team."""
        return not (self._robot.state().fallen or self.gate.is_stopped or self.gate.is_robot_lost)

    def _jobs(self) -> list[Job]:
        """Return the periodic jobs: no camera can delay other jobs, and nothing can delay the watchdog."""
        by_source: dict[Callable[[], Any], list[StateStream[Any, Any]]] = {}
        for stream in self._streams:
            by_source.setdefault(stream.read, []).append(stream)

        def report() -> None:
            self._safety.publish()
            self.health.publish()

        wall, publish, publisher = self._wall, self._clock.publish, self._clock.getTimePublisher
        team, robot_clock = self._team, self._robot.clock
        return [
            self._watchdog,
            *(self._state_job(read, streams) for read, streams in by_source.items()),
            Periodic(
                "clock", wall, lambda: _TICK, publish, thread="reports", wanted=lambda: publisher.listening
            ),
            Periodic("reports", wall, lambda: _HEALTH_PERIOD, report),
            Periodic(
                "team",
                robot_clock,
                lambda: team.period,
                team.report,
                thread="state",
                wanted=lambda: team.is_wanted,
            ),
            *(camera.job for camera in self._cameras),
            self._history.job,
        ]

    def _add_moves(self) -> list[Job]:
        moving = [
            self._action_job("motions", PERIOD, self.player),
            self._action_job("paths", PATH_PERIOD, self.paths),
        ]
        if self.walk_to is not None:
            moving.append(self._action_job("walk", WALK_PERIOD, self.walk_to))
        add = self.jobs.append if self._robot.control_loop is None else self._robot.control_loop.add
        for job in moving:
            add(job)
        return moving

    def _action_job(self, name: str, period: float, action: MotionPlayer | JointPaths | WalkTo) -> Job:
        clock = self._robot.clock
        return Periodic(name, clock, lambda: period, action.tick, thread="state", wanted=lambda: action.busy)

    def _state_job(self, read: Callable[[], Any], streams: Sequence[StateStream[Any, Any]]) -> Job:
        """Return the job of the streams of one source; readings of equal time are sent only once."""
        sent = math.nan

        def publish() -> None:
            nonlocal sent
            reading = read()
            if reading.time != sent:
                sent = reading.time
                for stream in streams:
                    if stream.listening:
                        stream.publish(reading)

        clock = self._robot.clock
        return Periodic(
            "state",
            clock,
            lambda: _STATE_PERIOD,
            publish,
            wanted=lambda: any(stream.listening for stream in streams),
            gap=lambda: clock.rate * _STATE_GAP,
        )

    def _guard(self, device: JointDevice, options: SafetyOptions, gate: Gate) -> GuardedDevice:
        # The body's own rules apply to its joints only, not to those of a mechanism.
        body = self._robot.body
        rules = (body.tables, body.couplings, body.speed_rules) if device is self._robot else ()
        safety = JointSafety(device.joints, options, *rules)
        guarded = GuardedDevice(device, safety, gate, self._watchdog.check_within)
        self.watched.append(guarded)
        return guarded
