"""What an agent may do with a project and its robot: the tools of the server, as methods.

Each returns JSON. What others have written, such as names, notes, logs and texts of errors, stands there in
the field `data` alone; all other text is ours.
"""

from __future__ import annotations

import re
import threading
import time
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

import interfaces
from interfaces.hfsm import HfsmMonitorPrx
from interfaces.jderobot import CameraPrx
from interfaces.nao import SafetyPrx
from visualhfsm import OpenDocument, Project, Verdict, decode_command
from visualhfsm.plugins import MONITOR_PREFIX, digest_of, find_documents, summary
from visualhfsm.trials import LocalPool, Series, make_archive, plan_of
from zenoh_ice import Communicator, Settings, initialize
from zenoh_ice.data import typed

from . import _simulation
from ._approval import Approvals, folder_in
from ._limits import AgentError, read_limits
from ._lock import lock
from ._run import LimitedRun, Prepared
from ._simulation import png_of

_DECLARED: Final = re.compile(r"^\s*interface (\w+)", re.MULTILINE)
_PAGE: Final = 20_000
"""Characters of a document that are returned at a time."""
_MOST_COMMANDS: Final = 500
_LARGEST: Final = 1 << 20
"""Most characters of the commands of a step."""

_LINK: Final = 2.0
"""s in which the servants of a realm are seen."""
_LINK_PERIOD: Final = 0.02

AUTHOR: Final = "agent"
"""Its name in *Undo* of a page."""
PNG: Final = "png"
"""The field of an answer that has a picture, in base 64."""

Answer = dict[str, Any]


