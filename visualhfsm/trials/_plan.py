"""The plan of a series of trials: what varies, what disturbs, what counts as success, and its limits.

A plan is a TOML file beside a document; plugins/trials/docs/trials.md describes its keys. The same plan and
seed draw the same values for a trial, whatever else is drawn.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta, Struct

from visualhfsm.simulation import CameraKind, RobotKind
from zenoh_ice.data.toml_file import parse_toml, read_text
from zenoh_ice.data.toml_file import place as place_in

from ._errors import TrialsError, wrong_plan
from ._quantities import Choice, Quantity, Same, Spread, Value, Values, draw_all, read_quantities, varies

SUFFIX: Final = ".trials.toml"
PARAMETERS: Final = "parameters."
"""Beginning of the names of quantities that are parameters of the component."""
CARRIED: Final = ("pan", "distance", "height")
"""The coordinates of a carried ball: rad, m and m."""
SAMPLED: Final = ("mean", "max")
"""The figures that are kept of samples."""
_KEPT: Final = ("number", "success", "reason", "states", "time", "calls", "cycles", "distance")
"""The columns that the table has of each trial in any case."""
_KINDS: Final = ("push", "move", "offline", "late", "fail")
_MOST_DRAWS: Final = 10_000
FAILURE: Final = "failure"
FAILS_AT: Final = "fails at"
"""The quantities of a failure that each trial has in turn."""
FATE: Final = "fate"
"""The group that says what became of the behavior then."""
FATE_AT: Final = "fate at"
"""The number that says since when, in s of the trial."""
WALKS_ON: Final = "walks on"
"""The number that says for how long it walked on without a word, in s."""

Time = Annotated[float, Meta(ge=0, le=86_400, description="write seconds from 0 to 86400")]
Failure = Annotated[str, Meta(pattern=r"^\S.* \w+\Z", description="write PART KIND, such as Camera black")]
Names = Annotated[tuple[str, ...], Meta(min_length=1)]
Speed = Annotated[float, Meta(gt=0, le=100, description="write a speed above 0, at most 100")]
Position = dict[str, Spread | Choice | float]
Function = Annotated[
    str, Meta(pattern=r"^[\w./-]+\.py:\w+\Z", description="write FILE.py:FUNCTION, such as judge.py:is_good")
]

Beside = Annotated[str, Meta(pattern=r"^[\w-][\w.-]*\Z", description="write the name of a file beside it")]


class Disturbance(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, omit_defaults=True):
    """Something that happens to the robot at a time, one of: `push`, `move`, `offline`, `late`, `fail`."""

    at: Spread | Choice | Time
    """In s of the trial."""
    seconds: Spread | Choice | Time = 0.0
    """The time for which it lasts; a failure without lasts until the end."""
    push: Spread | Choice | float | None = None
    """Force in N, horizontal."""
    direction: Spread | Choice | float = Spread(lowest=-3.14159, highest=3.14159)
    """Direction of a push in rad, from the robot's front to the left."""
    move: str | None = None
    """Name of a ball or another object."""
    to: Position | Annotated[tuple[Position, ...], Meta(max_length=100)] = {}
    """Where it is put, by x, y and z in m; a carried ball by pan in rad, distance and height in m.

    With a speed also the places to which a ball is carried in turn, again and again."""
    speed: Spread | Choice | Speed | None = None
    """The speed of each axis of a ball that is carried, in rad/s or m/s; without it, it is there at once."""
    offline: tuple[str, ...] | None = None
    """Identities of servants whose calls fail; none for all."""
    late: Spread | Choice | Time | None = None
    """Age in s of the pictures of all cameras."""
    fail: str | Names | None = None
    """The part of the robot that fails, such as a joint or a camera."""
    kind: str | Names = ""
    """How it fails, such as stuck."""
    amount: Spread | Choice | float | None = None
    """How much, in the unit of the kind; by default as much as is usual."""

    def __post_init__(self) -> None:
        given = [name for name in _KINDS if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"a disturbance has one of {', '.join(_KINDS)}; here: {', '.join(given) or 'none'}"
            )
        if self.move is not None and not self.to:
            raise ValueError(f"say where {self.move} is put: to = {{ x = 1.0, y = 0.5 }}")
        if isinstance(self.to, tuple) and self.speed is None:
            raise ValueError(f"say how fast {self.move} is carried from place to place: speed = 0.5")
        if self.speed is not None:
            axes = {axis for place in self.places.values() for axis in place}
            if self.move is None or not axes <= {*CARRIED}:
                raise ValueError(f"a speed is for a carried ball, which is moved by {', '.join(CARRIED)}")
            lowest = self.speed.bounds[0] if isinstance(self.speed, Spread) else 1.0
            if lowest <= 0.0 or (isinstance(self.speed, tuple) and min(self.speed) <= 0.0):
                raise ValueError("the speed may become 0: write from = 0.01, or more")
        if (self.fail is None) != (self.kind == "") or (self.fail is None and self.amount is not None):
            raise ValueError('a failure has a part and a kind: fail = "Camera", kind = "frozen"')
        if self.move is None and self.fail is None and self.seconds == 0.0:
            raise ValueError(f"say how long: seconds = 1.0, for {given[0]}")

    @property
    def quantities(self) -> dict[str, Quantity]:
        """Its numbers by name."""
        names = ["at", "seconds"] if self.move is None else ["at"]
        names += ["push", "direction"] if self.push is not None else []
        names += [name for name in ("late", "speed", "amount") if getattr(self, name) is not None]
        names += ["fail", "kind"] if self.fail is not None else []
        found = {name: getattr(self, name) for name in names}
        for prefix, place in self.places.items():
            found |= {prefix + axis: each for axis, each in place.items()}
        return found

    @property
    def places(self) -> dict[str, Position]:
        """The places of `to`, by what the names of their quantities begin with: numbers, if it is a list."""
        if isinstance(self.to, tuple):
            return {f"{number}.": place for number, place in enumerate(self.to, 1)}
        return {"": self.to} if self.to else {}


