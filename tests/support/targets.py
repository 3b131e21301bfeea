"""The size of what can be pressed in a page: criterion 2.5.8 of WCAG 2.2, with its exception of spacing alone."""

from __future__ import annotations

from typing import Final

from playwright.sync_api import Page

# What is pressed is known by its role, or by its cursor. On the canvas, the handle of an arc is its target. A target
# of less than 24 pixels has a circle of that diameter, which no other target and no other circle may touch.
SMALL: Final = """(drawn) => {
  const LEAST = 24 - 0.1;
  const ROLES = ["button", "checkbox", "combobox", "gridcell", "link", "menuitem", "menuitemcheckbox", "menuitemradio",
    "option", "radio", "slider", "spinbutton", "switch", "tab", "treeitem"].map((role) => `[role=${role}]`);
  const PRESSED = ["a[href]", "button", "input", "select", "summary", "textarea", ...ROLES].join();
  const DRAWN = ".state .body, .transition .grip";
  const roots = [document];
  for (const root of roots)
    for (const each of root.querySelectorAll("*")) if (each.shadowRoot) roots.push(each.shadowRoot);
  const isShown = (each) => each.checkVisibility({visibilityProperty: true, opacityProperty: true});
  const isPressed = (each) => {
    if (each.closest("svg .state, svg .transition, .names")) return drawn && each.matches(DRAWN);
    if (each.matches("[disabled], [aria-disabled=true]")) return false;
    if (each.matches("[aria-expanded] > .twist")) return true;
    return each.matches(PRESSED) ||
      (getComputedStyle(each).cursor === "pointer" && getComputedStyle(each.parentElement).cursor !== "pointer");
  };
  const boxOf = (each) => {
    const label = each.matches("[type=checkbox], [type=radio]") && each.closest("label");
    return (label || each).getBoundingClientRect();
  };
  const targets = roots.flatMap((root) => [...root.querySelectorAll("*")])
    .filter((each) => each.parentElement && isShown(each) && isPressed(each))
    .map((each) => ({each, box: boxOf(each)}))
    .filter(({box: {width, height, right, bottom, left, top}}) =>
      width > 1 && height > 1 && right > 0 && bottom > 0 && left < innerWidth && top < innerHeight);
  const isSmall = ({width, height}) => width < LEAST || height < LEAST;
  const middle = ({left, top, width, height}) => [left + width / 2, top + height / 2];
  const near = (one, other) => {
    const [x, y] = middle(one);
    const touches = Math.hypot(Math.max(other.left - x, 0, x - other.right), Math.max(other.top - y, 0, y - other.bottom));
    const [u, v] = middle(other);
    return touches < 12 - 0.1 || (isSmall(other) && Math.hypot(x - u, y - v) < LEAST);
  };
  const isLabel = (one, other) => [one, other].some((each) => each.matches("label") && each.contains(one) && each.contains(other));
  return targets.filter(({each, box}) => isSmall(box) &&
      targets.some((other) => other.each !== each && !isLabel(each, other.each) && near(box, other.box)))
    .map(({each, box: {width, height}}) => `${each.outerHTML.slice(0, 120)} ${width.toFixed(1)} x ${height.toFixed(1)}`);
}"""


def small_targets(page: Page, *, drawn: bool = True) -> list[str]:
    """Return what is too small to be pressed, with its size in pixels; also on the canvas, which zooms, if `drawn`."""
    found: list[str] = page.evaluate(SMALL, drawn)
    return found
