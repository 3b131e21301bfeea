"""Generate the Python module for the definitions of one IDL file in one Slice module."""

from __future__ import annotations

from collections.abc import Iterable

from ..python_layout import INDENT, bracketed, docstring, source_order, stacked, string
from . import ast
from .dependencies import ModuleGraph
from .doc_comments import DocComment
from .names import ModuleNames, exception_member_name, exported_names, python_name, relative_name
from .packages import GeneratedModule, header
from .schema import fingerprint

_BUILTINS = {"bool": "bool", "string": "str", "float": "float", "double": "float"}
_INTEGERS = {"byte": "Byte", "short": "Short", "int": "Int", "long": "Long"}
_INITIAL = {"bool": "False", "string": '""', "float": "0.0", "double": "0.0"} | dict.fromkeys(_INTEGERS, "0")


def write_module(module: GeneratedModule, graph: ModuleGraph) -> str:
    """Return the source of a generated module; `graph` has all modules of the run."""
    return _ModuleWriter(module, graph).write()


class _ModuleWriter:
    def __init__(self, module: GeneratedModule, graph: ModuleGraph) -> None:
        self._module = module
        self._graph = graph
        self._names = ModuleNames(module.package, module.definitions)

    def write(self) -> str:
        definitions = self._module.definitions
        # At the end, since they may contain classes and proxies with forward declarations.
        aliases = [each for each in definitions if isinstance(each, ast.Sequence | ast.Dictionary)]
        chunks = [chunk for each in definitions if each not in aliases for chunk in self._write(each)]
        if aliases:
            chunks.append([line for alias in aliases for line in self._alias(alias)])
        exported = {name for definition in definitions for name in exported_names(definition)}
        head = header(self._module.text, [self._module.source.path.name])
        if any(isinstance(each, ast.Interface) for each in definitions):
            # The result of a method that declares an operation comes from the servant.
            head.append('# mypy: disable-error-code="empty-body"')
        lines = stacked(
            [
                head,
                self._names.import_lines(),
                bracketed("__all__ = [", [f'"{name}"' for name in source_order(exported)], "]"),
                *chunks,
            ]
        )
        return "\n".join(lines) + "\n"

    def _write(self, definition: ast.Definition) -> list[list[str]]:
        """Return the statements of a definition."""
        name = python_name(definition)
        match definition:
            case ast.Interface():
                chunks = [self._proxy(definition), self._servant(definition)]
            case ast.Struct():
                chunks = [self._record(definition, [self._names.runtime("Struct")])]
            case ast.Class():
                base = self._base(definition, "Value")
                chunks = [self._record(definition, [base, f'tag="{definition.scoped}"'])]
            case ast.ExceptionType():
                base = self._base(definition, "UserException")
                chunks = [self._record(definition, [base, f'id="{definition.scoped}"'])]
            case ast.Enumeration():
                chunks = [self._enumeration(definition)]
            case ast.Constant():
                chunks = [self._constant(definition)]
            case _:
                raise AssertionError(f"no Python for {definition}")
        names = (name, f"{name}Prx") if isinstance(definition, ast.Interface) else (name,)
        shadowed = [each for each in names if self._names.is_shadowed(each)]
        return [*chunks, *([f"{self._names.defined(each)} = {each}"] for each in shadowed)]

    # Types and values

    def _type(self, kind: ast.Type, *, optional: bool = False, annotation: bool = True) -> str:
        """Return a type, for an annotation or not; one that is nullable, or `optional`, can be None."""
        match kind:
            case ast.BuiltinType(name="Object" | "Value"):
                text = self._names.runtime("Value")
            case ast.BuiltinType(name=name) if name in _BUILTINS:
                text = self._names.builtin(_BUILTINS[name])
            case ast.BuiltinType(name=name):
                text = self._names.runtime(_INTEGERS[name])
            case ast.ProxyType(target=ast.NamedType(definition=ast.Interface() as interface)):
                text = self._reference(interface, f"{python_name(interface)}Prx", annotation=annotation)
            case ast.ProxyType():
                text = self._names.runtime("ObjectPrx")
            case ast.NamedType(definition=ast.Interface() | ast.ForwardDeclaration()):
                text = self._names.runtime("Value")
            case ast.NamedType(definition=ast.Definition() as definition):
                text = self._reference(definition, annotation=annotation)
            case _:
                raise AssertionError(f"the checker accepted {kind}")
        return f"{text} | None" if optional or _is_nullable(kind) else text

    def _container(self, definition: ast.Sequence | ast.Dictionary) -> str:
        match definition:
            case ast.Sequence(element=ast.BuiltinType(name="byte")):
                return self._names.builtin("bytes")
            case ast.Sequence(element=element):
                return f"{self._names.builtin('list')}[{self._type(element, annotation=False)}]"
            case ast.Dictionary(key=key, value=value):
                types = f"{self._type(key, annotation=False)}, {self._type(value, annotation=False)}"
                return f"{self._names.builtin('dict')}[{types}]"

    def _reference(self, definition: ast.Definition, name: str = "", *, annotation: bool = False) -> str:
        """Return a definition, or another name of its module, as it is written in this module.

        In annotations it is looked up in its package, if its module also depends on this one.
        """
        name = name or python_name(definition)
        module = self._graph.module_of(definition)
        here = self._module.package
        if module is self._module:
            return self._names.defined(name)
        if annotation and self._graph.in_cycle(module, self._module):
            *around, package = module.package
            return f"{self._names.imported(relative_name(here, tuple(around)), package)}.{name}"
        return self._names.imported(relative_name(here, module.package, module.name), name)

    def _base(self, definition: ast.Derivable, root: str) -> str:
        base = definition.base_definition
        return self._reference(base) if base else self._names.runtime(root)

    def _value(self, literal: ast.Literal, kind: ast.Type) -> str:
        """Return the value of a constant or a default as an expression."""
        target, value = literal.target, literal.value
        if isinstance(target, ast.Constant):
            return self._reference(target)
        if isinstance(target, ast.Enumerator) and target.enumeration is not None:
            return f"{self._reference(target.enumeration)}.{python_name(target)}"
        if isinstance(value, str):
            return string(value)
        if isinstance(kind, ast.BuiltinType) and _BUILTINS.get(kind.name) == "float":
            return repr(float(value or 0)).replace("e+", "e")
        return repr(value)

    def _initial(self, member: ast.Member) -> str:
        """Return the default value of a member, as in Ice's mapping to Python.

        A sequence or dictionary is empty; in Ice it is None, which is sent as empty.
        """
        kind = member.type
        if member.default is not None:
            return self._value(member.default, kind)
        if member.tag is not None:
            return "None"
        if _is_nullable(kind):
            return self._names.runtime("NULL")
        match kind:
            case ast.BuiltinType(name=name):
                return _INITIAL[name]
            case ast.NamedType(definition=ast.Sequence(element=ast.BuiltinType(name="byte"))):
                return 'b""'
            case ast.NamedType(definition=ast.Sequence()):
                return "[]"
            case ast.NamedType(definition=ast.Dictionary()):
                return "{}"
            case ast.NamedType(definition=ast.Enumeration() as enumeration):
                return f"{self._reference(enumeration)}.{python_name(enumeration.enumerators[0])}"
            case ast.NamedType(definition=ast.Struct() as struct):
                return f"{self._reference(struct)}()"
        raise AssertionError(f"no value for {kind}")

    # Data

    def _record(self, definition: ast.Struct | ast.Derivable, bases: list[str]) -> list[str]:
        """Return the class of a struct, a class or an exception."""
        is_exception = isinstance(definition, ast.ExceptionType)
        lines = bracketed(f"class {python_name(definition)}(", bases, "):")
        doc = _doc_lines(definition, INDENT)
        lines += [*doc, *([""] if doc and definition.members else [])]
        for member in definition.members:
            name = exception_member_name(member) if is_exception else python_name(member)
            annotation = self._type(member.type, optional=member.tag is not None)
            lines.append(f"{INDENT}{name}: {annotation} = {self._initial(member)}")
            lines += _doc_lines(member, INDENT)
        if not doc and not definition.members:
            lines.append(f"{INDENT}pass")
        return lines

    def _alias(self, definition: ast.Sequence | ast.Dictionary) -> list[str]:
        name = python_name(definition)
        lines = [f"{name} = {self._container(definition)}", *_doc_lines(definition)]
        return [*lines, f"{self._names.defined(name)} = {name}"] if self._names.is_shadowed(name) else lines

    def _enumeration(self, definition: ast.Enumeration) -> list[str]:
        doc = _doc_lines(definition, INDENT)
        lines = [f"class {python_name(definition)}({self._names.runtime('IntEnum')}):", *doc]
        lines += [""] if doc else []
        for enumerator in definition.enumerators:
            lines.append(f"{INDENT}{python_name(enumerator)} = {enumerator.value}")
            lines += _doc_lines(enumerator, INDENT)
        return lines

    def _constant(self, definition: ast.Constant) -> list[str]:
        final = self._names.imported("typing", "Final")
        value = self._value(definition.literal, definition.type)
        line = f"{python_name(definition)}: {final}[{self._type(definition.type)}] = {value}"
        return [line, *_doc_lines(definition)]

    # Interfaces

    def _proxy(self, interface: ast.Interface) -> list[str]:
        """Return the class that declares an interface and is its proxy."""
        options = [f'id="{interface.scoped}"', f'fingerprint="{fingerprint(interface)}"']
        doc = interface.documentation.text or f"Proxy of {interface.name}."
        lines = self._class(interface, "Prx", "ObjectPrx", options, doc)
        for operation in interface.operations:
            decorator = self._names.runtime("stream" if operation.streamed else "operation")
            parameters = ["self", *self._parameters(operation, with_defaults=True)]
            returned = self._returned(operation)
            lines += [
                "",
                *bracketed(f"@{decorator}(", self._options(operation), ")", INDENT),
                *bracketed(f"def {python_name(operation)}(", parameters, f") -> {returned}:", INDENT),
                *docstring(_operation_doc(operation), INDENT * 2),
            ]
        return lines

    def _servant(self, interface: ast.Interface) -> list[str]:
        name = python_name(interface)
        proxy = self._names.defined(f"{name}Prx")
        doc = f"Servant of `{name}Prx`, which describes the operations."
        lines = self._class(interface, "", "Object", [f"proxy={proxy}"], doc)
        streamed = [each for each in interface.operations if each.streamed]
        if streamed:
            lines.append("")
        for operation in streamed:
            publisher = f"{self._names.runtime('publisher')}({proxy}.{python_name(operation)})"
            lines.append(f"{INDENT}{operation.name}Publisher = {publisher}")
        if interface.operations:
            lines.append("")
        for operation in interface.operations:
            returned = self._returned(operation)
            current = "current_" if any(each.name == "current" for each in operation.inputs) else "current"
            parameters = ["self", *self._parameters(operation)]
            parameters.append(f"{current}: {self._names.runtime('Current')}")
            lines.append(f"{INDENT}@{self._names.runtime('abstractmethod')}")
            method = f"def {python_name(operation)}("
            lines += bracketed(method, parameters, f") -> {returned}: ...", INDENT)
        return lines

    def _class(
        self, interface: ast.Interface, suffix: str, root: str, options: list[str], doc: str
    ) -> list[str]:
        bases = [self._reference(base, python_name(base) + suffix) for base in _bases(interface)]
        items = [*(bases or [self._names.runtime(root)]), *options]
        return [
            *bracketed(f"class {python_name(interface)}{suffix}(", items, "):"),
            *docstring(doc, INDENT),
        ]

    def _options(self, operation: ast.Operation) -> list[str]:
        """Return the arguments of an operation's decorator."""
        results = [] if operation.returns is None else ["returnValue"]
        results += [python_name(each) for each in operation.outputs]
        optional = [python_name(each) for each in operation.inputs if each.tag is not None]
        optional += ["returnValue"] * (operation.return_tag is not None)
        optional += [python_name(each) for each in operation.outputs if each.tag is not None]
        thrown = [self._reference(named.definition) for named in operation.throws if named.definition]
        named = {
            "throws": thrown,
            "results": [string(each) for each in results if results != ["returnValue"]],
            "optional": [string(each) for each in optional],
        }
        marks = {"idempotent": operation.idempotent, "stop": operation.stop}
        return [
            *(
                f"{name}=({', '.join(items)}{',' * (len(items) == 1)})"
                for name, items in named.items()
                if items
            ),
            *(f"{name}=True" for name, is_marked in marks.items() if is_marked),
        ]

    def _parameters(self, operation: ast.Operation, *, with_defaults: bool = False) -> list[str]:
        """Return the parameters; with defaults, the optional ones at the end can be omitted."""
        parameters = [
            f"{python_name(each)}: {self._type(each.type, optional=each.tag is not None)}"
            for each in operation.inputs
        ]
        for number in reversed(range(len(parameters) if with_defaults else 0)):
            if operation.inputs[number].tag is None:
                break
            parameters[number] += " = None"
        return parameters

    def _returned(self, operation: ast.Operation) -> str:
        """Return the return type of a proxy's method: None, one type, or a tuple."""
        results = [self._type(each.type, optional=each.tag is not None) for each in operation.outputs]
        if operation.returns is not None:
            results.insert(0, self._type(operation.returns, optional=operation.return_tag is not None))
        if not results:
            return "None"
        return results[0] if len(results) == 1 else f"{self._names.builtin('tuple')}[{', '.join(results)}]"


