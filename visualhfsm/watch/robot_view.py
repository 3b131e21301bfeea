"""The robot: where its ball is in the image, where head and arms are, and how its server keeps up."""

from __future__ import annotations

import math

from rich.text import Text

from visualhfsm.watch.bars import position_bar
from visualhfsm.watch.recording import ARM_JOINTS, Ball
from visualhfsm.watch.scene import Scene
from visualhfsm.watch.summary import in_middle_third

__all__ = ["camera_lines", "robot_lines"]

_FAINT = "bright_black"
_COLORS = ("red", "green", "blue", "yellow", "magenta", "cyan")
_JOINT_LABELS = {"ShoulderPitch": "shoulder pitch", "ShoulderRoll": "shoulder roll",
                 "ElbowYaw": "elbow yaw", "ElbowRoll": "elbow roll"}  # fmt: skip
_HEAD_LIMITS = {"HeadYaw": (-2.09, 2.09), "HeadPitch": (-0.67, 0.51)}
"""Ranges in rad of the scales until the robot has told its own."""
_LABEL_WIDTH = 14
_FACTS_WIDTH = 17
"""Columns that the ball's error takes beside the frame."""


def camera_lines(scene: Scene, width: int, height: int) -> list[Text]:
    """Draw the image's frame with the ball in it, and beside it the ball's error and the camera's rate."""
    finder = _view_finder(scene.ball, scene.image_size, width - _FACTS_WIDTH, height)
    beside = _ball_facts(scene)
    lines = []
    for number in range(height):
        line = finder[number].copy() if number < len(finder) else Text(" " * len(finder[0] if finder else ""))
        line.append("  ")
        if number < len(beside):
            line.append_text(beside[number])
        lines.append(line)
    return lines


def _view_finder(ball: Ball | None, image_size: tuple[int, int], width: int, height: int) -> list[Text]:
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
    lines = [Text("".join(row), _FAINT) for row in cells]
    if ball is not None and ball.seen:
        column = min(max(int((ball.error_u / image_size[0] + 0.5) * columns), 0), columns - 1)
        row = min(max(int((ball.error_v / image_size[1] + 0.5) * rows), 0), rows - 1)
        line = lines[row].plain
        style = f"bold {_color(ball)}"
        lines[row] = Text.assemble((line[:column], _FAINT), ("●", style), (line[column + 1 :], _FAINT))
    framed = [Text("┌" + "─" * columns + "┐", _FAINT)]
    framed += [Text.assemble(("│", _FAINT), line, ("│", _FAINT)) for line in lines]
    return [*framed, Text("└" + "─" * columns + "┘", _FAINT)]


def _ball_facts(scene: Scene) -> list[Text]:
    facts: list[Text] = []
    ball = scene.ball
    if ball is None:
        facts += [Text("no ball now", _FAINT), Text(), Text(), Text()]
    else:
        facts.append(Text.assemble("ball ", (ball.name, f"bold {_color(ball)}")))
        if ball.seen:
            facts.append(Text(f"u {ball.error_u:+6.1f} px"))
            facts.append(Text(f"v {ball.error_v:+6.1f} px"))
            centered = in_middle_third(ball, *scene.image_size)
            facts.append(Text("centered", "green") if centered else Text("off center", "yellow"))
        else:
            facts += [Text("out of sight", "yellow"), Text(), Text()]
    if scene.health is not None:
        rate = scene.health.value.cameraRates.get("Camera", 0.0)
        facts += [Text(), Text(f"{rate:.1f} images/s", _FAINT if scene.health.stale else "")]
    return facts


def _color(ball: Ball) -> str:
    return next((color for color in _COLORS if color in ball.name.lower().split()), "cyan")


def robot_lines(scene: Scene, width: int) -> list[Text]:
    """Draw the angles of head and arms in rad with their places in their ranges, then the server."""
    lines = [_head_line(scene, "pan", "HeadYaw", width), _head_line(scene, "tilt", "HeadPitch", width)]
    joints = scene.joints
    stale = joints is None or joints.stale
    bar_width = max((width - _LABEL_WIDTH - 16) // 2, 3)
    side_width = 8 + bar_width
    columns = "arms".ljust(_LABEL_WIDTH) + "left".rjust(6).ljust(side_width) + "right".rjust(6)
    header = Text.assemble((columns, _FAINT))
    lines.append(header)
    for name in ARM_JOINTS:
        line = Text.assemble((f"{_JOINT_LABELS[name]:<{_LABEL_WIDTH}}", _FAINT))
        for side in ("L", "R"):
            value = joints.value.get(side + name) if joints else None
            line.append_text(_angle(value, scene.limits.get(side + name), bar_width, stale=stale))
            line.append(" ")
        lines.append(line)
    return lines + _server_lines(scene)


def _head_line(scene: Scene, axis: str, joint: str, width: int) -> Text:
    line = Text.assemble((f"{'head ' + axis:<{_LABEL_WIDTH}}", _FAINT))
    head = scene.head
    value = None if head is None else (head.value.pan if axis == "pan" else head.value.tilt)
    stale = head is None or head.stale
    limits = scene.limits.get(joint, _HEAD_LIMITS[joint])
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


def _server_lines(scene: Scene) -> list[Text]:
    health = scene.health
    if health is None:
        return [Text("server         no word yet", _FAINT)]
    style = _FAINT if health.stale else ""
    report = health.value
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
