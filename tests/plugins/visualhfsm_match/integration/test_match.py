"""Matches between documents, in the physics: by the clock, the same again, and lost by what documents do."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.documents import document, state, sub
from tests.support.limits import RUN_LIMIT
from visualhfsm_match._film import Film
from visualhfsm_match._match import BALL, Plan, Result, play
from visualhfsm_match._rules import load_rules
from visualhfsm_match._series import Fixture, play_all, play_match

pytestmark = [pytest.mark.sim, pytest.mark.slow]


def proxy(name: str, interface: str) -> str:
    return (
        f"<iceinterface><nameinterface>{name}</nameinterface><nameproxy>{name}</nameproxy><ip>localhost</ip>"
        f"<port>7447</port><interface>{interface}</interface></iceinterface>"
    )


def written(folder: Path, name: str, code: str, *proxies: str, libraries: tuple[str, ...] = ()) -> Path:
    """Write a document with one state, which does something in each cycle."""
    path = folder / f"{name}.xml"
    automaton = sub(1, 0, state(1, "only", code, initial=True))
    path.write_text(document(automaton, libraries=libraries, config="".join(proxies)))
    return path


def standing(folder: Path, name: str = "stands") -> Path:
    return written(folder, name, "pass")


def plan(first: Path, second: Path, *, players: int = 1, seconds: float = 10.0, seed: int = 3) -> Plan:
    return Plan(
        documents=(str(first), str(second)),
        teams=("ours", "theirs"),
        players=players,
        seconds=seconds,
        seed=seed,
        rules=load_rules(),
        body="H25",
    )


def played(plan: Plan) -> Result:
    return play(plan, Film(BALL))


def test_two_teams_that_stand_draw(tmp_path: Path) -> None:
    found = played(plan(standing(tmp_path), standing(tmp_path, "other"), players=2))
    assert [event.kind for event in found.events] == ["kick-off", "whistle", "end"]
    assert (found.score, found.winner, found.lying, found.seconds) == ((0, 0), "", (), 10.0)


def test_the_same_seed_gives_the_same_match_bit_by_bit(tmp_path: Path) -> None:
    code = "self.Motors.setV(0.2)\nself.Motors.setW(random.uniform(-1, 1))"
    walks = written(tmp_path, "walks", code, proxy("Motors", "Motors"), libraries=("random",))
    first, second, other = (
        played(plan(walks, standing(tmp_path), seconds=7.0, seed=seed)) for seed in (2, 2, 4)
    )
    assert first == second
    assert first.digest != other.digest


@pytest.mark.parametrize(
    ("code", "proxies", "why"),
    [
        ("1 / 0", (), "ZeroDivisionError"),
        ("self.Scene.placeObject('Ball', Vector3())", (proxy("Scene", "Scene"),), "no servant Scene"),
        ("this is no Python", (), "cannot be run"),
        (
            (
                "reading = self.Referee.getMatch()\n"
                "if reading.phase is MatchPhase.Playing:\n"
                "    raise RuntimeError(f'{reading.team} {reading.place.x < -0.5} {reading.mayPlay}')"
            ),
            (proxy("Referee", "Referee"),),
            "theirs True True",
        ),
    ],
    ids=["raises", "cheats", "broken", "reads the referee"],
)
def test_a_document_that_raises_cheats_or_is_broken_loses(
    tmp_path: Path, code: str, proxies: tuple[str, ...], why: str
) -> None:
    libraries = ("from interfaces.nao import MatchPhase, Vector3",)
    bad = written(tmp_path, "bad", code, *proxies, libraries=libraries)
    found = played(plan(standing(tmp_path), bad))
    assert found.winner == "ours"
    assert found.reason.startswith("theirs loses: ")
    assert why in found.reason


def test_one_that_hangs_or_ends_its_process_loses_and_the_others_play_on(tmp_path: Path) -> None:
    hangs = written(tmp_path, "hangs", "while True: pass")
    ends = written(tmp_path, "ends", "os._exit(3)", libraries=("os",))
    page = tmp_path / "match.html"
    fixtures = [
        Fixture(plan(standing(tmp_path), ends, seconds=6.0)),
        Fixture(plan(standing(tmp_path), standing(tmp_path, "other"), seconds=6.0), page),
    ]
    results = dict(play_all(fixtures, 2, RUN_LIMIT))
    assert (results[fixtures[0]].winner, results[fixtures[1]].winner) == ("ours", "")
    assert results[fixtures[1]] == played(fixtures[1].plan)
    assert "match-page" in page.read_text()
    found = play_match(
        Fixture(plan(hangs, standing(tmp_path), seconds=6.0, seed=2)), RUN_LIMIT, longest_turn=1.0
    )
    assert found.winner == "theirs"
    assert "computes for too long" in found.reason
