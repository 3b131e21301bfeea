"""Write automaton documents for tests, and load the components that are generated from them."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from xml.sax.saxutils import escape

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from hfsm_runtime import Component

__all__ = ["compile_to", "document", "generate", "load", "problems", "state", "sub", "transition"]


def state(id: int, name: str, code: str = "", *, initial: bool = False, child: int = 0) -> str:
    """Return a state as XML; its code starts on the line of its tag."""
    return (
        f'<state initial="{str(initial).lower()}" id="{id}"><name>{escape(name)}</name>'
        f"<idSubautomataSon>{child}</idSubautomataSon><code>{escape(code)}</code></state>\n"
    )


def transition(
    id: int, origin: int, destination: int, trigger: str, *, type: str = "condition", code: str = "", name: str = ""
) -> str:  # fmt: skip
    """Return a transition as XML."""
    return (
        f'<transition id="{id}"><origin>{origin}</origin><destiny>{destination}</destiny>'
        f"<transcode>{escape(code)}</transcode><name>{escape(name)}</name>"
        f'<trans type="{type}">{escape(trigger)}</trans></transition>\n'
    )


def sub(
    id: int, father: int, *parts: str, variables: str = "", functions: str = "", period: str = "100"
) -> str:
    """Return an automaton as XML."""
    return (
        f'<SubAutomata id="{id}" idFather="{father}">\n{"".join(parts)}'
        f"<iteration_time>{escape(period)}</iteration_time>\n<variables>{escape(variables)}</variables>\n"
        f"<functions>{escape(functions)}</functions>\n</SubAutomata>\n"
    )


def document(
    *parts: str,
    libraries: tuple[str, ...] = (),
    config: str = "",
    head: str = "",
    events: tuple[str, ...] = (),
) -> str:
    """Return a document as XML; the first automaton starts on line 2. `events` may come from outside."""
    if events:
        names = "".join(f"<event><name>{escape(event)}</name></event>" for event in events)
        head += f"<events>{names}</events>"
    libs = "".join(f"<lib>{escape(library)}</lib>\n" for library in libraries)
    return (
        f"<VisualHFSM>{head}\n{''.join(parts)}<libraries>\n{libs}</libraries>\n"
        f"<config>\n{config}</config>\n</VisualHFSM>\n"
    )


def problems(path: Path, text: str, include: tuple[Path, ...] = ()) -> list[str]:
    """Return the diagnostics of a document, as `line:column: code: message`."""
    path.write_text(text, encoding="utf-8")
    diagnostics = Diagnostics()
    files = compile_document(path, None, diagnostics, include)
    assert (files is None) == diagnostics.has_errors
    return [
        f"{found.location.line}:{found.location.column}: {found.code}: {found.message}"
        for found in diagnostics
    ]


def compile_to(directory: Path, text: str, name: str = "behavior", include: tuple[Path, ...] = ()) -> Path:
    """Write a document and generate its component next to it; return the component's file."""
    path = directory / f"{name}.xml"
    path.write_text(text, encoding="utf-8")
    return generate(path, directory, include)


def generate(path: Path, directory: Path, include: tuple[Path, ...] = ()) -> Path:
    """Generate the component of a document into a directory; return its file."""
    diagnostics = Diagnostics()
    files = compile_document(path, directory, diagnostics, include)
    assert files is not None, diagnostics.render()
    (file,) = files
    file.path.write_text(file.text, encoding="utf-8")
    return file.path


def load(file: Path) -> Component:
    """Import a generated component and create an instance."""
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (found,) = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Component) and value._hfsm_document
    ]
    component: Component = found()
    return component
