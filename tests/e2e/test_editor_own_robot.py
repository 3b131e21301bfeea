"""A robot of the user's own in the page, in Chromium: its model chosen, seen, corrected, saved, started, moved."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, expect

from interfaces.nao import JointsPrx
from tests.support.arm import ARM, ARM_TOML
from tests.support.browser import EditorPage, editor_page
from tests.support.editor import editor
from tests.support.limits import CALL_LIMIT, RUN_LIMIT
from tests.support.monitor import comes_true, patient_parts, status
from tests.support.plugins import OWN_ROBOTS
from tests.support.processes import children, free_endpoint
from tests.support.waiting import until
from zenoh_ice import Settings, initialize

pytestmark = OWN_ROBOTS

STARTED = RUN_LIMIT * 1000
READ = RUN_LIMIT * 1000
TURNED = """([view, joint]) => {
  const found = document.querySelector(view)?.drawing?.body?.joints.find((each) => each.joint === joint);
  return found && found.link.quaternion.angleTo(found.turn) > 0.5;
}"""

INKED = """async (image) => {
  await image.decode();
  const context = new OffscreenCanvas(image.naturalWidth, image.naturalHeight).getContext("2d");
  context.drawImage(image, 0, 0);
  const {data} = context.getImageData(0, 0, image.naturalWidth, image.naturalHeight);
  return data.filter((value, index) => index % 4 === 3 && value).length;
}"""


@pytest.fixture
def settings() -> Settings:
    return Settings(realm="test-own-robot", connect=(free_endpoint(),), clock="wall", timeout=CALL_LIMIT)


@pytest.fixture
def shown(browser: Browser, tmp_path: Path, settings: Settings) -> Iterator[EditorPage]:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "arm.urdf").write_text(ARM)
    (tmp_path / "elsewhere.urdf").write_text(ARM)
    with (
        editor(tmp_path, make_parts=patient_parts(settings, folder=tmp_path)) as running,
        editor_page(browser, running) as shown,
    ):
        yield shown
    assert not children("naoserver_sim")


def chosen(shown: EditorPage, *path: str) -> Locator:
    """Choose a file by keys alone, and return the dialog of its robot."""
    button = shown.button("Your own robot")
    button.focus()
    shown.press("Enter")
    files = shown.page.get_by_role("listbox", name="Models of robots and folders")
    expect(files.get_by_role("option", name="arm.urdf")).to_be_visible()  # it opens in the folder robots
    if path[0] != "robots":
        shown.press("Backspace")
    for name in [each for each in path if each != "robots"]:
        expect(files.get_by_role("option", name=name)).to_be_visible()
        shown.type(name)
        shown.press("Enter")
    dialog = shown.page.get_by_role("dialog", name=f"Your own robot: {'/'.join(path)}")
    dialog.wait_for()
    return dialog


def text_of(dialog: Locator) -> Locator:
    """Return the field with the text, once the file is read."""
    field = dialog.get_by_label("Its parts: correct what was guessed")
    expect(field).to_have_value(re.compile("model = "), timeout=READ)
    expect(dialog.get_by_role("button", name="Check")).to_be_enabled(timeout=READ)
    return field


@pytest.mark.sim
def test_a_model_is_seen_corrected_saved_started_and_moved(
    shown: EditorPage, settings: Settings, tmp_path: Path
) -> None:
    page = shown.page
    dialog = chosen(shown, "robots", "arm.urdf")
    field = text_of(dialog)
    expect(dialog.get_by_role("list", name="What it was taken for")).to_contain_text("joints")
    dialog.get_by_role("combobox", name="Joint").select_option("elbow")
    dialog.get_by_role("slider").press("End")
    comes_true(shown, TURNED, ["hfsm-own-robot", "elbow"])
    assert shown.violations("dialog") == []

    guessed = field.input_value()
    assert "#" in guessed  # the reasons
    field.fill(guessed + '\n[hinges.Neck]\npan = "nowhere"\n')
    field.press("Control+Enter")
    problem = dialog.get_by_role("alert")
    expect(problem).to_contain_text("nowhere", timeout=READ)
    field.fill("mounted = 7\n" + re.sub("(?m)^mounted.*\n", "", guessed))
    field.press("Control+Enter")
    expect(problem).to_contain_text("Line 1: mounted = 7: write true or false", timeout=READ)
    assert (
        field.evaluate("(each) => each.value.slice(each.selectionStart, each.selectionEnd)") == "mounted = 7"
    )
    assert shown.violations("dialog") == []
    field.fill('title = "Mine"\nmounted = true\n' + re.sub("(?m)^(mounted|title).*\n", "", guessed))
    dialog.get_by_label("Name of its file in the folder robots").fill("mine")
    dialog.get_by_role("button", name="Save and start").click()
    expect(dialog).to_have_count(0, timeout=READ)
    expect(page.get_by_role("button", name="Simulated Mine")).to_be_visible(timeout=STARTED)
    assert [each.name for each in sorted((tmp_path / "robots").iterdir())] == ["arm.urdf", "mine.toml"]
    card = page.get_by_role("radiogroup", name="Robot").locator("label", has_text="Mine")
    expect(card.get_by_role("radio")).to_be_checked()
    assert card.locator("img").evaluate(INKED) > 300  # pixels of the robot, in its picture

    shown.button("Empty Start with a blank sheet.").click()
    shown.press("Alt+l")
    page.get_by_role("tab", name="3D").click()
    with initialize(settings.override(listen=("tcp/127.0.0.1:0",))) as communicator:
        until(lambda: "Body" in communicator.identities())
        body = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
        assert body is not None
        body.setJointPositions({"elbow": 1.0}, 1.0)
        comes_true(shown, TURNED, ["hfsm-robot-view", "elbow"])


@pytest.mark.sim
def test_a_run_whose_robot_is_exchanged_for_one_without_its_parts_says_so(shown: EditorPage) -> None:
    page = shown.page
    shown.button("Watch a robot dance").click()
    expect(status(shown)).to_have_text("Running", timeout=STARTED)
    shown.press("Alt+b")
    page.get_by_role("dialog", name="Robot").wait_for()
    dialog = chosen(shown, "robots", "arm.urdf")
    text_of(dialog)
    dialog.get_by_role("button", name="Save and start").click()
    expect(page.get_by_role("button", name="Simulated arm")).to_be_visible(timeout=STARTED)
    expect(status(shown)).to_have_text("Running, parts missing")
    expect(status(shown)).to_have_attribute("title", re.compile("This robot has no RightShoulderMotors, "))

    shown.press("Alt+b")
    page.get_by_role("dialog", name="Robot").get_by_label("Robot").select_option("H21")
    shown.button("Restart the simulation with these").click()
    expect(status(shown)).to_have_text("Running", timeout=STARTED)


def test_what_was_typed_outlives_a_closed_dialog_and_no_file_is_replaced_unasked(
    shown: EditorPage, tmp_path: Path
) -> None:
    page = shown.page
    (tmp_path / "robots" / "arm.toml").write_text(ARM_TOML)
    dialog = chosen(shown, "robots", "arm.toml")
    field = text_of(dialog)
    field.fill(ARM_TOML.replace("An arm", "Typed"))
    shown.press("Escape")
    expect(dialog).to_have_count(0)
    dialog = chosen(shown, "robots", "arm.toml")
    expect(text_of(dialog)).to_have_value(ARM_TOML.replace("An arm", "Typed"))
    (tmp_path / "robots" / "other.toml").write_text("")
    dialog.get_by_label("Name of its file in the folder robots").fill("other")
    dialog.get_by_role("button", name="Save", exact=True).click()
    expect(dialog.get_by_role("alert")).to_contain_text("robots/other.toml already exists")
    assert (tmp_path / "robots" / "other.toml").read_text() == ""
    dialog.get_by_role("button", name="Replace robots/other.toml").click()
    expect(page.get_by_text("robots/other.toml is saved")).to_be_visible()
    assert "Typed" in (tmp_path / "robots" / "other.toml").read_text()
    shown.press("Escape")
    expect(page.get_by_role("radiogroup", name="Robot").get_by_role("radio", name="Typed")).to_be_checked()


def test_a_model_elsewhere_is_refused_with_what_to_do(shown: EditorPage) -> None:
    dialog = chosen(shown, "elsewhere.urdf")
    expect(dialog.get_by_role("alert")).to_contain_text(
        "elsewhere.urdf is not in the folder robots: put it there, with its meshes", timeout=READ
    )


def test_on_a_phone_nothing_is_cut_off(shown: EditorPage, tmp_path: Path) -> None:
    (tmp_path / "robots" / "arm.toml").write_text(ARM_TOML)
    dialog = chosen(shown, "robots", "arm.toml")
    text_of(dialog)
    shown.resize(390, 700)
    wide = "() => document.querySelector('dialog .content').scrollWidth - document.querySelector('dialog .content').clientWidth"
    assert shown.page.evaluate(wide) == 0
    expect(dialog.get_by_role("button", name="Save and start")).to_be_in_viewport()
