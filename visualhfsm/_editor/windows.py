"""The open windows, and the components that each of them follows."""

from __future__ import annotations

from visualhfsm._monitor.messages import Push

from .tab import Tab
from .window import Window


class Windows:
    """The windows that get what changes. Used on the event loop only."""

    def __init__(self) -> None:
        self._windows: set[Window] = set()
        self._followers: dict[str, set[Window]] = {}

    def add(self, window: Window) -> None:
        """Send a window every change from now on."""
        self._windows.add(window)

    def remove(self, window: Window) -> None:
        """Forget a window; it still follows what it has not lost."""
        self._windows.discard(window)

    def others(self, window: Window) -> frozenset[int]:
        """Return the numbers of the other windows."""
        return frozenset(each.number for each in self._windows if each is not window)

    def push(self, push: Push) -> None:
        """Send a message to all windows."""
        for window in self._windows:
            window.push(push)

    def push_to_followers(self, component: str, push: Push) -> None:
        """Send a message to the windows that follow a component."""
        for window in self._followers.get(component, ()):
            window.push(push)

    def show(self, tab: Tab) -> None:
        """Send all windows what is new in the document of a tab."""
        for window in self._windows:
            window.show(tab)

    def close(self, tab: int) -> None:
        """Announce to all windows that a tab is closed."""
        for window in self._windows:
            window.close(tab)

    def followed_by(self, window: Window) -> list[str]:
        """Return the components that a window follows."""
        return [component for component, followers in self._followers.items() if window in followers]

    def follows(self, component: str) -> bool:
        """Return whether any window follows a component."""
        return component in self._followers

    def follow(self, window: Window, component: str) -> None:
        """Send a window what a component does from now on."""
        self._followers.setdefault(component, set()).add(window)

    def unfollow(self, window: Window, component: str) -> bool:
        """Remove a window from the followers of a component; return whether it was the last one."""
        followers = self._followers.get(component, set())
        if window not in followers:
            return False
        followers.remove(window)
        if not followers:
            del self._followers[component]
        return not followers
