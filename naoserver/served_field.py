"""A soccer field as `Sight.getField` says it, from the model of one and back."""

from __future__ import annotations

from interfaces.nao import SoccerField
from naoserver.soccer_field import Field


def said_of(field: Field) -> SoccerField:
    """Return a field as it is said."""
    return SoccerField(
        length=field.length,
        width=field.width,
        line=field.line,
        border=field.border,
        circleDiameter=field.circle_diameter,
        penaltyAreaDepth=field.penalty_area[0],
        penaltyAreaWidth=field.penalty_area[1],
        goalAreaDepth=field.goal_area[0],
        goalAreaWidth=field.goal_area[1],
        penaltyMark=field.penalty_mark,
        goalWidth=field.goal_width,
        goalHeight=field.goal_height,
        goalDepth=field.goal_depth,
        ballRadius=field.ball_radius,
        walled=field.walled,
        corner=field.corner,
    )


def field_of(said: SoccerField) -> Field:
    """Return the model of a field that is said so; the color of its grass is the usual one."""
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
