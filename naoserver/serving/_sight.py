"""Servant of what the robot sees."""

from __future__ import annotations

from typing import Final

from interfaces import nao
from naoserver.bodies.capabilities import Eyes, SeenThing, SightReading
from naoserver.serving._shared import StateStream
from naoserver.soccer_field import Field
from zenoh_ice import Current


class SightI(nao.Sight):
    """Report what eyes see, in calls and as a stream that sends each look once."""

    def __init__(self, eyes: Eyes) -> None:
        self.stream: Final = StateStream(eyes.look, self.getSightPublisher, _sight)
        self._field: Final = _field(eyes.field)

    def getSight(self, current: Current) -> nao.SightReading:
        return self.stream.now()

    def getField(self, current: Current) -> nao.SoccerField:
        return self._field


def _field(field: Field) -> nao.SoccerField:
    return nao.SoccerField(
        length=field.length,
        width=field.width,
        line=field.line,
        border=field.border,
        circleDiameter=field.circle_diameter,
        penaltyAreaDepth=field.penalty_area[0],
        penaltyAreaWidth=field.penalty_area[1],
        goalAreaDepth=field.goal_area[0],
        goalAreaWidth=field.goal_area[1],
        penaltyMark=field.penalty_mark,
        goalWidth=field.goal_width,
        goalHeight=field.goal_height,
        goalDepth=field.goal_depth,
        ballRadius=field.ball_radius,
        walled=field.walled,
        corner=field.corner,
    )


def _sight(reading: SightReading) -> nao.SightReading:
    return nao.SightReading(time=reading.time, things=[_thing(thing) for thing in reading.things])


def _thing(seen: SeenThing) -> nao.SeenThing:
    return nao.SeenThing(
        kind=seen.kind,
        name=seen.name,
        certainty=seen.certainty,
        camera=seen.camera,
        time=seen.time,
        left=seen.left,
        down=seen.down,
        pan=seen.pan,
        tilt=seen.tilt,
        distance=seen.distance,
        distanceError=seen.distance_error,
        x=seen.x,
        y=seen.y,
    )
