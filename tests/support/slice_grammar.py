"""Slice files generated from the grammar: most follow every rule, some break one, some are damaged."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from hypothesis import strategies as st

_BUILTIN = ("bool", "byte", "short", "int", "long", "float", "double", "string", "Object", "Value", "Object*")
_INTEGERS = ("byte", "short", "int", "long")
_NAMES = (
    "A",
    "B",
    "b",
    "Time",
    "time",
    "m",
    "n",
    "x",
    "value",
    "Data",
    "ice",
    "left_arm",
    "class",
    r"\class",
    "aPtr",
)
_TOKEN = re.compile(r'"[^"]*"|[\w\\]+|::|\[\[|\]\]|[^\w\s]')
_SPARE = (  # noqa: SIM905 - a list of words is easier to read than of literals
    "int string void out throws extends optional(1) idempotent class interface struct sequence < > ( ) { } ; , = *"
    ' A time 5 -1 1.5 "text" ["a:b"] :: x'
).split(" ")


@dataclass
class _Writer:
    """Writes definitions and remembers their names."""

    draw: Callable[[st.SearchStrategy[int]], int]
    lines: list[str] = field(default_factory=list)
    types: list[str] = field(default_factory=list)
    enumerators: dict[str, list[str]] = field(default_factory=dict)
    integers: list[str] = field(default_factory=list)
    classes: list[str] = field(default_factory=list)
    interfaces: list[str] = field(default_factory=list)
    exceptions: list[str] = field(default_factory=list)
    count: int = 0

    def number(self, limit: int) -> int:
        """Draw a number below `limit`."""
        return self.draw(st.integers(0, limit - 1))

    def rarely(self) -> bool:
        """Draw whether to do something that often breaks a rule."""
        return self.number(70) == 69

    def one_of(self, items: Sequence[str]) -> str:
        """Draw an item."""
        return items[self.number(len(items))]

    def name(self, prefix: str) -> str:
        """Return a new name, or rarely one that something else may have."""
        if self.rarely():
            return self.one_of(_NAMES)
        self.count += 1
        return f"{prefix}{self.count}"

    def reference(self, known: Sequence[str], otherwise: str) -> str:
        """Return a name from a list, rarely in another form."""
        if not known or self.rarely():
            return self.one_of([*_NAMES, *self.types, *self.exceptions, otherwise])
        name = self.one_of(known)
        form = self.number(30)
        return (
            f"m::{name}"
            if form == 1
            else f"::m::{name}"
            if form == 2
            else name.lower()
            if form == 3
            else name
        )

    def type(self) -> str:
        """Return a type."""
        choice = self.number(10)
        if choice < 5 or not self.types:
            return self.one_of(_BUILTIN)
        if choice < 9:
            return self.reference(self.types, "int")
        return self.reference(self.interfaces, "Object") + "*"

    def value(self, kind: str) -> str:
        """Return a value for a type, mostly a valid one."""
        if self.rarely():
            return self.one_of(
                ["5", "-1", "300", "1.5", '"text"', "true", "x", *self.integers, "99999999999"]
            )
        if kind in self.enumerators:
            enumerator = self.one_of(self.enumerators[kind])
            return self.one_of([enumerator, f"{kind}::{enumerator}", f"m::{enumerator}"])
        if kind in _INTEGERS:
            return self.one_of(["0", "5", "0x10", "017", "+3", *self.integers])
        return {"bool": "true", "string": '"a\\tb"', "float": "-1.5f", "double": "2"}.get(kind, "0")

    def members(self, *, tags: bool) -> list[str]:
        """Return the lines of members."""
        lines: list[str] = []
        for _ in range(self.number(4) + (0 if tags or self.rarely() else 1)):
            kind = self.type()
            line = f"{kind} {self.name('a')}"
            if (tags and self.number(4) == 0) or self.rarely():
                line = f"optional({self.one_of(['1', '2', '3', '4', '5', '-1', *self.integers])}) {line}"
            has_values = kind in self.enumerators or kind in _BUILTIN[:8]
            if (has_values and self.number(3) == 0) or self.rarely():
                line += f" = {self.value(kind)}"
            if self.number(12) == 0:
                line = f'["a:b"] {line}'
            lines.append(line + ("" if self.number(60) == 59 else ";"))
        return lines

    def operation(self) -> str:
        """Return an operation."""
        line = "idempotent " if self.number(4) == 0 else ""
        if self.number(2):
            line += "optional(7) " if self.number(8) == 0 else ""
            line += self.type()
        else:
            line += "void"
        parameters: list[str] = []
        for place in range(self.number(4)):
            out = "out " if place > self.number(4) else ""
            tag = f"optional({self.one_of(['1', '2', '3'])}) " if self.number(8) == 0 else ""
            parameters.append(f"{out}{tag}{self.type()} {self.name('p')}")
        line += f" {self.name('f')}({', '.join(parameters)})"
        if self.exceptions and self.number(3) == 0:
            thrown = [self.reference(self.exceptions, "X") for _ in range(1 + self.number(2))]
            line += " throws " + ", ".join(thrown)
        return line + ("" if self.number(60) == 59 else ";")

    def body(self, head: str, lines: Sequence[str]) -> None:
        """Write a body on several lines or on one."""
        if self.number(3) == 0:
            self.lines.append(f"{head} {{ {' '.join(lines)} }}{'' if self.number(4) == 0 else ';'}")
        else:
            self.lines += [head + " {", *("  " + line for line in lines), "};"]

    def extends(self, known: Sequence[str], word: str = "extends") -> str:
        """Return a clause with a base, or nothing."""
        if (known and self.number(3) == 0) or self.rarely():
            return f" {word} {self.reference(known, 'A')}"
        return ""

    def definition(self) -> None:
        """Write one definition."""
        kind = self.number(12)
        match kind:
            case 0 | 1:
                name = self.name("S")
                self.body(f"struct {name}", self.members(tags=False))
                self.types.append(name)
            case 2:
                name = self.name("C")
                tag = f"({self.number(9)})" if self.number(6) == 0 else ""
                head = f"class {name}{tag}{self.extends(self.classes)}"
                self.body(head + self.extends(self.interfaces, "implements"), self.members(tags=True))
                self.types.append(name)
                self.classes.append(name)
            case 3 | 4 | 5:
                name = self.name("I")
                bases = self.extends(self.interfaces)
                if bases and self.number(2):
                    bases += f", {self.reference(self.interfaces, 'A')}"
                operations = [self.operation() for _ in range(self.number(4))]
                self.body(f"interface {name}{bases}", operations)
                self.interfaces.append(name)
            case 6:
                name = self.name("X")
                self.body(f"exception {name}{self.extends(self.exceptions)}", self.members(tags=True))
                self.exceptions.append(name)
            case 7:
                name = self.name("E")
                names = [self.name("e") for _ in range(1 + self.number(3))]
                values = [f" = {self.value('int')}" if self.number(5) == 0 else "" for _ in names]
                pairs = [name + value for name, value in zip(names, values, strict=True)]
                self.body(f"enum {name}", [f"{pair}," for pair in pairs])
                self.types.append(name)
                self.enumerators[name] = names
            case 8:
                name = self.name("Q")
                self.lines.append(f"sequence<{self.type()}> {name};")
                self.types.append(name)
            case 9:
                name = self.name("D")
                key = self.one_of(["int", "string", "bool", *list(self.enumerators)])
                key = self.type() if self.number(4) == 0 else key
                self.lines.append(f"dictionary<{key}, {self.type()}> {name};")
                self.types.append(name)
            case 10:
                name = self.name("k")
                kind_ = self.one_of([*_BUILTIN[:8], *list(self.enumerators)])
                self.lines.append(f"const {kind_} {name} = {self.value(kind_)};")
                if kind_ in _INTEGERS:
                    self.integers.append(name)
            case _:
                word = self.one_of(["class", "interface"])
                name = self.reference(self.classes if word == "class" else self.interfaces, "Later")
                self.lines.append(f"{word} {name.rpartition('::')[2]};")


@st.composite
def slice_files(draw: st.DrawFn) -> str:
    """Return the text of a file; a third of them are damaged in one token."""
    writer = _Writer(draw)
    writer.lines.append("module m {")
    for _ in range(1 + writer.number(7)):
        writer.definition()
    writer.lines.append("};")
    text = "\n".join(writer.lines) + "\n"
    if writer.number(3):
        return text
    tokens = list(_TOKEN.finditer(text))
    token = tokens[writer.number(len(tokens))]
    word = token.group()
    spare = writer.one_of(_SPARE)
    replacement = writer.one_of(["", f"{word} {word}", spare, f"{word} {spare}", word.upper()])
    return text[: token.start()] + replacement + text[token.end() :]
