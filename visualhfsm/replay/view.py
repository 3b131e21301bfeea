"""Show people how a replay ended: the first difference, both timelines side by side, and what was guessed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, islice
from typing import Any, Final, TypeVar

from msgspec.structs import replace

from hfsm_recording.outcome import Difference, Divergence, Outcome, Side, Step

__all__ = ["outcome_lines"]

_T = TypeVar("_T", Step, Divergence, Difference)

_ROWS: Final = 40
_MOST: Final = 10
_WIDE: Final = 34
_LONG: Final = 60
_VERBS: Final = {"entered": "", "ghost": " (ghost)", "resumed": " (goes on)", "finished": " (finished)"}


def outcome_lines(outcome: Outcome) -> Iterator[str]:
    """Yield the lines that tell how a replay ended."""
    outcome = _told_apart(outcome)
    yield from (f"note: {_plain(note)}" for note in outcome.notes)
    cycles = f"{outcome.cycles:,}".replace(",", " ")
    did = f"replayed {outcome.seconds:.1f} s, {cycles} cycles"
    if outcome.identical and not outcome.error:
        yield f"{did}, identical"
    elif not outcome.divergences:
        yield f"{did}: the same states"
    else:
        # Under 0 stand the events that an automaton sends otherwise: mostly one that is counted anyway.
        count = len({found.automaton for found in outcome.divergences} - {0}) or 1
        yield f"{did}: {count} {'automaton behaves' if count == 1 else 'automata behave'} otherwise"
        yield ""
        yield from _first(outcome.divergences[0])
        yield ""
        yield from _timelines(outcome.recorded, outcome.replayed, outcome.divergences[0].time)
    if outcome.missing_cycles:
        yield f"{outcome.missing_cycles} cycles of the recording were not run"
    yield from _differences(outcome.differences)
    yield from _guesses(outcome.guesses)


def _told_apart(outcome: Outcome) -> Outcome:
    """Return an outcome in which automata of the same name have their ids with it."""
    everything: Iterator[Step | Divergence | Difference] = chain(
        outcome.divergences, outcome.recorded, outcome.replayed, outcome.differences
    )
    ids: dict[str, set[int]] = {}
    for found in everything:
        ids.setdefault(found.name, set()).add(found.automaton)

    def named(found: _T) -> _T:
        alone = len(ids[found.name]) == 1
        return found if alone else replace(found, name=f"{found.name} ({found.automaton})")

    return replace(
        outcome,
        divergences=[named(each) for each in outcome.divergences],
        recorded=[named(each) for each in outcome.recorded],
        replayed=[named(each) for each in outcome.replayed],
        differences=[named(each) for each in outcome.differences],
    )


def _first(found: Divergence) -> Iterator[str]:
    recorded, replayed = found.recorded, found.replayed
    yield f"first at {found.time:.3f} s: {_plain(found.name)} in the state {_plain(recorded.state) or '-'}"
    yield _row("", "recorded", "replayed")
    for name in dict.fromkeys([*recorded.guards, *replayed.guards]):
        yield _row(f"guard {name}", _value(recorded, name), _value(replayed, name))
    yield _row("fired", _listed(recorded.fired), _listed(replayed.fired))
    for ours, theirs in islice(_pairs(recorded.errors, replayed.errors), _MOST):
        yield _row("error", ours, theirs)
    yield _row("then in", recorded.state_after or "-", replayed.state_after or "-")


def _timelines(recorded: Sequence[Step], replayed: Sequence[Step], since: float) -> Iterator[str]:
    ours = {(step.time, step.automaton, step.kind, step.state): step for step in recorded}
    theirs = {(step.time, step.automaton, step.kind, step.state): step for step in replayed}
    rows = sorted((ours | theirs).items(), key=lambda row: row[0][:2])
    before = [row for row in rows if row[0][0] < since][-3:]
    after = [row for row in rows if row[0][0] >= since]
    yield f"{'time':>12}  {'automaton':<{_WIDE - 12}}{'recorded':<{_WIDE}}replayed"
    for key, step in before + after[:_ROWS]:
        shown = _plain(step.state) + _VERBS.get(step.kind, "")
        left, right = (shown if key in side else "" for side in (ours, theirs))
        mark = " " if left == right else "*"
        name = _plain(step.name)[: _WIDE - 13]
        yield f"{step.time:>10.3f} s{mark} {name:<{_WIDE - 12}}{left:<{_WIDE}}{right}".rstrip()
    if len(after) > _ROWS:
        yield f"... and {len(after) - _ROWS} more: --json has all"


def _differences(differences: Sequence[Difference]) -> Iterator[str]:
    if differences:
        yield ""
        yield "other values, the first of each:"
    for found in differences[:_MOST]:
        recorded, replayed = _shown(found.recorded), _shown(found.replayed)
        what = f"{found.kind} {_plain(found.what)}"
        yield f"{found.time:>10.3f} s  {_plain(found.name)}: {what} was {recorded} and is {replayed}"
    if len(differences) > _MOST:
        yield f"... and {len(differences) - _MOST} more: --json has all"


def _guesses(guesses: dict[str, int]) -> Iterator[str]:
    if guesses:
        yield ""
        yield "asked for what nobody had asked for then, and given the newest value before:"
    for what, count in list(guesses.items())[:_MOST]:
        yield f"{count:>8} x {_plain(what)}"
    if len(guesses) > _MOST:
        yield f"... and {len(guesses) - _MOST} more: --json has all"


def _row(label: str, recorded: str, replayed: str) -> str:
    left = _plain(recorded)[: _WIDE - 1]
    return f"  {_plain(label)[:_WIDE]:<{_WIDE}}{left:<{_WIDE}}{_plain(replayed)[:_LONG]}".rstrip()


def _value(side: Side, guard: str) -> str:
    return str(side.guards[guard]).lower() if guard in side.guards else "-"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) or "-"


def _pairs(ours: Sequence[str], theirs: Sequence[str]) -> Iterator[tuple[str, str]]:
    for index in range(max(len(ours), len(theirs))):
        yield (
            ours[index] if index < len(ours) else "-",
            theirs[index] if index < len(theirs) else "-",
        )


def _shown(value: Any) -> str:  # noqa: ANN401 - JSON
    text = "nothing" if value is None else repr(value)
    return _plain(text if len(text) <= _LONG else f"{text[:_LONG]}...")


def _plain(text: str) -> str:
    """Return a text without what a terminal would obey."""
    return "".join(character if character.isprintable() else "?" for character in text)
