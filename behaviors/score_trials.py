"""What counts in the trials of score.xml: which starts are legal, and what is a goal."""

import math

LIGHTS = {0.25: 0.15, 0.7: 0.4, 1.2: 0.5}
"""Brightness of the lamp, and of the light from everywhere: a bulb, a hall, and one that overexposes pictures."""
LINE, POST = 4.5, 0.8
"""m from the middle of the field to the goal line, and from the middle of the goal to that of a post."""
RADIUS = 0.05
"""Of the ball and of a post in m."""
APART = 0.3
"""Least distance in m between the middles of the robot and of what it does not touch: its arms reach 0.2 m."""


def is_legal(values):
    """Return whether the robot touches neither ball nor post, nor the ball a post; and whether the light is one."""
    robot = values["robot.x"], values["robot.y"]
    ball = values["Ball.x"], values["Ball.y"]
    posts = (LINE, POST), (LINE, -POST)
    return (
        math.dist(robot, ball) > APART
        and all(math.dist(robot, post) > APART and math.dist(ball, post) > 2 * RADIUS for post in posts)
        and LIGHTS[values["light.brightness"]] == values["light.ambient"]
    )


def is_goal(run):
    """Return whether the whole ball is behind the line, between the posts."""
    x, y, _ = run.robot.device.stage.truth().objects["Ball"].position
    return (x > LINE + RADIUS and abs(y) < POST - RADIUS) or f"the ball is at {x:.2f}, {y:.2f}: no goal"


def kicks(run):
    """Return how often it kicked."""
    return len(run.calls("Motions.play"))
