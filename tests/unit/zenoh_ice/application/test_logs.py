"""Where the log of a command goes, and how its lines read."""

from __future__ import annotations

import json
import logging
import os
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from zenoh_ice.application.logs import rotating, set_up_logging
from zenoh_ice.data.exceptions import ConfigurationException
from zenoh_ice.settings import Settings, load_settings

logger = logging.getLogger("robot.arm")


def test_text_has_date_time_level_and_place(capsys: pytest.CaptureFixture[str]) -> None:
    set_up_logging(Settings(log_level="info"))
    logger.info("reached %d", 3)
    logger.debug("not shown")
    shown = r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{3} INFO     robot\.arm: reached 3\n"
    assert re.fullmatch(shown, capsys.readouterr().err)


def test_json_is_one_object_on_each_line(capsys: pytest.CaptureFixture[str]) -> None:
    set_up_logging(Settings(log_format="json"))
    try:
        raise OSError("no\nway")
    except OSError:
        logger.exception("it is %s", "lost\n")
    logger.warning("Grüße")
    first, second = map(json.loads, capsys.readouterr().err.splitlines())
    exception, time = first.pop("exception"), datetime.fromisoformat(first.pop("time"))
    assert exception.startswith("Traceback")
    assert exception.endswith("OSError: no\nway")
    assert timedelta() <= datetime.now(UTC) - time < timedelta(minutes=1)
    assert first.pop("program")
    assert first == {
        "level": "error",
        "logger": "robot.arm",
        "message": "it is lost\n",
        "pid": os.getpid(),
        "thread": "MainThread",
    }
    assert (second["level"], second["message"]) == ("warning", "Grüße")


def test_a_file_takes_the_place_of_stderr_and_is_made_with_its_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["/usr/bin/ballmover"])
    environment = {"VISUALHFSM_LOG_FILE": f"{tmp_path}/logs/{{program}}-{{pid}}.log"}
    for _ in range(2):
        set_up_logging(load_settings(environment=environment))
        logger.warning("once")
    log = (tmp_path / f"logs/ballmover-{os.getpid()}.log").read_text("utf-8")
    assert re.fullmatch(r"(.* WARNING  robot\.arm: once\n){2}", log)
    assert capsys.readouterr().err == ""


def test_a_file_that_cannot_be_written_is_named_with_its_setting(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    settings = load_settings(flags={"log_file": f"{tmp_path}/file/log"}, environment={})
    with pytest.raises(
        ConfigurationException, match=r"^--log-file: log_file = '.*/file/log': cannot be written: "
    ):
        set_up_logging(settings)


def test_a_full_file_is_renamed_and_five_are_kept(tmp_path: Path) -> None:
    log = rotating(tmp_path / "log")
    line = logging.makeLogRecord({"msg": "x" * 1_000_000})
    for _ in range(70):
        log.emit(line)
    log.close()
    names = sorted(each.name for each in tmp_path.iterdir())
    assert names == ["log", "log.1", "log.2", "log.3", "log.4", "log.5"]
    assert max(each.stat().st_size for each in tmp_path.iterdir()) <= 10_000_000
