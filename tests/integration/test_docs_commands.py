"""docs/tutorial and docs/how-to: every command runs, in the environment that the page asks people to make.

What a page shows of its output is compared. `make test` types the commands of one page so; those of the others run in
this process if they end soon, and otherwise only their words and files are checked.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import pytest

from tests.support.carriers import LOCAL, is_used, over_both
from tests.support.documents import document, state, sub, transition
from tests.support.environments import copy_packages, make_environment
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS, Block, blocks_of, pages
from tests.support.places import ROOT
from tests.support.plugins import OF_THE_WHOLE
from tests.support.processes import ComponentProcess, free_endpoint
from tests.support.quick_reader import QuickReader
from tests.support.reader import Command, Reader, commands_of
from tests.support.soak import cases

pytestmark = [pytest.mark.slow, pytest.mark.sim]

ELSEWHERE: Final = {
    r"make demo": "downloads the packages; test_demo starts the demo",
    r"python3 -m venv": "`make_environment` makes it",
    r"\. \.venv/bin/activate @own-(project|hardware)": "`make_environment` makes it",
    r"naoserver-sim --lines": "the plug-in of the page adds it; test_docs_plug_in.py runs it",
    r"pip install": "downloads; `make_environment` does what it does",
    r"naoserver-naoqi --robot tcp://nao\.local": "needs a real robot; test_naoqi_command starts it beside a NAOqi",
    r"export|ros2": "ROS is not installed; test_ros_zenoh_peer talks with its wire format",
    r"visualhfsm (match|tournament)": "takes minutes; test_match plays one",
    r"visualhfsm trials behaviors/score": "takes half an hour; test_football_trials runs some of its trials",
    r"nao watch Body @what-if": "goes on until Ctrl-C; test_nao_command watches for some seconds",
    r"zenohd": "a router that is not ours is not installed",
}
"""Why a command of a page does not run here."""
CODES: Final = {
    "visualhfsm replay dance.mcap dance.xml": 3,
    "visualhfsm diff behaviors/blinker.xml further.xml": 1,
    "codegen diff released interfaces": 1,
}
"""Commands that do not end with 0: the page says that something differs."""
BEFORE: Final = {
    "how-to/nao.md": ["python -m naoserver.fake"],
    "how-to/recording.md": ["python -m naoserver.fake"],
    "../plugins/ros2/docs/ros2-behaviors.md": ["nao router", "codegen patrol.xml"],
    "how-to/troubleshooting.md": ["python -m naoserver.fake"],
}
"""Commands that a page presumes."""
SUPPLIED: Final = {
    "../plugins/ros2/docs/ros2-behaviors.md": ("examples/turtlebot/bump_and_go.xml",),
    "../plugins/old_documents/docs/scxml.md": ("behaviors/follow_ball.xml",),
    "../plugins/trials/docs/trials.md": ("behaviors/follow_ball.xml",),
    "tutorial/es/football.md": ("behaviors/score.xml",),
    "tutorial/football.md": ("behaviors/score.xml",),
}
"""Documents that a page presumes."""
PAGES: Final = pages("tutorial", "how-to")
CHECKOUT: Final = (
    "tutorial/",
    "how-to/editor.md",
    "../plugins/own_robots/docs/own-robot.md",
    "how-to/recording.md",
    "how-to/what-if.md",
    "how-to/several-robots.md",
)
"""Pages whose reader is in the checkout, in which `make demo` has made `.venv`."""
TYPED: Final = "tutorial/from-the-paper.md"
"""The page whose commands `make test` types as people do: a robot, and two components."""
PICTURES: Final = (
    "tutorial/es/football.md",
    "tutorial/football.md",
    "../plugins/own_robots/docs/own-robot.md",
    "../plugins/trials/docs/trials.md",
    "how-to/troubleshooting.md",
    "../plugins/naoqi/docs/virtual-nao.md",
)
"""Pages whose robot needs cameras."""


PERSONAL: Final = """
import warnings

import pytest
from helper import HALF


@pytest.mark.lesson
def test_it():
    warnings.warn("it gets old")
    assert HALF == 0.5
"""
"""A test with a module beside it, its own mark and a warning."""


SCRIPT: Final = """
from interfaces.nao import PoseHeadPrx
from zenoh_ice import initialize

with initialize() as communicator:
    head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
    print(head.setPose(0.5, 0.1, 0.2), flush=True)
    communicator.waitForShutdown()
