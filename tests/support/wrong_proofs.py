"""Documents whose proofs are wrong on purpose: the analysis is made to forget something that runs do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple
from xml.sax.saxutils import escape

import pytest

from codegen.hfsm._definitions import Answer
from codegen.hfsm._effects import CodeEffects
from codegen.hfsm._piece_effects import Effects
from codegen.hfsm.document import Text
from codegen.hfsm.model_checker import ModelReport, Verdict, check_model
from codegen.hfsm.model_checker._fireability import Fireability, fireability_of

__all__ = ["ALL", "Wrong"]

_RELIED = "codegen.hfsm.model_checker._relied"

Patch = Callable[[pytest.MonkeyPatch], None]


class Wrong(NamedTuple):
    """A document, what makes its proofs wrong, and a pattern of what is reported."""

    text: str
    patch: Patch
    reported: str


def _state(
    id: int, name: str, *, initial: bool = False, final: bool = False, inside: str = "", **code: Any
) -> str:
    parts = "".join(f"<{part}>{escape(text)}</{part}>" for part, text in code.items())
    flags = "<final>true</final>" * final
    start = ' initial="true"' * initial
    return f'<state{start} id="{id}"><name>{name}</name>{inside}{parts}{flags}</state>\n'


def _owns(child: int) -> str:
    return f"<idSubautomataSon>{child}</idSubautomataSon>"


def _on(id: int, origin: int, to: int, kind: str, trigger: str, guard: str = "", code: str = "") -> str:  # noqa: PLR0917
    return (
        f'<transition id="{id}"><origin>{origin}</origin><destiny>{to}</destiny>'
        f'<trans type="{kind}">{escape(trigger)}</trans><guard>{escape(guard)}</guard>'
        f"<transcode>{escape(code)}</transcode></transition>\n"
    )


def _sub(id: int, father: int, *parts: str, more: str = "") -> str:
    period = "<iteration_time>20</iteration_time>"
    return f'<SubAutomata id="{id}" idFather="{father}">{period}\n{"".join(parts)}{more}</SubAutomata>\n'


def _document(*parts: str, stated: tuple[str, str, str] | None = None) -> str:
    properties = ""
    if stated is not None:
        kind, expression, within = stated
        properties = (
            f'<properties><property kind="{kind}"><name>stated</name><within>{within}</within>'
            f"<expression>{escape(expression)}</expression></property></properties>"
        )
    return f"<VisualHFSM>{properties}\n{''.join(parts)}</VisualHFSM>\n"


def _forget(matches: Callable[[str], bool], **changes: Any) -> Patch:
    """Return what changes the effects of the code that matches, and forgets that some code is unclear."""

    def patch(monkeypatch: pytest.MonkeyPatch) -> None:
        right = CodeEffects.of

        def wrong(self: CodeEffects, text: Text) -> Effects:
            found = right(self, text)
            return replace(found, **changes) if matches(text.text) else found

        monkeypatch.setattr(CodeEffects, "of", wrong)
        monkeypatch.setattr(CodeEffects, "unclear_sends", ())

    return patch


_NO_EVENTS = _forget(lambda _: True, events={}, any_event=[])
_GO = 'self.send("go")'
_WAITING = _state(2, "run") + _on(1, 1, 2, "event", "go")
_ASKS = r"the state `ask` sent `go`"


def _sends(*parts: str, reported: str = _ASKS, more: str = "") -> Wrong:
    return Wrong(_document(_sub(1, 0, *parts, _WAITING, more=more)), _NO_EVENTS, reported)


def _hides(state: str, more: str = "") -> Wrong:
    return _sends(_state(1, "ask", initial=True, code=state), more=more)


def _in_child(leaves: int, **code: Any) -> str:
    """Return a document that owns an automaton with a state `child`, and leaves its owner after these ms."""
    return _document(
        _sub(
            1,
            0,
            _state(1, "ask", initial=True, inside=_owns(2) + "<history>restart</history>"),
            _WAITING,
            _state(3, "left"),
            _on(2, 1, 3, "time", str(leaves)),
            _on(3, 3, 2, "event", "go"),
        ),
        _sub(2, 1, _state(1, "child", initial=True, **code)),
    )


_ARGUMENT = f'<argument name="far">{escape(_GO)} or 1</argument>'
_INPUT = "<input><name>far</name><type>int</type></input>"


def _steady(first: str, second: str, rest: str = "") -> Wrong:
    """Return a document with two guards that are one atom, which gives another answer each time."""
    states = _state(1, "ask", initial=True) + _state(2, "run") + _state(3, "left")
    functions = escape(
        "def flips(self):\n    self.n = getattr(self, 'n', 0) + 1\n    return self.n % 2 == 0\n"
    )
    guards = _on(1, 1, 2, "condition", first) + _on(2, 1, 3, "condition", second)
    text = _document(_sub(1, 0, states, guards, rest, more=f"<functions>{functions}</functions>"))
    patch = _forget(lambda text: "flips()" in text, answer=Answer.SAME)
    return Wrong(text, patch, "guards out of the state `ask` contradict each other")


def _impossible(*, states: bool) -> Patch:
    """Return what lets the bounds of automata forget their second state, or the first transition."""

    def patch(monkeypatch: pytest.MonkeyPatch) -> None:
        def wrong(*given: Any) -> Fireability:
            found = fireability_of(*given)
            if states:
                return replace(found, states=tuple(each - {1} for each in found.states))
            return replace(found, transitions=tuple(each - {0} for each in found.transitions))

        monkeypatch.setattr(f"{_RELIED}.fireability_of", wrong)

    return patch


def _holds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every property be proved, whatever the times."""

    def wrong(*given: Any, **named: Any) -> ModelReport:
        report = check_model(*given, **named)
        proved = tuple(replace(each, verdict=Verdict.HOLDS) for each in report.properties)
        return replace(report, properties=proved)

    class _Held:
        verdict = Verdict.HOLDS

    monkeypatch.setattr(f"{_RELIED}.check_model", wrong)
    monkeypatch.setattr(f"{_RELIED}.check_property", lambda *_: _Held)


