"""The league's format: its pitch has its sizes, and what happens there counts by its rules."""

from __future__ import annotations

import math
from contextlib import closing
from pathlib import Path

import pytest
from msgspec.structs import replace

from naoserver_sim.world import StartPose, World, load_world
from tests.support.documents import document, state, sub
from visualhfsm.testing import MakeBehavior
from visualhfsm_match._errors import MatchError
from visualhfsm_match._match import Plan
from visualhfsm_match._rules import DEFAULT_FORMAT, formats, load_format, load_rules
from visualhfsm_match._series import Match, Matches, pack
from visualhfsm_match.field import field_of

pytestmark = [pytest.mark.sim, pytest.mark.slow]

RADIUS = 0.35


def interface(name: str) -> str:
    return (
        f"<iceinterface><nameinterface>{name}</nameinterface><nameproxy>{name}</nameproxy><ip>localhost</ip>"
        f"<port>7447</port><interface>{name}</interface></iceinterface>"
    )


def walking(folder: Path, name: str = "walks", speed: float = 0.4, seconds: float = 60.0) -> Path:
    """Write a document of a robot that walks ahead for some time, into whatever is there."""
    path = folder / f"{name}.xml"
    code = f"self.Motors.setV({speed} if self.clock.now() < {seconds} else 0.0)"
    only = state(1, "only", code, initial=True)
    path.write_text(document(sub(1, 0, only), config=interface("Motors") + interface("Sight")))
    return path


def league(*, ball: tuple[float, float], robot: StartPose) -> World:
    world = load_world("league")
    return replace(world, robots=(), robot=robot, balls=(replace(world.balls[0], position=ball),))


def test_a_format_is_known_by_its_name_or_its_file(tmp_path: Path) -> None:
    assert formats() == ("league", "robocup")
    played, rules = load_format()
    assert (played.world, played.body, played.players, played.minutes) == ("soccer", "H25", 2, 4.0)
    assert (DEFAULT_FORMAT, rules) == ("robocup", load_rules())
    own = tmp_path / "own.toml"
    text = (
        'description = "x"\nworld = "soccer"\nbody = "T1"\nplayers = 1\nminutes = 2.0\n[rules]\nmercy = {}\n'
    )
    own.write_text(text.format(3))
    assert load_format(str(own)) == (replace(played, **vars_of(own)), replace(rules, mercy=3))
    own.write_text(text.format(0))
    with pytest.raises(MatchError, match=r"own\.toml:7: rules\.mercy = 0"):
        load_format(str(own))
    with pytest.raises(MatchError, match="there is no format cup: there is league, robocup"):
        load_format("cup")


def vars_of(own: Path) -> dict[str, object]:
    import tomllib

    return tomllib.loads(own.read_text())


def test_the_pitch_of_the_league_has_its_sizes_and_who_sees_knows_them(
    tmp_path: Path, behavior: MakeBehavior
) -> None:
    played, rules = load_format("league")
    assert (played.body, played.players, played.minutes) == ("G1", 2, 10.0)
    assert rules.most_players >= played.players
    world = load_world(played.world)
    assert world.field is not None
    assert (world.field.length, world.field.width, world.field.ball_radius) == (14.0, 9.0, RADIUS)
    before_goal = league(ball=(5.5, 0.0), robot=StartPose(position=(3.5, 0.0)))
    b = behavior(walking(tmp_path, speed=0.0), robot="sim", body="H25", world=before_goal)
    assert field_of(b.component.Sight.getField()) == world.field
    b.advance(0.2)
    seen = b.component.Sight.getSight().things
    ball = next(each for each in seen if each.kind == "ball")
    assert (ball.x, ball.y) == pytest.approx((2.0, 0.0), abs=0.1)
    posts = sorted((each.y, each.x) for each in seen if each.kind == "goalpost")
    assert posts == [pytest.approx((y, 3.5), abs=0.15) for y in (-1.65, 1.65)]


def test_a_ball_that_rolls_into_a_wall_comes_back(tmp_path: Path, behavior: MakeBehavior) -> None:
    world = league(ball=(2.0, 3.3), robot=StartPose(position=(2.0, 1.9), heading=math.pi / 2))
    b = behavior(walking(tmp_path, seconds=3.0), robot="sim", body="G1", world=world)
    stage = b.robot.device.stage
    assert stage is not None

    def side() -> float:
        return float(stage.truth().objects["Ball"].position[1])

    b.run_until(lambda: side() > 4.5 - RADIUS - 0.05, limit=12.0)
    nearest = 0.0
    for _ in range(10):
        b.advance(0.05)
        nearest = max(nearest, side())
    assert nearest == pytest.approx(4.5 - RADIUS, abs=0.04)
    b.run_until(lambda: side() < nearest - 0.05, limit=3.0)


def test_the_middle_of_the_ball_behind_the_line_is_a_goal_in_a_match_of_the_league(tmp_path: Path) -> None:
    _, rules = load_format("league")
    world = load_world("league")
    assert world.field is not None
    short = replace(world, walls=(), field=replace(world.field, length=5.0))  # the way to the goal, too
    archive, (ours, theirs) = pack([walking(tmp_path), walking(tmp_path, "stands", 0.0)])
    plan = Plan(
        documents=(ours, theirs),
        teams=("ours", "theirs"),
        players=1,
        seconds=25.0,
        seed=2,
        rules=replace(rules, waiting=((-2.2, -1.5),)),  # out of the way
        world=short,
        body="G1",
    )
    with closing(Matches()) as matches:
        found = matches.run(Match(plan, 1, archive)).require().result
    goal = next(event for event in found.events if event.kind == "goal")
    assert (goal.team, goal.robot, found.score) == ("ours", "red1", (1, 0))
    assert [event.text for event in found.events if event.kind == "penalty"] == []
