"""The types of the page's messages, made from those of Python: `python -m tools.generators.protocol_types`.

The page has no build step: its modules are JavaScript whose comments name these types, and TypeScript checks
them. They are messages, commands and values as msgspec encodes and decodes them, and elements of documents as
`visualhfsm._document.views` shows them.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterable, Mapping
from types import NoneType, UnionType
from typing import Any, Final, get_args, get_type_hints

import msgspec
from msgspec import inspect as shapes

from codegen.hfsm.document import Automaton, Document, Event, Interface, Node, Text
from codegen.messages import Message
from tools.workspace import ROOT
from visualhfsm._base.html_file import STATIC
from visualhfsm._document.commands import COMMANDS
from visualhfsm._document.problems import CounterexampleView, StepView
from visualhfsm._document.views import SHOWN
from visualhfsm._editor import protocol
from visualhfsm._monitor.messages import Push
from visualhfsm._processes.test_results import TestsPush
from visualhfsm.plugins import ViewPush
from visualhfsm.project._code_help.protocol import Explanation as NameExplanation

__all__ = ["FILE", "TRIALS", "protocol_types", "trials_types"]

FILE: Final = STATIC / "data" / "protocol.d.ts"
TRIALS: Final = ROOT / "plugins/trials/src/visualhfsm_trials/static/messages.d.ts"
"""The types of a plug-in, which a checkout may lack."""

_HEAD: Final = (
    "// Written by `python -m tools.generators.protocol_types` from the types of Python. Do not edit.\n"
)
_MODULE: Final = "visualhfsm/data/protocol.js"
_PAGE: Final = """
/** The last parameters of a function that takes the fields of a message, which may have none. */
export type FieldsOf<Message> = {} extends Message ? [Message?] : [Message];

/** What the server answers: the value of a request, or why it was refused. */
export interface Answer {
  push?: undefined;
  re: number;
  ok?: unknown;
  error?: string;
  kind: string;
}

export type Workspace = Omit<WorkspacePush, "push">;

/** A text as elements: their tags, attributes and content. */
export type Words = (string | [tag: string, attributes: Record<string, string>, content: Words])[];

