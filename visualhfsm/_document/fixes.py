"""What a click fixes of a problem: commands, each with what a button says, the surest first.

A command that the document would refuse is not offered.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Final

import msgspec

from codegen.hfsm.codes import Code
from codegen.hfsm.document import Document
from codegen.hfsm.known_interfaces import KnownInterfaces
from codegen.messages import Message
from visualhfsm._base.errors import EditError

from .commands import AnyCommand, Command
from .commands.component import AddEntry
from .commands.text import Correction, CorrectName, SetText, StraightenText
from .commands.variables import ShareVariable
from .places import Place, texts_in
from .problems import Misspelt, Problem

_CODE: Final = frozenset(
    ("argument", "code", "entry", "exit", "fired", "functions", "guard", "trigger", "variables")
)
"""The parts with code: the place of a problem there is exactly where it is wrong."""
_TYPOGRAPHIC: Final = re.compile(
    "[\u00a0\u00ab\u00ad\u00b4\u00bb\u2000-\u201f\u2026-\u2033\u2039\u203a\u205f\u2060\u2212\u3000\ufeff]"
)
"""What word processors and PDFs write instead of quotes, hyphens and spaces."""
_REFUSED: Final = re.compile(r"'(.)' \(U\+")
"""The character that Python refuses, in what it says of it."""
_NAME: Final = re.compile(r"\w+")
_USED_AS_OBJECT: Final = re.compile(r"\s*[.(\[]")
"""What follows a name that no number can be."""


class Fix(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """A change that fixes a problem, and its name on a button."""

    name: Message
    command: AnyCommand


def as_declared(served: Mapping[str, Sequence[str]], known: KnownInterfaces) -> dict[str, str]:
    """Return the interfaces of identities, served with these type ids, as a document declares them."""
    plain = {name: types[0].rpartition("::")[2] for name, types in served.items() if types}
    return {name: served[name][0] if len(known.find(each)) > 1 else each for name, each in plain.items()}


def fixes(
    document: Document, problems: Sequence[Problem], served: Mapping[str, str]
) -> list[tuple[Fix, ...]]:
    """Return the fixes of each of the problems of a document, the surest first.

    `served` are the interfaces that a robot has, by identity: exactly these names come before similar ones.
    """
    found = _Fixes(document, problems, served)
    return [found.of(each) for each in problems]


class _Fixes:
    """Makes each fix once: problems that have the same one share it."""

    def __init__(self, document: Document, problems: Sequence[Problem], served: Mapping[str, str]) -> None:
        self._document = document
        self._served = served
        self._texts = {each.place: each.text or "" for each in texts_in(document)}
        self._made: dict[Hashable, Fix | None] = {}
        self._alike: dict[Misspelt, list[Problem]] = {}
        self._objects: set[tuple[int, str]] = set()
        """The undefined names of automata that are used as no number is."""
        for each in problems:
            if each.file or each.place is None:
                continue
            if each.misspelt is not None:
                self._alike.setdefault(each.misspelt, []).append(each)
            if each.code == Code.UNDEFINED_NAME and _USED_AS_OBJECT.match(self._rest(each)[1]):
                self._objects.add((each.place.automaton, self._rest(each)[0]))

    def of(self, problem: Problem) -> tuple[Fix, ...]:
        place = problem.place
        if problem.file or place is None:  # what is wrong in another file is changed there
            return ()
        offered = (
            self._imported(problem),
            self._declared(problem),
            *self._corrected(problem, place),
            self._set(problem, place),
            self._shared(problem, place),
            self._straightened(problem, place),
        )
        return tuple(each for each in offered if each is not None)

    def _imported(self, problem: Problem) -> Fix | None:
        if not (library := problem.library):
            return None
        title = Message("Import {library}", library=library)
        if library.startswith("from "):
            module, _, name = library.removeprefix("from ").partition(" import ")
            title = Message("Import {name} from {module}", name=name, module=module)
        return self._once(title, AddEntry(list="libraries", fields={"name": library}), library)

    def _declared(self, problem: Problem) -> Fix | None:
        name, _ = self._rest(problem)
        if problem.code != Code.UNKNOWN_ATTRIBUTE or not (interface := self._served.get(name)):
            return None
        command = AddEntry(list="interfaces", fields={"name": name, "type": interface})
        return self._once(Message("Declare {name} ({type})", name=name, type=interface), command, name)

    def _corrected(self, problem: Problem, place: Place) -> Iterator[Fix | None]:
        """Yield what writes the name that is meant: here, and wherever it is misspelt like this."""
        misspelt = problem.misspelt
        if misspelt is None:
            return
        name, meant, count = misspelt.name, misspelt.meant, len(self._alike[misspelt])
        here = CorrectName(name=name, meant=meant, at=(_at(problem, place, misspelt),))
        yield Fix(name=Message("Write {meant}", meant=meant), command=here)
        if count > 1:
            if misspelt not in self._made:
                at = (_at(each, each.place, misspelt) for each in self._alike[misspelt] if each.place)
                everywhere = CorrectName(name=name, meant=meant, at=tuple(dict.fromkeys(at)))
                title = Message("Write {meant} in all {count} places", meant=meant, count=len(everywhere.at))
                self._made[misspelt] = Fix(name=title, command=everywhere)
            yield self._made[misspelt]

    def _set(self, problem: Problem, place: Place) -> Fix | None:
        """Return what declares a variable: only for what may be a number, and where code sees variables."""
        name, _ = self._rest(problem)
        automaton = place.automaton
        if problem.code != Code.UNDEFINED_NAME or not automaton or place.part == "functions" or not name:
            return None
        if problem.library or (automaton, name) in self._objects:
            return None
        before = self._texts.get(Place(kind="automaton", automaton=automaton, part="variables"), "").rstrip()
        at = Place(kind="automaton", automaton=automaton, part="variables")
        command = SetText(place=at, text=f"{before}\n{name} = 0" if before else f"{name} = 0")
        return self._once(Message("Declare the variable {name}", name=name), command, (automaton, name))

    def _shared(self, problem: Problem, place: Place) -> Fix | None:
        """Return what shares a variable of an automaton above, if it can be."""
        if problem.code not in (Code.VARIABLE_ABOVE, Code.ASSIGNED_VARIABLE_ABOVE):
            return None
        command = ShareVariable(automaton=place.automaton, name=self._rest(problem)[0])
        if command not in self._made:
            try:
                command.apply(self._document)
            except EditError:
                self._made[command] = None
        return self._once(Message("Write self.{name} in both", name=command.name), command, command)

    def _straightened(self, problem: Problem, place: Place) -> Fix | None:
        """Return what removes the characters of a word processor, if it is these that are refused."""
        if problem.severity != "error":
            return None
        at, refused = place, self._texts.get(place, "")
        if place.part in _CODE:
            line = refused.split("\n")[problem.line - 1 :][:1]
            rest = (line or [""])[0][max(0, problem.column - 1) :]
            named = _REFUSED.search(problem.message)
            refused = (named[1] if named else "") + rest[:1] + (line[0] if rest[:1] in ('"', "'") else "")
        else:
            at = msgspec.structs.replace(place, name=place.name or "default")
            refused = self._texts.get(at, "")
        if not _TYPOGRAPHIC.search(refused):
            return None
        return Fix(
            name=Message("Write straight quotes, hyphens and spaces"), command=StraightenText(place=at)
        )

    def _rest(self, problem: Problem) -> tuple[str, str]:
        """Return the name at the place of a problem, and what follows it in the line."""
        text = self._texts.get(problem.place, "") if problem.place is not None else ""
        line = text.split("\n")[max(0, problem.line - 1) :][:1]
        rest = (line or [""])[0][max(0, problem.column - 1) :]
        found = _NAME.match(rest)
        return (found[0], rest[found.end() :]) if found else ("", rest)

    def _once(self, name: Message, command: Command, key: Hashable) -> Fix | None:
        return self._made.setdefault(key, Fix(name=name, command=command))


def _at(problem: Problem, place: Place, misspelt: Misspelt) -> Correction:
    if problem.line:
        return Correction(place=place, line=problem.line, column=problem.column)
    return Correction(place=place, field=misspelt.field)
