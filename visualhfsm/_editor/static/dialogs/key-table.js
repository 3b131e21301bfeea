/** The list of keys in the help. */

import {spoken} from "../kit/keys.js";
import {MONITOR_KEYS} from "../run/actions.js";
import {actionOf, withAdded} from "../kit/registry.js";
import {t} from "../kit/texts.js";

/** All keys for the help: groups of [keys, what it does]. */
export function keyTable() {
  /** @param {string} id */
  const row = (id) => {
    const {label, hint, help, keys = []} = actionOf(id);
    return {keys: keys.map((key) => spoken(key)), text: help ?? (hint ? `${label}: ${hint}` : label)};
  };
  const groups = {
    [t("Draw")]: "select newState newTransition shelf rename edit editCode openChild markInitial toggleFinal delete",
    [t("Move around")]: "up moveLeft moveRight moveUp moveDown goLeft goRight goUp goDown goNext goBack cancel",
    [t("Edit")]: "undo redo copy cut paste duplicate group selectAll tryEarlier tryLater resetHandle layout layoutAll",
    [t("View")]:
      "fit fitSelection zoomIn zoomOut palette menu search definition fromDefinition problems output undoSteps robot theme help",
    [t("Files")]: "new open save saveAs closeTab export compare nextTab previousTab",
    [t("Data and run")]: "interfaces timing variables functions component generate run stop tests",
    [t("Watch and control")]: MONITOR_KEYS.join(" "),
  };
  return Object.entries(groups).map(([title, ids]) => ({title, rows: withAdded(ids.split(" ")).map(row)}));
}