class Success(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, omit_defaults=True):
    """What a trial must do; all that is given must hold."""

    state: str | None = None
    """Path of the states that it must reach, which ends the trial."""
    upright: bool = True
    """True if a fall fails and ends the trial."""
    properties: bool = True
    """True if the properties of the document must hold."""
    function: Function | None = None
    """A function of the run, called at its end: returns whether it is good, or a text that says why not."""


class Plan(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, omit_defaults=True):
    """A series of trials of one document."""

    document: str = ""
    """The document, relative to the plan; by default the one with the same name."""
    runs: Annotated[int, Meta(ge=1, le=1_000_000)] = 100
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 1
    limit: Annotated[float, Meta(gt=0, le=86_400)] = 60.0
    """End of a trial in s of robot time."""
    robot: RobotKind | Literal["none"] = "sim"
    camera: CameraKind = "auto"
    stand_ins: bool = False
    """True if calls that nobody serves are answered with blank values, as in a dry run."""
    others: Annotated[tuple[Beside, ...], Meta(max_length=15)] = ()
    """Documents in its folder that drive the other robots of its world, in their order."""
    scene: dict[str, Quantity] = {}
    """Where the robot and the things are, and how well they are seen, by names; see `_scene`."""
    parameters: dict[str, Quantity] = {}
    """Parameters of the component."""
    accept: Function | None = None
    """A function of the drawn values that returns whether they are possible; else all are drawn again."""
    disturbances: dict[str, Disturbance] = {}
    """The disturbances, by a name for each."""
    failures: tuple[Failure, ...] = ()
    """What fails in the trials, one in each, in turn: a part and how, such as `Camera black`."""
    fails_at: Spread | Choice | Time = 2.0
    """When it does, in s of the trial."""
    fails_by: float | None = None
    """How much, in the unit of the kind; by default as much as is usual."""
    success: Success = Success()
    numbers: dict[str, Function] = {}
    """Functions of the run that are called at its end, by the name of the number that each returns."""
    samples: dict[str, Function] = {}
    """Functions of the run that are called ten times a second; their mean and maximum are noted."""
    groups: dict[str, Function] = {}
    """Functions of the run that are called at its end, and return a text: the group it belongs to."""
    patience: Annotated[float, Meta(gt=0, le=86_400)] = 300.0
    """Longest wall time of a trial in s."""
    memory: Annotated[int, Meta(ge=100, le=1_000_000)] = 4000
    """Most memory of a trial in MB."""

    @property
    def files(self) -> tuple[str, ...]:
        """The names of the files beside its document that it needs: of the other robots, and of worlds."""
        world = self.scene.get("world")
        worlds = world if isinstance(world, tuple) else (world,)
        return (*self.others, *(str(each) for each in worlds if str(each).endswith(".toml")))

    @property
    def quantities(self) -> dict[str, Quantity]:
        """All quantities by name: those of the scene, of parameters and of disturbances."""
        found = {**self.scene, **{PARAMETERS + name: each for name, each in self.parameters.items()}}
        for name, disturbance in self.disturbances.items():
            found |= {f"{name}.{key}": each for key, each in disturbance.quantities.items()}
        if self.failures:
            found |= {FAILURE: self.failures, FAILS_AT: self.fails_at}
        return found

    @property
    def varying(self) -> tuple[str, ...]:
        """The names of the quantities that differ from trial to trial."""
        return tuple(name for name, each in self.quantities.items() if varies(each))

    def check_names(self, where: Callable[[str, str], str] = "{}.{}".format) -> None:
        """Raise TrialsError if two columns of the table would have the same name.

        `where` says where a name is written, which has a table of the file and itself.
        """
        taken = {*_KEPT, *self.quantities}
        columns = [
            *(("groups", name, name) for name in self.groups),
            *(("numbers", name, name) for name in self.numbers),
            *(("samples", name, f"{name} {kind}") for name in self.samples for kind in SAMPLED),
        ]
        for key, name, column in columns:
            if column in taken:
                raise TrialsError.because(
                    "{where}: the table of trials has a column {column} already: write another name",
                    where=where(key, name),
                    column=column,
                )
            taken.add(column)

    @property
    def trials(self) -> range:
        """The numbers of its trials, from 1 on, as people count."""
        return range(1, self.runs + 1)

    def draw(self, number: int, accept: Callable[[Values], object] | None = None) -> dict[str, Value]:
        """Return the values of a trial; `accept` is the loaded function. Raises TrialsError."""
        for attempt in range(_MOST_DRAWS):
            values = draw_all(self.quantities, f"{self._drawn_as(number)}/{attempt}")
            if self.failures:
                values[FAILURE] = self.failures[(number - 1) % len(self.failures)]
            if accept is None or accept(values):
                return values
        raise TrialsError.because(
            "{accept} accepted none of {most_draws} draws: widen the ranges of the plan",
            accept=str(self.accept),
            most_draws=_MOST_DRAWS,
        )

    def seed_of(self, number: int) -> int:
        """Return the seed of noise and of the user's random numbers in a trial."""
        return random.Random(self._drawn_as(number)).getrandbits(31)

    def _drawn_as(self, number: int) -> str:
        # The first one has 0 there, so that a plan draws what it drew when trials counted from 0.
        return f"{self.seed}/{number - 1}"


