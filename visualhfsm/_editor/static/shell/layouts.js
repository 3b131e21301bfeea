/**
 * Layouts that the user chooses: what is shown around the drawing to draw, to watch a run, and to look back at one. Each
 * is again as it was when it was last left.
 *
 * @import {HfsmApp} from "./app.js"
 * @typedef {{side: string, bottom: string, tree: string, robot: boolean}} Arrangement
 */

import {browserStorage} from "../kit/location.js";

const CHOSEN = "visualhfsm.layout";
/** As they are at first. @type {Record<string, Arrangement>} */
const FIRST = {
  layoutDraw: {side: "hfsm-code-panel", bottom: "", tree: "", robot: false},
  layoutRun: {side: "", bottom: "", tree: "", robot: true},
  layoutLookBack: {side: "hfsm-monitor-panel", bottom: "hfsm-monitor-timeline", tree: "without-tree", robot: true},
};

/** Whether the layout is kept when the page is left. */
let isKept = false;

/** The layout that was chosen last; "" for none. */
const chosen = () => browserStorage.getItem(CHOSEN) ?? "";

/** Under which the browser keeps a layout. @param {string} id */
const keyOf = (id) => `visualhfsm.${id}`;

/** Keep how the chosen layout is now. @param {HfsmApp} app */
function keep({side, bottom, tree, showsRobot: robot}) {
  if (chosen()) browserStorage.setItem(keyOf(chosen()), JSON.stringify({side, bottom, tree, robot}));
}

/** @param {HfsmApp} app @param {string} id */
export async function choose(app, id) {
  if (isKept) keep(app);
  else addEventListener("pagehide", () => keep(app)); // the page has just been loaded, or nothing was chosen before
  isKept = true;
  browserStorage.setItem(CHOSEN, id);
  /** @type {Arrangement} */
  const {side, bottom, tree, robot} = {...FIRST[id], ...JSON.parse(browserStorage.getItem(keyOf(id)) ?? "{}")};
  app.tree = tree;
  await Promise.all([app.showSide(side), app.showBottom(bottom, {focuses: false}), app.foldRobot(!robot)]);
}

/** Arrange the page as it was left. @param {HfsmApp} app */
export function restoreLayout(app) {
  if (chosen() in FIRST) choose(app, chosen());
}
