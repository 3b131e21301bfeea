"""The automata as a tree of states, one a line: which is current, which a ghost's, how long each lasts."""

from __future__ import annotations

from rich.cells import cell_len
from rich.text import Text

from interfaces.hfsm import AutomatonSnapshot, ComponentSnapshot
from visualhfsm.watch.automata import Automata, StateRow, by_id
from visualhfsm.watch.bars import level_bar

__all__ = ["legend", "tree_lines"]

CURRENT, GHOST, OTHER, FINISHED, FINAL = "●", "◌", "○", "■", "□"
_GUIDE_STYLE = "bright_black"
_SHORTEST_BAR, _LONGEST_BAR = 6, 24


def tree_lines(automata: Automata, snapshot: ComponentSnapshot, width: int, height: int) -> list[Text]:
    """Draw at most `height` lines of `width` cells; what matters least is left out when there are more."""
    states = by_id(snapshot)
    rows, hidden = _fit(list(automata.rows()), states, height)
    name_width = max((3 * (len(row.last) - 1) + 2 + cell_len(row.state.name) for row in rows), default=0)
    name_width = min(name_width, max(width // 2, width - 22))
    lines = [
        _line(automata, row, states.get(row.automaton.id), snapshot.time, name_width=name_width, width=width)
        for row in rows
    ]
    if hidden:
        lines.append(Text(f"… {hidden} more states", style=_GUIDE_STYLE))
    return lines


def _fit(
    rows: list[StateRow], states: dict[int, AutomatonSnapshot], height: int
) -> tuple[list[StateRow], int]:
    """Leave out, as far as needed, other states of ghosts, then ghosts, then other states of the rest."""

    def current(row: StateRow) -> bool:
        found = states.get(row.automaton.id)
        return found is not None and found.state == row.state.id

    def ghost(row: StateRow) -> bool:
        found = states.get(row.automaton.id)
        return found is None or found.ghost

    kept = rows
    for leave_out in (
        lambda row: ghost(row) and not current(row),
        ghost,
        lambda row: not current(row),
    ):
        if len(kept) <= height:
            break
        kept = [row for row in kept if not leave_out(row)]
    if len(kept) == len(rows) and len(rows) <= height:
        return kept, 0
    kept = kept[: max(height - 1, 0)]
    return kept, len(rows) - len(kept)


def _line(
    automata: Automata,
    row: StateRow,
    snapshot: AutomatonSnapshot | None,
    now: float,
    *,
    name_width: int,
    width: int,
) -> Text:
    line = Text(no_wrap=True, overflow="ellipsis")
    for above in row.last[1:-1]:
        line.append("   " if above else "│  ", _GUIDE_STYLE)
    if len(row.last) > 1:
        line.append("└─ " if row.last[-1] else "├─ ", _GUIDE_STYLE)
    current = snapshot is not None and snapshot.state == row.state.id
    ghost = snapshot is None or snapshot.ghost
    if current and snapshot is not None and snapshot.finished:
        line.append(f"{FINISHED} {row.state.name}", "cyan")
    elif current and not ghost:
        line.append(f"{CURRENT} {row.state.name}", "bold green")
    elif current:
        line.append(f"{GHOST} {row.state.name}", "italic magenta")
    else:
        line.append(f"{FINAL if row.state.final else OTHER} {row.state.name}", "bright_black")
    if snapshot is None or not current:
        return line
    line.truncate(name_width, overflow="ellipsis", pad=True)
    line.append("  ")
    line.append_text(_progress(automata, snapshot, now, width - name_width - 2))
    return line


def _progress(automata: Automata, snapshot: AutomatonSnapshot, now: float, width: int) -> Text:
    """Draw the timer that fires next as a shrinking bar.

    Without one tell the time spent in the state, and the events that it waits for.
    """
    timers = sorted(snapshot.timers, key=lambda timer: timer.remaining)
    if snapshot.finished:
        return Text("finished", "bright_black")
    if not timers:
        spent = "ghost" if snapshot.ghost else f"for {max(now - snapshot.enteredAt, 0.0):.1f} s"
        events = automata.awaited(snapshot.id, snapshot.state)
        waits = f", waits for {' or '.join(events)}" if events else ""
        return Text(f"{spent}{waits}", "bright_black")
    timer = timers[0]
    transition = automata.transition(snapshot.id, timer.transition)
    total = transition.seconds if transition and transition.seconds > 0 else max(timer.remaining, 1.0)
    style = "magenta" if snapshot.ghost else "green"
    seconds = f" {timer.remaining:4.1f} s"
    destination = f" to {automata.destination_name(snapshot.id, timer.transition)}"
    room = width - len(seconds)
    if room - len(destination) < _SHORTEST_BAR:
        destination = ""
    bar_width = min(room - len(destination), _LONGEST_BAR)
    progress = Text()
    if bar_width >= _SHORTEST_BAR:
        progress.append_text(level_bar(timer.remaining / total, bar_width, style))
    progress.append(seconds, style)
    progress.append(destination, "bright_black")
    return progress


def legend() -> Text:
    """Explain the marks."""
    parts = (
        (CURRENT, "bold green"),
        " current  ",
        (GHOST, "magenta"),
        " ghost  ",
        (FINISHED, "cyan"),
        " finished  ",
        (OTHER, "bright_black"),
        " other  ",
        (FINAL, "bright_black"),
        " final",
    )
    return Text.assemble(*parts)
