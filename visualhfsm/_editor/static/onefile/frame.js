/**
 * What the pages that are one file have in common.
 *
 * @import {Automaton, Fields, Push} from "../data/protocol.js"
 */

import {iconButton} from "../kit/icons.js";
import {messageOf} from "../kit/notices.js";
import {t} from "../kit/texts.js";
import {currentTheme, initTheme, switchTheme} from "../kit/theme.js";

/** The number of the only document. */
export const TAB = 1;

/** Show the page, or why that is not possible. @param {() => Promise<void>} show */
export function begin(show) {
  initTheme();
  show().catch((error) => {
    const reason = messageOf(error);
    document.body.textContent = t("This page cannot be shown: {reason}. It needs a browser of 2023 or later.", {
      reason,
    });
  });
}

/** A button for light or dark. @param {() => void} [redraw] what does not follow by itself */
export const themeButton = (redraw = () => {}) =>
  iconButton(currentTheme() === "dark" ? "sun" : "moon", t("Light or dark"), () => {
    switchTheme();
    redraw();
  });

/**
 * The messages that the server would push about a document.
 *
 * @param {string} name @param {string} title @param {(Fields & {automata: Automaton[]}) | null} full
 * @returns {Push[]}
 */
export function pushes(name, title, full) {
  const tab = {tab: TAB, title, component: name, path: "", recording: name, views: []};
  /** @type {Push} */
  const workspace = {
    push: "workspace",
    tabs: [{...tab, dirty: false, outside: "", changed: false}],
    recoverable: [],
    present: [],
  };
  if (!full) return [workspace];
  return [workspace, {push: "document", tab: TAB, revision: 0, undo: [], redo: [], dirty: false, full}];
}
