"""The table of requests: what handles each of them, and what it waits for."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

from visualhfsm._monitor.messages import Simulation
from visualhfsm.project._document import OpenDocument
from zenoh_ice.data import typed

from . import documents, edits, questions, steering
from . import protocol as p
from .views import TabEdit, TabRequest, TabStop, ViewedDocument
from .window import Window
from .workspace import Workspace

R = TypeVar("R", bound=p.Request)

Handle = Callable[[Workspace, Window, R], Awaitable[object]]
"""Executes a request of a window and returns its answer. Raises VisualHfsmError."""

_JUDGING_LIMIT: Final = 300.0
"""Longest time in s to judge a document, perhaps after others."""
_READING_LIMIT: Final = 150.0
"""Longest time in s to read a model: by two processes, and perhaps after others."""


class Lane(Enum):
    """What a request waits for. Each lane of requests that run beside others has its limit."""

    IN_ORDER = "after the earlier requests of its window"
    BESIDE = "beside others, begun in order"
    CODE_HELP = "beside others, and so often that it must not keep out a run"
    STOP_STARTED = "beside others, kept out by nothing"
    STOP = "for nothing, not even until earlier requests are begun"
    AT_ONCE = "for nothing, since it takes no time"


@dataclass(frozen=True, slots=True)
class Handler:
    """The handler of a type of requests."""

    handle: Handle[Any]
    lane: Lane
    limit: float | None = None
    """The longest duration in s; None for that of most operations."""
    for_viewers: bool = False
    """True if viewers may ask it: it reads what they are shown anyway, or stops what moves."""


async def _output_shown(_: Workspace, window: Window, _request: p.OutputShown) -> None:
    window.output_shown()


HANDLERS: Final[dict[type[p.Request], Handler]] = {}
"""The handlers of all requests."""


def _on(
    kind: type[R],
    handle: Handle[R],
    lane: Lane = Lane.IN_ORDER,
    limit: float | None = None,
    *,
    for_viewers: bool = False,
) -> None:
    HANDLERS[kind] = Handler(handle, lane, limit, for_viewers)


_on(p.AddReady, edits.add_ready)
_on(p.Follow, lambda w, window, r: w.components.follow(window, r.component), for_viewers=True)
_on(p.Body, lambda w, _, r: w.parts.followers.body(r.hash), Lane.BESIDE, for_viewers=True)
_on(p.CheckRobot, lambda w, _, r: w.own_robots.look(r.name, r.text), Lane.BESIDE, _READING_LIMIT)
_on(p.Close, documents.close)
_on(p.CodeHelp, questions.code_help, Lane.CODE_HELP)
_on(p.ConnectRobot, steering.connect_robot, Lane.BESIDE)
_on(p.Copy, edits.copy)
_on(p.Cut, edits.cut)
_on(p.Unfollow, lambda w, window, r: w.components.unfollow(window, r.component), for_viewers=True)
_on(p.Diff, questions.diff, Lane.BESIDE)
_on(p.Discard, documents.discard)
_on(p.Do, edits.do)
_on(
    p.EmergencyStop,
    lambda w, window, _: w.components.emergency_stop(window.kind),
    Lane.STOP,
    for_viewers=True,
)
_on(p.EndRobot, lambda w, _, _r: w.parts.robot.end(), Lane.BESIDE)
_on(
    p.ExplainMoment,
    lambda w, _, r: w.parts.followers.explanation(r.component, r.automaton, r.time),
    Lane.BESIDE,
    for_viewers=True,
)
_on(p.Export, questions.export, Lane.BESIDE)
_on(p.ExportRun, steering.export_run, Lane.BESIDE)
_on(
    p.Extract,
    lambda w, window, r: edits.change(w, r, OpenDocument.extract, r.automaton, r.path, window.number),
)
_on(p.Facts, lambda w, _, _r: w.parts.followers.facts(), Lane.BESIDE, for_viewers=True)
_on(p.Failures, questions.failures, Lane.BESIDE)
_on(p.Fixes, questions.fixes, Lane.CODE_HELP)
_on(p.Generate, lambda w, _, r: w.components.generate(w.tabs.get(r.tab)), Lane.BESIDE)
_on(p.GoTo, lambda w, window, r: edits.step(w, window, r, OpenDocument.go_to, r.revision))
_on(p.GuessRobot, lambda w, _, r: w.own_robots.guess(r.path), Lane.BESIDE, _READING_LIMIT)
_on(p.Hello, documents.hello, for_viewers=True)
_on(p.Identities, lambda w, _, _r: w.parts.followers.identities(), Lane.BESIDE)
_on(p.Imported, lambda w, _, r: questions.imported_by(w, w.tabs.get(r.tab)), Lane.BESIDE, for_viewers=True)
_on(p.Inline, lambda w, window, r: edits.change(w, r, OpenDocument.inline, r.automaton, window.number))
_on(p.Interfaces, lambda w, _, _r: w.code_questions.interfaces(w.project.root.directory), Lane.CODE_HELP)
_on(p.Judge, questions.judge, Lane.BESIDE, _JUDGING_LIMIT)
_on(p.ListFiles, documents.list_files, Lane.BESIDE)
_on(p.Locate, questions.locate, Lane.BESIDE)
_on(p.LookAtTests, lambda w, _, r: w.parts.tests.find(w.tabs.get(r.tab).source), Lane.BESIDE)
_on(p.Moment, lambda w, _, r: w.parts.followers.moment(r.component, r.time), Lane.BESIDE, for_viewers=True)
_on(p.MoveBalls, lambda w, _, r: w.parts.robot.move_balls(moving=r.moving), Lane.BESIDE)
_on(p.New, lambda w, window, r: documents.shown(w, partial(w.project.new, r.template, window.language)))
_on(p.Open, lambda w, _, r: documents.open_file(w, r.path))
_on(p.OpenText, lambda w, _, r: documents.shown(w, partial(w.project.open_text, r.name, r.text)))
_on(p.OutputShown, _output_shown, Lane.AT_ONCE, for_viewers=True)
_on(p.Paste, edits.paste)
_on(
    p.Picture,
    lambda w, _, r: w.parts.followers.picture(r.component, r.camera, r.at),
    Lane.BESIDE,
    for_viewers=True,
)
_on(p.Duplicate, edits.duplicate)
_on(p.PutOnShelf, edits.put_on_shelf)
_on(p.Record, lambda w, _, r: w.components.record(r.component, r.pictures))
_on(p.Recording, documents.open_recording, Lane.BESIDE)
_on(p.Recover, documents.recover)
_on(p.Redo, edits.redo)
_on(p.ResetEmergencyStop, lambda w, _, _r: w.parts.followers.reset_robot(), Lane.BESIDE)
_on(p.Resolve, documents.resolve)
_on(p.RosGraph, lambda w, _, _r: w.parts.followers.ros_graph(), Lane.BESIDE)
_on(p.Start, steering.start, Lane.BESIDE)
_on(p.StartTests, steering.start_tests, Lane.BESIDE)
_on(p.Save, documents.save)
_on(p.SaveAs, documents.save_as)
_on(p.SaveRobot, steering.save_robot, Lane.BESIDE)
_on(p.Search, questions.search, Lane.BESIDE, for_viewers=True)
_on(
    p.Series,
    lambda w, _, r: w.parts.followers.series(r.component, r.names, r.start, r.end, r.points),
    Lane.BESIDE,
    for_viewers=True,
)
_on(p.Share, documents.share)
_on(
    p.Simulate,
    lambda w, _, r: w.parts.robot.simulate(typed.convert(r, Simulation, from_attributes=True)),
    Lane.BESIDE,
)
_on(p.StandRobot, lambda w, _, _r: w.parts.followers.stand_robot(), Lane.BESIDE)
_on(p.StopPresent, lambda w, _, r: w.components.steer(r.component, "stop", {}), Lane.BESIDE)
_on(p.Stop, lambda w, window, r: w.parts.started.stop(r.tab, window.kind), Lane.STOP_STARTED)
_on(p.StopTests, lambda w, _, r: w.parts.tests.stop(r.tab), Lane.STOP_STARTED)
_on(p.Undo, edits.undo)


def _on_view(
    view: str, kind: type[TabRequest], handle: Callable[[Any, ViewedDocument], Awaitable[object]]
) -> None:
    async def handled(w: Workspace, window: Window, r: TabRequest) -> object:
        tab = w.tabs.get(r.tab)
        source = tab.source

        def save_copy(target: Path, overwrite: bool) -> Awaitable[object]:
            return tab.edit(OpenDocument.save_copy, target, overwrite=overwrite)

        def dates() -> None:
            tab.of_views[view].of = source.document

        document = ViewedDocument(
            source,
            window.language,
            w.project.root,
            in_thread=w.threads.do,
            save_copy=save_copy,
            recordings=w.components.recordings,
            work=w.parts.views.get(view),
            dates=dates,
        )
        return await handle(r, document)

    lane = Lane.STOP_STARTED if issubclass(kind, TabStop) else Lane.BESIDE
    _on(kind, handled, Lane.IN_ORDER if issubclass(kind, TabEdit) else lane)


for name, view in p.VIEWS.items():
    for asks, answers in view.requests.items():
        _on_view(name, asks, answers)
for steers in p.Steering.__subclasses__():
    _on(steers, steering.steer, Lane.BESIDE)
for sets in p.SceneRequest.__subclasses__():
    _on(sets, steering.set_scene, Lane.BESIDE)
for fails in p.FaultRequest.__subclasses__():
    _on(fails, steering.set_faults, Lane.BESIDE)
