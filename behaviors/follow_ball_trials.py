"""What counts in the trials of follow_ball.xml: how far it aims past the ball, and how often it loses it."""

from itertools import pairwise


def aim(run):
    """Return by how much the head points past the ball in rad, while the robot follows it."""
    pan, _, _ = run.robot.ball("green").position
    return abs(run.robot.head[0] - pan) if run.active == "follow" and run.time > 1.0 else None


def losses(run):
    """Return how often it began to search."""
    return sum(state == "search" for _, state in run.changes("follow_ball"))


def lost(run):
    """Return how long it searched in s."""
    changes = [*run.changes("follow_ball"), (run.time, "")]
    return sum(end - begin for (begin, state), (end, _) in pairwise(changes) if state == "search")


def keeps_it(run):
    """Return why the robot did not follow the ball all the time, empty if it did."""
    return "loses the ball" if losses(run) else ""
