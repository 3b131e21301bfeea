"""Random documents whose code is drawn from the whole grammar of Python, and what in their runs refutes a proof.

A program has an aim: to send an event, to command a servant, to change a flag between two guards, or to answer
otherwise when it is asked again. It is composed of `python_forms` so that it reaches its aim, whatever way it
takes; hence what the model checker calls impossible happens if it has lost sight of that way.
"""

from __future__ import annotations

import random
import re
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import hfsm_runtime as runtime
from codegen.hfsm.document import Argument, Automaton, Document, Interface, Library, Parameter, Property, Result, Text, Transition
from codegen.hfsm.model_checker import ModelReport, Reachability, Verdict, check_model
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from tests.support.model_documents import after, automaton, document, on, state, stated, when
from tests.support.python_forms import FORMS, Form
from visualhfsm.simulation._loading import DocumentInvalid, forget, load_component

__all__ = ["Choices", "Found", "Program", "naive", "refuted", "shrunk"]

PATH: Final = Path("drawn.xml")
_MODULES: Final = (
    "collections concurrent.futures contextlib contextvars copy dataclasses enum functools inspect io itertools json"
    " math operator queue random re threading types weakref"
).split()
_EVENTS: Final = [("go", "al"), ("leg", 0), ("e", None), ("y", True), ("a b", "c"), ("n", 12)]
"""The halves of the names of events."""
_AIMS: Final = (*["event"] * 5, "command", "command", "flag", "variable", "flaky", "constant")
_OTHERS: Final = {
    "text": ["'decoy'"], "part": ["'decoy'", "None", "5", "False"], "flag": ["True", "None"], "flaky": ["True"],
    "true": ["0", "''"], "false": ["1", "'x'"], "me": ["None", "len"], "send": ["(lambda *_: None)", "str", "None"], "thunk": ["(lambda *_: None)", "dict", "None"],
}  # fmt: skip
_OPERATIONS: Final = {
    "command": ("self.Head.setSpeed", "setSpeed", "$me.Head"),
    "flag": ("self.flip", "flip", "$me"),
    "variable": ("flip", "", ""),
}
"""What an aim calls with a text: the usual expression, the name of the operation, and its object."""
_PLACES: Final = ("entry", "code", "exit", "transition", "second", "below", "guard")
_AUTOMATA: Final = {**dict.fromkeys([*_PLACES, "data"], 2), "below": 5, "guarded": 4, "change": 4}
"""The places of code, and the automata to which they belong."""
_OPERATION: Final = re.compile(r"\$(op|owner)\b")
_ACTS: Final = re.compile(r"\$(act|do|send|thunk|base|read)\b")
_LETTER: Final = re.compile(r"\$([A-Za-z])\b")
_AWAITED: Final = ("text", "part", "true", "false", "send", "thunk")
"""What may be assigned later than it is used first."""
_CARRIED: Final = ("text", "part", "true", "false", "me", "send", "thunk")
_HOLE: Final = re.compile(r"\$(\w+)")
_THREAD_LIMIT: Final = 5.0
"""How long a thread of a program may take, in s."""


class Choices:
    """Numbers that decide a program: first those of a list, then random ones, or 0 without a `seed`."""

    def __init__(self, made: Sequence[int] = (), seed: int | None = None) -> None:
        self._given: Final = tuple(made)
        self._random: Final = None if seed is None else random.Random(seed)
        self.made: Final[list[int]] = []

    def below(self, count: int) -> int:
        """Return a number below `count`; 0 decides for what is plainest."""
        place = len(self.made)
        if place < len(self._given):
            number = self._given[place] % count
        else:
            number = 0 if self._random is None else self._random.randrange(count)
        self.made.append(number)
        return number

    def one_of(self, values: Sequence[Any]) -> Any:
        """Return one of some values."""
        return values[self.below(len(values))]


class _NoForm(Exception):
    """No form fits a place."""


