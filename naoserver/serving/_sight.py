"""Servant of what the robot sees."""

from __future__ import annotations

from typing import Final

from interfaces import nao
from naoserver.bodies.capabilities import Eyes, SeenThing, SightReading
from naoserver.served_field import said_of
from naoserver.serving._shared import StateStream
from zenoh_ice import Current


class SightI(nao.Sight):
    """Report what eyes see, in calls and as a stream that sends each look once."""

    def __init__(self, eyes: Eyes) -> None:
        self.stream: Final = StateStream(eyes.look, self.getSightPublisher, _sight)
        self._field: Final = said_of(eyes.field)

    def getSight(self, current: Current) -> nao.SightReading:
        return self.stream.now()

    def getField(self, current: Current) -> nao.SoccerField:
        return self._field


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