class _File(Plan, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A plan as its file has it: names may be nested tables."""

    scene: dict[str, Any] = {}
    parameters: dict[str, Any] = {}


def read_plan(path: Path, *, document: Path | None = None) -> Plan:
    """Return the plan of a file; its document is absolute, or `document`, whatever the plan says.

    Raises TrialsError with file, line and key.
    """
    text, source = read_text(path, wrong_plan), str(path)
    file = parse_toml(text, _File, source, wrong_plan)
    fields: dict[str, Any] = {name: getattr(file, name) for name in Plan.__struct_fields__}
    for section in ("scene", "parameters"):
        fields[section] = read_quantities(fields[section], section, source, text, wrong_plan)
    plan = Plan(**fields)
    plan.check_names(partial(place_in, source, text))
    own = {name: each for name, each in plan.quantities.items() if not isinstance(each, Same)}
    for name, each in plan.quantities.items():
        if isinstance(each, Same) and each.same not in own:
            raise TrialsError.because(
                "{path}: {name}: there is no quantity {same} that has its own value",
                path=str(path),
                name=name,
                same=each.same,
            )
        if isinstance(each, Same) and not each.fits(own[each.same]):
            raise TrialsError.because(
                "{path}: {name}: {same} is no number, so it has no deviation",
                path=str(path),
                name=name,
                same=each.same,
            )
    if document is not None:
        return msgspec.structs.replace(plan, document=str(document))
    name = file.document or path.name.removesuffix(SUFFIX) + ".xml"
    document = path.parent / name
    if not document.is_file():
        raise TrialsError.because(
            "{path}: there is no document {document}: write document = ...",
            path=str(path),
            document=str(document),
        )
    return msgspec.structs.replace(plan, document=str(document))


def plan_of(path: Path, success: str | None = None, **changes: Any) -> Plan:  # noqa: ANN401 - fields of Plan
    """Return the plan in a file, or that of a document: of the file beside it, or one that varies nothing.

    `success` is the state that a trial must reach, and `changes` are other fields. Raises TrialsError.
    """
    beside = path if path.suffix == ".toml" else path.with_name(path.stem + SUFFIX)
    plan = read_plan(beside) if beside.is_file() else Plan(document=str(path))
    if success is not None:
        changes["success"] = msgspec.structs.replace(plan.success, state=success)
    return msgspec.structs.replace(plan, **changes)