class Program:
    """A document drawn by choices, its aim, and the forms that it is composed of."""

    def __init__(self, choices: Choices) -> None:
        self._choices: Final = choices
        self.forms: Final[list[str]] = []
        self._functions: Final[list[str]] = []
        self._variables: Final[dict[int, list[str]]] = {2: [], 4: [], 5: []}
        self._pieces: Final[dict[str, list[str]]] = {place: [] for place in _AUTOMATA}
        """The code of an automaton by its place."""
        self._lines: list[str] | None = []
        """What is being written; None where only an expression fits."""
        self._automaton = 2
        self._scope = "2"
        """Where local names belong: a function of the document, or an automaton by its id."""
        self._names: Final[dict[str, int]] = {}
        """How many names there are in each scope: they are the same in each, since that must not matter."""
        self.aim: Final = choices.one_of(_AIMS)
        self.word, self.part = choices.one_of(_EVENTS)
        self.event: Final = f"{self.word}{self.part}"
        self._left = choices.one_of((1, 1, 2, 2, 3, 4, 6))
        """How many more forms may be other than plain."""
        self._base, self._op, self._owner = _OPERATIONS.get(self.aim, ("self.send", "send", "$me"))
        self.document: Final = self._acting() if self.aim in ("event", "command") else self._guarding()

    # -- documents -----------------------------------------------------------------------------------------

    def _acting(self) -> Document:
        """Draw a document with code that sends or commands, in any place of an automaton or of the one below it."""
        place = self._choices.one_of([*_PLACES, "argument", "result", "data"])
        given, passed = "", {}
        if place == "argument":
            kind = self._choices.one_of(["text", "text", "send", "part"])
            self._in(2)
            with self._body(None):
                given = self._fill(kind)
            part = f"half = given\n$send(f'{self.word}{{half}}')"
            self._write_piece("below", {"text": "$send(given)", "send": "given($text)", "part": part}[kind])
            passed = {"arguments": (Argument(name="given", value=Text(given)),)}
        elif place == "result":
            self._write_piece("below", "out = $text")
            self._write_piece("code", "$send(got)")
            self._variables[2].append("got = 'decoy'")
            passed = {"results": (Result(name="out", variable=Text("got")),)}
        elif place == "data":
            self._write_piece("code", "self.send('data', $text)")
            self._write_piece("data", "$send(event.data)")
        else:
            self._write_piece(place, "$act")
        ways = [after(200, 1, 2, id=1, code=self._piece("transition")), after(100, 2, 1, id=2)]
        if self._pieces["guard"]:
            ways.append(when(self._piece("guard") + "\nreturn False", 1, 2, id=3))
        if place == "data":
            ways.append(on("data", 1, 1, id=4, code=self._piece("data")))
        below = automaton(
            5, [state(1, code=self._piece("below"))], father=2, variables=self._text(5),
            inputs=_declared("given") if place == "argument" else (), outputs=_declared("out") if place == "result" else (),
        )  # fmt: skip
        pieces = {name: self._piece(name) for name in ("entry", "code", "exit")}
        states = [state(1, children=[5], **pieces, **passed), state(2, entry=self._piece("second"))]
        acting = automaton(2, states, ways, father=1, variables=self._text(2))
        waits = state(1, code="self.Head.stop()" if self.aim == "command" else "")
        comes = [on(self.event, 1, 2, id=1), on("never", 1, 3, id=2)] if self.aim == "event" else [after(100, 1, 2, id=1)]
        listening = automaton(3, [waits, state(2), state(3)], [*comes, when("True", 2, 1, id=3), when("True", 3, 1, id=4)], father=1)
        return self._written([acting, listening, below], [stated("never", "#3/s2")] if self.aim == "event" else [])

    def _guarding(self) -> Document:
        """Draw a document with guards of one state, between which a flag may change, or which are flaky."""
        self._in(4)
        if self.aim == "flag":
            self._functions.append("def flip(self, *_, **__):\n    self.flag = not self.flag")
            self._variables[4].append("self.flag = False")
        elif self.aim == "variable":
            self._variables[4] += ["flag = False", "def flip(*_, **__):", "    nonlocal flag", "    flag = not flag"]
        with self._body(None):
            if self.aim == "constant":
                guards = [self._fill("false"), self._fill("true"), "True"]
            else:
                asked = self._fill({"flag": "own flag", "variable": "flag"}.get(self.aim, "flaky"))
                guards = [asked, self._choices.one_of([f"not ({asked})", asked, f"not not not ({asked})"]), "True"]
        if self.aim in ("flag", "variable"):
            self._write_piece("change", "$act")
            guards[1:1] = [self._piece("change") + "\nreturn False"]
        ways = [when(guard, 1, number, id=number) for number, guard in enumerate(guards, 2)]
        ways += [when("True", number, 1, id=number + 20) for number in range(2, len(guards) + 2)]
        states = [state(1, code=self._piece("guarded")), *(state(number) for number in range(2, len(guards) + 2))]
        guarded = automaton(4, states, ways, father=1, variables=self._text(4))
        held = stated("eventually", " or ".join(f"#4/s{number}" for number in range(2, len(guards) + 1)), "100")
        return self._written([guarded], [held])

    def _written(self, below: list[Automaton], properties: list[Property]) -> Document:
        """Return a document with these automata side by side, and the modules that its forms use."""
        side = [each.id for each in below if each.father == 1]
        functions = "\n\n".join(self._functions)
        root = automaton(1, [state(1, children=side)], functions=Text(functions))
        code = f"{root}{below}"
        libraries = tuple(Library(name=Text(name)) for name in _MODULES if f"{name.split('.')[0]}." in code)
        heads = (Interface(name="Head", type="PoseHead"),) if self.aim == "command" else ()
        return document(root, *below, properties=properties, libraries=libraries, interfaces=heads)

    # -- code ----------------------------------------------------------------------------------------------

    def _text(self, number: int) -> Text:
        return Text("\n".join(self._variables[number]))

    def _piece(self, place: str) -> str:
        return "\n".join(self._pieces[place])

    def _in(self, number: int) -> None:
        self._automaton, self._scope = number, str(number)

    @contextmanager
    def _body(self, lines: list[str] | None) -> Iterator[None]:
        """Write into other lines, or into none."""
        before, self._lines = self._lines, lines
        try:
            yield
        finally:
            self._lines = before

    def _write_piece(self, place: str, code: str) -> None:
        """Write code to a place of an automaton."""
        before = self._automaton, self._scope
        self._in(_AUTOMATA[place])
        with self._body([]) as _:
            self._write(code, "act", {})
            self._pieces[place] += [line for line in self._lines or () if line.strip()]
        self._automaton, self._scope = before

    def _fill(self, kind: str) -> str:
        """Return an expression of a kind, or a statement; what has to come before it is written."""
        if self._left <= 0 or not self._choices.below(3):
            return self._expand(_form(FORMS[kind][0]), kind, {})
        self._left -= 1
        is_carried = kind in _CARRIED and self._choices.below(2)
        if is_carried and self._lines is not None and self._choices.below(2):
            return self._assigned(kind)
        return self._expand(self._drawn("value" if is_carried else kind), kind, {})

    def _drawn(self, forms: str) -> Form:
        """Draw one of the forms that fit here."""
        form: Form = self._choices.one_of([form for form in map(_form, FORMS[forms]) if self._fits(form)])
        self.forms.append(form.code + (f" # {form.functions}" if form.functions else ""))
        return form

    def _fits(self, form: Form) -> bool:
        if form.variables and self._is_method:
            return False
        if self._lines is None and "\n" in form.code:
            return False
        if self.aim != "event" and "super(" in form.code:
            return False
        if self.aim == "variable":  # which functions of the document do not see
            return not (_OPERATION.search(" ".join(form)) or _ACTS.search(form.functions))
        return True

    @property
    def _is_method(self) -> bool:
        return not self._scope.isdigit()

    def _assigned(self, kind: str) -> str:
        """Assign something to a name or an attribute in any way, here or at another place, and return that."""
        is_attribute = bool(self._choices.below(2))
        form = self._drawn("attribute assignment" if is_attribute else "name assignment")
        name = self._name(is_attribute=is_attribute)
        target = f"self.{name}" if is_attribute else name
        first, names = f"{target} = {self._other(kind)}", {"t": target, "a": name}
        places = [place for place, number in _AUTOMATA.items() if number == self._automaton and place != "data"]
        is_elsewhere = kind in _AWAITED and (is_attribute or not self._is_method) and self._choices.below(2)
        if is_elsewhere:
            self._variables[self._automaton].append(f"{target} = {_OTHERS[kind][0]}")
            before = self._scope
            lines: list[str] = []
            self._in(self._automaton)
            with self._body(lines):
                lines.append(self._expand(form, kind, names))
            self._scope = before
            self._pieces[self._choices.one_of(places)] += lines
            return target
        assert self._lines is not None
        known = is_attribute or self._is_method or self._choices.below(2)
        (self._lines if known else self._variables[self._automaton]).append(first)
        self._lines.append(self._expand(form, kind, names))
        return target

    def _other(self, kind: str) -> str:
        return str(self._choices.one_of(_OTHERS.get(kind, ["None"])))

    def _name(self, *, is_attribute: bool) -> str:
        scope = "self" if is_attribute else self._scope
        self._names[scope] = self._names.get(scope, 0) + 1
        return f"n{self._names[scope]}"

    def _expand(self, form: Form, kind: str, names: dict[str, str]) -> str:
        """Return the last line of a form, after writing the others where they belong."""
        for letter in sorted(set(_LETTER.findall(" ".join(form)))):
            if letter not in names:
                own = form.functions + "".join(re.findall(r"self\.\$\w|'\$\w'", " ".join(form)))
                names[letter] = self._name(is_attribute=f"${letter}" in own)
        if form.functions:
            before, self._scope = self._scope, f"function {len(self._names)}"
            self._names[self._scope] = 0
            lines: list[str] = []
            with self._body(lines):
                self._write(form.functions, kind, names)
            self._scope = before
            self._functions.append("\n".join(lines))
        if form.variables:
            lines = []
            with self._body(lines):
                self._write(form.variables, kind, names)
            self._variables[self._automaton] += lines
        first, _, last = form.code.rpartition("\n")
        if first:
            self._write(first, kind, names)
        content = last.lstrip()
        indent = last[: len(last) - len(content)]
        return indent + self._line(content, indent, kind, names)

    def _write(self, text: str, kind: str, names: dict[str, str]) -> None:
        for line in text.split("\n"):
            content = line.lstrip()
            indent = line[: len(line) - len(content)]
            filled = self._line(content, indent, kind, names)
            assert self._lines is not None
            self._lines.append(indent + filled)

    def _line(self, content: str, indent: str, kind: str, names: dict[str, str]) -> str:
        """Return a line with its holes filled, after writing what comes before it with the same indentation."""
        lines: list[str] | None = None if self._lines is None else []
        with self._body(lines):
            filled = _HOLE.sub(lambda hole: self._hole(hole[1], kind, names), content)
        if self._lines is not None:
            self._lines += [indent + line for each in lines or () for line in each.split("\n")]
        return filled.replace("\n", "\n" + indent)

    def _hole(self, name: str, kind: str, names: dict[str, str]) -> str:
        match name:
            case "word":
                return self.word
            case "tail":
                return str(self.part)
            case "whole":
                return self.event
            case "literal":
                return repr(self.part)
            case "base":
                return self._base
            case "op":
                return self._op
            case "owner":
                return _HOLE.sub(lambda hole: self._hole(hole[1], kind, names), self._owner)
            case "read":
                return "flag" if self.aim == "variable" else "self.flag"
            case "other":
                return self._other(kind)
            case "value":
                return self._fill(kind)
        return names[name] if name in names else self._fill(name)


