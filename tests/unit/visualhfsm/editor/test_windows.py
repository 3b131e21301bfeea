"""Windows, and the components that they follow."""

from __future__ import annotations

import asyncio
from functools import partial

from tests.support.sent import sent
from visualhfsm._editor.window import Window
from visualhfsm._editor.windows import Windows
from visualhfsm._monitor.messages import RecentLines, Robot, Stale


def pushed(window: Window) -> list[str]:
    """Return the kinds of the messages that wait for a window."""
    return [message["push"] for message in asyncio.run(sent(window))]


def opened(windows: Windows) -> Window:
    window = Window(partial(RecentLines, 5, 100))
    window.greet()
    windows.add(window)
    return window


def test_only_followers_get_what_a_component_does() -> None:
    windows = Windows()
    follower, other = opened(windows), opened(windows)
    windows.follow(follower, "dance")
    windows.push_to_followers("dance", Stale(component="dance", since=1.0))
    windows.push_to_followers("walk", Stale(component="walk", since=1.0))
    windows.push(Robot())
    assert (pushed(follower), pushed(other)) == (["stale", "robot"], ["robot"])


def test_the_last_follower_that_leaves_is_known() -> None:
    windows = Windows()
    first, second = opened(windows), opened(windows)
    for window in (first, second):
        windows.follow(window, "dance")
    windows.follow(first, "walk")
    assert windows.followed_by(first) == ["dance", "walk"]
    assert not windows.unfollow(first, "dance")
    assert windows.unfollow(second, "dance")
    assert not windows.unfollow(second, "dance")
    assert windows.followed_by(first) == ["walk"]


def test_a_window_that_was_removed_gets_nothing() -> None:
    windows = Windows()
    window = opened(windows)
    windows.remove(window)
    windows.push(Robot())
    assert pushed(window) == []
