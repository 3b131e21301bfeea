"""The model of the soccer field that a robot is told: what the localization takes."""

from __future__ import annotations

from interfaces.nao import SoccerField
from naoserver.soccer_field import Field


def field_of(said: SoccerField) -> Field:
    """Return the model of a field as `Sight.getField` says it; the color of its grass is the usual one."""
    return Field(
        length=said.length,
        width=said.width,
        line=said.line,
        border=said.border,
        circle_diameter=said.circleDiameter,
        penalty_area=(said.penaltyAreaDepth, said.penaltyAreaWidth),
        goal_area=(said.goalAreaDepth, said.goalAreaWidth),
        penalty_mark=said.penaltyMark,
        goal_width=said.goalWidth,
        goal_height=said.goalHeight,
        goal_depth=said.goalDepth,
        ball_radius=said.ballRadius,
        walled=said.walled,
        corner=said.corner,
    )
