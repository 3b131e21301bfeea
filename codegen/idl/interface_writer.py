"""Write an interface: its operations for the runtime, its proxy and its servant."""

from __future__ import annotations

from . import ast
from .annotations import Annotations
from .doc_comments import DocComment, parse_doc_comment
from .fingerprint import canonical_definition, fingerprint
from .layout import INDENT, bracketed, docstring, string
from .names import ModuleNames, python_name
from .record_writer import Field, fields_of, write_record
from .type_writer import TypeWriter


def write_interface(
    interface: ast.Interface, types: TypeWriter, annotations: Annotations, names: ModuleNames
) -> list[list[str]]:
    """Return the statements of an interface: structs and operations, then the proxy, then the servant."""
    return _InterfaceWriter(interface, types, annotations, names).write()


class _InterfaceWriter:
    def __init__(
        self, interface: ast.Interface, types: TypeWriter, annotations: Annotations, names: ModuleNames
    ) -> None:
        self._interface = interface
        self._types = types
        self._annotations = annotations
        self._names = names
        self._name = python_name(interface)
        self._description = names.private(interface.name)
        self._operations = {
            operation.name: names.private(interface.name, operation.name)
            for operation in interface.operations
        }

    def write(self) -> list[list[str]]:
        chunks: list[list[str]] = []
        for operation in self._interface.operations:
            chunks += self._structs_and_operation(operation)
        chunks.append(self._interface_description())
        chunks.append(self._proxy())
        chunks.append(self._servant())
        chunks += [
            [f"{self._names.defined(name)} = {name}"]
            for name in (self._name, f"{self._name}Prx")
            if self._names.is_shadowed(name)
        ]
        return chunks

    # For the runtime

    def _structs_and_operation(self, operation: ast.Operation) -> list[list[str]]:
        private = self._operations[operation.name]
        struct = self._names.runtime("Struct")
        chunks: list[list[str]] = []
        arguments = result = ""
        if operation.inputs:
            arguments = self._names.private(private.removeprefix("_"), "Arguments")
            fields = fields_of(operation.inputs, self._annotations, documented=False)
            chunks.append(write_record(arguments, "", [struct], fields))
        results = fields_of(operation.outputs, self._annotations, documented=False)
        if operation.returns is not None:
            optional = operation.return_tag is not None
            annotation = self._annotations.type(operation.returns, optional=optional)
            default = "None" if optional else ""
            results.insert(0, Field("returnValue", "returnValue", annotation, default=default))
        if results:
            result = self._names.private(private.removeprefix("_"), "Result")
            chunks.append(write_record(result, "", [struct], results))
        class_ = self._names.runtime("Operation")
        inputs = ", ".join(self._type(parameter) for parameter in operation.inputs)
        kind = f"{class_}[[{inputs}], {self._returned(operation)}]"
        items = [
            string(operation.name),
            f"arguments={arguments or self._types.empty_struct()}",
            f"result={result or self._types.empty_struct()}",
        ]
        thrown = [
            self._annotations.reference(named.definition, at_import=True)
            for named in operation.throws
            if named.definition
        ]
        if thrown:
            items.append(self._tuple("exceptions", thrown))
        method = python_name(operation)
        if method != operation.name:
            items.append(f"method={string(method)}")
        if operation.idempotent:
            items.append("idempotent=True")
        if operation.streamed:
            items.append("streamed=True")
        if operation.stop:
            items.append("stop=True")
        if operation.amd:
            items.append("amd=True")
        final = self._names.imported("typing", "Final")
        return [*chunks, bracketed(f"{private}: {final}[{kind}] = {class_}(", items, ")")]

    def _interface_description(self) -> list[str]:
        bases = [
            f"{self._annotations.reference(base, at_import=True)}.ice_interface" for base in self._bases()
        ]
        items = [string(self._interface.scoped)]
        if bases:
            items.append(self._tuple("bases", bases))
        operations = list(self._operations.values())
        if operations:
            items.append(self._tuple("operations", operations))
        items.append(f'fingerprint="{fingerprint(canonical_definition(self._interface))}"')
        items.append("module=__name__")
        final, class_ = self._names.imported("typing", "Final"), self._names.runtime("Interface")
        return bracketed(f"{self._description}: {final} = {class_}(", items, ")")

    @staticmethod
    def _tuple(argument: str, items: list[str]) -> str:
        """Return a tuple as an argument of a call that has each of its arguments on a line of its own."""
        if len(items) == 1:
            return f"{argument}=({items[0]},)"
        lines = bracketed(f"{argument}=(", items, ")", INDENT, reserve=1)
        return "\n".join(lines).removeprefix(INDENT)

    def _bases(self) -> list[ast.Interface]:
        """Return the interfaces that Python's classes derive from: not those that another one implies.

        They come in one order for all interfaces, those with the longest line of ancestors first: then Python
        finds a method resolution order for every class.
        """
        direct = self._interface.base_definitions
        implied = {ancestor.scoped for base in direct for ancestor in base.ancestors()}
        bases = [base for base in direct if base.scoped not in implied]
        return sorted(bases, key=lambda base: (-base.generation, base.scoped))

    # Proxy and servant

    def _class(self, suffix: str, root: str, doc: str) -> list[str]:
        bases = [
            self._annotations.reference(base, python_name(base) + suffix, at_import=True)
            for base in self._bases()
        ] or [self._names.runtime(root)]
        class_var = self._names.imported("typing", "ClassVar")
        interface = self._names.runtime("Interface")
        return [
            *bracketed(f"class {self._name}{suffix}(", bases, "):"),
            *docstring(doc, INDENT),
            "",
            f"{INDENT}ice_interface: {class_var}[{interface}] = {self._description}",
        ]

    def _proxy(self) -> list[str]:
        lines = self._class("Prx", "ObjectPrx", self._class_doc("Proxy"))
        for operation in self._interface.operations:
            name, private = python_name(operation), self._operations[operation.name]
            parameters = ["self", *self._parameters_with_defaults(operation)]
            arguments = [private, *(python_name(parameter) for parameter in operation.inputs)]
            returned = self._returned(operation)
            future = self._names.imported("concurrent.futures", "Future")
            lines.append("")
            if operation.streamed:
                lines.append(f"{INDENT}@{self._names.runtime('streamed')}({private})")
            lines += [
                *bracketed(f"def {name}(", parameters, f") -> {returned}:", INDENT),
                *docstring(self._operation_doc(operation, servant=False), INDENT * 2),
                *bracketed("return self.ice_invoke(", arguments, ")", INDENT * 2),
                "",
                *bracketed(f"def {operation.name}Async(", parameters, f") -> {future}[{returned}]:", INDENT),
                *docstring(f"Call `{name}` without waiting.", INDENT * 2),
                *bracketed("return self.ice_invokeAsync(", arguments, ")", INDENT * 2),
            ]
        return lines

    def _servant(self) -> list[str]:
        lines = self._class("", "Object", self._class_doc("Servant"))
        for operation in self._interface.operations:
            name, private = python_name(operation), self._operations[operation.name]
            current = self._own_parameter("current", operation)
            parameters = [
                "self",
                *self._parameters(operation),
                f"{current}: {self._names.runtime('Current')}",
            ]
            returned = dispatched = self._returned(operation)
            if operation.amd:
                dispatched = f"{self._names.runtime('Dispatched')}[{returned}]"
            lines += [
                "",
                f"{INDENT}@{self._names.imported('abc', 'abstractmethod')}",
                *bracketed(f"def {name}(", parameters, f") -> {dispatched}:", INDENT),
                *docstring(self._operation_doc(operation, servant=True), INDENT * 2),
            ]
            if operation.streamed:
                publisher = f"{self._names.runtime('Publisher')}[{returned}]"
                lines += [
                    "",
                    f"{INDENT}@{self._names.builtin('property')}",
                    f"{INDENT}def {operation.name}Publisher(self) -> {publisher}:",
                    *docstring(f"Publish `{name}` to those who subscribe.", INDENT * 2),
                    f"{INDENT * 2}return self.ice_publisher({private})",
                ]
        return lines

    def _type(self, parameter: ast.Parameter) -> str:
        return self._annotations.type(parameter.type, optional=parameter.tag is not None)

    @staticmethod
    def _own_parameter(name: str, operation: ast.Operation) -> str:
        """Return the name of a parameter that Slice does not know, apart from those that it does."""
        return f"{name}_" if any(python_name(each) == name for each in operation.inputs) else name

    def _parameters(self, operation: ast.Operation) -> list[str]:
        return [f"{python_name(parameter)}: {self._type(parameter)}" for parameter in operation.inputs]

    def _parameters_with_defaults(self, operation: ast.Operation) -> list[str]:
        """Return the parameters, of which the optional ones at the end need not be given."""
        parameters = self._parameters(operation)
        for number in reversed(range(len(parameters))):
            if operation.inputs[number].tag is None:
                break
            parameters[number] += " = None"
        return parameters

    def _returned(self, operation: ast.Operation) -> str:
        """Return the type of what a proxy's method returns: nothing, a value, or a tuple of them."""
        results = [self._type(parameter) for parameter in operation.outputs]
        if operation.returns is not None:
            optional = operation.return_tag is not None
            results.insert(0, self._annotations.type(operation.returns, optional=optional))
        if not results:
            return "None"
        return results[0] if len(results) == 1 else f"{self._names.builtin('tuple')}[{', '.join(results)}]"

    # Documentation

    def _class_doc(self, role: str) -> str:
        text = parse_doc_comment(self._interface.doc).text
        if not text:
            return f"{role} of {self._interface.name}."
        first_word = text.split()[0]
        starts_a_sentence = first_word[0].isupper() and first_word[1:].islower()
        return f"{role}: {text[0].lower() + text[1:] if starts_a_sentence else text}"

    def _operation_doc(self, operation: ast.Operation, *, servant: bool) -> str:
        doc = parse_doc_comment(operation.doc)
        paragraphs = [doc.text or f"{'Serve' if servant else 'Call'} `{operation.name}`."]
        described = [
            f"  {python_name(parameter)}: {text}"
            for parameter in operation.inputs
            if (text := self._parameter_doc(parameter, doc))
        ]
        if described:
            paragraphs.append("\n".join(["Args:", *described]))
        if returns := self._returns_doc(operation, doc):
            paragraphs.append(returns)
        thrown = [named.definition for named in operation.throws if named.definition]
        if thrown and any(doc.throws.values()):
            raised = [
                f"  {python_name(each)}: {text}" if text else f"  {python_name(each)}"
                for each in thrown
                for text in [doc.throws.get(each.name) or parse_doc_comment(each.doc).text]
            ]
            paragraphs.append("\n".join(["Raises:", *raised]))
        elif thrown:
            paragraphs.append(f"Raises {', '.join(python_name(each) for each in thrown)}.")
        return "\n\n".join(paragraphs)

    @staticmethod
    def _parameter_doc(parameter: ast.Parameter, doc: DocComment) -> str:
        return doc.parameters.get(parameter.name) or parse_doc_comment(parameter.doc).text

    def _returns_doc(self, operation: ast.Operation, doc: DocComment) -> str:
        outputs = [
            f"`{parameter.name}`" + (f" ({text})" if (text := self._parameter_doc(parameter, doc)) else "")
            for parameter in operation.outputs
        ]
        if not outputs:
            return f"Returns: {doc.returns}" if doc.returns else ""
        if operation.returns is not None:
            outputs.insert(0, "the return value" + (f" ({doc.returns})" if doc.returns else ""))
        if len(outputs) == 1:
            return f"Returns {outputs[0]}."
        return f"Returns a tuple: {', '.join(outputs)}."
