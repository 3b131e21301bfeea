"""The panels of the terminal view: the tree of states, the camera image, the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.cells import cell_len
from rich.text import Text

from interfaces.hfsm import AutomatonSnapshot, ComponentSnapshot, Mark
from visualhfsm.monitoring.automata import Automata, StateRow, by_id
from visualhfsm.monitoring.robot import STALE
from visualhfsm.watch.telemetry import WatchState
from zenoh_ice.text import printable

ARM_JOINTS = {"ShoulderPitch": "shoulder pitch", "ShoulderRoll": "shoulder roll",
              "ElbowYaw": "elbow yaw", "ElbowRoll": "elbow roll"}  # fmt: skip
"""Joints of an arm that are shown, and their labels; L or R goes before the name."""
CURRENT, GHOST, OTHER, FINISHED, FINAL = "●", "◌", "○", "■", "□"
_FAINT = "bright_black"
_SHORTEST_BAR, _LONGEST_BAR = 6, 24
_COLORS = ("red", "green", "blue", "yellow", "magenta", "cyan")
_HEAD_LIMITS = {"HeadYaw": (-2.09, 2.09), "HeadPitch": (-0.67, 0.51)}
"""Ranges in rad of the scales until the robot has sent its own."""
_LABEL_WIDTH = 14
_FACTS_WIDTH = 17
"""Columns that the marks take beside the picture's frame."""


