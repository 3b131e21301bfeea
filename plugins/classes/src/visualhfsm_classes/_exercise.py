"""An exercise: a folder with a task, trials that pupils see and others that they do not, and criteria.

plugins/classes/docs/class.md describes the files of the folder.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Final

from msgspec import Meta, Struct
from msgspec.structs import replace

from visualhfsm.trials import SUFFIX, Function, Plan, read_plan
from visualhfsm_classes._errors import GradingError, wrong_exercise
from zenoh_ice.data.toml_file import parse_toml, place, read_text

FILE: Final = "exercise.toml"
START: Final = "start.xml"
VISIBLE: Final = "trials"
"""The name of the plan that pupils see."""
_HIDDEN: Final = "hidden"
SOLUTION: Final = "solution/solution.xml"
_MISTAKES: Final = "mistakes"

Language = Annotated[str, Meta(pattern=r"^[a-z]{2,3}\Z", description="write a language code, such as en")]
Words = dict[Language, Annotated[str, Meta(min_length=1, max_length=500)]]
"""A text in each language."""
Points = Annotated[float, Meta(ge=0, le=1000, description="write points from 0 to 1000")]


class Criterion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What earns points: a state that is entered in time, or what a function of the teacher's judges."""

    asks: Words
    """The task, in words."""
    points: Annotated[float, Meta(gt=0, le=1000, description="write points above 0, at most 1000")]
    state: str | None = None
    """Name or path of a state that must be entered, or be current already."""
    after: str | None = None
    """The disturbance after which that counts; else from the start on."""
    within: Annotated[float, Meta(gt=0, le=86_400, description="write seconds above 0")] | None = None
    """In at most so many s."""
    judge: Function | None = None
    """A function of the run: returns its share of the points from 0 to 1, and why, in words."""
    trials: tuple[str, ...] = ()
    """The plans whose trials count, such as `trials` and `hidden/far`; all by default."""

    def __post_init__(self) -> None:
        if (self.state is None) == (self.judge is None):
            raise ValueError("a criterion has either state or judge")
        if self.state is None and (self.after is not None or self.within is not None):
            raise ValueError("after and within belong to state")