def _form(form: Form | str) -> Form:
    return form if isinstance(form, Form) else Form(form)


def _declared(name: str) -> tuple[Parameter]:
    return (Parameter(name=name, type=Text("object"), default=Text("'decoy'")),)


# -- runs --------------------------------------------------------------------------------------------------


class _Seen(Observer):
    """The states that were entered and the transitions that fired, by the ids of automata, and their times."""

    def __init__(self) -> None:
        self.states: dict[tuple[int, int], int] = {}
        self.transitions: set[tuple[int, int]] = set()
        self.has_failed = False

    def cycle_ended(self, actor: Actor, at: int) -> None:
        self.states.setdefault((actor.automaton.id, actor.current.id), at)

    def fired(self, actor: Actor, transition: runtime.Transition, at: int) -> None:
        self.transitions.add((actor.automaton.id, transition.id))

    def code_failed(self, actor: Actor, error: Exception) -> None:
        self.has_failed = True
        self.error = error


class _Head:
    """Stand for a proxy, and note whether it was commanded."""

    def __init__(self) -> None:
        self.commanded = False

    def setSpeed(self, *_: object, **__: object) -> None:
        self.commanded = True

    def stop(self) -> None:
        pass


@dataclass(frozen=True)
class Found:
    """How many claims were made of a program, those that a run refutes, and why the run shows nothing if so."""

    claims: int
    refuted: tuple[str, ...] = ()
    failed: str = ""


