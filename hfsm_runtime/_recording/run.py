"""The runtime of a component whose run is recorded: all inputs and outputs are written down."""

from __future__ import annotations

import contextlib
import inspect
import logging
import platform
import random
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import msgspec

from hfsm_runtime.recording_file import messages
from hfsm_runtime.recording_file.messages import SOURCES, Action
from hfsm_runtime.recording_file.writer import RecordingFailedError, RecordingWriter
from zenoh_ice import ObjectPrx
from zenoh_ice.data import typed
from zenoh_ice.data.status import version_of
from zenoh_ice.data.text import sentence
from zenoh_ice.threads.clock import Clock

from .._automaton import Automaton
from .._marks import Mark
from .._runtime import Runtime
from .._timeline import Timeline
from ..component import Component, parameter_values, proxies_of, source_of
from ..errors import ComponentError, ComponentStoppedError, CycleCutError, ReloadRefusedError
from ..kinds import kinds_of
from ..places import kept_source
from ..tree import Actor, Phase, Replaced, Tree
from .clocks import InterceptedClock, InterceptedTime, InterceptedTimeline
from .recorder import LogRecorder, Recorder, automaton_context
from .transport import recorded_proxies

START: Final = "start"
"""The context of code before the first cycle."""
MONITOR: Final = "monitor"
"""The context of actions of the monitor."""

_logger = logging.getLogger(__name__)

_LARGEST_SOURCE: Final = 4 << 20
_PACKAGES: Final = ("visualhfsm", "eclipse-zenoh", "msgspec", "mcap")


@contextlib.contextmanager
def recording(component: Component, path: Path, *, with_images: bool = False) -> Iterator[Recorder]:
    """Record a component that is connected and has not run yet, during a `with` block.

    Give the recorder to a `RecordedRuntime`. Raises ComponentError when the file cannot be written, also at
    the end when it could not be written to its end.
    """
    start = time.time_ns()
    proxies = [vars(component).get(name) for name in proxies_of(component)]
    metadata = {
        "name": Path(component._hfsm_document).stem or type(component).__name__,
        "document": component._hfsm_document,
        "class": type(component).__name__,
        "module": type(component).__module__,
        "start": str(start),
        "random": random_state(),
        "images": "yes" if with_images else "no",
        "on_error": component._hfsm_on_error.value,
        "on_refused": component._hfsm_on_refused.value,
        "parameters": msgspec.json.encode(parameter_values(component)).decode(),
        "realm": next((proxy.ice_getRealm() for proxy in proxies if isinstance(proxy, ObjectPrx)), ""),
        "proxies": msgspec.json.encode({n: p.identity for n, p in proxies_of(component).items()}).decode(),
        "python": platform.python_version(),
        **{package: version_of(package) for package in _PACKAGES},
    }
    try:
        writer = RecordingWriter(path, metadata, _sources(component), start)
    except RecordingFailedError as error:
        raise ComponentError(str(error)) from error
    recorder = Recorder(writer.put, start)
    recorder.takes_images = lambda: with_images and not writer.crowded
    if not with_images:
        recorder.images_left_out = cache(_warn_of_images)
    log = LogRecorder(recorder)
    try:
        logging.getLogger().addHandler(log)
        with contextlib.ExitStack() as stack:
            stack.enter_context(recorded_proxies(component, recorder))
            stack.enter_context(InterceptedTime(recorder.ask).shown_to(type(component)))
            for kind in kinds_of(component).values():
                stack.enter_context(kind.recorded(component, recorder.ask))
            yield recorder
    finally:
        logging.getLogger().removeHandler(log)
        writer.close()
    if writer.trouble:
        raise ComponentError(writer.trouble)


def _warn_of_images(attribute: str) -> None:
    _logger.warning(
        "the images of self.%s are not recorded: code that looks at them can only be replayed if the run is "
        "recorded with --record-images",
        attribute,
    )


def random_state() -> str:
    """Return the states of the global random generators of Python and NumPy as JSON."""
    state: dict[str, Any] = {"python": random.getstate(), "numpy": None}
    numpy = sys.modules.get("numpy")
    if numpy is not None:
        kind, keys, *rest = numpy.random.get_state()
        state["numpy"] = [kind, keys.tolist(), *rest]
    return msgspec.json.encode(state).decode()


def restore_random(text: str) -> None:
    """Restore the recorded states of the random generators. Raises ValueError."""
    try:
        state = typed.from_json(text)
        version, internal, gauss = state["python"]
        random.setstate((version, tuple(internal), gauss))
        if state["numpy"] is not None:
            import numpy as np

            np.random.set_state(tuple(state["numpy"]))
    except (LookupError, TypeError, OverflowError, RecursionError, ImportError) as error:
        raise ValueError(f"the recorded state of the random numbers is malformed: {error}") from error


