/** Marks on states and transitions for the state of a running component. */

import {RADIUS} from "../measures/geometry.js";
import {n, t} from "../kit/texts.js";
import {make, set} from "./svg.js";

/**
 * @typedef {{status?: "active" | "ghost", trail?: boolean, timer?: number, remaining?: number, fired?: number, guard?:
 *   boolean, finished?: boolean, hanging?: boolean, late?: boolean,
 *   breakpoint?: "set" | "conditional" | "hit", note?: string, passed?: number, failed?: boolean,
 *   ended?: number, most?: boolean}} Live
 *   of a state `status`, `finished`, `hanging` (its code does not end), `late` (its cycles take longer than the period)
 *   and `trail` (it was left last); of a transition `timer` (the part that remains), `remaining` (s), `guard` (its
 *   last value) and `fired` (0..1, 1 just now); of both how often tests `passed` them, and whether one `failed` there;
 *   of a state how many failed trials `ended` there, and whether that is the `most`
 */

/** @type {Record<string, string>} */
const STATUS = {active: t("active"), ghost: t("ghost")};
const DIAGONAL = RADIUS * Math.SQRT1_2;
const FINISHED = `M-8 ${14 - RADIUS}l5 5L7 ${9 - RADIUS}`;
/** @type {Record<string, string>} */
const BREAKPOINTS = {
  set: t("breakpoint"),
  conditional: t("breakpoint with a condition"),
  hit: t("paused at this breakpoint"),
};

/** Which classes a state has for what it does. @param {Live} live @returns {Record<string, boolean>} */
export const stateClasses = ({status, trail = false, finished = false, hanging = false, late = false, ...tested}) => ({
  active: status === "active",
  ghost: status === "ghost",
  finished,
  hanging,
  late,
  trail,
  tested: Boolean(tested.passed),
  "test-failed": Boolean(tested.failed || tested.ended),
  "most-failed": Boolean(tested.most),
});

/** Which classes a transition has for what it does. @param {Live} live @returns {Record<string, boolean>} */
export const transitionClasses = ({timer = 0, fired = 0, guard, passed}) => ({
  waiting: timer > 0,
  fired: fired > 0,
  "guard-true": guard === true,
  "guard-false": guard === false,
  tested: Boolean(passed),
});

/** @param {SVGElement} group @param {Record<string, boolean>} classes */
function toggle({classList}, classes) {
  for (const [name, wanted] of Object.entries(classes)) classList.toggle(name, wanted);
}

/** @param {import("./state-view.js").StateView} view @param {Live} [live] */
export function markState(view, live = {}) {
  const {status, finished = false, breakpoint, note, passed, failed, ended, most} = live;
  const {group} = view;
  toggle(group, stateClasses(live));
  if (status === "active") group.setAttribute("aria-current", "true");
  else group.removeAttribute("aria-current");
  markWith(group, "finished-sign", finished, () => make("path", {class: "finished-sign", d: FINISHED}));
  markBreakpoint(group, breakpoint, -DIAGONAL, -DIAGONAL, 7);
  say(group, [
    view.words,
    status && STATUS[status],
    note,
    ...tested(passed, failed),
    ended && n("{count} failed trial ended here", "{count} failed trials ended here", ended),
    most && t("nowhere more"),
    breakpoint && BREAKPOINTS[breakpoint],
  ]);
}

/** @param {import("./transition-view.js").TransitionView} view @param {Live} [live] */
export function markTransition(view, live = {}) {
  const {timer = 0, remaining, fired = 0, guard, breakpoint, passed, failed} = live;
  const {group, parts} = view;
  toggle(group, transitionClasses(live));
  set(parts.timer, "stroke-dasharray", timer > 0 ? `${timer.toFixed(3)} 1` : undefined);
  set(parts.glow, "opacity", fired ? fired.toFixed(2) : undefined);
  markBreakpoint(parts.handle, breakpoint, -9, -9, 5.5);
  say(group, [
    view.words,
    timer > 0 && remaining !== undefined && t("in {seconds} s", {seconds: Math.ceil(remaining)}),
    fired > 0 && t("fired last"),
    ...tested(passed, failed),
    guard !== undefined && (guard ? t("condition true") : t("condition false")),
    breakpoint && BREAKPOINTS[breakpoint],
  ]);
}

/** What tests did there, in words. @param {number} [passed] @param {boolean} [failed] */
const tested = (passed, failed) => [
  passed && n("passed once by tests", "passed {count} times by tests", passed),
  failed && t("a test failed here"),
];

/** @param {SVGElement} group @param {Live["breakpoint"]} kind @param {number} x @param {number} y @param {number} r */
function markBreakpoint(group, kind, x, y, r) {
  const sign = markWith(group, "breakpoint-sign", Boolean(kind), () =>
    make(
      "g",
      {class: "breakpoint-sign", transform: `translate(${x},${y})`},
      make("circle", {class: "halo", r: r + 5}),
      make("circle", {class: "dot", r}),
      make("path", {class: "if", d: `M${-r / 2} -1.500H${r / 2}M${-r / 2} 1.500H${r / 2}`}),
    ),
  );
  sign?.classList.toggle("conditional", kind === "conditional");
  sign?.classList.toggle("hit", kind === "hit");
}

/**
 * Add a child with a class to a group, or remove it.
 *
 * @param {SVGElement} group @param {string} name @param {boolean} wanted @param {() => SVGElement} build
 */
function markWith(group, name, wanted, build) {
  let found = [...group.children].find((each) => each.classList.contains(name));
  if (wanted && !found) group.append((found = build()));
  else if (!wanted) found?.remove();
  return wanted ? found : undefined;
}

/** @param {SVGElement} group @param {(string | false | 0 | undefined)[]} parts */
function say(group, parts) {
  const words = parts.filter(Boolean).join(", ");
  if (group.getAttribute("aria-label") !== words) group.setAttribute("aria-label", words);
}