def tree_lines(automata: Automata, snapshot: ComponentSnapshot, width: int, height: int) -> list[Text]:
    """Draw at most `height` lines of `width` cells; the least important are left out."""
    states = by_id(snapshot)
    rows, hidden = _fit(list(automata.rows()), states, height)
    name_width = max((3 * (len(row.last) - 1) + 2 + cell_len(row.state.name) for row in rows), default=0)
    name_width = min(name_width, max(width // 2, width - 22))
    lines = [
        _line(automata, row, states.get(row.automaton.id), snapshot.time, name_width=name_width, width=width)
        for row in rows
    ]
    if hidden:
        lines.append(Text(f"… {hidden} more states", style=_FAINT))
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
        line.append("   " if above else "│  ", _FAINT)
    if len(row.last) > 1:
        line.append("└─ " if row.last[-1] else "├─ ", _FAINT)
    current = snapshot is not None and snapshot.state == row.state.id
    ghost = snapshot is None or snapshot.ghost
    if current and snapshot is not None and snapshot.finished:
        line.append(f"{FINISHED} {row.state.name}", "cyan")
    elif current and not ghost:
        line.append(f"{CURRENT} {row.state.name}", "bold green")
    elif current:
        line.append(f"{GHOST} {row.state.name}", "italic magenta")
    else:
        line.append(f"{FINAL if row.state.final else OTHER} {row.state.name}", _FAINT)
    if snapshot is None or not current:
        return line
    line.truncate(name_width, overflow="ellipsis", pad=True)
    line.append("  ")
    line.append_text(_progress(automata, snapshot, now, width - name_width - 2))
    return line


def _progress(automata: Automata, snapshot: AutomatonSnapshot, now: float, width: int) -> Text:
    """Draw the timer that fires next as a shrinking bar.

    Without one, show how long it has been in the state, and which events it waits for.
    """
    timers = sorted(snapshot.timers, key=lambda timer: timer.remaining)
    if snapshot.finished:
        return Text("finished", _FAINT)
    if not timers:
        spent = "ghost" if snapshot.ghost else f"for {max(now - snapshot.enteredAt, 0.0):.1f} s"
        events = automata.awaited(snapshot.id, snapshot.state)
        waits = f", waits for {' or '.join(events)}" if events else ""
        return Text(f"{spent}{waits}", _FAINT)
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
    progress.append(destination, _FAINT)
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
        (OTHER, _FAINT),
        " other  ",
        (FINAL, _FAINT),
        " final",
    )
    return Text.assemble(*parts)


def camera_lines(state: WatchState, width: int, height: int) -> list[Text]:
    """Draw the image's frame with the marks, and beside it their places and the camera's rate."""
    finder = _view_finder(state.marks, state.image_size, width - _FACTS_WIDTH, height)
    beside = _mark_facts(state, height)
    lines = []
    for number in range(height):
        line = finder[number].copy() if number < len(finder) else Text(" " * len(finder[0] if finder else ""))
        line.append("  ")
        if number < len(beside):
            line.append_text(beside[number])
        lines.append(line)
    return lines


def _view_finder(marks: Sequence[Mark], image_size: tuple[int, int], width: int, height: int) -> list[Text]:
    """Draw the image's frame, with lines at the thirds, as large as it fits; nothing where that is too small.

    A cell of a terminal is about twice as high as wide.
    """
    shape = 2 * image_size[0] / image_size[1]
    rows = min(height - 2, int((width - 2) / shape))
    columns = min(round(rows * shape), width - 2)
    if rows < 3 or columns < 3:
        return []
    cells = [[" "] * columns for _ in range(rows)]
    for row in range(rows):
        cells[row][columns // 3] = cells[row][columns - 1 - columns // 3] = "┊"
    for column in range(columns):
        for row in (rows // 3, rows - 1 - rows // 3):
            cells[row][column] = "┼" if cells[row][column] == "┊" else "┄"
    styles: dict[tuple[int, int], str] = {}
    for mark in marks:
        if not (math.isfinite(mark.u) and math.isfinite(mark.v)):
            continue
        column = min(max(int(mark.u / image_size[0] * columns), 0), columns - 1)
        row = min(max(int(mark.v / image_size[1] * rows), 0), rows - 1)
        cells[row][column] = "●"
        styles[row, column] = f"bold {_color(mark.label)}"
    framed = [Text("┌" + "─" * columns + "┐", _FAINT)]
    for row, line in enumerate(cells):
        drawn = Text("│" + "".join(line) + "│", _FAINT)
        for (at, column), style in styles.items():
            if at == row:
                drawn.stylize(style, column + 1, column + 2)
        framed.append(drawn)
    return [*framed, Text("└" + "─" * columns + "┘", _FAINT)]


def _mark_facts(state: WatchState, height: int) -> list[Text]:
    """Show how far each mark is from the center of the image, then the rate of images."""
    rate: list[Text] = []
    if state.robot.health is not None:
        images = state.robot.health.cameraRates.get(state.camera, 0.0)
        rate = [Text(), Text(f"{images:.1f} images/s", _FAINT if state.robot_age > STALE else "")]
    facts: list[Text] = []
    for mark in state.marks:
        if len(facts) + 3 + len(rate) > max(height, 3 + len(rate)):
            break
        u, v = from_center(mark, state.image_size)
        facts.append(Text(printable(mark.label)[:_FACTS_WIDTH], f"bold {_color(mark.label)}"))
        facts += [Text(f"u {u:+6.1f} px"), Text(f"v {v:+6.1f} px")]
    return [*(facts or [Text("nothing marked", _FAINT)]), *rate]


def from_center(mark: Mark, image_size: tuple[int, int]) -> tuple[float, float]:
    """Return how far a mark is from the center of the picture in pixels, to the right and down."""
    return mark.u - (image_size[0] - 1) / 2, mark.v - (image_size[1] - 1) / 2


def _color(label: str) -> str:
    return next((color for color in _COLORS if color in label.lower().split()), "cyan")


def robot_lines(state: WatchState, width: int) -> list[Text]:
    """Draw the angles of head and arms in rad with their places in their ranges, then the server."""
    lines = [_head_line(state, "pan", "HeadYaw", width), _head_line(state, "tilt", "HeadPitch", width)]
    stale = state.robot_age > STALE
    bar_width = max((width - _LABEL_WIDTH - 16) // 2, 3)
    side_width = 8 + bar_width
    columns = "arms".ljust(_LABEL_WIDTH) + "left".rjust(6).ljust(side_width) + "right".rjust(6)
    header = Text.assemble((columns, _FAINT))
    lines.append(header)
    for name, label in ARM_JOINTS.items():
        line = Text.assemble((f"{label:<{_LABEL_WIDTH}}", _FAINT))
        for side in ("L", "R"):
            value = state.robot.joints.get(side + name)
            line.append_text(_angle(value, state.limits.get(side + name), bar_width, stale=stale))
            line.append(" ")
        lines.append(line)
    return lines + _server_lines(state)


def _head_line(state: WatchState, axis: str, joint: str, width: int) -> Text:
    line = Text.assemble((f"{'head ' + axis:<{_LABEL_WIDTH}}", _FAINT))
    value = state.robot.pan if axis == "pan" else state.robot.tilt
    stale = state.robot_age > STALE
    limits = state.limits.get(joint, _HEAD_LIMITS[joint])
    line.append_text(
        _angle(value, limits, max(width - _LABEL_WIDTH - 8, 3), stale=stale, mirrored=axis == "pan")
    )
    return line


def _angle(
    value: float | None,
    limits: tuple[float, float] | None,
    width: int,
    *,
    stale: bool,
    mirrored: bool = False,
) -> Text:
    """Draw an angle and its place in its range; `mirrored` draws positive angles on the left."""
    if value is None or not math.isfinite(value):
        return Text("-".rjust(6).ljust(7 + width), _FAINT)
    text = Text.assemble((f"{value:+6.2f} ", _FAINT if stale else ""))
    lower, upper = limits or (-math.pi, math.pi)
    sign = -1 if mirrored else 1
    lower, upper = sorted((sign * lower, sign * upper))
    return text.append_text(position_bar(sign * value, lower, upper, width, _FAINT if stale else "bold cyan"))


def _server_lines(state: WatchState) -> list[Text]:
    report = state.robot.health
    if report is None:
        return [Text("server         no data yet", _FAINT)]
    style = _FAINT if state.robot_age > STALE else ""
    slow = report.realTimeFactor < 0.95
    factor = Text.assemble(
        (f"{'real time':<{_LABEL_WIDTH}}", _FAINT),
        (f"x {report.realTimeFactor:4.2f}", style or ("yellow" if slow else "")),
        ("   lag ", _FAINT),
        (f"{report.lag * 1000:.0f} ms", style),
    )
    torso = Text.assemble(
        (f"{'torso tilt':<{_LABEL_WIDTH}}", _FAINT),
        ("FALLEN", "bold red") if report.fallen else (f"{math.degrees(report.torsoTilt):5.1f}°", style),
    )
    return [factor, torso]


def level_bar(fraction: float, width: int, style: str) -> Text:
    """Draw a bar that is filled from the left by a fraction from 0 to 1, to half a cell."""
    share = min(max(fraction, 0.0), 1.0) if math.isfinite(fraction) else 0.0
    halves = round(share * width * 2)
    full, half = divmod(halves, 2)
    filled = "━" * full + "╸" * half
    return Text.assemble((filled, style), ("─" * (width - len(filled)), "grey30"))


def position_bar(value: float, lower: float, upper: float, width: int, style: str) -> Text:
    """Draw a scale from `lower` to `upper` with a mark at `value` and a tick at zero."""
    span = upper - lower
    if not (0 < span < math.inf and math.isfinite(value)):
        return Text("─" * width, style="bright_black")

    def cell(position: float) -> int:
        share = (min(max(position, lower), upper) - lower) / span
        return min(int(share * width), width - 1)

    characters = ["─"] * width
    if lower < 0 < upper:
        characters[cell(0.0)] = "┼"
    mark = cell(value)
    characters[mark] = "█"
    bar = Text("".join(characters), style="bright_black")
    bar.stylize(style, mark, mark + 1)
    return bar
