"""Replace a running component with the present version of its file, without stopping it.

Whatever may fail or take long comes first: the file is loaded, its automata are made and its new proxies
connected. Only then do they replace the old ones, between two cycles.
"""

from __future__ import annotations

import linecache
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from itertools import count
from pathlib import Path
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Final

from interfaces.hfsm import ReloadReport
from zenoh_ice import ZenohIceError
from zenoh_ice.data.text import sentence

from .._automaton import Automaton, State
from .._component_run import ComponentRun
from .._stop import begin_to_stop_robot, stop_removed
from .._variables import cells_of, values_of
from ..component import Component, make_automata, parameters_of, proxies_of, source_of
from ..errors import ComponentError, ReloadRefusedError, describe
from ..loading import has_own_builtins, load_module, loading_again
from ..places import locate
from ..tree import Actor, Phase, Replaced, Tree, grow
from ._expressions import plain


class Reloading:
    """Exchange one component for other versions of it, any number of times; create it before it has run.

    `connect` connects the proxies of a component that are not connected yet.
    """

    def __init__(self, run: ComponentRun, connect: Callable[[Component], None]) -> None:
        self._run = run
        self._connect = connect
        self._busy = threading.Lock()
        self._first = first_values_of(run.tree.actors)

    def reload(self) -> ReloadReport:
        """Continue with the present file of the component; keep the states, timers and variables it has.

        Raises ReloadRefusedError; the component then continues unchanged.
        """
        with self._alone():
            run = self._run
            if run.tree.root.phase is Phase.UNUSED or run.ended.is_set():
                raise ReloadRefusedError("the component does not run")
            former = type(run.component)
            with _loaded_again(former, Path(source_of(run.component))) as loaded:
                try:
                    report = self._exchange(self._make(loaded))
                except ReloadRefusedError:
                    _forget(loaded)
                    raise
            _forget(former)
            return report

    def exchange(self, component: Component) -> ReloadReport:
        """Continue with another version of the component; raises what making its automata raises."""
        with self._alone():
            return self._exchange(Replacement(self._run.component, component, self._connect))

    @contextmanager
    def _alone(self) -> Iterator[None]:
        if not self._busy.acquire(blocking=False):
            raise ReloadRefusedError("another reload is under way")
        try:
            yield
        finally:
            self._busy.release()

    def _exchange(self, replacement: Replacement) -> ReloadReport:
        run = self._run
        apply = partial(replacement.apply, run.tree, self._first)
        held = run.replace(replacement.component, replacement.actors, apply)
        self._first = replacement.first
        return ReloadReport(run.reloads, held, replacement.not_kept)

    def _make(self, loaded: type[Component]) -> Replacement:
        run = self._run
        try:
            made = Replacement(run.component, loaded(), self._connect)
        except (ComponentError, ZenohIceError) as error:
            raise ReloadRefusedError(str(error)) from error
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a document may define what makes its component
            place = locate(error, source_of(run.component))
            reason = f"{describe(error)} at {place}" if place else describe(error)
            raise ReloadRefusedError(sentence(f"the component cannot be created: {reason}")) from error
        name = made.actors[0].automaton.name
        if name != run.name:
            raise ReloadRefusedError(f"the file now defines {name}, not {run.name}")
        return made


FirstValues = Mapping[str, object]
"""Copies of the initial values of an automaton's variables, by name, where they are plain data."""


def first_values_of(actors: tuple[Actor, ...]) -> dict[int, FirstValues]:
    """Return the initial values of the automata's variables, by automaton id; call it before they run."""
    first: dict[int, FirstValues] = {}
    for actor in actors:
        first[actor.automaton.id] = values = {}
        for name, value in values_of(actor.automaton).items():
            with suppress(ValueError):  # not plain data: whether it changes is unknown
                values[name] = plain(value)
    return first