"""
"""What a user writes who has read the README, and then stays."""


def blocks(page: str) -> list[Block]:
    return blocks_of((DOCS / page).read_text("utf-8"))


def commands(page: str) -> list[Command]:
    return [
        command
        for block in blocks(page)
        if block.name is None
        for command in commands_of(block.text, block.language)
    ]


def reason(page: str, command: Command) -> str | None:
    """Return why a command does not run here."""
    place = f"{command.text} @{Path(page).stem}"
    return next((why for pattern, why in ELSEWHERE.items() if re.match(pattern, place)), None)


def extras(page: str) -> frozenset[str]:
    """Return the extras that the page installs, or those of `make demo` with those that it says are needed, too."""
    text = (DOCS / page).read_text("utf-8")
    installs = " ".join(command.text for command in commands(page) if command.text.startswith("pip install"))
    named = re.findall(r"visualhfsm\[([\w,]+)\]", installs or text)
    return frozenset(
        {each for names in named for each in names.split(",")} | (set() if installs else {"demo"})
    )


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packages")
    copy_packages(folder)
    return folder


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkout after `make demo`."""
    folder = tmp_path_factory.mktemp("checkout")
    copy_packages(folder, checkout=True)
    (folder / "pyproject.toml").symlink_to(ROOT / "pyproject.toml")
    make_environment(folder / ".venv", ["demo"], packages=folder, editable=True)
    return folder


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory, packages: Path) -> Callable[[frozenset[str]], Path]:
    """Return the folder of programs of an environment with these extras."""
    made: dict[frozenset[str], Path] = {}

    def programs(wanted: frozenset[str]) -> Path:
        if wanted not in made:
            made[wanted] = make_environment(tmp_path_factory.mktemp("venv"), wanted, packages=packages)
        return made[wanted]

    return programs


def arrive(reader: Reader, checkout: Path, page: str) -> None:
    """Begin a page in the checkout, where a reader who did the first page is."""
    mine = checkout / "mine"
    shutil.rmtree(mine, ignore_errors=True)
    reader.folder = checkout
    if page.endswith("first-behavior.md"):
        return
    mine.mkdir()
    reader.activate(checkout / ".venv/bin")
    if page.endswith("football.md"):
        reader.folder = mine


def prepare(page: str, reader: Reader) -> None:
    """Save the files of a page, and those that its reader has from elsewhere."""
    for name in SUPPLIED.get(page, ()):
        reader.save(Path(name).name, (ROOT / name).read_text("utf-8"))
    if page == "../plugins/ros2/docs/ros2-behaviors.md":
        (patrol,) = (block.text for block in blocks("how-to/steering.md") if block.name == "patrol.xml")
        reader.save("patrol.xml", patrol)
    for block in blocks(page):
        if block.name is not None:
            reader.save(block.name, block.text)


def save_test(page: str, reader: Reader) -> None:
    """Save the test of a tutorial, and the document that its reader has drawn by now."""
    text = (DOCS / page).read_text("utf-8")
    for name, test in re.findall(r"`(test_\w+\.py)`[^`]*\n\n```python\n(.*?)^```", text, re.M | re.S):
        reader.save(name, test)
    if page.endswith("first-behavior.md"):
        reader.save("look_around.xml", look_around(page))


def look_around(page: str) -> str:
    """Return the document that a reader of the tutorial draws; test_draw draws it in the editor."""
    left, right, there, *_ = (block.text.strip() for block in blocks(page) if block.language == "python")
    head = "<iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface></iceinterface>"
    return document(
        sub(
            1,
            0,
            state(1, "left", left, initial=True),
            state(2, "right", right),
            transition(1, 1, 2, "2000", type="time", name="two seconds"),
            transition(2, 2, 1, there, name="there"),
        ),
        config=head,
    )


def parameter(page: str) -> Any:
    """Return a page as a parameter of the test that types its commands."""
    return pytest.param(
        page,
        id=f"{page}@checkout" if page.startswith(CHECKOUT) else page,
        marks=[pytest.mark.gl] if page in PICTURES else [],
    )


def type_all(page: str, reader: Reader) -> None:
    """Type the commands of a page in order."""
    for text in BEFORE.get(page, ()):
        reader.type(Command(text))
    for block in blocks(page):
        for command in commands_of(block.text, block.language) if block.name is None else ():
            if command.text.startswith("pytest "):
                reader.leave()  # a test needs nothing that runs, which would keep the processor busy
                save_test(page, reader)
            if reason(page, command) is None:
                reader.type(command, code=CODES.get(command.text, 0))


