"""Help with code as the page gets it: real documents, with the real helper processes."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import psutil
import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.document import Text
from tests.support.documents import document, state, sub, transition
from tests.support.limits import END_LIMIT, EVENT_LIMIT, RUN_LIMIT, START_LIMIT
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._document.places import Place
from visualhfsm._editor.code_questions import CodeQuestions
from visualhfsm.project._code_help.service import CodeHelp
from visualhfsm.project._version import Version

CONFIG = (
    "<iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface>"
    "</iceinterface>"
)
HEAD = "<parameters><parameter><name>speed</name><type>float</type><default>0.3</default></parameter></parameters>"
TEXT = document(
    sub(
        1, 0, state(1, "walk", "steps += 1\ngoal = self.find('red')", initial=True, child=2), state(2, "stand"),
        transition(1, 1, 2, "steps > 3"), transition(2, 2, 1, "kick", type="event"),
        variables="steps = 0\nname = 'nao'",
        functions="def find(self, color):\n    '''Find a ball.'''\n    return 1.0, 2.0\n",
    ),
    sub(2, 1, state(1, "inside", "hidden = 1", initial=True), functions="def deep(self):\n    return 'x'\n"),
    libraries=("math", "numpy as np"), config=CONFIG, head=HEAD,
)  # fmt: skip
WALK = Place(kind="state", automaton=1, id=1, part="code")
GUARD = Place(kind="transition", automaton=1, id=1, part="trigger")
KICKED = Place(kind="transition", automaton=1, id=2, part="fired")
SLOW = "steps += 1\n" * 300 + "self."
VARIABLES = Place(kind="automaton", automaton=1, part="variables")
FUNCTIONS = Place(kind="automaton", automaton=1, part="functions")


def version(path: Path | None = None) -> Version:
    parsed = parse_document(TEXT, path or Path("walk.xml"), Diagnostics())
    assert parsed is not None
    return Version(
        revision=1,
        document=parsed,
        path=path,
        title="walk",
        dirty=False,
        is_unsaved=False,
        undo=(),
        redo=(),
    )


class Typing:
    """A user who types code; `|` is the cursor."""

    def __init__(self, helper: CodeHelp, path: Path | None = None) -> None:
        self.helper = helper
        self.questions = CodeQuestions(helper)
        self.version = version(path)

    async def options(self, place: Place, text: str) -> list[dict[str, Any]]:
        code, line, column = _at_cursor(text)
        found = await self.questions.ask(
            self, "complete", self.version, place, code, line=line, column=column
        )
        return list(found["options"]) if found else []

    async def labels(self, place: Place, text: str) -> list[str]:
        return [option["label"] for option in await self.options(place, text)]

    async def signature(self, place: Place, text: str) -> Any:
        code, line, column = _at_cursor(text)
        return await self.questions.ask(
            self, "signature", self.version, place, code, line=line, column=column
        )

    async def explanation(self, place: Place, text: str) -> Any:
        code, line, column = _at_cursor(text)
        return await self.questions.ask(self, "explain", self.version, place, code, line=line, column=column)


def _at_cursor(text: str) -> tuple[str, int, int]:
    before = text.partition("|")[0]
    return text.replace("|", ""), before.count("\n") + 1, len(before.rpartition("\n")[2])


class Type(Protocol):
    """Runs a coroutine function with a user who types into a document, which has a path if it is saved."""

    def __call__(self, go: Callable[[Typing], Awaitable[None]], path: Path | None = None) -> None: ...


@pytest.fixture(scope="module")
def typing() -> Iterator[Type]:
    """Run a coroutine function with a user who types; the helper processes are started once for all tests."""
    with asyncio.Runner() as runner, ThreadPoolExecutor(2) as threads:
        runner.get_loop().set_default_executor(threads)
        together = threading.Barrier(2)  # both threads start now, not during some test
        list(threads.map(lambda _: together.wait(EVENT_LIMIT), range(2)))
        helper = CodeHelp(START_LIMIT)

        async def warm() -> None:
            person = Typing(helper)
            await person.labels(WALK, "self.|")

        runner.run(warm())
        yield lambda go, path=None: runner.run(asyncio.wait_for(go(Typing(helper, path)), RUN_LIMIT))
        helper.close()


def alone(go: Callable[[Typing], Awaitable[None]]) -> None:
    """Run a coroutine function with a user who types, and with separate processes."""

    async def run() -> None:
        with contextlib.closing(CodeHelp(START_LIMIT)) as helper:
            await go(Typing(helper))

    asyncio.run(asyncio.wait_for(run(), RUN_LIMIT))


def test_what_the_document_gives_stands_first(typing: Type) -> None:
    async def go(person: Typing) -> None:
        labels = await person.labels(WALK, "self.|")
        assert set(labels[:4]) == {"Head", "deep", "find", "speed"}
        assert {"clock", "log", "send", "sleep"} <= set(labels)
        assert not any(label.startswith("_") for label in labels)
        assert not {"globalNamespace", "interfaces", "namespace", "rosNode"} & set(labels)
        assert not any(label.startswith("ice_") for label in await person.labels(WALK, "self.Head.|"))
        assert "ice_ping" in await person.labels(WALK, "self.Head.ice_|")
        assert await person.labels(WALK, "self.Hea|") == ["Head"]
        assert (await person.labels(WALK, "step|"))[0] == "steps"
        assert "atan2" in await person.labels(WALK, "math.at|")
        assert "array" in await person.labels(WALK, "np.arr|")

    typing(go)


def test_operations_come_with_their_documentation_and_streams_have_types(typing: Type) -> None:
    async def go(person: Typing) -> None:
        options: dict[str, dict[str, Any]] = {}
        while not {"setPose", "getPose"} <= {name for name, each in options.items() if "info" in each}:
            # Documentation that takes too long is left out at first, and is there once it has been read.
            options = {each["label"]: each for each in await person.options(WALK, "self.Head.|")}
        assert "Turn the head to a pose" in options["setPose"]["info"]
        assert options["setPose"]["detail"].startswith(
            "(pan: float, tilt: float, fraction: float) -> HeadPose"
        )
        assert "Return where the head points" in options["getPose"]["info"]
        assert list(options)[:2] == ["getLimits", "getPose"]  # before the casts, which every proxy has
        assert await person.labels(WALK, "self.Head.getPose().p|") == ["pan", "panSpeed"]
        assert await person.labels(WALK, "s = self.Head.getPose.latest()\ns.value.t|") == [
            "tilt",
            "tiltSpeed",
            "time",
        ]
        assert "pan" in await person.labels(WALK, "for s in self.Head.getPose.samples():\n    s.value.|")

    typing(go)


def test_every_kind_of_piece_sees_what_it_may_use(typing: Type) -> None:
    async def go(person: Typing) -> None:
        assert "upper" in await person.labels(WALK, "name.|")
        assert "bit_length" in await person.labels(GUARD, "steps > 2 and steps.|")
        assert "data" in await person.labels(KICKED, "event.|")
        assert "event" not in await person.labels(WALK, "eve|")
        assert "goal" in await person.labels(GUARD, "go|")
        assert "hidden" not in await person.labels(WALK, "hid|")
        assert "find" in await person.labels(VARIABLES, "x = self.fi|")
        assert await person.labels(FUNCTIONS, "def find(self, a):\n    return self.sp|") == ["speed"]
        assert "find" in await person.labels(
            FUNCTIONS, "def other(self):\n    self.fi|\n\ndef find(self): pass"
        )
        assert "upper" in await person.labels(WALK, "    if True:\n        name.up|")

    typing(go)


def test_only_what_is_of_use_is_offered(typing: Type) -> None:
    async def go(person: Typing) -> None:
        labels = await person.labels(WALK, "|")
        assert set(labels[:2]) == {"name", "steps"}
        assert "self" in labels
        # What only the generator uses, what it imports, and attributes of the component.
        internal = {"Automaton", "Component", "PoseHeadPrx", "Walk", "automaton", "main", "clock", "log"}
        assert not internal & set(labels)
        assert "automaton" not in await person.labels(WALK, "self.au|")
        assert "State" not in await person.labels(GUARD, "Sta|")
        assert "begin" in await person.labels(WALK, "self.Head.setPose.be|")
        assert "upper" in await person.labels(WALK, "if steps:\n    name = None\nname.up|")

    typing(go)


def test_code_beside_that_is_no_python_hides_nothing(typing: Type) -> None:
    async def go(person: Typing) -> None:
        automaton = person.version.document.automata[0]
        states = (replace(automaton.states[0], code=Text("goal = (")), *automaton.states[1:])
        functions = Text("def find(self, color):\n    return = 1\n\ndef lose(self):\n    pass\n")
        broken = replace(
            automaton, states=states, functions=functions, variables=Text("steps = 0\nname = = 1")
        )
        document = replace(person.version.document, automata=(broken, *person.version.document.automata[1:]))
        person.version = replace(person.version, document=document, revision=2)
        assert {"Head", "find", "lose", "speed"} <= set(await person.labels(GUARD, "self.|"))
        assert (await person.labels(GUARD, "step|"))[0] == "steps"

    typing(go)


def test_an_ellipsis_in_an_annotation_is_no_hindrance(typing: Type) -> None:
    async def go(person: Typing) -> None:
        assert "index" in await person.labels(WALK, "def f() -> tuple[int, ...]: ...\nf().in|")

    typing(go)


def test_a_call_shows_its_parameters(typing: Type) -> None:
    async def go(person: Typing) -> None:
        found = await person.signature(WALK, "self.Head.setPose(1.0, |")
        assert found["parameters"] == [
            "pan: float",
            "tilt: float",
            "fraction: float",
        ]
        assert found["active"] == 1
        assert found["result"] == "HeadPose"
        assert "fraction of its full speed" in found["documentation"]
        assert (await person.signature(WALK, "self.Head.getPose(|"))["name"] == "getPose"
        assert (await person.signature(WALK, "self.find(|"))["parameters"] == ["color"]
        assert await person.signature(WALK, "steps|") is None

    typing(go)


def test_a_name_shows_its_meaning(typing: Type) -> None:
    async def go(person: Typing) -> None:
        found = await person.explanation(WALK, "self.Head.|setPose(1.0)")
        assert found["name"] == "setPose"
        assert found["detail"].startswith("(pan: float, tilt: float, fraction: float) -> HeadPose")
        assert "fraction of its full speed" in found["documentation"]
        assert await person.explanation(WALK, "x = self.|find('red')") == {
            "name": "find",
            "detail": "(color)",
            "documentation": "Find a ball.",
        }
        assert "cosine" in (await person.explanation(GUARD, "math.|cos(1)"))["documentation"]
        for nothing in ("|steps += 1", "i|f steps: pass", "x = 1 |+ 2"):
            assert await person.explanation(WALK, nothing) is None

    typing(go)


def test_a_place_without_code_is_refused(typing: Type) -> None:
    async def go(person: Typing) -> None:
        for place in (
            Place(kind="state", automaton=1, id=9, part="code"),
            Place(kind="state", automaton=1, id=1, part="name"),
            Place(kind="document"),
        ):
            with pytest.raises(VisualHfsmError):
                await person.options(place, "x|")

    typing(go)


def test_code_is_read_and_never_run(typing: Type, tmp_path: Path) -> None:
    ran = tmp_path / "ran"
    evil = f"__import__('pathlib').Path({str(ran)!r}).touch()\n"
    (tmp_path / "helpers.py").write_text(f"{evil}\ndef useful():\n    '''Help.'''\n")
    (tmp_path / "walk_ext.py").write_text(f"{evil}\nclass WalkExtension:\n    extra = 1\n")

    async def go(person: Typing) -> None:
        assert await person.labels(WALK, "import helpers\nhelpers.use|") == ["useful"]
        assert "extra" in await person.labels(WALK, "self.ext|")
        await person.labels(WALK, f"{evil}self.|")
        await person.signature(WALK, f"{evil}self.find(|")

    typing(go, tmp_path / "walk.xml")
    assert not ran.exists()


def test_a_process_that_takes_too_long_or_dies_is_replaced_and_the_next_is_helped() -> None:
    async def go(person: Typing) -> None:
        others = set(psutil.Process().children())
        await person.labels(WALK, "self.|")  # what reads code is loaded
        person.helper._patience = 0.05
        with pytest.raises(VisualHfsmError, match="too long"):
            await person.labels(WALK, "value = [1, 2, 3]\n" * 8000 + "value.|")
        person.helper._patience = START_LIMIT
        assert "Head" in await person.labels(WALK, "self.|")

        (child,) = set(psutil.Process().children()) - others
        child.kill()
        psutil.wait_procs([child], END_LIMIT)
        assert "Head" in await person.labels(WALK, "self.|")

    alone(go)


def test_of_many_questions_only_the_newest_is_asked(typing: Type) -> None:
    async def go(person: Typing) -> None:
        await person.labels(WALK, "self.|")
        answers = await asyncio.gather(*(person.labels(WALK, "self.Hea|") for _ in range(12)))
        assert answers[-1] == ["Head"]
        assert answers.count([]) >= 9

    typing(go)


def test_a_question_that_is_out_of_date_ends_at_once(typing: Type) -> None:
    async def go(person: Typing) -> None:
        def ask() -> asyncio.Task[Any]:
            return asyncio.create_task(
                person.questions.ask(
                    person, "complete", person.version, WALK, SLOW, line=SLOW.count("\n") + 1, column=5
                )
            )

        asked = [ask() for _ in range(8)]
        ended, _ = await asyncio.wait(asked[1:-1], timeout=START_LIMIT, return_when=asyncio.ALL_COMPLETED)
        assert {task.result() for task in ended} == {None}, "what was not looked at is not without faults"
        assert not asked[0].done()
        asked[-1].cancel()  # one that waits gives up
        newest = ask()
        assert (await asked[0])["options"]
        assert (await newest)["options"]

    typing(go)


def test_each_of_several_windows_gets_an_answer_to_its_newest_question(typing: Type) -> None:
    async def go(person: Typing) -> None:
        async def ask(window: int, number: int) -> tuple[int, int, Any]:
            line = SLOW.count("\n") + 1
            found = await person.questions.ask(
                window, "complete", person.version, WALK, SLOW, line=line, column=5
            )
            return window, number, found

        asked = [ask(window, number) for number in range(3) for window in range(5)]
        answered = [(window, number) for window, number, found in await asyncio.gather(*asked) if found]
        assert answered == [(0, 0), *((window, 2) for window in range(5))]

    typing(go)


def test_the_interfaces_are_described(typing: Type) -> None:
    async def go(person: Typing) -> None:
        found = {each["scoped"]: each for each in await person.questions.interfaces(Path.cwd())}
        operations = {each["name"]: each for each in found["nao::PoseHead"]["operations"]}
        assert operations["getPose"]["streamed"]
        assert operations["setPose"]["signature"] == ("(self, pan: float, tilt: float, fraction: float)")
        assert "getImageData" in {each["name"] for each in found["jderobot::Camera"]["operations"]}

    typing(go)


def test_every_window_that_asks_gets_the_interfaces(typing: Type) -> None:
    async def go(person: Typing) -> None:
        first, *others = await asyncio.gather(*(person.questions.interfaces(Path.cwd()) for _ in range(4)))
        assert first
        assert others == [first] * 3

    typing(go)


def test_a_document_that_changes_is_read_again(typing: Type) -> None:
    async def go(person: Typing) -> None:
        assert "Body" not in await person.labels(WALK, "self.Bo|")
        interface = replace(person.version.document.interfaces[0], name="Body", type="Joints")
        changed = replace(person.version.document, interfaces=(interface,))
        person.version = replace(person.version, document=changed, revision=2)
        assert await person.labels(WALK, "self.Bo|") == ["Body"]

    typing(go)
