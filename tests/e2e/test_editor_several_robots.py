"""Several robots in one world in the page: all are drawn, of whatever kind, and the view can follow each."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from interfaces.nao import JointsPrx, ScenePrx
from tests.support.browser import EditorPage
from tests.support.editor import editor
from tests.support.limits import CALL_LIMIT
from tests.support.monitor import DOCUMENT, comes_true, monitor_page, patient_parts
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import Communicator, Settings, initialize

pytestmark = pytest.mark.sim

WORLD = """
[[balls]]
name = "Ball"
position = [0.0, 1.0]

[[robots]]
name = "own"

[[robots]]
name = "mate"
position = [0.0, -1.0]
shirt = [1.0, 0.5, 0.0]

[[robots]]
name = "cart"
body = "Cart"
position = [2.0, 0.0]
"""
OTHERS = """() => {
  const others = document.querySelector("hfsm-robot-view")?.drawing?.others ?? new Map();
  const seen = [...others].filter(([, {body}]) => body.torso.visible);
  return Object.fromEntries(seen.map(([name, {body}]) => [name, [
    ...body.torso.position.toArray().slice(0, 2),
    body.links.get("neck")?.quaternion.z ?? null,
    body.torso.children.find((part) => part.isMesh)?.material.color.getHexString(),
  ]]));
}"""
MIDDLE = "() => document.querySelector('hfsm-robot-view').drawing.viewpoints.at.toArray()"


@pytest.fixture
def shown(tmp_path: Path, browser: Browser) -> Iterator[tuple[EditorPage, Communicator]]:
    world, document, endpoint = tmp_path / "three.toml", tmp_path / "walk.xml", free_endpoint()
    world.write_text(WORLD)
    document.write_text(DOCUMENT)
    settings = Settings(realm="own", connect=(endpoint,), clock="wall", timeout=CALL_LIMIT)
    serves = module(
        "naoserver_sim", "--listen", endpoint, "--world", str(world), "--no-skin", "--speed", "0.5"
    )
    with ComponentProcess(serves) as process:
        process.wait_for("realm cart")
        with (
            editor(tmp_path, document, make_parts=patient_parts(settings)) as running,
            monitor_page(browser, running) as page,
            initialize(realm="mate", connect=[endpoint], listen=[]) as communicator,
        ):
            yield page, communicator


def test_all_robots_of_a_world_are_drawn_and_the_view_follows_the_one_that_is_chosen(
    shown: tuple[EditorPage, Communicator],
) -> None:
    (page, mate) = shown
    page.show_robot()
    comes_true(page, f"() => 'mate,cart' === Object.keys(({OTHERS})()).sort().reverse().join()")
    found = page.page.evaluate(OTHERS)
    assert found["mate"][:2] == pytest.approx([0.0, -1.0], abs=0.1)
    assert found["cart"][:2] == pytest.approx([2.0, 0.0], abs=0.1)
    assert found["mate"][3] == "ff8000"

    joints = JointsPrx.uncheckedCast(mate.stringToProxy("Body"))
    joints.setJointPositions({"HeadYaw": 0.8}, 0.5)
    comes_true(page, f"() => (({OTHERS})().mate?.[2] ?? 0) > 0.3")
    ScenePrx.uncheckedCast(mate.stringToProxy("Scene")).placeRobot(-1.0, -1.0, 0.0)
    comes_true(page, f"() => Math.abs(({OTHERS})().mate?.[0] + 1) < 0.1")
    assert page.page.evaluate(MIDDLE)[:2] == pytest.approx([0.0, 0.0], abs=0.2)

    page.press("Alt+b")
    page.page.get_by_role("button", name="Look at cart (Cart)").click()
    comes_true(page, f"() => Math.abs(({MIDDLE})()[0] - 2) < 0.2")
    hint = page.page.locator(".robot-hint")
    expect(hint).to_have_text("This is cart. Home returns to your own robot.")
    page.page.locator(".view-tools").get_by_role("button", name="Home").click()
    comes_true(page, f"() => Math.abs(({MIDDLE})()[0]) < 0.2")
    expect(hint).not_to_contain_text("cart")
