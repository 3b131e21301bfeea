/**
 * One state in the drawing.
 *
 * @import {Problem, State} from "../protocol.js"
 * @import {Point} from "./geometry.js"
 * @typedef {{problem?: Problem, imported: boolean, mark?: string}} More
 */

import {FAILED, sameProblem, SEVERITIES} from "../problems.js";
import {n, t} from "../texts.js";
import {BADGES, CODES, MARKS} from "./glyphs.js";
import {RADIUS} from "./geometry.js";
import {make, template, templates} from "./svg.js";
import {fitCircle, lineHeight} from "./text.js";

const blank = template(`
  <g class="state" role="button" tabindex="-1">
    <circle class="glow" r="${RADIUS + 6}"/><circle class="body" r="${RADIUS}"/>
  </g>`);
/** Parts that are not visible from far away. */
const blankDetails = templates(`
  <circle class="ring" r="${RADIUS - 5}"/><text class="name" aria-hidden="true"/>
  <g class="codes" aria-hidden="true"/><circle class="rim" r="${RADIUS}"/>`);
const MOST_BARS = 4;
const CLEAR = 0.5; // radians between a badge and an arc
const TURNS = [0, 0.35, -0.35, 0.7, -0.7, 1.05, -1.05, 1.4, -1.4, 1.9, -1.9, 2.4, -2.4];
const CODES_AT = RADIUS - 13;

/** The angle between two directions. @param {number} a @param {number} b */
const apart = (a, b) => Math.abs(((a - b + Math.PI * 3) % (Math.PI * 2)) - Math.PI);

export class StateView {
  words = "";
  selected = false;
  /** The text beside the pointer. */
  tip = "";

