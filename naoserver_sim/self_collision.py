"""Where a body's own shapes touch, and the range tables that keep two joints of a limb from it.

    python -m naoserver_sim.self_collision T1
    python -m naoserver_sim.self_collision T1 --pair Left_Shoulder_Pitch,Left_Shoulder_Roll

It prints each table as an entry for `tables` in the facts file of the body. A table knows two joints only:
all others are as in the body's rest, or as in each of the postures given by `--posture`, and the other arm or
leg is not considered.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from itertools import combinations, pairwise
from typing import Annotated, Final

import msgspec
import mujoco
import numpy as np
import typer

from naoserver.bodies import BODY_NAMES
from naoserver.bodies.parts import Joint, RangeTable
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim._body import add_body, possible
from naoserver_sim.named_body import named_body
from zenoh_ice.application.cli import run

MARGIN: Final = 0.005
"""Distance in m that shapes keep, which also covers what lies between the angles that are tried."""
_STEP: Final = 0.15
"""Largest angle in rad between two rows."""
_FINE: Final = 0.04
"""Largest angle in rad between two angles of the dependent joint that are tried before its limit is found."""
_EXACT: Final = 0.001
"""Precision in rad of a limit."""
_BEND: Final = 0.05
"""Angle in rad by which the line between a row's neighbors may lie within it, so that it is left out."""
_EQUAL: Final = 1e-6

_Interval = tuple[float, float]


@dataclass(frozen=True)
class Finding:
    """What was found of two joints."""

    table: RangeTable | None
    """None when nothing touches in their ranges."""
    touching: tuple[tuple[str, str], ...]
    """The links that touch each other beyond the table."""
    reach: _Interval
    """The angles of the independent joint at which the dependent one has a way from rest, in rad."""


class BodyShapes:
    """The contact shapes of a body alone, and how near they are to each other. For one thread."""

    def __init__(self, body: Body) -> None:
        self.body: Final = body
        scene = resources.files("naoserver_sim").joinpath("scene.xml").read_text(encoding="utf-8")
        spec = mujoco.MjSpec.from_string(scene)
        with possible(body):
            add_body(spec, body, body.cameras)
            self._mj = spec.compile()
        self._data = mujoco.MjData(self._mj)
        self._ends = np.zeros(6)

    def pairs_moved_by(self, joints: Sequence[str]) -> list[tuple[int, int]]:
        """Return the pairs of shapes that may touch, and that some joints of a limb move against each other.

        Those of the opposite limb are left out: where they are is up to its own joints.
        """
        mj = self._mj
        solid = np.flatnonzero(mj.geom_contype).tolist()
        apart = set(mj.exclude_signature.tolist())
        opposite = self._opposite(joints)
        found = []
        for first, second in combinations(solid, 2):
            one, other = sorted((int(mj.geom_bodyid[first]), int(mj.geom_bodyid[second])))
            if one == other or (one << 16) + other in apart:
                continue
            between = self._movers(one) ^ self._movers(other)
            if not between.isdisjoint(joints) and between.isdisjoint(opposite):
                found.append((first, second))
        return found

    def _opposite(self, joints: Sequence[str]) -> tuple[str, ...]:
        """Return the joints of the other arm, or of the other leg, than that of some joints."""
        of = self.body.groups
        arms, legs = (of.left_arm, of.right_arm), (of.left_leg, of.right_leg)
        for own, other in (arms, arms[::-1], legs, legs[::-1]):
            if not set(joints).isdisjoint(own):
                return other
        return ()

    def link_of(self, shape: int) -> str:
        """Return the link that a shape is on."""
        return str(self._mj.body(self._mj.geom_bodyid[shape]).name)

    def _movers(self, link: int) -> frozenset[str]:
        """Return the joints between the root and a link."""
        name, movers = self._mj.body(link).name, set()
        while name in self.body.moved_by:
            joint = self.body.moved_by[name]
            movers.add(joint.name)
            name = joint.parent
        return frozenset(movers)

    def nearest(
        self, angles: Mapping[str, float], pairs: Sequence[tuple[int, int]], within: float
    ) -> tuple[float, tuple[str, str] | None]:
        """Return the smallest distance in m of pairs of shapes at some angles, and the links that have it.

        It is negative for shapes that overlap, and `within` without links when all are farther apart.
        """
        mj, data = self._mj, self._data
        for name, angle in angles.items():
            data.qpos[mj.joint(name).qposadr[0]] = angle
        mujoco.mj_kinematics(mj, data)
        least, links = within, None
        for first, second in pairs:
            distance = mujoco.mj_geomDistance(mj, data, first, second, within, self._ends)
            if distance < least:
                least = distance
                one, other = sorted((self.link_of(first), self.link_of(second)))
                links = one, other
        return least, links


