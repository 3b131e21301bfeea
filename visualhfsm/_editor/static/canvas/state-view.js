/**
 * One state in the drawing.
 *
 * @import {Problem, State} from "../data/protocol.js"
 * @import {Box, Point} from "../measures/geometry.js"
 * @typedef {{problem?: Problem, imported: boolean, mark?: string}} More
 */

import {sameProblem} from "../data/problems.js";
import {n, t, visible} from "../kit/texts.js";
import {ElementView} from "./element-view.js";
import {BADGES} from "./glyphs.js";
import {RADIUS} from "../measures/geometry.js";
import {stateClasses} from "./live-marks.js";
import {make, template} from "./svg.js";
import {fitCircle, lineHeight} from "../measures/text.js";

const blank = template(`
  <g class="state" role="button" tabindex="-1">
    <circle class="glow" r="${RADIUS + 6}"/><circle class="body" r="${RADIUS}"/>
    <circle class="ring" r="${RADIUS - 5}"/><text class="name" aria-hidden="true"/>
    <circle class="mark" cy="${RADIUS - 13}" r="3"/><circle class="rim" r="${RADIUS}"/>
    <circle class="focus-ring" r="${RADIUS + 12}"/>
  </g>`);
const MOST_BARS = 4;
const CLEAR = 0.5; // radians between a badge and an arc
const TURNS = [0, 0.35, -0.35, 0.7, -0.7, 1.05, -1.05, 1.4, -1.4, 1.9, -1.9, 2.4, -2.4];
const FEW_SIGNS = 12; // letters of a name that are larger than that leave no room for a sign of code

/** The angle between two directions. @param {number} a @param {number} b */
const apart = (a, b) => Math.abs(((a - b + Math.PI * 3) % (Math.PI * 2)) - Math.PI);

export class StateView extends ElementView {
  /** @param {State} state */
  constructor(state) {
    super(blank());
    this.state = state;
  }

  /** @type {SVGElement | undefined} */
  #badges = undefined;
  #name = this.group.children[3];
  /** @type {Partial<More>} */
  #more = {};
  #x = NaN;
  #y = NaN;

  /** Show a state as it is now. @param {State} state @param {More} more */
  update(state, more) {
    const {problem, imported} = more;
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
    this.#write();
  }

  get classes() {
    const {children, initial, final} = this.state;
    const hasCode = codesOf(this.state).length > 0;
    const kinds = ["state", children.length && "parent", initial && "initial", final && "final", hasCode && "has-code"];
    return this.classesOf(kinds, this.#more, this.live ? stateClasses(this.live) : {});
  }

  /** The width of its name, where the letters are larger than usual. */
  room = 0;

  /** Write its name in letters of a size at least. @param {number} letters @param {number} room */
  scaleLetters(letters, room) {
    this.letters = letters;
    this.room = room;
    this.#drawName();
  }

  #drawName() {
    const {name, initial, final} = this.state;
    const hasCodes = this.letters < FEW_SIGNS && codesOf(this.state).length > 0;
    drawName(this.#name, visible(name), hasCodes, initial || final, this);
  }

  #write() {
    const {state} = this;
    const {name, children, history} = state;
    const words = [
      t("State {name}", {name: name || t("without a name")}),
      state.initial && t("initial"),
      state.final && t("final"),
      children.length > 0 && n("has a sub-automaton", "has {count} sub-automata", children.length),
      this.#more.imported && BADGES.imported.word,
      history.trim() === "restart" && BADGES.restart.word,
    ];
    this.tell(`s${state.id}`, this.classes, words, [name || t("unnamed state"), ...codesOf(state)], this.#more);
    this.#drawName();
    this.#drawBadges(state, this.#more.imported, this.#more.problem);
  }

  /** Move the state; returns whether its position changed. @param {Point} point */
  place({x, y}) {
    if (x === this.#x && y === this.#y) return false;
    [this.#x, this.#y] = [x, y];
    this.group.setAttribute("transform", `translate(${x},${y})`);
    return true;
  }

  get middle() {
    return {x: this.#x, y: this.#y};
  }

  /** The box around it. @returns {Box} */
  get box() {
    const {x, y} = this.middle;
    return {left: x - RADIUS, right: x + RADIUS, top: y - RADIUS, bottom: y + RADIUS};
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

/** @param {Element} element @param {string} name @param {boolean} hasCodes @param {boolean} hasRing @param {{letters: number, room: number}} fit */
function drawName(element, name, hasCodes, hasRing, {letters, room}) {
  const {lines, size} = fitCircle(name, hasRing, letters, room);
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

/** The kinds of code that a state has, in words. @param {State} state */
const codesOf = ({entry, code, exit}) =>
  [entry.trim() && t("entry code"), code.trim() && t("code"), exit.trim() && t("exit code")].filter(Boolean);

/**
 * A badge at the rim of a state, at some half turns, with a glyph and, if there are several, a bar for each.
 *
 * @param {string} kind @param {number} halfTurns @param {string} path
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
