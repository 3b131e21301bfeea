"""The calls of a behavior on its proxies, remembered."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hfsm_runtime.tree import Run

__all__ = ["Call", "CallLog"]


@dataclass(frozen=True, slots=True)
class Call:
    """A call that the behavior made, at a time in s, and what came of it.

    `automaton` and `state` are the names of those whose code made it, empty for calls outside of any cycle.
    """

    time: float
    target: str
    """Servant and operation, as in `Head.setPose`."""
    arguments: dict[str, Any]
    """What was handed over, by the names of the parameters."""
    result: Any
    error: Exception | None
    automaton: str
    state: str

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        """Return an argument: `call.pan` is `call.arguments["pan"]`."""
        if name.startswith("__"):  # asked for by copy and pickle, also while there are no arguments yet
            raise AttributeError(name)
        try:
            return self.arguments[name]
        except KeyError:
            known = ", ".join(self.arguments) or "none"
            raise AttributeError(f"{self.target} has no argument {name!r}; it has {known}") from None

    def __str__(self) -> str:
        arguments = ", ".join(f"{name}={_short(value)}" for name, value in self.arguments.items())
        outcome = f"raised {self.error!r}" if self.error else f"-> {_short(self.result)}"
        place = f"  [{self.automaton}/{self.state}]" if self.automaton else ""
        return f"{self.time:9.3f} s  {self.target}({arguments}) {outcome}{place}"


class CallLog:
    """The calls that were made, in their order."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._calls: list[Call] = []
        self.run: Run | None = None
        """The automaton whose code runs now."""

    def add(self, target: str, arguments: dict[str, Any], result: object, error: Exception | None) -> None:
        """Remember a call."""
        place = (self.run.automaton.name, self.run.current.name) if self.run else ("", "")
        self._calls.append(Call(self._now(), target, arguments, result, error, *place))

    def find(self, target: str = "") -> list[Call]:
        """Return the calls of an operation (`Head.setPose`) or of a servant (`Head`), or all."""
        return [call for call in self._calls if target in ("", call.target, call.target.partition(".")[0])]

    def __iter__(self) -> Iterator[Call]:
        return iter(self._calls)


def _short(value: object) -> str:
    text = repr(value) if not isinstance(value, float) else f"{value:.4g}"
    return text if len(text) <= 60 else text[:57] + "..."