def limb_pairs(body: Body) -> Iterator[tuple[str, str]]:
    """Yield the joints of each limb of which one may have to make way for the other.

    Those are the first two of a head and of an arm, and the last two of a leg: its ankle.
    """
    of = body.groups
    limbs = *(limb[:2] for limb in (of.head, of.left_arm, of.right_arm)), of.left_leg[-2:], of.right_leg[-2:]
    yield from ((limb[0], limb[1]) for limb in limbs if len(limb) == 2)


def find_table(
    shapes: BodyShapes,
    independent: str,
    dependent: str,
    postures: Sequence[Mapping[str, float]],
    margin: float = MARGIN,
) -> Finding:
    """Return the range of one joint at each angle of the other in which no shapes touch.

    It is the range that is reached from the first of `postures`, and holds in all of them. Raises RobotError
    for joints that are unknown or turn without end, or when shapes touch in that posture.
    """
    search = _Search(
        shapes, _limited(shapes.body, independent), _limited(shapes.body, dependent), postures, margin
    )
    return search.find()


def _limited(body: Body, name: str) -> Joint:
    joint = body.joint.get(name)
    if joint is None:
        raise RobotError(f"there is no joint {name!r}; there are {', '.join(body.joint_names)}")
    if not math.isfinite(joint.upper - joint.lower):
        raise RobotError(f"joint {name} turns without end: it has no table")
    return joint


