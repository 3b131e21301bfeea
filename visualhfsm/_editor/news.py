"""What the parts report, passed on to tabs and windows."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable

from visualhfsm._monitor import messages
from visualhfsm._processes.test_results import TestsPush

from .tab import Tab
from .tabs import Tabs
from .views import ViewPush
from .windows import Windows

_logger = logging.getLogger(__name__)


class News:
    """Takes reports in any thread, and passes them on on the event loop where it was made.

    `publish_state` sends all windows what the workspace says of its tabs and of what is `present`.
    """

    def __init__(self, tabs: Tabs, windows: Windows, publish_state: Callable[[], None]) -> None:
        self._tabs = tabs
        self._windows = windows
        self.publish_state = publish_state
        self.present = messages.Present([])
        """The components of the realm, as they were reported last."""
        self.robot = messages.Robot()
        """The robot, in the same way."""
        self._loop = asyncio.get_running_loop()

    def publish(self, news: messages.Present | messages.Failed | messages.Push) -> None:
        """Take a message of a part of the server."""
        with contextlib.suppress(RuntimeError):  # the loop is closed: there is no listener
            self._loop.call_soon_threadsafe(self._publish, news)

    def _show_problems(self, tab: Tab) -> None:
        if (problems := tab.problems) is not None:
            self._windows.push(problems)

    def _publish(self, news: messages.Present | messages.Failed | messages.Push) -> None:
        match news:
            case messages.Present():
                self.present = news
                self.publish_state()
            case messages.Robot():
                self.robot = news
                self._windows.push(news)
            case (
                messages.Snapshot(component=component)
                | messages.Structure(component=component)
                | messages.Stale(component=component)
            ):
                self._windows.push_to_followers(component, news)
            case messages.Output(tab=number, lines=lines, dropped=dropped) if number in self._tabs:
                self._tabs.get(number).output.add(lines, dropped)
                self._windows.push(news)
            case ViewPush(tab=number, name=view) if number in self._tabs:
                tab = self._tabs.get(number)
                self._windows.push(tab.of_views[view].take(news, tab.shown.document))
            case TestsPush(tab=number) if number in self._tabs:
                tab = self._tabs.get(number)
                self._windows.push(tab.tests.take(news, tab.shown.document, tab.content))
            case messages.Failed(tab=number) if number in self._tabs:
                tab = self._tabs.get(number)
                tab.failures.append(news)
                self._show_problems(tab)
            case messages.StartedPush(tab=number) if number in self._tabs:
                tab = self._tabs.get(number)
                if news.status == "generating":
                    tab.output.clear()
                    tab.failures.clear()
                    self._show_problems(tab)
                tab.started = news
                self.publish_state()  # first: a window gets a tab's name before what is started
                self._windows.push(news)
            case _:
                _logger.debug("no window is left for %s", type(news).__name__)
