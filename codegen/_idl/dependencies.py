"""Divide the modules of Slice so that Python can import them, however they depend on each other.

Some definitions are needed when another one is executed: bases of classes, exceptions of operations, values
of constants and defaults, types in sequences and dictionaries. Such definitions never need each other, since
Slice declares names before their use; but their modules may:

    module m { struct A { int x; }; };
    module n { struct B { m::A a; }; };
    module m { struct C { n::B b; }; };

Such a module becomes several Python modules of one package. What only annotations name is looked up at the
first call, when everything is imported: modules may depend on each other by it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Mapping, Set
from graphlib import CycleError, TopologicalSorter
from typing import TypeVar

from ..graphs import reached
from . import ast
from .lexer import Source
from .packages import GeneratedModule, ModuleKey

_Node = TypeVar("_Node", bound=Hashable)
_DefinitionKey = tuple[Source, str]
_References = Callable[[ast.Definition], Iterator[ast.Definition]]


class ModuleGraph:
    """The Python modules of a run, divided where necessary, and what they depend on."""

    def __init__(self, modules: Mapping[ModuleKey, GeneratedModule]) -> None:
        self._whole = modules
        self._module_of = {
            _key(definition): module for module in modules.values() for definition in module.definitions
        }
        executed = cycles(self._edges(_executed_with))
        self._divide([module for module in modules.values() if module in executed])
        self._needs = self._edges(_named_in)
        self._cycles = cycles(self._needs)

    @property
    def modules(self) -> list[GeneratedModule]:
        """All modules, in the order of their definitions."""
        return list(dict.fromkeys(self._module_of.values()))

    def module_of(self, definition: ast.Definition) -> GeneratedModule:
        """Return the module of a definition."""
        module = self._module_of.get(_key(definition))
        return module or self._whole[definition.token.source, definition.module]

    def needed_by(self, module: GeneratedModule) -> Set[GeneratedModule]:
        """Return the other modules whose definitions a module names."""
        return self._needs[module]

    def in_cycle(self, one: GeneratedModule, other: GeneratedModule) -> bool:
        """Return whether two modules depend on each other, directly or not."""
        return other in self._cycles.get(one, ())

    def _edges(self, references: _References) -> dict[GeneratedModule, set[GeneratedModule]]:
        """Return the other modules to which the definitions of each module refer."""
        return {
            module: {
                self.module_of(each) for definition in module.definitions for each in references(definition)
            }
            - {module}
            for module in self.modules
        }

    def _divide(self, group: list[GeneratedModule]) -> None:
        """Divide modules that depend on each other when they are executed.

        Each part has a level above those of the parts that it needs. A definition goes to the last part of
        its module if this can have such a level, and to a new part if not.
        """
        definitions = {_key(each): each for module in group for each in module.definitions}
        needs = {
            key: [_key(needed) for needed in _executed_with(each) if _key(needed) in definitions]
            for key, each in definitions.items()
        }
        parts = {module: [module] for module in group}
        levels = dict.fromkeys(group, 0)
        ceilings: dict[GeneratedModule, int] = {}  # the lowest levels of those that need a part
        placed: dict[_DefinitionKey, GeneratedModule] = {}
        for key in TopologicalSorter(needs).static_order():
            whole = self._module_of[key]
            part = parts[whole][-1]
            required = {placed[each] for each in needs[key]} - {part}
            level = max((levels[each] + 1 for each in required), default=0)
            if level >= ceilings.get(part, level + 1):
                name = f"{whole.name}_part{len(parts[whole]) + 1}"
                part = GeneratedModule(whole.source, whole.slice_module, whole.doc, name=name)
                parts[whole].append(part)
            levels[part] = max(level, levels.get(part, 0))
            for each in required:
                ceilings[each] = min(levels[part], ceilings.get(each, levels[part]))
            placed[key] = part
        for module in group:
            own, module.definitions = module.definitions, []
            for definition in own:
                placed[_key(definition)].definitions.append(definition)
        self._module_of |= placed


def cycles(graph: Mapping[_Node, Set[_Node]]) -> dict[_Node, set[_Node]]:
    """Return the nodes in cycles, each with the set of its cycle: they all depend on each other."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError:
        return _strongly_connected(graph)
    return {}


def _strongly_connected(graph: Mapping[_Node, Set[_Node]]) -> dict[_Node, set[_Node]]:
    """Return the strongly connected components with several nodes, by node."""
    needed_by: dict[_Node, set[_Node]] = defaultdict(set)
    for node, needed in graph.items():
        for each in needed:
            needed_by[each].add(node)
    found: dict[_Node, set[_Node]] = {}
    for node in graph:
        if node not in found:
            below = reached([node], lambda each: graph.get(each, ()))
            component = {each for each in reached([node], needed_by.__getitem__) if each in below}
            found |= dict.fromkeys(component if len(component) > 1 else (), component)
    return found


def _key(definition: ast.Definition) -> _DefinitionKey:
    """Return what identifies a definition: each translation unit has its own tree of an included file."""
    return definition.token.source, definition.scoped


# References


def _executed_with(definition: ast.Definition) -> Iterator[ast.Definition]:
    """Yield what must be defined before the Python of a definition is executed."""
    match definition:
        case ast.Interface():
            yield from definition.base_definitions
            for operation in definition.operations:
                yield from (named.definition for named in operation.throws if named.definition is not None)
        case ast.Struct():
            for member in definition.members:
                yield from _in_initial_value(member)
        case ast.Derivable():
            if definition.base_definition is not None:
                yield definition.base_definition
            for member in definition.members:
                yield from _in_initial_value(member)
        case ast.Sequence():
            yield from _in_type(definition.element)
        case ast.Dictionary():
            yield from _in_type(definition.key)
            yield from _in_type(definition.value)
        case ast.Constant():
            yield from _in_value(definition.literal)


def _named_in(definition: ast.Definition) -> Iterator[ast.Definition]:
    """Yield what the Python of a definition names, in annotations, too."""
    yield from _executed_with(definition)
    for kind in ast.types_in(definition):
        yield from _in_type(kind)


def _in_type(kind: ast.Type) -> Iterator[ast.Definition]:
    target = kind.target if isinstance(kind, ast.ProxyType) else kind
    is_reference = target is kind
    match target:
        case ast.NamedType(definition=ast.Interface() as interface) if not is_reference:
            yield interface
        case ast.NamedType(definition=ast.Interface() | ast.ForwardDeclaration()):
            pass  # an interface by value is any value, and what no file defines is any object
        case ast.NamedType(definition=ast.Definition() as definition) if is_reference:
            yield definition


def _in_initial_value(member: ast.Member) -> Iterator[ast.Definition]:
    if member.default is not None:
        yield from _in_value(member.default)
    elif member.tag is None and isinstance(member.type, ast.NamedType):
        definition = member.type.definition
        if isinstance(definition, ast.Struct | ast.Enumeration):
            yield definition


def _in_value(literal: ast.Literal) -> Iterator[ast.Definition]:
    target = literal.target
    if isinstance(target, ast.Constant):
        yield target
    elif target is not None and target.enumeration is not None:
        yield target.enumeration