class _Search:
    """The search for the table of two joints."""

    def __init__(
        self,
        shapes: BodyShapes,
        independent: Joint,
        dependent: Joint,
        postures: Sequence[Mapping[str, float]],
        margin: float,
    ) -> None:
        self._shapes = shapes
        self._independent, self._dependent = independent, dependent
        self._postures = postures
        self._margin = margin
        self._pairs = shapes.pairs_moved_by((independent.name, dependent.name))
        count = math.ceil((dependent.upper - dependent.lower) / _FINE)
        self._tried: list[float] = np.linspace(dependent.lower, dependent.upper, count + 1).tolist()
        self._touching: set[tuple[str, str]] = set()

    def find(self) -> Finding:
        independent, dependent = self._independent, self._dependent
        start = self._postures[0][independent.name]
        if not self._is_free(start, self._postures[0][dependent.name]):
            pairs = " and ".join(" at ".join(pair) for pair in sorted(self._touching))
            raise RobotError(f"{pairs} are nearer than {self._margin:g} m in the first posture")
        ranges = {start: self._range(start, self._postures[0][dependent.name])}
        for edge in (independent.lower, independent.upper):
            self._follow(ranges, start, edge)
        angles = sorted(ranges)
        table = None
        if any(free != (dependent.lower, dependent.upper) for free in ranges.values()):
            rows = _simplified(_tightest(angles, [ranges[angle] for angle in angles]))
            table = RangeTable(independent.name, dependent.name, tuple(rows), "own: self_collision")
        return Finding(table, tuple(sorted(self._touching)), (angles[0], angles[-1]))

    def _follow(self, ranges: dict[float, _Interval], start: float, edge: float) -> None:
        """Find the ranges from the start towards an edge, as long as each overlaps the one before."""
        count = 2 * math.ceil(abs(edge - start) / _STEP)
        before = ranges[start]
        for angle in np.linspace(start, edge, count + 1)[1:].tolist():
            free = [tried for tried in self._tried if self._is_free(angle, tried)]
            inside = [each for each in free if before[0] <= each <= before[1]]
            if not inside:
                return
            # From the middle of what is free here and was free before.
            before = ranges[angle] = self._range(angle, inside[len(inside) // 2])

    def _range(self, angle: float, inside: float) -> _Interval:
        """Return the range round an angle of the dependent joint in which nothing touches."""
        below = [tried for tried in reversed(self._tried) if tried < inside]
        above = [tried for tried in self._tried if tried > inside]
        return self._limit(angle, inside, below), self._limit(angle, inside, above)

    def _limit(self, angle: float, inside: float, outwards: Sequence[float]) -> float:
        """Return the last angle on the way outwards at which nothing touches."""
        free = inside
        for blocked in outwards:
            if not self._is_free(angle, blocked):
                break
            free = blocked
        else:
            return free
        while abs(blocked - free) > _EXACT:
            middle = (free + blocked) / 2
            if self._is_free(angle, middle):
                free = middle
            else:
                blocked = middle
        return free

    def _is_free(self, angle: float, tried: float) -> bool:
        """Return whether the shapes keep their distance at these angles, in each of the postures."""
        two = {self._independent.name: angle, self._dependent.name: tried}
        for posture in self._postures:
            _, links = self._shapes.nearest({**posture, **two}, self._pairs, self._margin)
            if links is not None:
                self._touching.add(links)
                return False
        return True


def _tightest(angles: Sequence[float], ranges: Sequence[_Interval]) -> list[tuple[float, float, float]]:
    """Return rows whose ranges are no wider than any range up to the next rows.

    So the range between two rows, which is linear, is nowhere wider than those that were found there.
    """
    rows = []
    for place in range(0, len(angles), 2):
        near = ranges[max(0, place - 2) : place + 3]
        rows.append((angles[place], max(lower for lower, _ in near), min(upper for _, upper in near)))
    if len(angles) % 2 == 0:
        rows.append((angles[-1], rows[-1][1], rows[-1][2]))
    return rows


def _simplified(rows: Sequence[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """Leave out rows that the line between their neighbors replaces, a little within; round inwards."""
    kept, left_out = [rows[0]], []
    for row, after in pairwise(rows[1:]):
        left_out.append(row)
        line = RangeTable("", "", (kept[-1], after))
        if not all(_replaces(line, each) for each in left_out):
            kept.append(row)
            left_out = []
    if len(rows) > 1:
        kept.append(rows[-1])
    return [
        (round(angle, 4), math.ceil(lower * 1e4 - _EQUAL) / 1e4, math.floor(upper * 1e4 + _EQUAL) / 1e4)
        for angle, lower, upper in kept
    ]


def _replaces(line: RangeTable, row: tuple[float, float, float]) -> bool:
    lower, upper = line.at(row[0])
    return 0.0 <= lower - row[1] <= _BEND and 0.0 <= row[2] - upper <= _BEND


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def self_collision(
    body: Annotated[str, typer.Argument(help=f"The body: {', '.join(BODY_NAMES)}, or the file of your own.")],
    pair: Annotated[
        list[str] | None,
        typer.Option(
            metavar="JOINT,JOINT", help="The independent joint and the dependent one; may be repeated."
        ),
    ] = None,
    posture: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="A posture of the other joints; may be repeated.")
    ] = None,
    margin: Annotated[float, typer.Option(help="Distance in m that shapes keep.", min=0.0, max=0.1)] = MARGIN,
) -> None:
    """Print the range tables that keep a body from hitting itself, one for each two joints of its limbs."""
    facts = named_body(body)
    postures = [_angles(facts, name) for name in posture or ()] or [facts.resting_angles]
    shapes = BodyShapes(facts)
    for independent, dependent in [_two(text) for text in pair or ()] or limb_pairs(facts):
        found = find_table(shapes, independent, dependent, postures, margin)
        touching = "; ".join(" and ".join(links) for links in found.touching) or "nothing touches"
        typer.echo(f"{independent}, {dependent}: {touching}", err=True)
        joint = facts.joint[independent]
        if found.reach != (joint.lower, joint.upper):
            low, high = found.reach
            typer.echo(f"{independent}: no way beyond {low:.3f} to {high:.3f} rad", err=True)
        if found.table is not None:
            typer.echo(json.dumps(msgspec.to_builtins(found.table)))


def _angles(body: Body, name: str) -> Mapping[str, float]:
    if name not in body.postures:
        raise RobotError(f"there is no posture {name!r}; there are {', '.join(body.postures)}")
    return body.postures[name].angles


def _two(text: str) -> tuple[str, str]:
    independent, _, dependent = (part.strip() for part in text.partition(","))
    if independent == dependent or not dependent:
        raise RobotError(f"--pair {text}: write two joints, such as HeadYaw,HeadPitch")
    return independent, dependent


if __name__ == "__main__":
    sys.exit(run(app, expected=(RobotError,)))
