/**
 * The panels of the page, and other elements that are loaded when they are first shown.
 *
 * Views of plug-ins are panels beside or below the drawing, with actions: their module `view.js` is loaded with the page.
 *
 * @import {PageElement} from "../data/element.js"
 * @import {Action} from "../kit/registry.js"
 */

import {html, nothing} from "lit";
import {iconButton} from "../kit/icons.js";
import {messageOf, notifyError} from "../kit/notices.js";
import {addActions} from "../kit/registry.js";
import {t} from "../kit/texts.js";
import {laterStyles} from "../kit/theme.js";
import {viewing} from "../kit/viewers.js";
import {page} from "../data/page.js";

/**
 * An element that is loaded when it is first shown: a panel, or a part of the monitor.
 *
 * @typedef {PageElement & {focusFirst?: () => void, revealed?: Promise<unknown>}} Panel
 */

/** Elements that are loaded when they are first shown, and their modules. @type {Record<string, string>} */
const LAZY = {
  "hfsm-code-panel": "../panels/code.js",
  "hfsm-data-panel": "../panels/data.js",
  "hfsm-problems": "../panels/problems.js",
  "hfsm-search": "../panels/search.js",
  "hfsm-output": "../panels/output.js",
  "hfsm-undo-steps": "../panels/undo-steps.js",
  "hfsm-tests-panel": "../panels/tests.js",
  "hfsm-monitor-toolbar": "../run/toolbar.js",
  "hfsm-monitor-panel": "../run/panel.js",
  "hfsm-monitor-timeline": "../run/timeline.js",
  "hfsm-robot-dock": "../robot3d/dock.js",
  "hfsm-shelf": "../shelf/shelf.js",
  "hfsm-start": "./start-page.js",
};
/** What viewers see of these. */
export const FOR_VIEWERS = new Set(["hfsm-problems", "hfsm-search", "hfsm-output", "hfsm-monitor-timeline"]);
const SIDE = [
  ["hfsm-code-panel", t("Code")],
  ["hfsm-data-panel", t("Data")],
  ["hfsm-monitor-panel", t("Live")],
];
const BOTTOM = [
  ["hfsm-problems", t("Problems")],
  ["hfsm-search", t("Search")],
  ["hfsm-output", t("Output")],
  ["hfsm-tests-panel", t("Tests")],
  ["hfsm-undo-steps", t("Undo steps")],
  ["hfsm-monitor-timeline", t("Timeline")],
];

/**
 * @typedef {{name: string, tag: string, title: string, module: string, actions: Action[], before?: string}} View `name`
 *   is that of its entry point, `tag` that of the element of its panel, which `module` defines. It stands below the
 *   drawing if it is `before` another panel there, and is shown when somebody asks for it
 */

/** The views by the tags of their panels. @type {Map<string, View>} */
export const views = new Map();

/** Add a view. @param {View} view */
export function addView(view) {
  views.set(view.tag, view);
  addActions(view.actions);
}

/** Whether a view has something to show of the document. @param {{name: string}} view */
export const isOffered = ({name}) => !viewing.on && !!page.tabState?.views.includes(name);

/** The panels beside the drawing. @returns {string[][]} */
export const sidePanels = () => [...SIDE, ...offeredBefore(undefined)];

/** The panels below the drawing. @returns {string[][]} */
export const bottomPanels = () =>
  BOTTOM.flatMap((panel) => [...offeredBefore(panel[0]), panel]).filter(([tag]) => !viewing.on || FOR_VIEWERS.has(tag));

/** @param {string | undefined} tag @returns {string[][]} */
const offeredBefore = (tag) =>
  [...views.values()].filter((view) => view.before === tag && isOffered(view)).map((view) => [view.tag, view.title]);

export class Panels {
  /** Those that are loaded. @type {Map<string, Panel>} */
  #elements = new Map();
  #drawAgain;

  /** @param {() => void} drawAgain */
  constructor(drawAgain) {
    this.#drawAgain = drawAgain;
  }

  /** A panel, if it is loaded. @param {string} tag */
  get(tag) {
    return this.#elements.get(tag);
  }

  /** An element that is loaded as soon as it is to be shown. @param {string} tag */
  lazily(tag) {
    const element = this.#elements.get(tag);
    if (!element) this.load(tag).then((loaded) => loaded && this.#drawAgain());
    return element ?? nothing;
  }

  /**
   * Load the module of an element once; reports when that is not possible.
   *
   * @param {string} tag
   * @returns {Promise<Panel | undefined>}
   */
  async load(tag) {
    const file = LAZY[tag] ?? views.get(tag)?.module;
    try {
      await Promise.all([import(file), laterStyles()]);
    } catch (error) {
      notifyError(new Error(t("{file} could not be loaded: {reason}", {file, reason: messageOf(error)})));
      return undefined;
    }
    if (!this.#elements.has(tag)) {
      const element = /** @type {Panel} */ (document.createElement(tag));
      this.#elements.set(tag, element);
    }
    return this.#elements.get(tag);
  }
}

/**
 * The tabs of panels, with a button that closes the shown one.
 *
 * @param {string[][]} list @param {string} shown @param {(tag: string) => void} show @param {() => void} left
 */
export function panelTabs(list, shown, show, left) {
  return html`<h2 class="for-readers">${list.find(([tag]) => tag === shown)?.[1]}</h2>
    <div class="panel-tabs">
      <div role="tablist" aria-label=${t("Panels")}>
        ${list.map(
          ([tag, name]) =>
            html` <button type="button" role="tab" aria-selected=${tag === shown} @click=${() => show(tag)}>
              ${name}
            </button>`,
        )}
      </div>
      ${iconButton("close", t("Close the panel"), () => {
        show("");
        left();
      })}
    </div>`;
}
