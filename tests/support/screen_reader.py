"""What a screen reader says of the editor's page: what has the focus, by role and name, and what is spoken."""

from __future__ import annotations

import re
from typing import Any, Final, Self

from playwright.sync_api import CDPSession, Page

from tests.support.limits import PAGE_LIMIT
from tests.support.waiting import until

# Screen readers speak a polite region only if it was there before its text; an alert also when it appears. A status
# and an alert are read as a whole, of other regions what was added.
LISTEN: Final = """() => {
  window.spoken = [];
  const LIVE = "[aria-live], [role=status], [role=alert], [role=log]";
  const WHOLE = "[role=status]:not([aria-atomic=false]), [role=alert], [aria-atomic=true]";
  const known = new WeakSet(document.querySelectorAll(LIVE));
  const isUrgent = (region) => region.matches("[role=alert], [aria-live=assertive]");
  const say = (region, text) => {
    const words = text.replace(/\\s+/g, " ").trim();
    if (words && region.ariaLive !== "off" && region.checkVisibility({visibilityProperty: true}) &&
        !region.closest("[aria-hidden=true]"))
      window.spoken.push([isUrgent(region) ? "assertive" : "polite", words]);
  };
  new MutationObserver((records) => {
    const whole = new Set();
    const fresh = [];
    for (const {target, addedNodes, type} of records) {
      const element = target instanceof Element ? target : target.parentElement;
      const region = element?.isConnected && element.closest(LIVE);
      if (region && known.has(region)) {
        if (region.matches(WHOLE)) whole.add(region);
        else if (type === "characterData") say(region, target.data);
        else for (const node of addedNodes) if (!node.matches?.("[role=alert]")) say(region, node.textContent);
      }
      for (const node of addedNodes)
        if (node instanceof Element)
          fresh.push(...[node, ...node.querySelectorAll("*")].filter((each) => each.matches(LIVE)));
    }
    for (const region of whole) say(region, region.textContent);
    for (const region of fresh) {
      if (known.has(region)) continue;
      known.add(region);
      if (isUrgent(region)) say(region, region.textContent);
    }
  }).observe(document, {subtree: true, childList: true, characterData: true});
}"""
FOCUSED: Final = """(() => {
  let element = document.activeElement;
  while (element.shadowRoot?.activeElement) element = element.shadowRoot.activeElement;
  return element;
})()"""
MOST_TABS: Final = 80


class Reader:
    """A user who presses keys and hears, and neither sees the page nor has a mouse."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self._devtools: CDPSession = page.context.new_cdp_session(page)
        self._heard = 0
        page.evaluate(LISTEN)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._devtools.detach()

    def press(self, *keys: str) -> None:
        """Press keys in order."""
        for key in keys:
            self.page.keyboard.press(key)

    def type(self, text: str) -> None:
        """Type a text."""
        self.page.keyboard.type(text)

    def focused(self) -> str:
        """Return role, name and states of what has the focus, as the browser gives them to assistive technology."""
        node = self._focused_node()
        found = [node["role"]["value"], node.get("name", {}).get("value", "")]
        properties = {each["name"]: each["value"].get("value") for each in node.get("properties", [])}
        found += [
            f"{name} {properties[name]}" for name in ("pressed", "expanded", "checked") if name in properties
        ]
        return " ".join(each for each in found if each)

    def expect_focus(self, words: str) -> None:
        """Wait until what has the focus is described by a regular expression from its beginning."""
        try:
            until(lambda: re.match(words, self.focused()), PAGE_LIMIT)
        except AssertionError:
            raise AssertionError(f"the focus is at {self.focused()!r}, not at {words!r}") from None

    def tab_to(self, words: str, key: str = "Tab") -> None:
        """Press Tab until what has the focus is described by a regular expression."""
        passed = []
        for _ in range(MOST_TABS):
            if re.match(words, self.focused()):
                return
            passed.append(self.focused())
            self.press(key)
        raise AssertionError(f"Tab does not lead to {words!r}, only to {passed}")

    def expect_spoken(self, words: str, kind: str = "polite") -> None:
        """Wait until something is spoken that contains a regular expression; forget what was spoken before it."""

        def is_spoken() -> bool:
            for index, (how, text) in enumerate(self.spoken(), start=1):
                if how == kind and re.search(words, text):
                    self._heard += index
                    return True
            return False

        try:
            until(is_spoken, PAGE_LIMIT)
        except AssertionError:
            raise AssertionError(f"{words!r} is not among what was spoken: {self.spoken()}") from None

    def spoken(self) -> list[tuple[str, str]]:
        """Return what was spoken since the last expected words, each with its urgency."""
        found: list[list[str]] = self.page.evaluate("from => window.spoken.slice(from)", self._heard)
        return [(how, text) for how, text in found]

    def _focused_node(self) -> dict[str, Any]:
        answer = self._devtools.send("Runtime.evaluate", {"expression": FOCUSED})
        found: dict[str, Any] = self._devtools.send(
            "Accessibility.getPartialAXTree",
            {"objectId": answer["result"]["objectId"], "fetchRelatives": False},
        )
        node: dict[str, Any] = found["nodes"][0]
        return node
