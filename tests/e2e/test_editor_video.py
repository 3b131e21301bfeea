"""*Save as video* in the 3D view of a past run: the browser records what is drawn, until the end or a pause."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Browser, expect

from tests.support.browser import editor_page
from tests.support.editor import editor
from tests.support.limits import RUN_LIMIT
from tests.support.monitor import patient_parts
from tests.support.places import ROOT
from visualhfsm.trials import plan_of, run_trial
from zenoh_ice import Settings


def record(folder: Path) -> Path:
    """Record the first seconds of a dance of a simulated Nao."""
    shutil.copy(ROOT / "behaviors/dance.xml", folder)
    plan = folder / "dance.trials.toml"
    plan.write_text('robot = "sim"\ncamera = "drawn"\nlimit = 3\n[success]\nstate = "low"\n')
    run_trial(plan_of(plan), 1, folder / "dance.mcap")
    return folder / "dance.mcap"


def frames(video: Path) -> list[NDArray[np.uint8]]:
    """Return the pictures of a video."""
    opened, found = cv2.VideoCapture(str(video)), []
    while (read := opened.read())[0]:
        found.append(read[1])
    opened.release()
    return found


def test_the_rest_of_a_recording_becomes_a_video(browser: Browser, tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.mkdir()
    recording = record(root)
    parts = patient_parts(Settings(listen=(), connect=(), clock="wall"), folder=root)
    with editor(root, recording, make_parts=parts) as running, editor_page(browser, running) as shown:
        page = shown.page
        loaded: list[str] = []
        page.on("request", lambda request: loaded.append(request.url.rpartition("/")[2]))
        save = page.get_by_role("button", name="Save as video")
        shown.show_robot()
        expect(page.locator("hfsm-robot-view canvas")).to_be_visible(timeout=RUN_LIMIT * 1000)
        assert "video.js" not in loaded
        with page.expect_download(timeout=RUN_LIMIT * 1000) as download:
            save.click()
            expect(page.get_by_role("button", name="Stop and save")).to_have_attribute("aria-pressed", "true")
        assert "video.js" in loaded
        assert download.value.suggested_filename == "dance.webm"
        pictures = frames(Path(download.value.path()))
        expect(save).to_have_attribute("aria-pressed", "false")
        expect(page.locator(".notice")).to_contain_text("Saved dance.webm.")
    assert len(pictures) > 3
    first, last = pictures[0].astype(int), pictures[-1].astype(int)
    assert first.std() > 5, "the robot is seen"
    assert np.abs(first - last).max() > 50, "it has moved"
    assert min(first[0, 0]) > 200, "the paper is light"
