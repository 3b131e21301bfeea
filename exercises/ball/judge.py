"""Judge how near the robot comes to the ball, by where both really are."""

import math

NEAR = 0.6
"""m from the ball that are asked."""


def away(moment):
    """Return how far the robot is from the ball, in m."""
    x, y, _ = moment.things["Ball"]
    return math.dist(moment.place, (x, y))


def before(run):
    """Return the moments before somebody moves the ball."""
    end = run.events.get("moved", math.inf)
    return [moment for moment in run.moments if moment.time <= end]


def comes_near(run):
    nearest = min(away(moment) for moment in before(run))
    return float(nearest <= NEAR), {
        "en": f"comes as near as {nearest:.2f} m to the ball; asked: {NEAR} m",
        "es": f"se acerca hasta {nearest:.2f} m del balón; se pide: {NEAR} m",
    }


def follows(run):
    nearest = min(away(moment) for moment in run.moments[len(before(run)) + 1 :])
    return float(nearest <= NEAR), {
        "en": f"after the ball is moved it comes as near as {nearest:.2f} m; asked: {NEAR} m",
        "es": f"después de mover el balón se acerca hasta {nearest:.2f} m; se pide: {NEAR} m",
    }


def careful(run):
    if run.fell is not None:
        return 0.0, {"en": f"falls after {run.fell:.1f} s", "es": f"se cae a los {run.fell:.1f} s"}
    moments = before(run)
    rolled = math.dist(moments[0].things["Ball"][:2], moments[-1].things["Ball"][:2])
    walked = math.dist(moments[0].place, moments[-1].place)
    if walked < 0.1:
        return 0.0, {"en": "stays where it is", "es": "se queda donde está"}
    return float(rolled < 0.05), {
        "en": f"the ball rolls {rolled:.2f} m; asked: that it stays where it is",
        "es": f"el balón rueda {rolled:.2f} m; se pide: que se quede donde está",
    }
