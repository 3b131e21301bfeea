"""Judge the states, and the lights of the eyes, by the calls that set them."""


def eyes(run):
    """Return how bright the left eye, or the first light of a robot without eyes, is from a time in s on."""
    calls = [call for call in run.calls("Leds.setLed") if call.error is None]  # a refused one changes nothing
    names = [call.name for call in calls]
    eye = "LeftEye" if "LeftEye" in names or not names else names[0]
    return [(call.time, call.color.blue) for call in calls if call.name == eye]


def right_all_the_time(run):
    comes, goes = run.events["comes"], run.events["goes"]
    wrong = 0.0
    for since, until in run.spans("awake"):
        wrong += max(0.0, min(until, comes) - since) + max(0.0, until - max(since, goes))
    for since, until in run.spans("asleep"):
        wrong += max(0.0, min(until, goes) - max(since, comes))
    return float(wrong <= 1.0), {
        "en": f"sleeps or wakes {wrong:.1f} s at the wrong time; asked: at most 1 s",
        "es": f"duerme o vela {wrong:.1f} s a destiempo; se pide: 1 s como máximo",
    }


def dark(run):
    changes = eyes(run)
    if not changes:
        return 0.0, {"en": "never sets the lights of the eyes", "es": "no cambia nunca la luz de los ojos"}
    lit = 0.0
    for (begin, blue), (end, _) in zip(changes, [*changes[1:], (run.time, 0.0)]):
        if blue > 0.1:
            lit += sum(max(0.0, min(end, until) - max(begin, since)) for since, until in run.spans("asleep"))
    slept = sum(until - since for since, until in run.spans("asleep"))
    if slept < 2.0:
        return 0.0, {"en": f"sleeps for {slept:.1f} s only", "es": f"solo duerme {slept:.1f} s"}
    return float(lit < 0.2), {
        "en": f"the eyes are lit for {lit:.1f} s of its sleep; asked: never",
        "es": f"los ojos están encendidos {lit:.1f} s mientras duerme; se pide: nunca",
    }


def blinks(run):
    spans = [(since, until) for since, until in run.spans("awake") if until > run.events["comes"]]
    awake = sum(until - since for since, until in spans)
    lights = [blue for time, blue in eyes(run) if any(since <= time <= until for since, until in spans)]
    changes = sum((before > 0.1) != (after > 0.1) for before, after in zip(lights, lights[1:]))
    wanted = max(2, int(awake))
    return float(changes >= wanted), {
        "en": f"changes of the eyes in {awake:.1f} s: {changes}; asked: at least {wanted}",
        "es": f"cambios de los ojos en {awake:.1f} s: {changes}; se pide: al menos {wanted}",
    }
