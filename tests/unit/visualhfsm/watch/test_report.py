"""The report: one self-contained file, with pictures that can be decoded."""

import base64
import io
import os
import re
import threading
from dataclasses import replace

import pytest

from tests.support.limits import EVENT_LIMIT

pytest.importorskip("matplotlib")
from PIL import Image

from tests.support.watching import contents
from visualhfsm.errors import MissingPackageError, VisualHfsmError
from visualhfsm.watch import report
from visualhfsm.watch.report import check_place, write_report
from visualhfsm.watch.telemetry import Picture, picture_png


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "below" / "report.html"
    camera = [Picture(1.0, "followBall > red", 32, 24, bytes(32 * 24 * 3), [(15.5, 11.5)])]
    outside = [Picture(2.0, "dance <b>", 32, 24, bytes(32 * 24 * 3))]
    write_report(path, replace(contents(27), outside=outside, through_camera=camera))
    assert [other.name for other in path.parent.iterdir()] == ["report.html"]
    return path.read_text(encoding="utf-8")


def test_the_report_needs_no_other_file_and_no_network(page):
    addresses = re.findall(r'(?:src|srcset|href)="([^"]{0,40})', page)
    assert addresses
    assert all(address.startswith("data:image/png;base64,") for address in addresses)
    assert "http" not in re.sub(r"base64,[^\"]*", "", page)


def test_every_picture_can_be_decoded(page):
    sizes = [
        Image.open(io.BytesIO(base64.b64decode(data))).size for data in re.findall(r"base64,([^\"]+)", page)
    ]
    assert sizes.count((32, 24)) == 2
    assert len(sizes) == 2 + 3  # and the plots


def test_the_report_shows_the_figures_and_the_changes(page):
    assert "100.0 %" in page
    assert "27 s of a run watched on 1 March 2026, 12:30" in page
    assert "<td>10.00</td><td>dance_and_follow</td><td>followBall → dance</td>" in page


def test_what_components_send_is_escaped(page):
    assert "dance &lt;b&gt;" in page
    assert "<b>dance" not in page


def test_marks_are_drawn_in_their_places():
    marked = picture_png(Picture(0.0, "", 64, 48, bytes(64 * 48 * 3), [(40.0, 20.0), (20.0, 40.0)]))
    image = Image.open(io.BytesIO(marked))
    assert image.getpixel((40, 20)) == (255, 255, 255)
    assert image.getpixel((20, 40)) == (255, 255, 255)
    assert image.getpixel((10, 10)) == (0, 0, 0)


def test_a_mark_outside_of_the_image_does_no_harm():
    assert picture_png(Picture(0.0, "", 8, 6, bytes(8 * 6 * 3), [(-400.0, 900.0)]))


def test_a_short_run_without_ball_or_pictures_has_a_report(tmp_path):
    path = tmp_path / "report.html"
    write_report(path, replace(contents(0.1), outside_trouble="No GL library."))
    assert "There is no picture from outside. No GL library." in path.read_text(encoding="utf-8")


def test_a_name_may_hold_dollar_signs(tmp_path):
    run = contents(27)
    for automaton in run.automata.all:
        automaton.name = r"$\frac$"
        for state in automaton.states:
            state.name = r"$\x$"
    write_report(tmp_path / "report.html", run)
    assert r"$\x$" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(VisualHfsmError, match="report cannot be written"):
        write_report(tmp_path / "file" / "report.html", contents(0.1))
    with pytest.raises(VisualHfsmError, match="report cannot be written"):
        check_place(tmp_path / "file" / "report.html")


def test_a_link_stays_a_link(tmp_path):
    link = tmp_path / "link.html"
    link.symlink_to(tmp_path / "report.html")
    write_report(link, contents(0.1))
    assert link.is_symlink()
    assert (tmp_path / "report.html").is_file()


def test_a_pipe_is_written_to_and_not_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text(encoding="utf-8")), daemon=True)
    reader.start()
    write_report(pipe, contents(0.1))
    reader.join(EVENT_LIMIT)
    assert pipe.is_fifo()
    assert read[0].rstrip().endswith("</html>")


def test_a_missing_package_is_named_with_the_command_that_installs_it(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(MissingPackageError, match=re.escape("pip install 'visualhfsm[demo]'")):
        report.check_packages()