class _RecordedTree(Tree):
    """Automata whose cycles run one at a time."""

    def __init__(self, root: Automaton, recorder: Recorder) -> None:
        super().__init__(root)
        self._recorder = recorder
        self._lock = recorder.lock
        recorder.watch(self)

    def begin_cycle(self, actor: Actor) -> bool:
        if not (actor.active or actor.stepping):  # as it will most probably still be in a moment
            return False
        self._lock.acquire(automaton_context(actor.automaton.id))
        begun = super().begin_cycle(actor)
        if not begun:
            self._lock.release()
        return begun

    def end_cycle(self, actor: Actor) -> None:
        super().end_cycle(actor)
        self._lock.release()

    def reach(self, actor: Actor, phase: Phase) -> None:
        super().reach(actor, phase)
        if phase in (Phase.PAUSED, Phase.PAUSED_AT_CODE):
            self._recorder.reading("break", True)

    def wait_for_cycles(self, actor: Actor, timeout: float) -> list[Actor]:
        if not actor.below:
            return []
        with self._lock.released():
            late = super().wait_for_cycles(actor, timeout)
        self._recorder.reading("handover", [each.automaton.id for each in late])
        return late


class RecordedRuntime(Runtime):
    """The life of a component that is recorded."""

    def __init__(self, component: Component, clock: Clock, recorder: Recorder, **options: Any) -> None:  # noqa: ANN401 - of ComponentRun
        self._recorder = recorder
        timeline = InterceptedTimeline(clock, recorder.ask)
        with recorder.lock.held(START):
            super().__init__(
                component,
                InterceptedClock(clock, recorder.ask),
                timeline=timeline,
                tree=partial(_RecordedTree, recorder=recorder),
                **options,
            )
        self.record_snapshot = recorder.snapshot
        recorder.component_time = partial(Timeline.now, timeline)  # not recorded as a reading
        settings = {
            "on_error": self._supervision.on_error.value,
            "on_refused": self._supervision.on_refused.value,
            "periods": {str(actor.automaton.id): actor.automaton.interval for actor in self.tree.actors},
        }
        recorder.put("/actions", Action("made", settings))

    def start(self) -> None:
        """Start the automata."""
        self._recorder.action("start")
        super().start()

    def replace(
        self,
        component: Component,  # noqa: ARG002
        actors: tuple[Actor, ...],  # noqa: ARG002
        apply: Callable[[int], Replaced],  # noqa: ARG002
    ) -> float:
        """Raise ReloadRefusedError: a recording is of one document."""
        raise ReloadRefusedError(
            sentence(
                "a component that is recorded is not reloaded, as its recording is of one document: "
                "start it again without --record"
            )
        )

    def mark(self, mark: Mark) -> None:
        """Show a mark on the picture of a camera."""
        self._recorder.put("/marks", messages.Mark(*mark))
        super().mark(mark)

    @contextlib.contextmanager
    def action(self, kind: str, **arguments: object) -> Iterator[None]:
        """Record a control command, in a `with` block that executes it."""
        inside = self._recorder.lock.context is not None
        with self._recorder.lock.held(MONITOR):
            if not inside:  # otherwise it results from user code, or from a breakpoint
                if "value" in arguments:
                    arguments["json"] = _json(arguments.pop("value"))
                self._recorder.action(kind, **arguments)
            try:
                yield
            except ComponentError:
                if not inside:
                    self._recorder.action("refused", of=kind)
                raise

    def _sleep(self, seconds: float) -> None:
        ending = "done"
        try:
            with self._recorder.lock.released():
                super()._sleep(seconds)
        except ComponentStoppedError:
            ending = "stopped"
            raise
        except CycleCutError:
            ending = "cut"
            raise
        finally:
            self._recorder.reading("sleep", ending)


def _json(value: object) -> str:
    """Return a value as exact JSON; null for one that JSON lacks, because its receiver refuses it."""
    try:
        return msgspec.json.encode(value).decode()
    except (TypeError, ValueError, RecursionError):
        return "null"


def _sources(component: Component) -> dict[str, str]:
    """Return the files that make up the component, by attachment.

    They are the document, its imports, the component's Python, and the handwritten code beside it.
    """
    file = Path(source_of(component))
    document, python, by_hand, imported = SOURCES
    found: dict[str, Path] = {}
    if component._hfsm_document:
        path = file.parent / component._hfsm_document
        found[f"{document}/{path.name}"] = path
    found[f"{python}/{file.name}"] = file
    extension = file.with_name(f"{file.stem}_ext.py")
    classes = (base for base in type(component).__mro__ if base not in (object, Component))
    if extension.name in {Path(inspect.getfile(base)).name for base in classes}:
        found[f"{by_hand}/{extension.name}"] = extension
    names = kept_source(type(component).automaton.__globals__, str(file)).imported.values()
    found |= {f"{imported}/{name}": file.parent / name for name in names}
    texts: dict[str, str] = {}
    for name, path in found.items():
        with contextlib.suppress(OSError):  # it ran anyway, and replay reports what is missing
            if path.stat().st_size <= _LARGEST_SOURCE:
                texts[name] = path.read_bytes().decode("utf-8", "surrogateescape")
    return texts