def _is_nullable(kind: ast.Type) -> bool:
    match kind:
        case ast.BuiltinType(name="Object" | "Value") | ast.ProxyType():
            return True
        case ast.NamedType(definition=ast.Class() | ast.Interface() | ast.ForwardDeclaration()):
            return True
    return False


def _bases(interface: ast.Interface) -> list[ast.Interface]:
    """Return the bases of the Python classes, without those that another base implies.

    They have the same order for all interfaces, with the most ancestors first, so that there is a method
    resolution order for every class.
    """
    direct = interface.base_definitions
    implied = {ancestor.scoped for base in direct for ancestor in base.ancestors()}
    bases = [base for base in direct if base.scoped not in implied]
    return sorted(bases, key=lambda base: (-len(list(base.ancestors())), base.scoped))


# Documentation


def _doc_lines(definition: ast.Definition, indent: str = "") -> list[str]:
    """Return the docstring of a definition, if it has a doc comment."""
    text = definition.documentation.text
    return docstring(text, indent) if text else []


def _operation_doc(operation: ast.Operation) -> str:
    """Return the docstring of an operation; its exceptions are in the decorator."""
    doc = operation.documentation
    paragraphs = [doc.text or f"Call `{operation.name}`."]
    paragraphs += _list("Args", operation.inputs, doc.parameters)
    if returns := _returns_doc(operation, doc):
        paragraphs.append(returns)
    if any(doc.throws.values()):
        thrown = [named.definition for named in operation.throws if named.definition]
        paragraphs += _list("Raises", thrown, doc.throws)
    return "\n\n".join(paragraphs)


def _list(title: str, definitions: Iterable[ast.Definition], texts: dict[str, str]) -> list[str]:
    """Return a paragraph with the documentation of definitions, if they have any."""
    described = [
        f"  {python_name(each)}: {text}"
        for each in definitions
        if (text := texts.get(each.name) or each.documentation.text)
    ]
    return ["\n".join([f"{title}:", *described])] if described else []


def _returns_doc(operation: ast.Operation, doc: DocComment) -> str:
    outputs = [
        f"`{each.name}`" + (f" ({text})" if (text := doc.parameters.get(each.name)) else "")
        for each in operation.outputs
    ]
    if not outputs:
        return f"Returns: {doc.returns}" if doc.returns else ""
    if operation.returns is not None:
        outputs.insert(0, "the return value" + (f" ({doc.returns})" if doc.returns else ""))
    return f"Returns {outputs[0]}." if len(outputs) == 1 else f"Returns a tuple: {', '.join(outputs)}."
