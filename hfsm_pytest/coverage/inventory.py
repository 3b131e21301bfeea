"""What there is to cover in a document."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.hfsm.document import Automaton, Document, Transition
from codegen.hfsm.formats.reader import looks_like_document

from ..loading import read

__all__ = ["AutomatonItems", "DocumentItems", "StateItem", "TransitionItem", "take_inventory"]


@dataclass(frozen=True, slots=True)
class StateItem:
    """A state, and where it stands: the line in the file, the place on the canvas in pixels."""

    id: int
    name: str
    line: int
    x: float
    y: float
    initial: bool
    final: bool


@dataclass(frozen=True, slots=True)
class TransitionItem:
    """A transition; `trigger` is what it fires at, in words; `guarded` whether it has a guard."""

    id: int
    name: str
    origin: int
    destination: int
    line: int
    x: float
    y: float
    trigger: str
    guarded: bool


@dataclass(frozen=True, slots=True)
class AutomatonItems:
    """An automaton: `name` is the path of the states that own it, with its id where several have the same.

    `file` is where it is written.
    """

    id: int
    name: str
    file: str
    states: tuple[StateItem, ...]
    transitions: tuple[TransitionItem, ...]

    def state(self, id: int) -> str:
        """Return the name of a state."""
        return next((state.name for state in self.states if state.id == id), f"state {id}")


@dataclass(frozen=True, slots=True)
class DocumentItems:
    """A document by its file, relative to the root of the project."""

    file: str
    automata: tuple[AutomatonItems, ...]


def take_inventory(paths: Sequence[Path], root: Path) -> list[DocumentItems]:
    """Return what there is in documents, and in all documents of directories.

    Raises DocumentInvalid for a document that cannot be read, and FileNotFoundError.
    """
    return [_document(file, root) for file in dict.fromkeys(_files(paths))]


def shown(file: Path, root: Path) -> str:
    """Return a file as reports name it: relative to the root of the project, if it is below."""
    resolved = file.resolve()
    return resolved.relative_to(root).as_posix() if resolved.is_relative_to(root) else resolved.as_posix()


def _files(paths: Sequence[Path]) -> Iterator[Path]:
    for path in paths:
        if path.is_dir():
            yield from filter(looks_like_document, sorted(path.resolve().rglob("*.xml")))
        elif path.is_file():
            yield path.resolve()
        else:
            raise FileNotFoundError(f"--hfsm-cov: there is no {path}")


def _document(file: Path, root: Path) -> DocumentItems:
    document = read(file)
    names = {each.id: _path(document, each) or file.stem for each in document.automata}
    several = {name for name, count in Counter(names.values()).items() if count > 1}
    return DocumentItems(
        file=shown(file, root),
        automata=tuple(
            _automaton(each, f"{name} ({each.id})" if name in several else name, file, root)
            for each, name in zip(document.automata, names.values(), strict=True)
        ),
    )


def _automaton(automaton: Automaton, name: str, file: Path, root: Path) -> AutomatonItems:
    return AutomatonItems(
        id=automaton.id,
        name=name,
        file=shown(automaton.path or file, root),
        states=tuple(
            StateItem(
                id=state.id,
                name=state.name or f"state {state.id}",
                line=state.line,
                x=state.x,
                y=state.y,
                initial=state.initial,
                final=state.final,
            )
            for state in automaton.states
        ),
        transitions=tuple(
            TransitionItem(
                id=transition.id,
                name=transition.name or f"transition {transition.id}",
                origin=transition.origin,
                destination=transition.destination,
                line=transition.line,
                x=transition.x,
                y=transition.y,
                trigger=_trigger(transition),
                guarded=transition.type == "condition" or not transition.guard.is_blank,
            )
            for transition in automaton.transitions
        ),
    )


def _path(document: Document, automaton: Automaton) -> str:
    names: list[str] = []
    above: Automaton | None = automaton
    while above is not None and len(names) < len(document.automata):
        owner = document.owner(above)
        if owner is None:
            break
        names.append(owner.name)
        above = document.automaton(above.father)
    return "/".join(reversed(names))


def _trigger(transition: Transition) -> str:
    text = " ".join(transition.trigger.text.split())
    guard = " ".join(transition.guard.text.split())
    words = {"time": f"after {text} ms", "event": f"at event {text}", "finished": "when all have finished"}
    what = words.get(transition.type, f"when {text}")
    return f"{what} if {guard}" if guard else what