def _states(kind: str, expression: str, within: str = "") -> Wrong:
    states = _state(1, "ask", initial=True) + _state(2, "run", inside=_owns(2))
    below = _state(1, "begin", initial=True) + _state(2, "end", final=True) + _on(1, 1, 2, "time", "60")
    parts = _sub(1, 0, states, _on(1, 1, 2, "time", "60")), _sub(2, 1, below)
    text = _document(*parts, stated=(kind, expression, within))
    return Wrong(
        text,
        _holds,
        r"the proof of `stated` is wrong here: `stated` does not hold at \d+\.\d+ s, in (ask|run)",
    )


_TWO = _state(1, "ask", initial=True) + _state(2, "run") + _on(1, 1, 2, "time", "60", "n > 0")
_TWO += _on(2, 1, 2, "condition", "not n > 0 and n > 5") + "<variables>n = 1</variables>"

ALL = {
    "code": _sends(_state(1, "ask", initial=True, code=_GO)),
    "entry": _sends(_state(1, "ask", initial=True, entry=_GO)),
    "exit": _sends(_state(1, "ask", initial=True, exit=_GO), _state(3, "x"), _on(2, 1, 3, "time", "60")),
    "guard": _sends(
        _state(1, "ask", initial=True), _state(3, "x"), _on(2, 1, 3, "condition", f"{_GO} or False")
    ),
    "code of a transition": _sends(
        _state(1, "first", initial=True), _state(3, "ask"), _on(2, 1, 3, "time", "60", code=_GO)
    ),
    "argument": Wrong(
        _document(
            _sub(1, 0, _state(1, "ask", initial=True, inside=_owns(2) + _ARGUMENT), _WAITING),
            _sub(2, 1, _state(1, "x", initial=True), more=_INPUT),
        ),
        _NO_EVENTS,
        _ASKS,
    ),
    "child": Wrong(_in_child(60_000, code=_GO), _NO_EVENTS, "the state `child` sent `go`"),
    "exit of a child": Wrong(_in_child(2000, exit=_GO), _NO_EVENTS, _ASKS),
    "function": _hides("self.asks()", f"<functions>def asks(self):\n    {_GO}\n</functions>"),
    "text that is put together": _hides('getattr(self, "se" + "nd")("g" + "o")'),
    "list of functions": _hides('[self.send][0]("go")'),
    "thread": Wrong(
        _document(
            _sub(
                1,
                0,
                _state(
                    1,
                    "ask",
                    initial=True,
                    code="t = Thread(target=self.send, args=['go'])\nt.start()\nt.join()",
                ),
                _WAITING,
            )
        ).replace(
            "</VisualHFSM>", "<libraries><lib>from threading import Thread</lib></libraries></VisualHFSM>"
        ),
        _NO_EVENTS,
        "code outside of cycles sent `go`",
    ),
    "one state of two": Wrong(
        _document(
            _sub(
                1,
                0,
                _state(1, "first", initial=True, code=_GO),
                _state(2, "ask", code='self.send("g" "o")'),
                _on(1, 1, 2, "event", "go"),
            )
        ),
        _forget(lambda text: '"g" "o"' in text, events={}),
        _ASKS,
    ),
    "guards that are both false": _steady("self.flips()", "not self.flips()"),
    "guards of one text": _steady("self.flips()", "self.flips()"),
    "guards whose parts are both false": _steady(
        "self.flips() or len('') > 0", "not self.flips() and not len('') > 0"
    ),
    "guards beside a timer": _steady("self.flips()", "not self.flips()", _on(3, 1, 3, "time", "1")),
    "transition": Wrong(_document(_sub(1, 0, _TWO)), _impossible(states=False), "transition 1 fired, which"),
    "state": Wrong(
        _document(_sub(1, 0, _TWO)), _impossible(states=True), "the state `run` was entered, which"
    ),
    "never": _states("never", "run"),
    "always": _states("always", "ask or run/begin"),
    "never, in time": _states("never", "active(run)", "10000"),
    "eventually, in time": _states("eventually", "run/end", "70"),
    "finished": _states("always", "not finished(#2)"),
}
"""The documents by what is forgotten."""
