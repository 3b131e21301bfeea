"""Judge a goal by where the ball really is: on the field of the Standard Platform League."""

import math

LINE, POST, RADIUS = 4.5, 0.75, 0.05
"""m from the middle of the field to the goal line, from the middle of the goal to a post, and of the ball."""
KICKED = 0.2
"""m by which the ball moves within a second, which no push with the feet does."""


def scored_at(run):
    """Return when the ball was behind the line, in s, or None."""
    for moment in run.moments:
        x, y, _ = moment.things["Ball"]
        if x > LINE + RADIUS and abs(y) < POST:
            return moment.time
    return None


def has_played(run):
    """Return whether it began to kick."""
    return any(call.error is None for call in run.calls("Motions.play"))


def kicks(run):
    far = max(
        (math.dist(before.things["Ball"][:2], after.things["Ball"][:2]), after.time)
        for before, after in zip(run.moments, run.moments[10:])
    )
    return float(has_played(run) and far[0] > KICKED), {
        "en": f"moves the ball by up to {far[0]:.2f} m within a second; asked: a kick, more than {KICKED} m",
        "es": f"mueve el balón hasta {far[0]:.2f} m en un segundo; se pide: un chut, más de {KICKED} m",
    }


def scores(run):
    time = scored_at(run)
    if time is not None:
        return 1.0, {"en": f"scores after {time:.0f} s", "es": f"marca a los {time:.0f} s"}
    x, y, _ = run.moments[-1].things["Ball"]
    way = math.hypot(max(0.0, LINE + RADIUS - x), max(0.0, abs(y) - POST))
    return 0.0, {
        "en": f"the ball ends {way:.2f} m before the goal",
        "es": f"el balón acaba a {way:.2f} m de la portería",
    }


def notices(run):
    goal, said = scored_at(run), run.entered("scored")
    if said is None:
        return 0.0, {"en": "never goes to `scored`", "es": "no pasa nunca a `scored`"}
    if goal is None or said < goal:
        return 0.0, {
            "en": f"goes to `scored` after {said:.1f} s, when there is no goal yet",
            "es": f"pasa a `scored` a los {said:.1f} s, cuando aún no hay gol",
        }
    return float(said - goal <= 10.0), {
        "en": f"goes to `scored` {said - goal:.1f} s after the goal; asked: within 10 s",
        "es": f"pasa a `scored` {said - goal:.1f} s después del gol; se pide: en 10 s como máximo",
    }


def upright(run):
    if run.fell is not None:
        return 0.0, {"en": f"falls after {run.fell:.1f} s", "es": f"se cae a los {run.fell:.1f} s"}
    if not has_played(run):
        return 0.0, {"en": "never begins to kick", "es": "no empieza nunca a chutar"}
    walked = max(math.dist(run.moments[0].place, moment.place) for moment in run.moments)
    return float(walked > 0.1), {
        "en": f"does not fall, and walks {walked:.1f} m",
        "es": f"no se cae, y anda {walked:.1f} m",
    }
