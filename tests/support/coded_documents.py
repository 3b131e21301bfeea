"""Run documents with code in virtual time, and see what they did."""

from __future__ import annotations

import random
from pathlib import Path

import hfsm_runtime as runtime
from codegen.hfsm import write_document
from codegen.hfsm.document import Document
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from visualhfsm.simulation._loading import load_component

__all__ = ["Visits", "commanded", "run", "sent_by"]


class Visits(Observer):
    """When each state was entered first, in ns, by id, and which transitions fired."""

    def __init__(self) -> None:
        self.first: dict[int, int] = {}
        self.fired_: set[int] = set()

    def cycle_ended(self, run: Actor, at: int) -> None:
        self.first.setdefault(run.current.id, at)

    def fired(self, run: Actor, transition: runtime.Transition, at: int) -> None:
        self.fired_.add(transition.id)


def run(path: Path, seed: int) -> Visits:
    """Return what a document did in 0.6 s of virtual time; `seed` is that of `random`."""
    random.seed(seed)
    virtual = runtime.VirtualRun(load_component(path)())
    seen = Visits()
    virtual.tree.observers.append(seen)
    virtual.advance(0.6)
    return seen


def sent_by(path: Path) -> set[str]:
    """Return the names of the events that a document sent in 0.3 s of virtual time."""
    component, found = load_component(path)(), set[str]()
    virtual = runtime.VirtualRun(component)
    send = component._hfsm_send
    assert send is not None

    def note(name: str, data: object) -> None:
        found.add(name.strip())
        send(name, data)

    component._hfsm_send = note
    virtual.advance(0.3)
    return found


class Servant:
    """Stand for a proxy: note that it is commanded."""

    def __init__(self, identity: str, commanded: set[str]) -> None:
        self._identity, self._commanded = identity, commanded

    def setPose(self, *_: object) -> None:
        self._commanded.add(self._identity)

    def stop(self) -> None:
        self._commanded.add(self._identity)

    setSpeed = setPose

    def getPose(self) -> None:
        pass

    def ice_invocationTimeout(self, milliseconds: float) -> Servant:
        return self


def commanded(doc: Document, directory: Path) -> set[str]:
    """Return the servants that the code of a document commands when it runs."""
    path = directory / "commanded.xml"
    path.write_text(write_document(doc), encoding="utf-8")
    component, found = load_component(path)(), set[str]()
    for name in ("Head", "Neck"):
        setattr(component, name, Servant(name, found))
    runtime.VirtualRun(component).advance(0.5)
    return found
