"""A robot of the user's own in the editor: its model is read by real processes, checked and saved."""

from __future__ import annotations

import asyncio
from pathlib import Path

import msgspec
import pytest

from tests.support.arm import ARM, ARM_TOML
from tests.support.editor import Refused, editor
from tests.support.plugins import OWN_ROBOTS
from tests.support.processes import children
from visualhfsm._base.errors import ForbiddenPathError, VisualHfsmError, WouldOverwriteError
from visualhfsm._editor.own_robots import OwnRobot, OwnRobots
from visualhfsm.project._root import Root


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A project with the model of an arm in its folder of robots."""
    root = tmp_path / "project"
    (root / "robots").mkdir(parents=True)
    (root / "robots" / "arm.urdf").write_text(ARM)
    return root


def look(root: Path, text: str, name: str = "arm") -> OwnRobot:
    return asyncio.run(OwnRobots(Root(root)).look(name, text))


def drawn(robot: OwnRobot) -> dict[str, object]:
    assert robot.robot is not None, robot.problem
    found: dict[str, object] = msgspec.json.decode(robot.robot)
    return found


@OWN_ROBOTS
def test_a_text_is_drawn_as_the_robot_that_it_describes(root: Path) -> None:
    robot = drawn(look(root, ARM_TOML))
    assert robot["title"] == "An arm"
    assert [link["name"] for link in robot["links"]] == ["base", "upper", "hand"]  # type: ignore[attr-defined]


@OWN_ROBOTS
@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        (ARM_TOML.replace("true", "7"), 3, "mounted = 7: write true or false"),
        (ARM_TOML.replace("arm.urdf", "leg.urdf"), 0, "robots/leg.urdf: cannot be read"),
    ],
)
def test_what_is_wrong_is_said_with_its_line_and_without_the_path_of_the_project(
    root: Path, text: str, line: int, says: str
) -> None:
    robot = look(root, text)
    assert (robot.robot, robot.line, robot.text) == (None, line, text)
    assert says in robot.problem
    assert str(root) not in robot.problem


@OWN_ROBOTS
def test_a_model_alone_is_guessed_with_reasons_and_leaves_no_file(root: Path) -> None:
    (root / "robots" / "ours").mkdir()
    (root / "robots" / "arm.urdf").rename(root / "robots" / "ours" / "my arm.urdf")
    robot = asyncio.run(OwnRobots(Root(root)).guess("robots/ours/my arm.urdf"))
    assert robot.name == "my_arm"
    assert 'model = "ours/my arm.urdf"\n' in robot.text
    assert "--body my_arm.toml" in robot.text
    assert "mounted = true  # " in robot.text
    assert any("2 joints" in line for line in robot.took)
    assert drawn(robot)["name"] == "my arm"
    assert [each.name for each in (root / "robots").iterdir()] == ["ours"]


@OWN_ROBOTS
def test_what_is_left_out_of_a_model_is_noted_once(root: Path) -> None:
    shape = '<visual><geometry><mesh filename="hand.stl"/></geometry></visual></link>'
    (root / "robots" / "arm.urdf").write_text(ARM.replace("</link>", shape, 1))
    robot = asyncio.run(OwnRobots(Root(root)).guess("robots/arm.urdf"))
    noted = [line for line in (*robot.took, *robot.notes) if "hand.stl" in line]
    assert len(noted) == 1
    assert noted[0].startswith("robots/arm.urdf")


@OWN_ROBOTS
def test_a_model_that_cannot_be_read_says_why_beside_a_text_to_go_on_with(root: Path) -> None:
    (root / "robots" / "arm.urdf").write_text(ARM.replace('child link="hand"', 'child link="foot"'))
    robot = asyncio.run(OwnRobots(Root(root)).guess("robots/arm.urdf"))
    assert (robot.name, robot.text, robot.robot) == ("arm", 'model = "arm.urdf"\n', None)
    assert robot.problem.startswith("robots/arm.urdf:")
    assert "foot" in robot.problem
    assert [each.name for each in (root / "robots").iterdir()] == ["arm.urdf"]


@OWN_ROBOTS
def test_a_file_of_the_project_is_answered_as_it_is(root: Path) -> None:
    (root / "robots" / "mine.toml").write_text(ARM_TOML)
    robot = asyncio.run(OwnRobots(Root(root)).guess("robots/mine.toml"))
    assert (robot.name, robot.text) == ("mine", ARM_TOML)
    assert drawn(robot)["name"] == "mine"


def test_files_elsewhere_are_refused(root: Path) -> None:
    (root.parent / "secret.urdf").write_text(ARM)
    (root / "robots" / "stolen.urdf").symlink_to(root.parent / "secret.urdf")
    (root / "arm.urdf").write_text(ARM)
    robots = OwnRobots(Root(root))
    for path in ("../secret.urdf", str(root.parent / "secret.urdf"), "robots/stolen.urdf", "robots", "a.py"):
        with pytest.raises(ForbiddenPathError):
            asyncio.run(robots.guess(path))
    for path, says in (
        ("robots/leg.urdf", "there is no file"),
        ("arm.urdf", "put it there, with its meshes"),
    ):
        with pytest.raises(VisualHfsmError, match=says):
            asyncio.run(robots.guess(path))


def test_a_model_that_takes_too_long_ends_with_its_process(root: Path) -> None:
    robot = asyncio.run(OwnRobots(Root(root), patience=0.05).look("arm", ARM_TOML))
    assert robot.problem == "reading it took longer than 0.05 s"
    assert not children("naoserver_sim._description")


@OWN_ROBOTS
def test_a_model_that_takes_too_much_memory_ends_with_its_process(root: Path) -> None:
    robot = asyncio.run(OwnRobots(Root(root), memory=100 << 20).look("arm", ARM_TOML))
    assert "the model cannot be read" in robot.problem


def test_a_window_that_closes_ends_what_it_asked_for(root: Path) -> None:
    async def leave() -> None:
        looking = asyncio.create_task(OwnRobots(Root(root)).look("arm", ARM_TOML))
        async with asyncio.timeout(5):
            while not children("naoserver_sim._description"):
                await asyncio.sleep(0.01)
        looking.cancel()
        await asyncio.wait({looking})

    asyncio.run(leave())
    assert not children("naoserver_sim._description")


def test_a_robot_is_saved_under_a_name_and_replaces_none_unasked(root: Path) -> None:
    robots = OwnRobots(Root(root))
    assert robots.save("my arm", ARM_TOML, overwrite=False) == "robots/my arm.toml"
    with pytest.raises(WouldOverwriteError, match=r"robots/my arm\.toml already exists"):
        robots.save("my arm", "other", overwrite=False)
    assert (root / "robots" / "my arm.toml").read_text() == ARM_TOML
    robots.save("my arm", "other", overwrite=True)
    assert (root / "robots" / "my arm.toml").read_text() == "other"


@pytest.mark.parametrize("name", ["", "../arm", "a/b", ".hidden", "a" * 61, "a\nb", "a\0"])
def test_what_is_no_name_of_a_file_is_refused(root: Path, name: str) -> None:
    with pytest.raises(VisualHfsmError, match="is no name of a file"):
        OwnRobots(Root(root)).save(name, ARM_TOML, overwrite=True)


def test_a_folder_that_leads_out_of_the_project_is_not_written_to(root: Path) -> None:
    (root.parent / "elsewhere").mkdir()
    (root / "robots").rename(root / "others")
    (root / "robots").symlink_to(root.parent / "elsewhere")
    with pytest.raises(ForbiddenPathError):
        OwnRobots(Root(root)).save("arm", ARM_TOML, overwrite=True)
    assert not [*(root.parent / "elsewhere").iterdir()]


@OWN_ROBOTS
def test_a_window_checks_and_saves_a_robot_that_can_be_simulated_then(root: Path) -> None:
    with editor(root) as running, running.window() as window:
        listed = window.ask("listFiles", directory="robots")["entries"]
        assert [(each["path"], each["kind"]) for each in listed] == [("robots/arm.urdf", "model")]
        assert window.ask("checkRobot", name="arm", text=ARM_TOML)["robot"]["title"] == "An arm"
        saved = window.ask("saveRobot", name="arm", text=ARM_TOML)
        assert saved["path"] == "robots/arm.toml"
        assert saved["bodies"][-1] == {"name": "robots/arm.toml", "title": "An arm"}
        with pytest.raises(Refused, match="already exists") as refused:
            window.ask("saveRobot", name="arm", text="")
        assert refused.value.kind == "exists"
        assert window.ask("guessRobot", path="robots/arm.toml")["text"] == ARM_TOML
