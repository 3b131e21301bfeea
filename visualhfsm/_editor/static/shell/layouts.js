/**
 * What is shown around the drawing: as it was before the page was loaded again, and in layouts that the user chooses, to
 * draw, to watch a run, and to look back at one. Each is again as it was when it was last left.
 *
 * @import {HfsmApp} from "./app.js"
 * @import {Chosen} from "../data/page.js"
 * @typedef {{side: string, bottom: string, tree: string, robot: boolean}} Arrangement
 */

import {putTypedBack} from "../code/typed-offline.js";
import {page} from "../data/page.js";
import {leaveUnsent} from "../data/unsent.js";
import {store} from "../data/store.js";
import {browserStorage, windowStorage} from "../kit/location.js";

const CHOSEN = "visualhfsm.layout";
/** As they are at first. @type {Record<string, Arrangement>} */
const FIRST = {
  layoutDraw: {side: "hfsm-code-panel", bottom: "", tree: "", robot: false},
  layoutRun: {side: "", bottom: "", tree: "", robot: true},
  layoutLookBack: {side: "hfsm-monitor-panel", bottom: "hfsm-monitor-timeline", tree: "without-tree", robot: true},
};

/** What a window showed when it was left. */
const LEFT = "visualhfsm.left";

/** The layout that was chosen last; "" for none. */
const chosen = () => browserStorage.getItem(CHOSEN) ?? "";

/** Under which the browser keeps a layout. @param {string} id */
const keyOf = (id) => `visualhfsm.${id}`;

/** @param {HfsmApp} app @returns {Arrangement} */
const arrangementOf = ({side, bottom, tree, showsRobot: robot}) => ({side, bottom, tree, robot});

/** Keep how the chosen layout is now. @param {HfsmApp} app */
function keep(app) {
  if (chosen()) browserStorage.setItem(keyOf(chosen()), JSON.stringify(arrangementOf(app)));
}

/** @param {HfsmApp} app @param {string} id */
export async function choose(app, id) {
  keep(app);
  browserStorage.setItem(CHOSEN, id);
  await arrange(app, layoutOf(id));
}

/** A layout as it was when it was last left. @param {string} id @returns {Arrangement} */
const layoutOf = (id) => ({...FIRST[id], ...JSON.parse(browserStorage.getItem(keyOf(id)) ?? "{}")});

/** @param {HfsmApp} app @param {Arrangement} arrangement */
async function arrange(app, {side, bottom, tree, robot}) {
  app.tree = tree;
  await Promise.all([app.showSide(side), app.showBottom(bottom, {focuses: false}), app.foldRobot(!robot)]);
}

/** The panel with the values of a run. @param {HfsmApp} app */
const livePanel = (app) =>
  /** @type {import("../run/panel.js").MonitorPanel | undefined} */ (app.panels.get("hfsm-monitor-panel"));

/** Arrange the page as this window was left, else as the chosen layout; put back what was typed. @param {HfsmApp} app */
export function restore(app) {
  addEventListener("pagehide", () => {
    keep(app);
    const {automaton, states, transitions} = page;
    const spot = {
      title: page.tabState?.title,
      automaton: automaton?.id,
      states: [...states],
      transitions: [...transitions],
    };
    windowStorage.setItem(LEFT, JSON.stringify({...arrangementOf(app), spot, live: livePanel(app)?.chosen}));
  });
  const left = windowStorage.getItem(LEFT);
  if (left) returnTo(app, JSON.parse(left));
  else if (chosen() in FIRST) arrange(app, layoutOf(chosen()));
  putTypedBack((text) => {
    leaveUnsent(text);
    app.requestUpdate();
  });
}

/** @param {HfsmApp} app @param {Arrangement & {spot: {title?: string, automaton?: number} & Chosen, live?: string}} left */
async function returnTo(app, {spot, live, ...arrangement}) {
  const isThere = () => page.document && page.tabState?.title === spot.title;
  const select = () => {
    if (!page.document) return;
    store.removeEventListener("document", select);
    if (spot.automaton && isThere()) page.open(spot.automaton, spot);
  };
  store.addEventListener("document", select);
  select();
  await arrange(app, arrangement);
  if (live) await livePanel(app)?.choose(live);
}
