"""Find people's code in a generated component by the marks around it, which the generator writes.

Code of the document stands between marks, `# <code 1.2>` and `# </code 1.2>`, or before one at the end of its
line, `# <trigger 1.2/>`: the kind of the code, the ids of its automaton and of its state or transition, and
the name of an argument. The libraries are between `# <libraries>` and `# </libraries>`. No mark changes with
the code, nor with what stands elsewhere in the document, so that branches of a component merge where those of
its document do. Who needs the line of the document looks for the code there.

A running component reads them, too, so that this module needs nothing of the compiler.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import Final, NamedTuple

LIBRARIES: Final = "libraries"
"""The key of the marks around the libraries, each of which is code of one line."""
_OWNER: Final = r"(?P<automaton>\d+)(?:\.(?P<id>\d+))?(?: (?P<name>\w+))?"
_MARK: Final = re.compile(rf"(?:^ *|  )# <(?P<part>[a-z]+)(?: {_OWNER})?(?P<only>/?)>$")
"""A mark before code, or at the end of its only line."""
_AROUND: Final = re.compile(r'^(?:return |"\w+": )|,$')
"""What the generator writes around the only line of code: of a condition, or of an argument."""


class MarkedCode(NamedTuple):
    """A piece of code in lines `first` to `last` of the component.

    `part` is `library`, `functions`, `variables`, or `automaton` where a whole one is imported; of a state
    `entry`, `code`, `exit` or `argument`; of a transition `trigger`, `guard` or `fired`. `automaton` and `id`
    are 0, and `name` is blank, where they mean nothing. `text` is the code as `plain` returns it.
    """

    first: int
    last: int
    part: str
    automaton: int
    id: int
    name: str
    text: str

    @property
    def key(self) -> str:
        """What its mark says."""
        return key(*self[2:6])


def key(part: str, automaton: int, id: int = 0, name: str = "") -> str:
    """Return what the mark of a code says; only what repeats an id, or an argument, repeats it."""
    owner = f"{automaton}.{id}" if id else f"{automaton}"
    return " ".join(filter(None, (part, owner, name)))


def plain(code: str) -> str:
    """Return code without indentation, and without blank lines around it: to compare it, not to run it."""
    return "\n".join(line.strip() for line in code.strip().splitlines())


def library(statement: str) -> str:
    """Return what an import statement imports, as a document names it: `numpy as np`."""
    return statement.strip().removeprefix("import ")


def read_marks(component: str) -> tuple[MarkedCode, ...]:
    """Return the code of the document in a component's text, in the order of its lines."""
    return tuple(_codes(component.split("\n")))


def code_at(codes: Sequence[MarkedCode], line: int) -> MarkedCode | None:
    """Return the code in a line of the component, None for a line that the generator wrote."""
    index = bisect_right(codes, line, key=attrgetter("first")) - 1
    return codes[index] if index >= 0 and line <= codes[index].last else None


def _codes(lines: Sequence[str]) -> Iterator[MarkedCode]:
    number = 0  # of the lines that are read
    while number < len(lines):
        line = lines[number]
        number += 1
        mark = _MARK.search(line) if "# <" in line else None
        if mark is None:
            continue
        part, name = mark["part"], mark["name"] or ""
        automaton, element = int(mark["automaton"] or 0), int(mark["id"] or 0)
        if mark["only"]:
            text = _AROUND.sub("", line[: mark.start()].strip())
            yield MarkedCode(number, number, part, automaton, element, name, text)
            continue
        first, end = number, line.replace("# <", "# </", 1)
        number = next((each for each in range(first, len(lines)) if lines[each] == end), first)
        if part == LIBRARIES:
            for index in range(first, number):
                yield MarkedCode(index + 1, index + 1, "library", 0, 0, "", library(lines[index]))
        elif number > first:
            text = plain("\n".join(lines[first:number]))
            yield MarkedCode(first + 1, number, part, automaton, element, name, text)