class Desk:
    """A project, the verdicts on its documents, and the one behavior that runs. Thread-safe; close it."""

    def __init__(self, root: Path, settings: Settings, *, patience: float = 60.0) -> None:
        self._root = root.resolve()
        self._patience = patience
        """Wall time that a run in virtual time may take, in s, and as long the tests."""
        self._settings = settings
        journals = folder_in(self._root) / "journals"
        self._project = Project(self._root, journals=journals, author=AUTHOR)
        self._lock = threading.RLock()
        self._verdicts: dict[Path, Verdict] = {}
        self._steps: dict[Path, list[int]] = {}
        """The revisions before each step of the agent."""
        self._simulations = _simulation.processes()
        self._approvals = Approvals(self._root)
        self._connecting = threading.Lock()
        """Held instead of the other one, so that a stop waits for no verdict."""
        self._communicator: Communicator | None = None
        self._run: LimitedRun | None = None

    def close(self) -> None:
        """Stop what runs, and end all processes."""
        if self._run is not None:
            self._run.stop("the end of the agent")
        self._simulations.close()
        self._project.close()
        if self._communicator is not None:
            self._communicator.destroy()

    # -- read ----------------------------------------------------------------------------------------------

    def project(self) -> Answer:
        """List the documents of the project, and what a person allows on a robot."""
        found = [str(each.relative_to(self._root)) for each in find_documents(self._root)]
        limits = msgspec.to_builtins(read_limits(self._root))
        return {"limits": limits, "data": {"documents": found[:1000]}}

    def document(self, path: str, since: int = -1, offset: int = 0) -> Answer:
        """Return a document as XML, a page at a time, unless its revision is still the one in `since`."""
        with self._lock:
            document = self._open(path)
            version, text = document.version, document.text()
        answer: Answer = {"revision": version.revision, "unchanged": version.revision == since}
        if answer["unchanged"]:
            return answer
        end = min(max(offset, 0) + _PAGE, len(text))
        steps = [each.name for each in version.undo if each.revision > since] if since >= 0 else []
        return {
            **answer,
            "next_offset": end if end < len(text) else None,
            "data": {"text": text[max(offset, 0) : end], "steps_since": steps},
        }

    def interface(self, name: str = "") -> Answer:
        """Return the IDL file that declares an interface such as PoseHead; without a name, list them all."""
        folders = [*map(Path, interfaces.__path__), self._root / "interfaces"]
        files = [file for folder in folders for file in sorted(folder.glob("*.idl"))]
        declared = {word: file for file in files for word in _DECLARED.findall(file.read_text("utf-8"))}
        if name not in declared:
            return {"data": {"interfaces": sorted(declared)}}
        return {"data": {"idl": declared[name].read_text("utf-8")}}

    def robot(self) -> Answer:
        """Say what is served in the realm, and whether anybody may command the robot."""
        realm, until = self._realm(), time.monotonic() + _LINK
        while not realm.identities() and time.monotonic() < until:  # it may have just been connected
            time.sleep(_LINK_PERIOD)
        answer: Answer = {"present": "Safety" in realm.identities(), "data": {"servants": realm.identities()}}
        if answer["present"]:
            safety = SafetyPrx.uncheckedCast(realm.stringToProxy("Safety")).getSafetyState()
            answer |= {"emergency_stop": safety.stopped, "held_by_somebody": bool(safety.holder)}
            answer["data"] |= {"why_stopped": safety.reason, "holder": safety.holder}
        return answer

    def picture(self, path: str, automaton: int = 0) -> Answer:
        """Draw an automaton of a document, by its id, as SVG; 0 is the root."""
        with self._lock:
            return {"data": {"svg": self._open(path).svg(automaton or None)}}

    def camera(self, identity: str = "Camera") -> Answer:
        """Return the picture of a camera of the robot, in RGB."""
        image = CameraPrx.uncheckedCast(self._realm().stringToProxy(identity)).getImageData("RGB8")
        size = image.description.width, image.description.height
        return {"time": image.timeStamp.seconds, PNG: png_of(bytes(image.pixelData), size)}

    # -- edit ----------------------------------------------------------------------------------------------

    def edit(self, path: str, commands: list[dict[str, Any]]) -> Answer:
        """Change a document by the commands of the editor, all or none, as one step; save it.

        A document that is not there is made. A command is {"command": "addState", "automaton": 1, "x": 150,
        "y": 150, "name": "wait"}; a refusal lists the others, or their fields; their schema is the resource
        visualhfsm://commands.
        """
        content = msgspec.json.encode(commands)
        if len(commands) > _MOST_COMMANDS or len(content) > _LARGEST:
            raise AgentError.because("a step has at most {limit} commands, and 1 MiB", limit=_MOST_COMMANDS)
        several = [decode_command(each) for each in typed.from_json(content, list[msgspec.Raw])]
        with self._lock:
            document = self._open(path, make=True)
            before, file = document.version.revision, self._file(path)
            try:
                change = document.apply(several)
                document.save(None if document.path else file)
            except BaseException:
                if document.path is None:
                    document.close(discard=True)
                elif document.version.revision != before:
                    document.go_to(before)
                raise
            self._steps.setdefault(file, []).append(before)
            added = msgspec.to_builtins(change.added)
            return {"revision": document.version.revision, "added": added}

    def undo(self, path: str) -> Answer:
        """Undo the agent's last step in a document, with what was changed after it; save it."""
        with self._lock:
            document, steps = self._open(path), self._steps.get(self._file(path), [])
            if not steps:
                raise AgentError.because("there is no step of the agent to undo")
            document.go_to(steps.pop())
            document.save()
            return {"revision": document.version.revision}

    # -- judge and try -------------------------------------------------------------------------------------

    def verdict(self, path: str, seconds: float = 10.0) -> Answer:
        """Say whether a document is ready to drive a robot, or what is not, in the order of what to mend."""
        with self._lock:
            document, file = self._open(path), self._file(path)
            self._verdicts.pop(file, None)
            found = document.verdict(
                seconds=_within(seconds), patience=self._patience, allow=lambda it: Prepared(it).close()
            )
            self._verdicts[file] = found
        return {"ready": found.ready, "tests": found.tests, "data": msgspec.to_builtins(found, enc_hook=str)}

    def simulate(
        self,
        path: str,
        seconds: float = 10.0,
        robot: Literal["fake", "sim"] = "fake",
        picture: bool = False,
    ) -> Answer:
        """Run a document in virtual time, with the fake robot or with physics; say what happened.

        The answer has the timeline, calls, variables, joints, and a picture of the robot's camera as PNG.
        """
        with self._lock:
            self._open(path)
            with Prepared(make_archive(self._file(path))) as prepared:
                document = str(prepared.document)
                asked = _simulation.Question(document, _within(seconds), robot, picture)
                found = self._simulations.ask(asked, _simulation.PATIENCE)
        data = msgspec.to_builtins(found)
        png = data.pop("picture", "")
        return {"time": found.time, "failed": bool(found.error), "data": data, PNG: png}

    def trials(self, path: str, runs: int = 20, seconds: float = 30.0, success: str = "") -> Answer:
        """Run a document many times in simulation, by its plan if it has one; say how often it succeeds."""
        with self._lock:
            self._open(path)
            limits = {"runs": min(max(runs, 1), 1000), "limit": _within(seconds)}
            with Prepared(make_archive(self._file(path))) as prepared, LocalPool() as pool:
                series = Series(plan_of(prepared.document, success or None, **limits))
                outcomes = [*series.outcomes(series.plan.trials, pool)]
        failed = [each for each in outcomes if not each.success]
        listed = [
            {"number": each.number, "reason": each.reason, "states": each.states} for each in failed[:50]
        ]
        return {"trials": len(outcomes), "succeeded": len(outcomes) - len(failed), "data": {"failed": listed}}

    # -- run -----------------------------------------------------------------------------------------------

    def run(self, path: str) -> Answer:
        """Run a document on the robot of the realm; `watch` says what happens.

        Its verdict must be ready and nothing may have changed since; a person's agent.toml must allow it, and
        perhaps a person in the page: then ask again after that.
        """
        with self._lock:
            if self._run is not None and self._run.runs:
                raise AgentError.because("a behavior runs already: stop it first")
            file, limits = self._file(path), read_limits(self._root)
            found = self._verdicts.get(file)
            if found is None:
                raise AgentError.because("it has no verdict that says ready: ask for one")
            if not found.ready:
                raise AgentError.because("it is not ready: {message}", message=summary(found.reasons))
            archive = make_archive(file)
            if found.digest != digest_of(archive):
                del self._verdicts[file]
                raise AgentError.because("a file has changed since the verdict: ask for another one")
            prepared = Prepared(archive)
            try:
                limits.require(self._settings.realm, prepared.identities, len(found.undecided))
                realm = self._realm()
                with lock(folder_in(self._root) / "run.lock", 0.0) as held:
                    if limits.ask:
                        self._approvals.require(found.digest, path, limits.longest_run)
                    self._run = LimitedRun(prepared, realm, limits, self._settings.environment(), held)
            except BaseException:
                prepared.close()
                raise
        return self.watch(1.0)

    def watch(self, seconds: float = 0.0) -> Answer:
        """Say what the behavior and the robot do, or did, after some seconds at most, or at its end."""
        if self._run is None:
            raise AgentError.because("nothing was run")
        self._run.wait(min(max(seconds, 0.0), 60.0))
        return self._run.report()

    def why_not(self, automaton: int = 0) -> Answer:
        """Say of each transition out of the current state of an automaton why it has not fired."""
        if self._run is None or not self._run.runs:
            raise AgentError.because("no behavior runs")
        monitor = HfsmMonitorPrx.uncheckedCast(
            self._realm().stringToProxy(f"{MONITOR_PREFIX}{self._run.name}")
        )
        found = monitor.explain(automaton or monitor.getStructure().automata[0].id)
        return {"data": msgspec.to_builtins(found)}

    def stop(self, robot: bool = False) -> Answer:
        """Stop the behavior; with `robot` stop the robot, too, until a person lets it go on."""
        try:
            if robot:
                safety = SafetyPrx.uncheckedCast(self._realm().stringToProxy("Safety"))
                safety.emergencyStop("an agent asked for it")
        finally:  # a robot that does not answer is no reason to go on
            if self._run is not None:
                self._run.stop("the agent")
        return {"ran": False} if self._run is None else {"ran": True, **self._run.report()}

    # -- parts ---------------------------------------------------------------------------------------------

    def _file(self, path: str) -> Path:
        file = self._project.file(path)
        if any(part.startswith(".") for part in file.relative_to(self._root).parts):
            raise AgentError.because("hidden files and folders are none of the project")
        return file

    def _open(self, path: str, *, make: bool = False) -> OpenDocument:
        """Return a document as its file is now. Raises AgentError for one that cannot be read any more."""
        file = self._file(path)
        if make and not file.exists():
            if (gone := self._project.find(file)) is not None:
                gone.close(discard=True)
                self._steps.pop(file, None)
            return self._project.new()
        document = self._project.open(path)
        if document.refresh() != "same":
            raise AgentError.because("the file has changed, and is no document now, or gone")
        return document

    def _realm(self) -> Communicator:
        with self._connecting:
            if self._communicator is None:
                self._communicator = initialize(self._settings)
            return self._communicator


def _within(seconds: float) -> float:
    """Return how long a run in virtual time may last, in s, when it was asked to last so long."""
    return min(max(seconds, 0.1), 600.0)