@pytest.mark.timeout(900)  # a page has many commands
@pytest.mark.parametrize(
    "page",
    cases([parameter(TYPED)], [parameter(page) for page in PAGES if commands(page) and page != TYPED]),
)
def test_the_commands_run(
    page: str,
    tmp_path: Path,
    request: pytest.FixtureRequest,
    environment: Callable[[frozenset[str]], Path],
) -> None:
    try:
        programs = environment(extras(page)) if not page.startswith(CHECKOUT) else None
    except PackageNotFoundError as missing:
        pytest.skip(f"{missing} is not there, for which {page} asks")
    with Reader(tmp_path, programs) as reader:
        if programs is None:
            arrive(reader, request.getfixturevalue("checkout"), page)
        prepare(page, reader)
        type_all(page, reader)


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page) and page != TYPED])
def test_the_commands_are_understood(page: str, tmp_path: Path) -> None:
    if page == "how-to/several-robots.md" and find_spec("visualhfsm_ros2") is None:
        pytest.skip("its command naoserver-ros2 is that of the plug-in ros2")
    if page.startswith(CHECKOUT):
        (tmp_path / "behaviors").symlink_to(ROOT / "behaviors")
    with QuickReader(tmp_path) as reader:
        if page.startswith(CHECKOUT):
            arrive(reader, tmp_path, page)
        prepare(page, reader)
        type_all(page, reader)


def test_nothing_of_the_checkout_is_in_the_environment(
    tmp_path: Path, environment: Callable[[frozenset[str]], Path]
) -> None:
    programs = environment(frozenset({"demo"}))
    assert Path(
        run(programs, "import interfaces.nao as ours; print(ours.__file__)", tmp_path)
    ).is_relative_to(programs.parent)
    found = run(
        programs, "from importlib.util import find_spec; print(find_spec('pytest_timeout'))", tmp_path
    )
    assert found.strip() == "None"


@over_both
def test_an_installed_script_calls_an_installed_robot_server(
    carrier: str, tmp_path: Path, environment: Callable[[frozenset[str]], Path]
) -> None:
    """From the settings in a file to the connection, without anything of the tests."""
    programs, endpoint = environment(frozenset({"demo"})), free_endpoint()
    settings = tmp_path / "settings.toml"
    sockets = "true" if carrier == LOCAL else "false"
    settings.write_text(f'realm = "installed"\nconnect = ["{endpoint}"]\nlocal_sockets = {sockets}\n')
    python = str(programs / "python")
    server = [python, "-m", "naoserver.fake", "--realm", "installed", "--listen", endpoint]
    with ComponentProcess(server, cwd=tmp_path) as robot:
        robot.wait_for("^ready")
        chosen = {"VISUALHFSM_CONFIG": str(settings)}
        with ComponentProcess([python, "-c", SCRIPT], chosen, tmp_path) as script:
            script.wait_for("^HeadPose")
            assert is_used(carrier, robot.process.pid)
            assert is_used(carrier, script.process.pid)


def run(programs: Path, code: str, folder: Path) -> str:
    """Return what Python in an environment prints."""
    command = [str(programs / "python"), "-c", code]
    return subprocess.run(
        command, cwd=folder, stdout=subprocess.PIPE, text=True, timeout=RUN_LIMIT, check=True
    ).stdout


def test_tests_that_people_write_below_a_checkout_follow_their_own_rules(checkout: Path) -> None:
    mine = checkout / "mine"
    shutil.rmtree(mine, ignore_errors=True)
    with Reader(checkout, checkout / ".venv/bin") as reader:
        reader.type(Command("mkdir mine"))
        reader.type(Command("cd mine"))
        reader.save("helper.py", "HALF = 0.5\n")
        reader.save("test_mine.py", PERSONAL)
        reader.type(Command("pytest", "...1 passed, 2 warnings in ..."))


@OF_THE_WHOLE
def test_each_exception_is_one() -> None:
    places = [f"{command.text} @{Path(page).stem}" for page in PAGES for command in commands(page)]
    assert [pattern for pattern in ELSEWHERE if not any(re.match(pattern, place) for place in places)] == []
    ran = [command for page in PAGES for command in commands(page) if reason(page, command) is None]
    assert len(ran) >= 115, "commands of pages are not found any more"
