"""Judge a match of one against one by where the ball really is: on the field of the Standard Platform League."""

import math

LINE, POST, RADIUS = 4.5, 0.75, 0.05
"""m from the middle of the field to the goal line, from the middle of the goal to a post, and of the ball."""
KICKED = 0.2
"""m by which the ball moves within a second, which no push with the feet does."""


def scored_at(run):
    """Return when the ball was behind the line of the rival's goal, in s, or None."""
    for moment in run.moments:
        x, y, _ = moment.things["Ball"]
        if x > LINE + RADIUS and abs(y) < POST:
            return moment.time
    return None


def looks(run):
    chosen = run.entered("choose")
    kicked = next((call.time for call in run.calls("Motions.play")), math.inf)
    if chosen is None or chosen > kicked:
        return 0.0, {
            "en": "does not go to `choose` before it kicks",
            "es": "no pasa a `choose` antes de chutar",
        }
    return 1.0, {
        "en": f"goes to `choose` after {chosen:.1f} s",
        "es": f"pasa a `choose` a los {chosen:.1f} s",
    }


def kicks(run):
    far = max(
        math.dist(before.things["Ball"][:2], after.things["Ball"][:2])
        for before, after in zip(run.moments, run.moments[10:])
    )
    played = any(call.error is None for call in run.calls("Motions.play"))
    return float(played and far > KICKED), {
        "en": f"moves the ball by up to {far:.2f} m within a second; asked: a kick, more than {KICKED} m",
        "es": f"mueve el balón hasta {far:.2f} m en un segundo; se pide: un chut, más de {KICKED} m",
    }


def scores(run):
    time = scored_at(run)
    if time is not None:
        return 1.0, {"en": f"scores after {time:.0f} s", "es": f"marca a los {time:.0f} s"}
    ball, rival = (run.moments[-1].things[name] for name in ("Ball", "blue1"))
    way = math.hypot(max(0.0, LINE + RADIUS - ball[0]), max(0.0, abs(ball[1]) - POST))
    near = math.dist(ball[:2], rival[:2])
    return 0.0, {
        "en": f"the ball ends {way:.2f} m before the goal, {near:.2f} m from the rival",
        "es": f"el balón acaba a {way:.2f} m de la portería y a {near:.2f} m del rival",
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
    walked = max(math.dist(run.moments[0].place, moment.place) for moment in run.moments)
    return float(walked > 0.2), {
        "en": f"does not fall, and walks {walked:.1f} m",
        "es": f"no se cae, y anda {walked:.1f} m",
    }
