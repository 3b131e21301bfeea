"""Random documents whose code is drawn from the whole grammar of Python.

A program has an aim: to send an event, to command a servant, to change a flag between two guards, or to answer
otherwise when it is asked again. It is composed of `python_forms` so that it reaches its aim, whatever way it
takes; hence what the model checker calls impossible happens if it has lost sight of that way.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final, TypeVar

from codegen.hfsm.document import (
    Argument,
    Automaton,
    Document,
    Interface,
    Library,
    Parameter,
    Property,
    Result,
    Text,
)
from tests.support.model_documents import after, automaton, document, on, state, stated, when
from tests.support.python_forms import FORMS, Form

__all__ = ["Choices", "Program"]

T = TypeVar("T")

_MODULES: Final = (
    "collections", "concurrent.futures", "contextlib", "contextvars", "copy", "dataclasses", "enum", "functools",
    "inspect", "io", "itertools", "json", "math", "operator", "queue", "random", "re", "threading", "types", "weakref",
)  # fmt: skip
_EVENTS: Final = [("go", "al"), ("leg", 0), ("e", None), ("y", True), ("a b", "c"), ("n", 12)]
"""The halves of the names of events."""
_AIMS: Final = (*["event"] * 5, "command", "command", "flag", "variable", "flaky", "constant")
_OTHERS: Final = {
    "text": ["'decoy'"],
    "part": ["'decoy'", "None", "5", "False"],
    "true": ["0", "''"],
    "false": ["1", "'x'"],
    "me": ["None", "len"],
    "send": ["(lambda *_: None)", "str", "None"],
    "thunk": ["(lambda *_: None)", "dict", "None"],
}
"""Values that are not wanted, by kind; the first does nothing if it is used."""
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

    def one_of(self, values: Sequence[T]) -> T:
        """Return one of some values."""
        return values[self.below(len(values))]


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
        arguments: tuple[Argument, ...] = ()
        results: tuple[Result, ...] = ()
        if place == "argument":
            kind = self._choices.one_of(["text", "text", "send", "part"])
            self._in(2)
            with self._body(None):
                given = self._fill(kind)
            part = f"half = given\n$send(f'{self.word}{{half}}')"
            self._write_piece("below", {"text": "$send(given)", "send": "given($text)", "part": part}[kind])
            arguments = (Argument(name="given", value=Text(given)),)
        elif place == "result":
            self._write_piece("below", "out = $text")
            self._write_piece("code", "$send(got)")
            self._variables[2].append("got = 'decoy'")
            results = (Result(name="out", variable=Text("got")),)
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
            inputs=_declared("given") if arguments else (), outputs=_declared("out") if results else (),
        )  # fmt: skip
        pieces = {name: self._piece(name) for name in ("entry", "code", "exit")}
        states = [
            state(1, children=[5], arguments=arguments, results=results, **pieces),
            state(2, entry=self._piece("second")),
        ]
        acting = automaton(2, states, ways, father=1, variables=self._text(2))
        waits = state(1, code="self.Head.stop()" if self.aim == "command" else "")
        comes = (
            [on(self.event, 1, 2, id=1), on("never", 1, 3, id=2)]
            if self.aim == "event"
            else [after(100, 1, 2, id=1)]
        )
        listening = automaton(
            3,
            [waits, state(2), state(3)],
            [*comes, when("True", 2, 1, id=3), when("True", 3, 1, id=4)],
            father=1,
        )
        return self._written(
            [acting, listening, below], [stated("never", "#3/s2")] if self.aim == "event" else []
        )

    def _guarding(self) -> Document:
        """Draw a document with guards of one state, between which a flag may change, or which are flaky."""
        self._in(4)
        if self.aim == "flag":
            self._functions.append("def flip(self, *_, **__):\n    self.flag = not self.flag")
            self._variables[4].append("self.flag = False")
        elif self.aim == "variable":
            self._variables[4] += [
                "flag = False",
                "def flip(*_, **__):",
                "    nonlocal flag",
                "    flag = not flag",
            ]
        with self._body(None):
            if self.aim == "constant":
                guards = [self._fill("false"), self._fill("true"), "True"]
            else:
                asked = self._fill({"flag": "own flag", "variable": "flag"}.get(self.aim, "flaky"))
                guards = [
                    asked,
                    self._choices.one_of([f"not ({asked})", asked, f"not not not ({asked})"]),
                    "True",
                ]
        if self.aim in ("flag", "variable"):
            self._write_piece("change", "$act")
            guards[1:1] = [self._piece("change") + "\nreturn False"]
        ways = [when(guard, 1, number, id=number) for number, guard in enumerate(guards, 2)]
        ways += [when("True", number, 1, id=number + 20) for number in range(2, len(guards) + 2)]
        states = [
            state(1, code=self._piece("guarded")),
            *(state(number) for number in range(2, len(guards) + 2)),
        ]
        guarded = automaton(4, states, ways, father=1, variables=self._text(4))
        held = stated(
            "eventually", " or ".join(f"#4/s{number}" for number in range(2, len(guards) + 1)), "100"
        )
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
        form = self._choices.one_of([form for form in map(_form, FORMS[forms]) if self._fits(form)])
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
        places = [
            place for place, number in _AUTOMATA.items() if number == self._automaton and place != "data"
        ]
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
        return self._choices.one_of(_OTHERS.get(kind, ["None"]))

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
