"""Matches between documents, in the physics: by the clock, the same again, and lost by what documents do."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import msgspec
import psutil
import pytest
from typer.testing import CliRunner
from typer.testing import Result as Done

from naoserver_sim.world import load_world
from plugins.trials.tests.support.dask_cluster import DaskCluster
from tests.support.documents import document, state, sub
from tests.support.limits import START_LIMIT
from tests.support.processes import ComponentProcess, assert_gone, module
from tests.support.waiting import until
from visualhfsm import VisualHfsmError
from visualhfsm.trials import ProcessPool, find_runner, run_tasks
from visualhfsm_match._command import match
from visualhfsm_match._command import tournament as play_all
from visualhfsm_match._errors import MatchError
from visualhfsm_match._match import Plan, Result
from visualhfsm_match._rules import RULES, load_rules
from visualhfsm_match._series import Match, MatchAnswer, Matches, Played, pack, team_names
from visualhfsm_match._table import table_of

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


@pytest.fixture(scope="module")
def matches(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Matches]:
    """A process that lasts, as a test must leave none behind."""
    stands = standing(tmp_path_factory.mktemp("matches"))
    with closing(Matches()) as processes:
        processes.run(between(stands, stands, seconds=0.1))
        yield processes


def between(
    first: Path, second: Path, *, players: int = 1, seconds: float = 7.0, seed: int = 3, page: bool = False
) -> Match:
    archive, (ours, theirs) = pack([first, second])
    plan = Plan(
        documents=(ours, theirs),
        teams=("ours", "theirs"),
        players=players,
        seconds=seconds,
        seed=seed,
        rules=load_rules(),
        world=load_world("soccer"),
        body="H25",
    )
    return Match(plan, 1, archive, page=page)


def run(matches: Matches, match: Match) -> Played:
    return matches.run(match).require()


def test_the_same_seed_gives_the_same_match_bit_by_bit(tmp_path: Path, matches: Matches) -> None:
    code = "self.Motors.setV(0.2)\nself.Motors.setW(random.uniform(-1, 1))"
    walks = written(tmp_path, "walks", code, proxy("Motors", "Motors"), libraries=("random",))
    first, second, other = (
        run(matches, between(walks, standing(tmp_path), seed=seed)).result for seed in (2, 2, 4)
    )
    assert first == second
    assert first.digest != other.digest


def test_random_numbers_are_those_of_a_robot_and_the_seed(tmp_path: Path, matches: Matches) -> None:
    rolls = written(tmp_path, "rolls", "raise ValueError(random.random())", libraries=("random",))
    sides = [(rolls, standing(tmp_path)), (standing(tmp_path), rolls), (standing(tmp_path), rolls)]
    first, second, again = (
        run(matches, between(*each, seconds=16)).result.reason.partition(":")[2] for each in sides
    )
    assert "ValueError" in first
    assert first != second == again


@pytest.mark.parametrize(
    ("code", "proxies", "why"),
    [
        ("1 / 0", (), "ZeroDivisionError"),
        ("self.Scene.placeObject('Ball', Vector3())", (proxy("Scene", "Scene"),), "cannot reach Scene"),
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
    tmp_path: Path, matches: Matches, code: str, proxies: tuple[str, ...], why: str
) -> None:
    libraries = ("from interfaces.nao import MatchPhase, Vector3",)
    bad = written(tmp_path, "bad", code, *proxies, libraries=libraries)
    found = run(matches, between(standing(tmp_path), bad)).result
    assert found.winner == "ours"
    assert found.reason.startswith("theirs loses: ")
    assert why in found.reason


@pytest.mark.parametrize(
    ("ours", "theirs"), [("1 / 0", "no Python"), ("no Python", "1 / 0"), ("1 / 0", "1 / 0")]
)
def test_if_both_documents_fail_at_once_both_lose(
    tmp_path: Path, matches: Matches, ours: str, theirs: str
) -> None:
    documents = written(tmp_path, "one", ours), written(tmp_path, "two", theirs)
    found = run(matches, between(*documents)).result
    assert found.winner == ""
    assert "ours loses: " in found.reason
    assert "theirs loses: " in found.reason
    assert [(row.lost, row.points) for row in table_of(found.teams, [found])] == [(1, 0), (1, 0)]


def test_a_team_that_takes_all_the_time_loses(tmp_path: Path, matches: Matches) -> None:
    # On a busy machine, too, each cycle ends long before it would take too much by itself.
    slow = written(tmp_path, "slow", "threading.Event().wait(1)", libraries=("threading",))
    match = between(standing(tmp_path), slow)
    found = run(matches, replace(match, plan=msgspec.structs.replace(match.plan, patience=6.0))).result
    assert found.reason == "theirs loses: it took most of 6 s"


HOSTILE = {
    "hangs": "while True: pass",
    "ends": "os._exit(3)",
    "eats": "self.eaten = bytearray(3 << 30)",
    "writes": "open({outside!r}, 'w').write('found')",
    "connects": "socket.create_connection(('127.0.0.1', 7447))",
    "searches": (
        "for each in gc.get_objects():\n"
        "    if str(type(each).__module__).startswith(('visualhfsm_match', 'naoserver_sim')):\n"
        "        raise LookupError(f'found {{each}}')\n"
        "for name in ('visualhfsm_match', 'naoserver_sim', 'visualhfsm', 'mujoco'):\n"
        "    if name in sys.modules:\n"
        "        raise LookupError(f'found {{name}}')\n"
        "open({outside!r}).read()"
    ),
}
WHY = {
    "hangs": "took more than 5 s in state only",
    "ends": "its process ended by itself with exit code 3",
    "eats": "MemoryError",
    "writes": "its code raised FileNotFoundError",
    "connects": "PermissionError",
    "searches": "its code raised FileNotFoundError",
}


def test_hostile_documents_lose_their_matches_and_change_no_other(tmp_path: Path) -> None:
    """What else code could try is in the tests of the sandbox: test_grading_attacks.py."""
    outside = tmp_path / "outside"
    walks = written(tmp_path, "walks", "self.Motors.setV(0.2)", proxy("Motors", "Motors"))
    honest = [walks, standing(tmp_path)]
    libraries = ("os", "sys", "gc", "socket")
    hostile = [
        written(tmp_path, name, code.format(outside=str(outside)), libraries=libraries)
        for name, code in HOSTILE.items()
    ]
    folders = []
    for number, documents in enumerate((honest, [*honest, *hostile])):
        folders.append(tmp_path / str(number))
        folders[-1].mkdir()
        for path in documents:
            shutil.copy(path, folders[-1])
    alone, beside = (tournament(folder) for folder in folders)
    assert beside["stands"] == alone["stands"]
    assert not outside.exists()
    assert {name: beside[name].winner for name in HOSTILE} == dict.fromkeys(HOSTILE, "walks")
    reasons = {name: beside[name].reason for name in HOSTILE}
    assert [reasons[name] for name, why in WHY.items() if why not in reasons[name]] == []


def tournament(folder: Path) -> dict[str, Result]:
    """Return the results of `walks` against all others, by their names."""
    paths = sorted(folder.glob("*.xml"), key=lambda path: path.stem != "walks")
    archive, (ours, *theirs) = pack(paths)
    tasks = []
    for number, (name, their) in enumerate(zip(team_names(paths)[1:], theirs, strict=True)):
        plan = between(paths[0], paths[1], seconds=5.5).plan
        plan = msgspec.structs.replace(plan, documents=(ours, their), teams=("walks", name))
        tasks.append((number, Match(plan, number, archive)))
    with ProcessPool(Matches(), 2) as pool:
        results = [answer.require().result for _, answer in run_tasks(tasks, pool)]
    return {result.teams[1]: result for result in results}


def test_rules_with_too_few_places_are_refused_at_the_start(tmp_path: Path) -> None:
    rules = tmp_path / "rules.toml"
    rules.write_text(RULES.read_text().replace(", [-3.9, 0.0]]", "]", 1))
    document = str(standing(tmp_path))
    done = CliRunner().invoke(match, [document, document, "--players", "4", "--rules", str(rules)])
    assert isinstance(done.exception, MatchError), done.output
    assert "there are 3 places for --players 4" in str(done.exception)


def test_a_cluster_plays_the_same_match(tmp_path: Path, matches: Matches) -> None:
    walks = written(tmp_path, "walks", "self.Motors.setV(0.2)", proxy("Motors", "Motors"))
    match = between(walks, standing(tmp_path), seconds=5.5, page=True)
    here = run(matches, match)
    with DaskCluster(tmp_path, workers=1) as cluster, find_runner(cluster.address) as pool:
        ((number, there),) = run_tasks([(7, match)], pool)
    played = there.require()
    assert (number, played.result) == (7, here.result)
    assert len(played.page) == len(here.page)  # they differ by nonces alone


def test_a_tournament_writes_a_table_and_pages(tmp_path: Path) -> None:
    standing(tmp_path)
    written(tmp_path, "raises", "1 / 0", proxy("Referee", "Referee"))  # which begins before a whistle
    done = tournament_of(tmp_path, "--matches", "1")
    assert (done.exception, done.exit_code) == (None, 0), done.output
    assert "raises loses" in done.output
    assert (tmp_path / "out" / "table.csv").read_text().splitlines()[1].startswith("stands,1,1,0,0,")
    assert 'href="match1.html"' in (tmp_path / "out" / "index.html").read_text()
    assert (tmp_path / "out" / "match1.html").is_file()


def test_each_document_of_a_tournament_has_the_kick_off_as_often(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    standing(tmp_path)
    standing(tmp_path, "other")
    plans: list[Plan] = []

    def seen(_: Matches, match: Match) -> MatchAnswer:
        plans.append(match.plan)
        return MatchAnswer(refused="it was only looked at")

    monkeypatch.setattr(Matches, "run", seen)
    tournament_of(tmp_path, "--matches", "4")
    begins = [plan.teams[plan.seed % 2] for plan in plans]
    assert sorted(begins) == ["other", "other", "stands", "stands"]
    assert len({(plan.teams, plan.seed % 2) for plan in plans}) == 4  # from each side, too


def test_a_match_that_nobody_can_judge_is_named(tmp_path: Path) -> None:
    rules = tmp_path / "rules.toml"
    rules.write_text(RULES.read_text().replace("[-2.4, 0.9]", "[-0.75, 0.05]", 1))
    standing(tmp_path)
    standing(tmp_path, "other")
    done = tournament_of(tmp_path, "--matches", "1", "--players", "2", "--rules", str(rules))
    assert done.exit_code == 1
    assert "other : stands: the match cannot be judged: robot" in done.output
    assert "index.html has all matches" in done.output


def test_where_nothing_contains_code_nothing_is_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    standing(tmp_path)
    standing(tmp_path, "other")
    monkeypatch.setenv("PATH", "")
    done = tournament_of(tmp_path)
    assert isinstance(done.exception, VisualHfsmError), done.output
    assert "run them with --unsafe" in str(done.exception)


def tournament_of(folder: Path, *options: str) -> Done:
    out = ("--out", str(folder / "out"), "--minutes", "0.1", "--players", "1", "--workers", "1")
    return CliRunner().invoke(play_all, [str(folder), *out, *options])


def test_a_match_ends_with_the_command_that_plays_it(tmp_path: Path) -> None:
    stands = standing(tmp_path)
    command = module("visualhfsm", "match", str(stands), str(stands), "--players", "1", "--minutes", "90")
    with ComponentProcess([*command, "--report", str(tmp_path / "match.html")]) as playing:
        until(lambda: _plays(below(playing)), START_LIMIT)
        left = below(playing)
        playing.process.kill()
        playing.wait()
        assert_gone(left)


def test_ctrl_c_ends_a_match_that_is_watched_and_leaves_no_file(tmp_path: Path) -> None:
    stands, files = standing(tmp_path), tmp_path / "temporary"
    files.mkdir()
    command = module("visualhfsm", "match", str(stands), str(stands), "--players", "1", "--minutes", "90")
    with ComponentProcess([*command, "--watch"], {"TMPDIR": str(files)}, tmp_path) as playing:
        until(lambda: _plays(below(playing)), START_LIMIT)
        assert any(files.iterdir())
        left = below(playing)
        playing.process.send_signal(signal.SIGINT)
        assert playing.wait() == 130, playing.output
        assert_gone(left)
    assert not any(files.iterdir())


def below(playing: ComponentProcess) -> list[psutil.Process]:
    found: list[psutil.Process] = psutil.Process(playing.process.pid).children(recursive=True)
    return found


def _plays(processes: list[psutil.Process]) -> bool:
    """Return whether code of a document runs: in a process of that which plays."""
    try:
        commands = [each.cmdline() for each in processes]
    except psutil.NoSuchProcess:  # one that only prepared something has ended
        return False
    return len(commands) > 1 and any("visualhfsm_match._process" in each for each in commands)


def test_a_tournament_that_is_there_is_replaced_on_request_alone(tmp_path: Path) -> None:
    standing(tmp_path, "one"), standing(tmp_path, "two")
    out = tmp_path / "out"
    out.mkdir()
    (out / "table.csv").write_text("mine", "utf-8")
    done = CliRunner().invoke(play_all, [str(tmp_path), "--out", str(out), "--unsafe"])
    assert isinstance(done.exception, MatchError)
    assert "--again replaces it" in str(done.exception)
    assert (out / "table.csv").read_text("utf-8") == "mine"
