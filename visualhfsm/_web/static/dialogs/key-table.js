/** The list of keys in the help. */

import {spoken} from "../keys.js";
import {MONITOR_KEYS} from "../monitor/actions.js";
import {actionOf} from "../registry.js";

/** All keys for the help: groups of [keys, what it does]. */
export function keyTable() {
  /** @param {string} id */
  const row = (id) => {
    const {label, hint, help, keys = []} = actionOf(id);
    return {keys: keys.map((key) => spoken(key)), text: help ?? (hint ? `${label}: ${hint}` : label)};
  };
  const groups = {
    Draw: [
      "select",
      "newState",
      "newTransition",
      "shelf",
      "rename",
      "edit",
      "editCode",
      "openChild",
      "markInitial",
      "toggleFinal",
      "delete",
    ],
    "Move around": [
      "up",
      "moveLeft",
      "moveRight",
      "moveUp",
      "moveDown",
      "goLeft",
      "goRight",
      "goUp",
      "goDown",
      "goNext",
      "goBack",
      "cancel",
    ],
    Edit: [
      "undo",
      "redo",
      "copy",
      "cut",
      "paste",
      "duplicate",
      "group",
      "selectAll",
      "tryEarlier",
      "tryLater",
      "resetHandle",
      "layout",
      "layoutAll",
    ],
    View: [
      "fit",
      "fitSelection",
      "zoomIn",
      "zoomOut",
      "palette",
      "search",
      "problems",
      "output",
      "undoSteps",
      "robot",
      "theme",
      "help",
    ],
    Files: ["new", "open", "save", "saveAs", "closeTab", "export", "compare", "nextTab", "previousTab"],
    "Data and run": [
      "interfaces",
      "timing",
      "variables",
      "functions",
      "component",
      "generate",
      "run",
      "stopRun",
      "tests",
      "trials",
    ],
    "Follow and steer": MONITOR_KEYS,
  };
  return Object.entries(groups).map(([title, ids]) => ({title, rows: ids.map(row)}));
}
