"""docs/how-to/recording.md: its topics and options exist; test_docs_commands runs its commands."""

from __future__ import annotations

import re

from tests.support.pages import DOCS
from tests.support.processes import REPOSITORY

PAGE = DOCS / "how-to/recording.md"


def test_every_topic_of_the_page_is_recorded_and_every_option_is_there() -> None:
    text = PAGE.read_text("utf-8")
    writers = ("hfsm_runtime/_recording", "hfsm_runtime/recording_file", "visualhfsm/_monitor")
    sources = "".join(
        path.read_text("utf-8") for folder in writers for path in (REPOSITORY / folder).glob("*.py")
    )
    topics = {topic.split("/")[1] for topic in re.findall(r"`(/[a-z]+[^`]*)`", text)}
    assert [topic for topic in sorted(topics) if f'"/{topic}' not in sources] == []
    for option in ("--from", "--until", "--json", "--record-images", "--record"):
        assert option in text