class Replacement:
    """Another version of a component, with its automata, made while the former one still runs.

    It takes over the attributes of the former version, then `connect` connects new proxies. Creating it runs
    the variables of the document; raises the exceptions of `make_automata`, and DefinitionError. `not_kept`
    has texts about what the new version could not keep; it is complete after `apply`.
    """

    def __init__(
        self, former: Component, component: Component, connect: Callable[[Component], None] = lambda _: None
    ) -> None:
        kept, self.not_kept = _kept(former, type(component))
        vars(component).update({name: value for name, value in vars(former).items() if name in kept})
        connect(component)
        self._former = former
        self.component = component
        self.actors = grow(make_automata(component))
        self.first = first_values_of(self.actors)

    def apply(self, tree: Tree, first: Mapping[int, FirstValues], now: int) -> Replaced:
        """Take the place of the former version, under the lock of the tree and while no cycle runs.

        `first` has the initial values of the former version's variables.
        """
        for new in self.actors:
            old, own = tree.actor(new.automaton.id), new.automaton
            if old is not None:
                lost = ", ".join(_carry_variables(old.automaton, own, first.get(own.id, {})))
                if lost:
                    text = sentence(f"no code of automaton {own.id} ({own.name}) uses {lost} any more")
                    self.not_kept.append(text)
                for output, kind in _retyped(old.automaton, own).items():
                    text = sentence(
                        f"the output {output} of automaton {own.id} ({own.name}) is {kind.__name__} now and "
                        "has its default again"
                    )
                    self.not_kept.append(text)
        stop_removed(self._former, self.component)
        _share_attributes(self._former, self.component)
        began = {actor: actor.active for actor in tree.actors if actor.phase is not Phase.UNUSED}
        replaced = tree.replace(self.actors, now)
        for actor in replaced.gone:
            own, state = actor.automaton, actor.current
            if actor in began:
                text = sentence(f"automaton {own.id} ({own.name}) is gone, which was in {state.name}")
                self.not_kept.append(text + self._without_exit(state, is_active=began[actor]))
            else:
                self.not_kept.append(sentence(f"automaton {own.id} ({own.name}) is gone"))
        for actor, left in replaced.displaced:
            own, initial = actor.automaton, actor.automaton.initial
            text = sentence(
                f"automaton {own.id} ({own.name}) was in the state {left.name}, which is gone, and restarts "
                f"in {initial.name}"
            )
            self.not_kept.append(text + self._without_exit(left, is_active=began[actor]))
        return replaced

    def _without_exit(self, left: State, *, is_active: bool) -> str:
        """Stop everything if the state is active, since its exit code does not run, and say so."""
        if left.exit is None:
            return ""
        if is_active:
            begin_to_stop_robot(self._former)
        return f"; {sentence('its exit code did not run')}"


def _carry_variables(old: Automaton, new: Automaton, first: FirstValues) -> list[str]:
    """Give variables of a new version of an automaton their old values; return the names of those lost.

    One that still has its first value gets the new version's: a number changed in the document takes effect.
    """
    cells, retyped = cells_of(new), _retyped(old, new)
    lost = []
    for name, cell in cells_of(old).items():
        if name in retyped:
            continue
        try:
            value = cell.cell_contents
        except ValueError:  # nothing has been assigned
            continue
        if _is_code(value):
            continue
        if name not in cells:
            lost.append(name)
            continue
        try:
            begins_with = cells[name].cell_contents
        except ValueError:
            cells[name].cell_contents = value
            continue
        if not _is_code(begins_with) and not (name in first and _same(value, first[name])):
            cells[name].cell_contents = value
    return sorted(lost)


def _retyped(old: Automaton, new: Automaton) -> dict[str, type]:
    """Return the new types of outputs that had another type before, by name."""
    former = {each.name: each.type for each in old.outputs}
    return {each.name: each.type for each in new.outputs if former.get(each.name, each.type) is not each.type}


def _share_attributes(old: Component, new: Component) -> None:
    """Share the attributes of both versions: threads of old code still assign them."""
    shared = vars(old)
    kept, _ = _kept(old, type(new))
    for name in [name for name in shared if name not in kept]:
        del shared[name]
    for name, value in vars(new).items():
        shared.setdefault(name, value)
    new.__dict__ = shared


