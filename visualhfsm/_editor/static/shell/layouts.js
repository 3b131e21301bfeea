/**
 * Layouts that the user chooses: what is shown around the drawing to draw, to watch a run, and to look back at one. Each
 * is again as it was when it was last left.
 *
 * @import {HfsmApp} from "./app.js"
 * @typedef {{side: string, bottom: string, tree: string, robot: boolean}} Arrangement
 */

import {browserStorage} from "../kit/storage.js";
import {t} from "../kit/texts.js";

const CHOSEN = "visualhfsm.layout";
/** As they are at first. @type {Record<string, Arrangement>} */
const FIRST = {
  layoutDraw: {side: "hfsm-code-panel", bottom: "", tree: "", robot: false},
  layoutRun: {side: "", bottom: "", tree: "", robot: true},
  layoutLookBack: {side: "hfsm-monitor-panel", bottom: "hfsm-monitor-timeline", tree: "without-tree", robot: true},
};

/** The layout that was chosen last; "" for none. */
const chosen = () => browserStorage.getItem(CHOSEN) ?? "";

/** Under which the browser keeps a layout. @param {string} id */
const keyOf = (id) => `visualhfsm.${id}`;

/** Keep how the chosen layout is now. @param {HfsmApp} app */
function keep({side, bottom, tree, showsRobot: robot}) {
  if (chosen()) browserStorage.setItem(keyOf(chosen()), JSON.stringify({side, bottom, tree, robot}));
}

/** @param {HfsmApp} app @param {string} id */
async function choose(app, id) {
  keep(app);
  browserStorage.setItem(CHOSEN, id);
  /** @type {Arrangement} */
  const {side, bottom, tree, robot} = {...FIRST[id], ...JSON.parse(browserStorage.getItem(keyOf(id)) ?? "{}")};
  app.tree = tree;
  await Promise.all([app.showSide(side), app.showBottom(bottom, {focuses: false}), app.foldRobot(!robot)]);
}

/** Arrange the page as it was left. @param {HfsmApp} app */
export function restoreLayout(app) {
  addEventListener("pagehide", () => keep(app));
  if (chosen() in FIRST) choose(app, chosen());
}

/** @param {string} id @param {string} label @param {string} image @param {string} hint */
const action = (id, label, image, hint) => ({
  id,
  label,
  hint,
  icon: image,
  words: t("panels, views, workspace"),
  run: (/** @type {{app: HfsmApp}} */ {app}) => choose(app, id),
  checked: () => chosen() === id,
});

export const layoutActions = [
  action("layoutDraw", t("Draw"), "state", t("the drawing and its code")),
  action("layoutRun", t("Run and watch"), "run", t("the drawing and the robot")),
  action("layoutLookBack", t("Look back"), "timing", t("the drawing, the robot, its values and the timeline")),
];
