/**
 * Draw the state of the followed component on the canvas.
 *
 * @import {Live} from "../canvas/live-marks.js"
 * @import {Breakpoint, LiveSnapshot} from "../data/protocol.js"
 */

import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {monitor, ON_TIME} from "./monitor.js";

const FLASH = 1.2; // s
/** How strongly the transition into the current state stays marked. */
const AFTERGLOW = 0.3;

/**
 * The state of an automaton, by the keys of its states and transitions.
 *
 * @param {number} id
 * @param {LiveSnapshot} snapshot
 * @returns {Map<string, Live>}
 */
function liveOf(id, {component}) {
  /** @type {Map<string, Live>} */
  const live = new Map();
  /** @param {string} key @param {Live} what */
  const put = (key, what) => live.set(key, {...live.get(key), ...what});
  const now = monitor.now(id);
  if (now) {
    const {state, ghost, finished, timers, guards, hangsFor} = now;
    const newest = monitor.past.latest(id, component.time);
    if (newest && newest.origin !== state) put(`s${newest.origin}`, {trail: true});
    const hanging = hangsFor > 0;
    const late = !ghost && !hanging && !finished && monitor.isLate(id);
    const note = finished
      ? t("finished")
      : hanging
        ? t("its code does not end")
        : late
          ? t("its cycles take too long")
          : "";
    put(`s${state}`, {status: ghost ? "ghost" : "active", finished, hanging, late, note});
    if (newest?.transition) {
      const age = component.time - newest.time;
      put(`t${newest.transition}`, {fired: age < FLASH && !ghost ? Math.max(AFTERGLOW, 1 - age / FLASH) : AFTERGLOW});
    }
    for (const {transition, remaining} of timers) {
      const {kind, seconds = 0} = monitor.transition(id, transition) ?? {};
      const part = kind === ON_TIME && seconds > 0 ? remaining / seconds : 0;
      put(`t${transition}`, {timer: Math.min(1, Math.max(0.001, part)), remaining});
    }
    for (const {transition, value} of guards) put(`t${transition}`, {guard: value});
  }
  for (const {key, conditional, state, transition} of breakpointsIn(id, monitor.breakpoints.of(monitor.tab))) {
    const hit = component.stoppedAt.some(
      (each) => each.automaton === id && each.state === state && each.transition === transition,
    );
    put(key, {breakpoint: hit ? "hit" : conditional ? "conditional" : "set"});
  }
  return live;
}

/**
 * The marks of an automaton whose component is not followed: its breakpoints.
 *
 * @param {number} id
 * @param {Breakpoint[]} breakpoints
 * @returns {Map<string, Live>}
 */
const plannedOf = (id, breakpoints) =>
  new Map(
    breakpointsIn(id, breakpoints).map(({key, conditional}) => [
      key,
      {breakpoint: conditional ? "conditional" : "set"},
    ]),
  );

/** The breakpoints of an automaton. @param {number} id @param {Breakpoint[]} breakpoints */
const breakpointsIn = (id, breakpoints) =>
  breakpoints
    .filter(({automaton}) => automaton === id)
    .map(({state, transition, condition}) => ({
      key: state ? `s${state}` : `t${transition}`,
      conditional: Boolean(condition),
      state,
      transition,
    }));

/**
 * Follows the page and the monitor as long as the page is open.
 *
 * @param {import("../canvas/canvas.js").HfsmCanvas} canvas
 */
export function showOn(canvas) {
  let shown = false;
  let marked = "";
  const draw = () => {
    if (page.highlight) return;
    const here = page.tab && page.tab === monitor.tab && !monitor.isOver ? monitor.snapshot : undefined;
    canvas.classList.toggle("live", Boolean(here));
    canvas.classList.toggle("stale", Boolean(here && monitor.isLost));
    document.documentElement.classList.toggle("live-lost", monitor.isLost);
    canvas.classList.toggle("past", Boolean(here && monitor.looking));
    const running = here?.component.automata ?? [];
    const signature = running.map(({id, state, ghost}) => `${id}.${state}${ghost ? "g" : ""}`).join();
    if (signature !== marked) {
      marked = signature;
      /** @type {import("../shell/tree.js").Tree | null} */
      const tree = document.querySelector("hfsm-tree");
      tree?.showLive(new Map(running.map(({id, state, ghost}) => [`${id}.${state}`, ghost ? "ghost" : "active"])));
    }
    const planned = here || !page.automaton ? [] : monitor.breakpoints.of(page.tab);
    if (!here && !shown && !planned.length) return;
    shown = Boolean(here || planned.length);
    if (here && monitor.follows && !here.component.stoppedAt.length) followDeepest(here);
    canvas.showLive(
      !page.automaton ? undefined : here ? liveOf(page.automaton.id, here) : plannedOf(page.automaton.id, planned),
    );
  };
  for (const kind of /** @type {const} */ (["shown", "mode", "structure"])) monitor.addEventListener(kind, draw);
  for (const kind of /** @type {const} */ (["tab", "automaton", "highlight"])) page.addEventListener(kind, draw);
  store.addEventListener("document", draw);
  draw();
}

/** Show the deepest active automaton; of several, the first in the document. @param {LiveSnapshot} now */
function followDeepest({component}) {
  const {automata} = page.shownDocument;
  const active = new Map(component.automata.filter((each) => !each.ghost).map((each) => [each.id, each]));
  let each = [...automata.values()].find(({father}) => father === 0);
  for (;;) {
    const {state} = active.get(each?.id ?? 0) ?? {};
    const below = each?.states
      .find(({id}) => id === state)
      ?.children.find((id) => active.has(id) && automata.get(id)?.states.length);
    if (below === undefined) break;
    each = automata.get(below);
  }
  if (each && each.id !== page.automaton?.id) page.open(each.id);
}