def refuted(program: Program, seconds: float = 0.7, *, checked: Document | None = None) -> Found:
    """Check a program, run it in virtual time, and return what happened against a claim.

    What is `checked` may be another document of the same states and transitions.
    """
    report = check_model(checked or program.document, PATH)
    claims = _claims(program, report)
    if not claims:
        return Found(0)
    try:
        component = load_component(PATH, content=program.document)
    except (DocumentInvalid, SyntaxError) as error:
        return Found(0, (), f"{error}")
    try:
        seen, head = _run(component, seconds)
    except Exception as error:  # noqa: BLE001 - of any code: it voids the claims
        return Found(len(claims), (), f"{type(error).__name__}: {error}")
    finally:
        forget(component)
    if seen.has_failed:
        return Found(len(claims), (), f"{type(seen.error).__name__}: {seen.error}")
    return Found(len(claims), tuple(text for kind, what, text in claims if _happened(kind, what, seen, head)))


def _claims(program: Program, report: ModelReport) -> list[tuple[str, Any, str]]:
    """Return what a report claims: what it is about, and how it reads."""
    impossible = Reachability.IMPOSSIBLE
    found: list[tuple[str, Any, str]] = [
        ("state", (each.automaton, each.state), f"#{each.automaton}/s{each.state} is never entered")
        for each in report.states if each.reachability is impossible
    ]  # fmt: skip
    found += [
        ("transition", (each.automaton, each.transition), f"transition {each.transition} of #{each.automaton} never fires")
        for each in report.transitions if each.reachability is impossible
    ]  # fmt: skip
    for each in report.properties:
        if each.verdict is Verdict.HOLDS:
            states = [(int(a), int(b)) for a, b in re.findall(r"#(\d+)/s(\d+)", each.property.expression.text)]
            text = f"{each.property.kind} {each.property.expression.text} {each.property.within.text}".strip()
            found.append((each.property.kind, states, f"{text} holds"))
    if program.aim == "command" and report.complete and not report.conflicts:
        found.append(("command", None, "no other automaton commands Head"))
    return found