  /** @param {State} state */
  constructor(state) {
    this.state = state;
    this.group = blank();
    [this.glow, this.#body] = this.group.children;
  }

  glow;
  #body;
  /** @type {SVGElement | undefined} */
  #badges = undefined;
  /** Parts that are hidden from far away, once they are drawn. @type {{name: Element, codes: Element} | undefined} */
  #details = undefined;
  /** @type {Partial<More>} */
  #more = {};
  #x = NaN;
  #y = NaN;

  /** Its name is a part of it. */
  get label() {
    return undefined;
  }

  /**
   * Draw a state; does nothing when nothing that is drawn differs.
   *
   * @param {State} state
   * @param {More} more
   */
  update(state, more) {
    const {problem, imported, mark = ""} = more;
    const former = this.#more;
    if (
      state === this.state &&
      imported === former.imported &&
      more.mark === former.mark &&
      sameProblem(problem, former.problem)
    )
      return;
    this.state = state;
    this.#more = more;
    const has = codesOf(state);
    const {group} = this;
    group.dataset.key = `s${state.id}`;
    const kinds = [
      "state",
      state.children.length && "parent",
      state.initial && "initial",
      state.final && "final",
      problem && `has-${problem.severity}`,
      problem?.code === FAILED && "failed",
      mark && `is-${mark}`,
      this.selected && "selected",
    ];
    group.setAttribute("class", kinds.filter(Boolean).join(" "));
    this.words = describe(state, imported, problem, mark);
    group.setAttribute("aria-label", this.words);
    this.tip = [state.name || t("unnamed state"), ...has.map((part) => CODES[part].word), problem?.message]
      .filter(Boolean)
      .join("\n");
    this.#drawDetails();
  }

  /** Draw the parts that are not visible from far away, too. */
  finish() {
    if (this.#details) return;
    const details = blankDetails();
    const [, name, codes] = details.children;
    this.#details = {name, codes};
    this.#body.after(details);
    this.#drawDetails();
  }

  /** Move the state; returns whether its position changed. @param {Point} point */
  place({x, y}) {
    if (x === this.#x && y === this.#y) return false;
    [this.#x, this.#y] = [x, y];
    this.group.setAttribute("transform", `translate(${x},${y})`);
    return true;
  }

  /** Whether it stands in a box. @param {import("./geometry.js").Box} box */
  isIn({left, right, top, bottom}) {
    return this.#x > left - RADIUS && this.#x < right + RADIUS && this.#y > top - RADIUS && this.#y < bottom + RADIUS;
  }

  #drawDetails() {
    if (!this.#details) return;
    const {state} = this;
    const has = codesOf(state);
    drawName(this.#details.name, state.name, has.length > 0, state.initial || state.final);
    drawCodes(this.#details.codes, has);
    this.#drawBadges(state, this.#more.imported, this.#more.problem);
  }

  /** Place the badges where no arc is, by the angles (rad) at which arcs touch the rim. @param {number[]} angles */
  placeBadges(angles) {
    this.#angles = angles;
    if (!this.#badges) return;
    const taken = [...angles];
    for (const each of this.#badges.children) {
      const wanted = Number(each.getAttribute("data-angle"));
      const angle =
        TURNS.map((turn) => wanted + turn).find((free) => taken.every((other) => apart(free, other) > CLEAR)) ?? wanted;
      taken.push(angle);
      each.setAttribute(
        "transform",
        `translate(${(Math.cos(angle) * RADIUS).toFixed(1)},${(Math.sin(angle) * RADIUS).toFixed(1)})`,
      );
    }
  }

  /** @type {number[]} */
  #angles = [];

  /** @param {State} state @param {boolean | undefined} imported @param {Problem | undefined} problem */
  #drawBadges(state, imported, problem) {
    this.#badges?.remove();
    this.#badges = undefined;
    const all = [];
    const history = state.history.trim();
    if (problem)
      all.push(
        badge(
          `problem ${problem.severity}`,
          -0.25,
          (problem.severity === "error" ? BADGES.error : BADGES.warning).path,
        ),
      );
    if (state.children.length) {
      const count = state.children.length;
      all.push(badge("child", 0.25, BADGES.child.path, count));
    }
    if (history) all.push(badge("history", 0.75, (history === "restart" ? BADGES.restart : BADGES.resume).path));
    if (imported) all.push(badge("imported", -0.75, BADGES.imported.path));
    if (!all.length) return;
    this.#badges = make("g", {class: "badges", "aria-hidden": "true"}, ...all);
    this.group.append(this.#badges);
    this.placeBadges(this.#angles);
  }
}

/** @param {Element} element @param {string} name @param {boolean} hasCodes @param {boolean} hasRing */
function drawName(element, name, hasCodes, hasRing) {
  const {lines, size} = fitCircle(name, hasRing);
  const high = lineHeight(size);
  const top = -((lines.length - 1) * high) / 2 + size * 0.35 - (hasCodes ? 2 : 0);
  element.setAttribute("font-size", String(size));
  element.replaceChildren(
    ...lines.map((line, index) => {
      const span = make("tspan", {x: 0, y: +(top + index * high).toFixed(1)});
      span.textContent = index < lines.length - 1 && name.includes(`${line} `) ? `${line} ` : line; // as it is read
      return span;
    }),
  );
}

/** @param {Element} element @param {(keyof typeof CODES)[]} has */
function drawCodes(element, has) {
  const start = -(has.length - 1) * 6;
  element.replaceChildren(
    ...has.map((part, index) =>
      make("path", {d: CODES[part].path, transform: `translate(${start + index * 12},${CODES_AT})`}),
    ),
  );
}

const PARTS = /** @type {(keyof typeof CODES)[]} */ (Object.keys(CODES));

/** The parts in which a state has code. @param {State} state */
const codesOf = (state) => PARTS.filter((part) => state[part].trim());

/**
 * A badge at the rim of a state, at some half turns, with a glyph and, if there are several, a bar for each.
 *
 * @param {string} kind
 * @param {number} halfTurns
 * @param {string} path
 */
function badge(kind, halfTurns, path, count = 1) {
  const bars = count > 1 ? Math.min(count, MOST_BARS) : 0;
  const group = make("g", {class: `badge ${kind}`, "data-angle": halfTurns * Math.PI});
  const d = Array.from({length: bars}, (_, index) => `M${9 + index * 4}-4.5V4.5`).join("");
  group.append(
    make("rect", {x: -9, y: -9, width: 18 + (bars ? bars * 4 + 1 : 0), height: 18, rx: 9}),
    make("path", {d: path + d}),
  );
  return group;
}

/** @param {State} state @param {boolean} imported @param {Problem | undefined} problem @param {string} mark */
function describe(state, imported, problem, mark) {
  const count = state.children.length;
  return [
    t("State {name}", {name: state.name || t("without a name")}),
    state.initial && t("initial"),
    state.final && t("final"),
    count > 0 && n("has a sub-automaton", "has {count} sub-automata", count),
    imported && BADGES.imported.word,
    state.history.trim() === "restart" && BADGES.restart.word,
    MARKS[mark],
    problem && `${SEVERITIES[problem.severity]}: ${problem.message}`,
  ]
    .filter(Boolean)
    .join(", ");
}
