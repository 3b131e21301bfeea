"""The code of a document to which lines of a component's output refer."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Final, Literal, NamedTuple

from codegen.code_marks import MarkedCode, code_at, library, read_marks
from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Document, Library
from codegen.messages import NO_MESSAGE, Message
from visualhfsm._document.imported_places import ImportedPlaces
from visualhfsm._document.places import Locator, Place, text_of, texts_at, texts_in

_FRAME: Final = re.compile(r'\s*File "(.+)", line (\d+)')


class Origin(NamedTuple):
    """A line, from 1, of a piece of code; 0 for an element as a whole.

    The place of imported code is that of its automaton in the document, as in `ImportedPlaces`. It stands at
    `source` in another `file`, in words `where`, and `owners` are the states that own the imported automata.
    `transition` is what people call the transition whose code it is: `seen (look → go)`.
    """

    place: Place
    line: int
    file: str = ""
    source: Place | None = None
    where: Message = NO_MESSAGE
    owners: tuple[Place, ...] = ()
    transition: str = ""


class Origins:
    """The origins of the lines of one generated component."""

    def __init__(
        self,
        document: Document,
        path: Path,
        component: Path,
        codes: Sequence[MarkedCode] = (),
        include: Sequence[Path] = (),
        *,
        home: Path | None = None,
    ) -> None:
        self._document = document
        self._place = path, include, home
        self._name = path.name
        self._component = component
        self._codes = codes
        self._logged = re.compile(rf"\({re.escape(path.name)}:(\d{{1,9}})\)")
        """The pattern of a place in the component's own log: `follow_ball.py:57 (follow_ball.xml:31)`."""
        self._running = re.compile(rf"{re.escape(component.name)}:(\d{{1,9}}) \(")
        """The line of the component in such a place: the document may have changed since it was saved."""
        self._unloaded = re.compile(r"[^ :]+: error: ([^ :]+):(\d{1,9}): ")
        """The pattern of a library that fails: `follow_ball.py: error: follow_ball.xml:9: `."""

    @cached_property
    def _imports(self) -> ImportedPlaces:
        path, include, home = self._place
        return ImportedPlaces(self._document, path, include, home=home)

    @cached_property
    def _locator(self) -> Locator:
        return Locator(self._document)

    @property
    def _whole(self) -> Document:
        """The document with all that it imports."""
        return self._imports.whole

    def find(self, line: str, *, automaton: int = 0, state: int = 0) -> Origin | None:
        """Return the piece of code that a line of output refers to, None if it refers to none.

        If pieces share a line of the document, that of the `automaton` and `state`, ids of a report of
        the component, is preferred.
        """
        found = self._find(line, automaton, state)
        return None if found is None else self._named(found)

    def _find(self, line: str, automaton: int, state: int) -> Origin | None:
        frame = _FRAME.match(line)
        if frame is not None:
            number = int(frame[2])
            return self._of_line(number) if Path(frame[1]).name == self._component.name else None
        unloaded = self._unloaded.match(line)
        if unloaded is not None:
            return self._library_at(unloaded[1], int(unloaded[2]))
        running = self._running.search(line)
        if running is not None and (origin := self._of_line(int(running[1]))) is not None:
            return origin
        logged = self._logged.search(line)
        if logged is None:
            return None
        found = self._locator.find_code(int(logged[1]), automaton=automaton, state=state)
        return Origin(found.place, found.line) if found else self._library_at(self._name, int(logged[1]))

    def element(self, automaton: int, state: int, transition: int) -> Origin | None:
        """Return a state, or a transition unless its id is 0, as a whole; None for another document's."""
        source = self._whole.automaton(automaton)
        if source is None:
            return None
        kind: Literal["state", "transition"] = "transition" if transition else "state"
        elements = source.transitions if transition else source.states
        element = next((each for each in elements if each.id == (transition or state)), None)
        if element is None:
            return None
        place = Place(kind=kind, automaton=automaton, id=element.id)
        return self._named(self._origin(Origin(place, 0), element.line, element.column))

    def state_name(self, automaton: int, state: int) -> str:
        """Return the name of a state; empty for another document's."""
        source = self._whole.automaton(automaton)
        states = () if source is None else source.states
        return next((each.name for each in states if each.id == state), "")

    def texts(self, place: Place) -> tuple[str, ...]:
        """Return the texts at a place, as the component runs them."""
        return texts_at(self._whole, place)

    def _named(self, origin: Origin) -> Origin:
        """Return an origin with the name of its transition, if it is in one."""
        place = origin.place
        automaton = self._whole.automaton(place.automaton)
        if place.kind != "transition" or automaton is None:
            return origin
        for each in automaton.transitions:
            if each.id == place.id:
                ends = " → ".join(
                    self.state_name(automaton.id, end) for end in (each.origin, each.destination)
                )
                return origin._replace(transition=f"{each.name} ({ends})" if each.name else ends)
        return origin

    def _origin(self, origin: Origin, line: int, column: int) -> Origin:
        """Return an origin with where it stands, which is a line and a column of a file."""
        automaton = self._whole.automaton(origin.place.automaton)
        if automaton is None or automaton.path is None:
            return origin
        found = self._imports.find(automaton.path, line, column)
        if found is None or found.source is None:
            return origin
        owners = self._imports.owners(automaton)
        return origin._replace(file=found.file, source=found.source.place, where=found.name, owners=owners)

    def _of_line(self, number: int) -> Origin | None:
        """Return the place of a line of the component, None for one that the generator wrote."""
        code = code_at(self._codes, number)
        if code is None:
            return None
        if code.part == "library":
            return self._library(lambda each: library(each.name.text) == code.text)
        found = text_of(code, texts_in(self._whole))
        if found is None:
            return None
        placed, before = found
        line = before + number - code.first
        column = 1 if line else placed.column
        return self._origin(Origin(placed.place, line + 1), placed.line + line, column)

    def _library_at(self, file: str, line: int) -> Origin | None:
        """Return the library in a line of a file, by the file's name."""

        def is_there(library: Library) -> bool:
            text = library.name
            here = self._name if library.path is None else library.path.name
            return here == file and text.line <= line <= text.line + text.text.count("\n")

        return self._library(is_there)

    def _library(self, is_meant: Callable[[Library], bool]) -> Origin | None:
        for index, each in enumerate(self._whole.libraries):
            text = each.name
            if not text.text or not is_meant(each):
                continue
            if each.path is None:
                return Origin(Place(kind="document", part="libraries", index=index, name="name"), 1)
            found = self._imports.find(each.path, text.line, text.column)
            if found is not None and found.source is not None and found.owners:
                source = found.source.place
                return Origin(found.owners[0], 0, each.path.name, source, found.name, found.owners)
        return None


def read_origins(
    document: Path,
    component: Path,
    include: Sequence[Path] = (),
    *,
    home: Path | None = None,
    content: Document | None = None,
) -> Origins | None:
    """Return the origins of a component's lines, or None without its document.

    Without its file, only lines that name the document are found. `include` are as for `resolve`, `home` is
    the document's own file where this one is a copy, and `content` the document if it was read already.
    """
    read = content or read_document(document, Diagnostics())
    if read is None:
        return None
    try:
        text = component.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        text = ""
    return Origins(read, document, component, read_marks(text), include, home=home)