def _kept(old: Component, new: type[Component]) -> tuple[set[str], list[str]]:
    """Return the names of attributes that another version of a component keeps, and texts on the others."""
    former, present = _declarations(old), _declarations(new)
    lost = [
        sentence(f"the parameter {name} is gone")
        for name in parameters_of(old)
        if name not in parameters_of(new)
    ]
    kept = set()
    for name in vars(old):
        if name in former or name in present:
            keep = former.get(name) == present.get(name)
            if not keep and name in parameters_of(old) and name in parameters_of(new):
                kind = type(parameters_of(new)[name].default).__name__
                lost.append(sentence(f"the parameter {name} is {kind} now and has its default again"))
        else:
            keep = not _defines(new, name) or _defines(type(old), name)
            if not keep:
                lost.append(sentence(f"self.{name} was an attribute, and is now defined by the document"))
        if keep:
            kept.add(name)
    return kept, lost


def _declarations(component: Component | type[Component]) -> dict[str, object]:
    """Return the declarations of parameters and proxies, by attribute, to compare two versions."""
    parameters, proxies = parameters_of(component), proxies_of(component)
    return {name: type(declared.default) for name, declared in parameters.items()} | {
        name: (declared.identity, declared.type) for name, declared in proxies.items()
    }


def _defines(component: type[Component], name: str) -> bool:
    return any(name in vars(base) for base in component.__mro__ if base not in Component.__mro__)


def _is_code(value: object) -> bool:
    kinds = (BuiltinFunctionType, FunctionType, MethodType, ModuleType, type)
    return issubclass(type(value), kinds)


def _same(value: object, first: object) -> bool:
    try:
        present = plain(value)
    except ValueError:
        return False
    return type(present) is type(first) and repr(present) == repr(first)  # NaN is the same as NaN


_numbers = count(1)
_MARK: Final = "_reloaded_"


@contextmanager
def _loaded_again(former: type[Component], path: Path) -> Iterator[type[Component]]:
    """Give the class that a component's file defines now, in a new module; raises ReloadRefusedError.

    When the block fails, the module of its extension remains the former one.
    """
    if not path.is_file():
        raise ReloadRefusedError(f"the component was not loaded from a file that is there: {path}")
    before = sys.modules.get(former.__module__)
    package = getattr(before, "__package__", "") or ""
    own = before is not None and has_own_builtins(before)
    above = f"{package}." if package else ""
    extension = f"{above}{path.stem}_ext"
    with loading_again(extension, path.with_name(f"{path.stem}_ext.py"), package):
        yield _defined_in(
            path, f"{above}{path.stem}{_MARK}{next(_numbers)}", package, former, own_builtins=own
        )


def _defined_in(
    path: Path, name: str, package: str, former: type[Component], *, own_builtins: bool
) -> type[Component]:
    """Return the class that takes the place of the former one, from a file loaded as a module `name`."""
    try:
        module = load_module(name, path, package, own_builtins=own_builtins)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise ReloadRefusedError(_explain(error, str(path))) from error
    finally:
        linecache.checkcache(str(path))
    found = components_in(module)
    if len(found) > 1:
        found = [value for value in found if value.__name__ == former.__name__]
    if len(found) != 1:
        del sys.modules[module.__name__]
        raise ReloadRefusedError(f"{path.name} does not define one component any more")
    return found[0]


def components_in(module: ModuleType) -> list[type[Component]]:
    """Return the components that a module defines itself, each once even if it has several names."""
    found = (
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Component) and value.__module__ == module.__name__
    )
    return [value for value in dict.fromkeys(found) if "automaton" in vars(value)]


def _forget(component: type[Component]) -> None:
    """Release the module of a component that was loaded again; its code may still run."""
    if _MARK in component.__module__:
        sys.modules.pop(component.__module__, None)


def _explain(error: BaseException, path: str) -> str:
    if isinstance(error, SyntaxError) and error.filename == path:
        return f"{Path(path).name}:{error.lineno}: {error.msg}"
    place = locate(error, path)
    text = f"{Path(path).name} cannot be loaded: {describe(error)}"
    return f"{text} at {place}" if place else text