def _happened(kind: str, what: Any, seen: _Seen, head: _Head) -> bool:  # noqa: ANN401 - by kind
    """Return whether what happened refutes a claim."""
    match kind:
        case "state":
            return what in seen.states
        case "transition":
            return what in seen.transitions
        case "never":
            return any(each in seen.states for each in what)
        case "command":
            return head.commanded
    times = [seen.states[each] for each in what if each in seen.states]
    return not times or min(times) > 100_000_000


def _run(component: type[runtime.Component], seconds: float) -> tuple[_Seen, _Head]:
    """Run a component in virtual time, and let its threads end in between."""
    random.seed(0)
    before = set(threading.enumerate())
    made = component()
    head = _Head()
    vars(made)["Head"] = head
    seen = _Seen()
    virtual = runtime.VirtualRun(made, on_error="continue", observers=[seen])
    for _ in range(round(seconds / 0.1)):
        virtual.advance(0.1)
        for thread in set(threading.enumerate()) - before:
            thread.join(_THREAD_LIMIT)
    return seen, head


def naive(document: Document) -> Document:
    """Return a document as it looks to who does not read its code: all guards are one name or its opposite."""
    return replace(document, automata=tuple(map(_naive, document.automata)))


def _naive(one: Automaton) -> Automaton:
    nothing = Text("")
    return replace(
        one, functions=nothing, variables=nothing,
        states=tuple(replace(each, entry=nothing, code=nothing, exit=nothing, arguments=()) for each in one.states),
        transitions=tuple(replace(each, code=nothing, trigger=_naive_trigger(each)) for each in one.transitions),
    )  # fmt: skip


def _naive_trigger(one: Transition) -> Text:
    text = one.trigger.text
    if one.type != "condition" or text == "True":
        return one.trigger
    return Text("False" if "\n" in text else "not n" if text.startswith("not ") else "n")


def shrunk(made: Sequence[int], *, limit: int = 1500) -> list[int]:
    """Return simpler choices whose program still refutes a claim."""
    best, tries = list(made), 0
    is_better = True
    while is_better and tries < limit:
        is_better = False
        for candidate in _simpler(best):
            tries += 1
            choices = Choices(candidate)
            if refuted(Program(choices)).refuted and _size(choices.made) < _size(best):
                best, is_better = choices.made, True
                break
    return best


def _simpler(made: list[int]) -> Iterator[list[int]]:
    """Yield lists of choices without a part of others, and with a choice of what is plainer."""
    for size in (16, 8, 5, 3, 2, 1):
        for place in range(3, len(made) - size + 1):
            yield [*made[:place], *made[place + size :]]
    for place, number in enumerate(made):
        if number:
            yield [*made[:place], 0, *made[place + 1 :]]


def _size(made: list[int]) -> tuple[int, int]:
    return sum(map(bool, made)), len(made)
