"""Let the command line of a component set its parameters."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Final, TypeVar

import typer

from zenoh_ice import command

from .component import Component, Parameter, parameters_of

__all__ = ["make_component", "option_of", "with_parameters"]

_C = TypeVar("_C", bound=Component)

_PREFIX: Final = "parameter_"
"""What the names of the options begin with in Python, so that they meet no others there."""


def with_parameters(component: type[Component]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command an option for each parameter of a component; it takes the values as `parameters`."""

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(function)
        def with_options(**options: Any) -> None:  # noqa: ANN401 - typer has checked them
            values = {name: options.pop(_PREFIX + name) for name in parameters}
            function(parameters=values, **options)

        parameters = parameters_of(component)
        own = [
            parameter
            for parameter in inspect.signature(function, eval_str=True).parameters.values()
            if parameter.name != "parameters"
        ]
        added = [_option(name, declared) for name, declared in parameters.items()]
        with_options.__signature__ = inspect.Signature([*added, *own])  # type: ignore[attr-defined]
        return with_options

    return decorate


def option_of(name: str) -> str:
    """Return the option of a parameter: `--top-speed` of `top_speed`."""
    return f"--{name.replace('_', '-')}"


def make_component(component: type[_C], parameters: Mapping[str, object]) -> _C:
    """Return a component with the values of its parameters, which its `__init__` sees already."""
    made = component.__new__(component)
    vars(made).update(parameters)
    made.__init__()  # type: ignore[misc]  # of the document, if it has one
    return made


def _option(name: str, declared: Parameter[Any]) -> inspect.Parameter:
    kind = type(declared.default)
    option = option_of(name)
    names = f"{option}/--no-{option.removeprefix('--')}" if kind is bool else option
    callback = command.finite if kind is float else None
    annotation = Annotated[kind, typer.Option(names, help=declared.description or None, callback=callback)]  # type: ignore[valid-type]
    return inspect.Parameter(
        _PREFIX + name, inspect.Parameter.KEYWORD_ONLY, annotation=annotation, default=declared.default
    )