class _File(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    title: Words
    criteria: tuple[Criterion, ...]
    robots: tuple[str, ...] = ()
    events: dict[str, Words] = {}
    mistakes: dict[str, Points] = {}


class Exercise(Struct, frozen=True, kw_only=True):
    """An exercise that was read."""

    folder: Path
    name: str
    languages: tuple[str, ...]
    """The languages of its title, the first one by default."""
    title: Mapping[str, str]
    criteria: tuple[Criterion, ...]
    robots: tuple[str, ...]
    """The bodies of which its solution earns all points; empty if the exercise does not say."""
    plans: Mapping[str, Plan]
    """By name: `trials`, `hidden/far`; their document is a placeholder, and each goes on to its limit."""
    events: Mapping[str, Mapping[str, str]]
    """The disturbances in words, by their name."""
    mistakes: Mapping[str, float]
    """The points that each document in `mistakes/` is expected to earn, by name."""

    @property
    def points(self) -> float:
        """The most points."""
        return sum(each.points for each in self.criteria)

    @property
    def start(self) -> Path | None:
        """The document that pupils begin with; None for an empty one."""
        path = self.folder / START
        return path if path.is_file() else None

    @property
    def solution(self) -> Path:
        """The document that earns all points."""
        return self.folder / SOLUTION

    def mistake(self, name: str) -> Path:
        """Return a document with a typical mistake."""
        return self.folder / _MISTAKES / f"{name}.xml"

    def task(self, language: str) -> Path:
        """Return the file with the task in a language."""
        return self.folder / f"task.{language}.md"

    def language(self, wanted: str) -> str:
        """Return a language if there is a task in it, else the first one."""
        return wanted if wanted in self.languages else self.languages[0]


def read_exercise(folder: Path) -> Exercise:
    """Return the exercise in a folder. Raises GradingError, or TrialsError, with file, line and key."""
    path = folder / FILE
    if not path.is_file():
        raise GradingError.because(
            "{folder} is no exercise: there is no {file}", folder=str(folder), file=FILE
        )
    text, source = read_text(path, wrong_exercise), str(path)
    file = parse_toml(text, _File, source, wrong_exercise)
    plans = {name: _read_plan(each) for name, each in _plan_files(folder).items()}
    exercise = Exercise(
        folder=folder,
        name=folder.resolve().name,
        languages=tuple(file.title),
        title=file.title,
        criteria=file.criteria,
        robots=file.robots,
        plans=plans,
        events=file.events,
        mistakes=file.mistakes,
    )
    _check(exercise, source, text)
    return exercise


def _plan_files(folder: Path) -> dict[str, Path]:
    """Return the files of the plans by name."""
    visible, hidden = folder / f"{VISIBLE}.toml", folder / _HIDDEN
    if not visible.is_file():
        raise GradingError.because(
            "{folder}: there is no {visible}, the trials that pupils see",
            folder=str(folder),
            visible=visible.name,
        )
    names = {
        f"{_HIDDEN}/{each.name.removesuffix(SUFFIX)}": each for each in sorted(hidden.glob(f"*{SUFFIX}"))
    }
    return {VISIBLE: visible, **names}


def _read_plan(path: Path) -> Plan:
    plan = read_plan(path, document=Path())  # that of each submission takes its place
    if plan.accept or plan.numbers or plan.samples or plan.success.function:
        raise GradingError.because(
            "{path}: the trials of an exercise call no functions, since these are looked for "
            "beside a document: write a criterion with judge = ... in {file}",
            path=str(path),
            file=FILE,
        )
    return replace(plan, success=replace(plan.success, state=None))  # criteria may look at what comes after


def _check(exercise: Exercise, source: str, text: str) -> None:
    """Raise GradingError for what is missing, or named and not there."""
    if not exercise.languages:
        raise GradingError.because(
            "{place}: write a title, such as en = 'Two states'", place=place(source, text, "title")
        )
    if not exercise.criteria:
        raise GradingError.because("{source}: criteria is empty: write what earns points", source=source)
    for name, plan in exercise.plans.items() if exercise.robots else ():
        bodies = plan.scene.get("body", ())
        for body in bodies if isinstance(bodies, tuple) else (bodies,):
            if body not in exercise.robots:
                raise GradingError.because(
                    "{source}: the plan {name} has the body {body}, and the exercise is for {robots}",
                    source=source,
                    name=name,
                    body=str(body),
                    robots=", ".join(exercise.robots),
                )
    for name, plan in exercise.plans.items():
        for file in plan.files:
            if not (exercise.folder / file).is_file():
                raise GradingError.because(
                    "{folder}: there is no {file}, which the plan {name} names",
                    folder=str(exercise.folder),
                    file=file,
                    name=name,
                )
    for language in exercise.languages:
        if not exercise.task(language).is_file():
            raise GradingError.because(
                "{source}: title.{language}: there is no {name}",
                source=source,
                language=language,
                name=exercise.task(language).name,
            )
    for index, criterion in enumerate(exercise.criteria):
        _check_words(exercise, criterion.asks, place(source, text, "criteria", index, "asks"))
        for name in criterion.trials:
            if name not in exercise.plans:
                raise GradingError.because(
                    "{place}: there is no plan {name}; there is {plans}",
                    place=place(source, text, "criteria", index, "trials"),
                    name=name,
                    plans=", ".join(exercise.plans),
                )
        if criterion.after is not None:
            _check_event(exercise, criterion, place(source, text, "criteria", index, "after"))
    for name, words in exercise.events.items():
        _check_words(exercise, words, place(source, text, "events", name))
    for name in exercise.mistakes:
        if not exercise.mistake(name).is_file():
            raise GradingError.because(
                "{place}: there is no {mistake}",
                place=place(source, text, "mistakes", name),
                mistake=str(exercise.mistake(name)),
            )


def _check_words(exercise: Exercise, words: Mapping[str, str], where: str) -> None:
    missing = [each for each in exercise.languages if each not in words]
    if missing:
        raise GradingError.because(
            "{where}: it has no words in {missing}, as the title has", where=where, missing=", ".join(missing)
        )


def _check_event(exercise: Exercise, criterion: Criterion, where: str) -> None:
    for name in criterion.trials or exercise.plans:
        if criterion.after not in exercise.plans[name].disturbances:
            raise GradingError.because(
                "{where}: the plan {name} has no disturbance {after}: write it there, or trials = "
                "[...] for those that have it",
                where=where,
                name=name,
                after=str(criterion.after),
            )
    if criterion.after not in exercise.events:
        raise GradingError.because(
            "{where}: write what it is called: [events.{after}] en = ...",
            where=where,
            after=str(criterion.after),
        )