/** A document without its automata. */
export type Fields = DocumentFields & {name: string};
"""
"""What the page makes of these types."""
_NAMES: Final[Mapping[type, str]] = {
    CounterexampleView: "Counterexample",
    Document: "DocumentFields",  # the browser has another Document, and other events
    Event: "DocumentEvent",
    NameExplanation: "NameExplanation",
    StepView: "Step",
}
"""Types whose names in the page differ, since names of all modules of Python meet there."""

_WIDTH: Final = 120


def protocol_types() -> str:
    """Return the types of everything that passes between page and server, as TypeScript."""
    writer = _Writer()
    known: set[type[msgspec.Struct]] = {*_descendants(Push), TestsPush}  # no other import makes it known
    known.difference_update(_descendants(ViewPush))  # a view has types of its own
    pushes = sorted(known, key=_name_of_push)
    writer.alias("Push", "".join(f"\n  | {writer.message(each, _name_of_push(each))}" for each in pushes))
    requests = sorted(_concrete_requests(), key=lambda each: each.__name__)
    writer.table("Requests", "The fields of each request.", requests, left_out=("id:",))
    writer.table("Commands", "The fields of each command.", COMMANDS)
    writer.alias("Command", "{[Name in keyof Commands]: {command: Name} & Commands[Name]}[keyof Commands]")
    writer.answers(requests)
    for element in (Document, Automaton):
        writer.element(element)
    return writer.text()


def trials_types() -> str:
    """Return the types of what passes between the page of trials and its view, as TypeScript."""
    from visualhfsm_trials._messages import TrialsPush
    from visualhfsm_trials._view import view as trials

    writer = _Writer()
    writer.message(TrialsPush, "TrialsPush")
    requests = sorted(trials.requests, key=lambda each: each.__name__)
    writer.table("Requests", "The fields of each request.", requests, left_out=("id:",))
    writer.answers(requests)
    return writer.text_of_view()


def _descendants(base: type[msgspec.Struct]) -> list[type[msgspec.Struct]]:
    return [each for child in base.__subclasses__() for each in (child, *_descendants(child))]


def _concrete_requests() -> list[type[msgspec.Struct]]:
    """Return the requests of the page itself, which the server decodes."""
    return [*protocol.REQUESTS]


def _name_of_push(push: type[msgspec.Struct]) -> str:
    return f"{push.__name__.removesuffix('Push')}Push"


class _Writer:
    """Writes interfaces, each with those that it names."""

    def __init__(self) -> None:
        self._written: dict[str, str] = {}
        self._types: dict[str, type] = {}

    def text(self) -> str:
        """Return all that was written, in alphabetical order."""
        return "\n".join([_HEAD + _PAGE, *(self._written[name] for name in sorted(self._written))])

    def text_of_view(self) -> str:
        """Return the same of a view, whose requests are added to those of the page."""
        added = [self._written.pop(name).partition("\n")[2] for name in ("Answers", "Requests")]
        lines = "".join(added).replace("export ", "").splitlines()
        module = [f'declare module "{_MODULE}" {{', *(f"  {line}" for line in lines), "}", ""]
        types = [self._written[name] for name in sorted(self._written)]
        return "\n".join([_HEAD, *types, "\n".join(module)])

    def alias(self, name: str, content: str) -> None:
        """Write a type that is made of others."""
        self._written[name] = f"export type {name} = {content};\n".replace("= \n", "=\n")

    def message(self, kind: type[msgspec.Struct], name: str) -> str:
        """Write a message with its tag, and return its name."""
        shape = _struct(kind)
        tag = f'{shape.tag_field}: "{shape.tag}"'
        self._interface(name, kind, lambda: [tag, *self._fields(shape)])
        return name

    def table(
        self, name: str, doc: str, kinds: Iterable[type[msgspec.Struct]], left_out: tuple[str, ...] = ()
    ) -> None:
        """Write an interface with the fields of each type below its tag."""
        lines = [f"/** {doc} */", f"export interface {name} {{"]
        for kind in kinds:
            shape = _struct(kind)
            fields = [field for field in self._fields(shape) if not field.startswith(left_out)]
            lines += [f"  /** {_first_line(kind)} */", *_member(shape.tag, fields)]
        self._written[name] = "\n".join([*lines, "}", ""])

    def answers(self, kinds: Iterable[type[msgspec.Struct]]) -> None:
        """Write an interface with the answer to each request."""
        lines = ["/** The answer to each request. */", "export interface Answers {"]
        for kind in kinds:
            answer: Any = getattr(kind, "answer")  # noqa: B009 - of requests alone
            several = get_args(answer) if isinstance(answer, UnionType) else (answer,)
            types = [self._type(shapes.type_info(each)) for each in several]
            lines.append(f"  {_struct(kind).tag}: {' | '.join(dict.fromkeys(types))};")
        self._written["Answers"] = "\n".join([*lines, "}", ""])

    def reference(self, kind: type, fields: Callable[[], list[str]] | None = None) -> str:
        """Write a type that messages contain, unless it is written, and return its name."""
        name = _NAMES.get(kind, kind.__name__)
        if name not in self._written:
            self._interface(name, kind, fields or (lambda: self._fields(_struct(kind))))
        assert self._types[name] is kind, f"two types are called {name}: add one of them to _NAMES"
        return name

    def element(self, kind: type[Node]) -> str:
        """Write an element of a document as the page gets it, and return its name."""
        name = _NAMES.get(kind, kind.__name__)
        if name not in self._written:
            hints = get_type_hints(kind)

            def fields() -> list[str]:
                found = {shown: self._shown(hints[field]) for field, shown in SHOWN[kind]}
                if kind is Interface:
                    found |= {"proxy": "string", "identity": "string"}
                return [f"{field}: {type_}" for field, type_ in found.items()]

            self._interface(name, kind, fields)
        return name

    def _interface(self, name: str, kind: type, fields: Callable[[], list[str]]) -> None:
        self._types[name] = kind
        self._written[name] = ""  # it may contain itself
        lines = [f"  {field};" for field in fields()]
        doc = f"/** {_first_line(kind)} */"
        self._written[name] = "\n".join([doc, f"export interface {name} {{", *lines, "}", ""])

    def _fields(self, shape: shapes.StructType) -> list[str]:
        """Return the fields of a struct; those that a message may leave out are optional."""
        may_lack = shape.forbid_unknown_fields or shape.cls.__struct_config__.omit_defaults
        found = []
        for field in shape.fields:
            is_optional = may_lack and not field.required
            found.append(f"{field.encode_name}{'?' if is_optional else ''}: {self._type(field.type)}")
        return found

    def _member(self, field: shapes.Field) -> str:
        return f"{field.encode_name}{'' if field.required else '?'}: {self._type(field.type)}"

    def _type(self, shape: shapes.Type) -> str:
        """Return a type of JSON, and write those that it names."""
        match shape:
            case shapes.Metadata(extra={"page": name}):
                return str(name)
            case shapes.Metadata(type=inner):
                return self._type(inner)
            case (
                shapes.TypedDictType(cls=kind, fields=fields) | shapes.DataclassType(cls=kind, fields=fields)
            ):
                return self.reference(kind, lambda: [self._member(each) for each in fields])
            case shapes.UnionType(types=types):
                return " | ".join(dict.fromkeys(self._type(each) for each in types))
            case shapes.StructType(array_like=True, fields=fields):
                return f"[{', '.join(f'{field.name}: {self._type(field.type)}' for field in fields)}]"
            case shapes.StructType(cls=kind, tag="") | shapes.StructType(cls=kind, tag=None):
                return self.reference(kind)
            case shapes.StructType():
                return "Command"
            case shapes.BoolType():
                return "boolean"
            case shapes.EnumType(cls=kind) if issubclass(kind, str):
                return _either(each.value for each in kind)
            case shapes.IntType() | shapes.FloatType() | shapes.EnumType():
                return "number"
            case shapes.StrType() | shapes.BytesType():
                return "string"
            case shapes.CustomType(cls=kind) if kind is Message:
                return "string"
            case shapes.NoneType():
                return "null"
            case shapes.LiteralType(values=values):
                return _either(values)
            case shapes.TupleType(item_types=items):
                return f"[{', '.join(self._type(each) for each in items)}]"
            case shapes.CollectionType(item_type=item):
                return _array(self._type(item))
            case shapes.DictType(value_type=value):
                return f"Record<string, {self._type(value)}>"
            case shapes.AnyType() | shapes.RawType():
                return "unknown"
        raise NotImplementedError(f"{shape} has no equivalent in TypeScript yet")

    def _shown(self, hint: Any) -> str:  # noqa: ANN401 - a type, also one of several
        """Return the type of a field of an element."""
        if inspect.isclass(hint) and issubclass(hint, Node):
            return self.element(hint)
        plain = {
            str: "string",
            Text: "string",
            bool: "boolean",
            int: "number",
            float: "number",
            NoneType: "null",
        }
        if hint in plain:
            return plain[hint]
        arguments = get_args(hint)
        if Ellipsis in arguments:
            return _array(self._shown(arguments[0]))
        return " | ".join(self._shown(each) for each in arguments)


def _struct(kind: type[msgspec.Struct]) -> shapes.StructType:
    shape = shapes.type_info(kind)
    assert isinstance(shape, shapes.StructType)
    return shape


def _member(name: object, fields: Iterable[str]) -> list[str]:
    """Return the lines of a member that is an object."""
    line = f"  {name}: {{{'; '.join(fields)}}};"
    if len(line) <= _WIDTH:
        return [line]
    return [f"  {name}: {{", *(f"    {field};" for field in fields), "  };"]


def _either(values: Iterable[object]) -> str:
    return " | ".join(json.dumps(value) for value in values)


def _array(item: str) -> str:
    return f"({item})[]" if " | " in item else f"{item}[]"


def _first_line(kind: type) -> str:
    return inspect.cleandoc(kind.__doc__ or "").partition("\n")[0]


if __name__ == "__main__":
    FILE.write_text(protocol_types(), encoding="utf-8")
    if TRIALS.exists():
        TRIALS.write_text(trials_types(), encoding="utf-8")
