"""Measure what several robots in one world are good for: stops of one of them, and matches.

    python benchmarks/bench_match.py stops --runs 100   # of one of four that are commanded and asked in haste
    python benchmarks/bench_match.py same --runs 20     # each match alone, and again beside another one
    python benchmarks/bench_match.py play --runs 40     # team_score against itself: ends, goals, who lies
    python benchmarks/bench_match.py against --runs 30  # team_score against score: who wins

A stop has taken effect when the newest setpoint of the robot that differs from the one before was streamed.
"""

from __future__ import annotations

import argparse
import random
import statistics
import sys
import time
from collections import Counter
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Final

from interfaces.nao import JointsPrx, JointState, SafetyPrx
from naoserver.bodies import DEFAULT_BODY
from tests.support.processes import ComponentProcess, free_endpoint, module
from visualhfsm.trials import ProcessPool, run_tasks
from visualhfsm_match._match import Plan, Result
from visualhfsm_match._page import outcome_of
from visualhfsm_match._rules import RULES, load_rules
from visualhfsm_match._series import Match, Matches, pack, team_names
from zenoh_ice import Communicator, Sample, ZenohIceError, initialize

BEHAVIORS: Final = Path(__file__).resolve().parents[1] / "behaviors"
REALMS: Final = ("red1", "red2", "blue1", "blue2")
_MOVED: Final = 1e-6  # rad
_LOOK: Final = 1.0  # s after a stop for which motion is watched
_LONGEST: Final = 36_000.0

COMMANDER: Final = """
import sys, time
from interfaces.nao import JointsPrx
from zenoh_ice import initialize
with initialize(connect=[sys.argv[1]], realm=sys.argv[2], clock="wall") as communicator:
    body = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
    print("commanding", flush=True)
    commanded = 0.0
    while True:
        try:
            if time.monotonic() > commanded + 1.0:
                commanded = time.monotonic()
                up = -1.0 if commanded % 40.0 < 20.0 else 1.0
                body.setJointPositions({"LShoulderPitch": up, "RShoulderPitch": up}, 0.02)
            for call in [body.getJointState.begin() for _ in range(50)]:
                call.result()
        except Exception:
            time.sleep(0.02)
"""


class Watched:
    """A robot whose setpoints are streamed; `moved` is when the newest one differed from the one before."""

    def __init__(self, communicator: Communicator, realm: str) -> None:
        proxy = communicator.stringToProxy
        self.safety: Final = SafetyPrx.uncheckedCast(proxy(f"Safety@{realm}"))
        self.moved = 0.0
        self._before: list[float] = []
        self._subscription = JointsPrx.uncheckedCast(proxy(f"Body@{realm}")).getJointState.subscribe(
            self._see
        )

    def _see(self, sample: Sample[JointState]) -> None:
        commands = list(sample.value.commands)
        if any(abs(a - b) > _MOVED for a, b in zip(commands, self._before, strict=False)):
            self.moved = time.monotonic()
        self._before = commands


def stops(runs: int, seed: int) -> None:
    """Print how long a robot of four moves on after its stop, and whether the others go on."""
    draw, endpoint = random.Random(seed), free_endpoint()
    times, went_on, moving = [], 0, 0
    with ExitStack() as ends:
        server = ends.enter_context(
            ComponentProcess(
                module("naoserver_sim", "--world", "match", "--listen", endpoint), {"MUJOCO_GL": "disable"}
            )
        )
        server.wait_for("^ready")
        communicator = ends.enter_context(initialize(connect=[endpoint], clock="wall"))
        robots = {realm: Watched(communicator, realm) for realm in REALMS}
        for realm in REALMS:
            command = [sys.executable, "-c", COMMANDER, endpoint, realm]
            ends.enter_context(ComponentProcess(command)).wait_for("commanding")
        for _ in range(runs):
            time.sleep(draw.uniform(0.5, 1.5))
            one = robots[draw.choice(REALMS)]
            began = time.monotonic()
            others = [each for each in robots.values() if each is not one and each.moved > began - 0.2]
            one.safety.emergencyStop("a hand in the way")
            time.sleep(_LOOK)
            times.append(max(0.0, one.moved - began))
            moving += len(others)
            went_on += sum(each.moved > began + _LOOK / 2 for each in others)
            with suppress(ZenohIceError):
                one.safety.resetEmergencyStop()
    ordered = sorted(times)
    print(f"{runs} stops: median {1e3 * statistics.median(ordered):.0f} ms,", end=" ")
    print(f"p99 {1e3 * ordered[min(runs - 1, int(0.99 * runs))]:.0f} ms, longest {1e3 * ordered[-1]:.0f} ms;")
    print(f"of {moving} others that moved then {went_on} went on")


def fixtures(first: str, second: str, given: argparse.Namespace) -> dict[int, Match]:
    """Return matches of two of our documents by their seeds; they change sides, and also the kick-off."""
    archive, paths = pack([BEHAVIORS / f"{first}.xml", BEHAVIORS / f"{second}.xml"])
    teams = team_names([BEHAVIORS / first, BEHAVIORS / second])
    found = {}
    for seed in range(given.seed, given.seed + given.runs):
        # The last bit of the seed says whose kick-off it is.
        order = slice(None, None, 1 if seed // 2 % 2 else -1)
        plan = Plan(
            documents=tuple(paths[order]),  # type: ignore[arg-type]
            teams=tuple(teams[order]),  # type: ignore[arg-type]
            players=2,
            seconds=60.0 * given.minutes,
            seed=seed,
            rules=load_rules(RULES),
            body=given.body,
            patience=_LONGEST,
        )
        found[seed] = Match(plan, seed, archive)
    return found


def played(matches: dict[int, Match], workers: int) -> dict[int, Result]:
    """Play matches, print each, and return what they came to by their seeds."""
    results = {}
    with ProcessPool(Matches(), workers) as pool:
        for seed, each in run_tasks(matches.items(), pool):
            result = results[seed] = each.require().result
            lying = f", lying: {', '.join(result.lying)}" if result.lying else ""
            print(f"seed {seed}: {outcome_of(result)}{lying}", flush=True)
    return results


def same(matches: dict[int, Match]) -> None:
    """Play each match alone, and again beside another one, and compare all their states."""
    alone, beside = played(matches, 1), played(matches, 2)
    equal = sum(alone[each].digest == beside[each].digest for each in alone)
    print(f"{equal} of {len(matches)} matches are the same, bit by bit")


def play(matches: dict[int, Match], workers: int) -> None:
    """Play matches, and print what came of them."""
    results = played(matches, workers).values()
    won = Counter(result.winner or "nobody" for result in results)
    print(
        f"{len(matches)} matches: {sum(not each.reason for each in results)} ended by the clock or the score,"
    )
    print(f"goals in {sum(any(each.score) for each in results)}, robots that lie at the end in", end=" ")
    print(f"{sum(bool(each.lying) for each in results)}; won by {dict(won)}")


def main() -> None:
    """Print the figures that are asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("stops", "same", "play", "against"))
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=4.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--body", default=DEFAULT_BODY)
    given = parser.parse_args()
    if given.what == "stops":
        stops(given.runs, given.seed)
    elif given.what == "same":
        same(fixtures("team_score", "team_score", given))
    else:
        other = "score" if given.what == "against" else "team_score"
        play(fixtures("team_score", other, given), given.workers)


if __name__ == "__main__":
    main()
