"""What counts in the trials of score.xml: which starts are legal, and what is a goal."""

import math

from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.kinematics import kinematics_of

LIGHTS = {0.25: 0.15, 0.7: 0.4, 1.2: 0.5}
"""Brightness of the lamp, and of the light from everywhere: a bulb, a hall, and one that overexposes pictures."""
LINE, POST = 4.5, 0.8
"""m from the middle of the field to the goal line, and from the middle of the goal to that of a post."""
RADIUS = 0.05
"""Of the ball and of a post in m."""


def room(body):
    """Return how far in m the middle of a body must be from that of what it does not touch: a Nao's 0.3 m.

    It may turn, and its hands are longer than the way to their links.
    """
    body = find_body(body)
    kinematics = kinematics_of(body)
    torso = kinematics.torso_place(body.resting_angles)
    links = (
        torso @ kinematics.link_place(each.link, body.resting_angles) for each in body.effectors.values()
    )
    return 1.9 * max(math.hypot(link[0, 3], link[1, 3]) for link in links)


def is_legal(values):
    """Return whether the robot touches neither ball nor post, nor the ball a post; and whether the light is one."""
    robot = values["robot.x"], values["robot.y"]
    ball = values["Ball.x"], values["Ball.y"]
    posts = (LINE, POST), (LINE, -POST)
    apart = room(values.get("body", DEFAULT_BODY))
    return (
        math.dist(robot, ball) > apart
        and all(math.dist(robot, post) > apart and math.dist(ball, post) > 2 * RADIUS for post in posts)
        and LIGHTS[values["light.brightness"]] == values["light.ambient"]
    )


def is_goal(run):
    """Return whether the whole ball is behind the line, between the posts."""
    x, y, _ = run.robot.device.stage.truth().objects["Ball"].position
    return (x > LINE + RADIUS and abs(y) < POST - RADIUS) or f"the ball is at {x:.2f}, {y:.2f}: no goal"


def kicks(run):
    """Return how often it kicked."""
    return len(run.calls("Motions.play"))
