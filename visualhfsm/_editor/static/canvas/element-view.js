/**
 * What the views of states and of transitions have in common.
 *
 * @import {Problem} from "../data/protocol.js"
 * @import {Live} from "./live-marks.js"
 * @typedef {{problem?: Problem, mark?: string}} Marks of an element: its worst problem, and its kind in a comparison
 */

import {FAILED, SEVERITIES} from "../data/problems.js";
import {uncoded} from "../kit/texts.js";
import {MARKS} from "./glyphs.js";

/** @typedef {(string | false | 0 | undefined)[]} Words those that do not hold are left out */

export class ElementView {
  words = "";
  selected = false;
  /** What it does in a running component. @type {Live | undefined} */
  live = undefined;
  /** The text beside the pointer. */
  tip = "";
  /** The smallest size of the letters of its name. */
  letters = 0;

  /** @param {SVGElement} group its elements @param {SVGElement} [label] what of its name is not a part of them */
  constructor(group, label) {
    this.group = group;
    this.label = label;
  }

  /** Remove its elements. */
  remove() {
    this.group.remove();
    this.label?.remove();
  }

  /** Select it, or not. @param {boolean} selected */
  select(selected) {
    if (this.selected === selected) return;
    this.selected = selected;
    this.group.setAttribute("aria-pressed", String(selected));
    for (const each of [this.group, this.label]) each?.classList.toggle("selected", selected);
  }

  /** Its classes: of its kind, of its marks and of what it does. @param {Words} kinds @param {Marks} marks @param {Record<string, boolean>} doing */
  classesOf(kinds, {problem, mark}, doing) {
    const all = [
      ...kinds,
      problem && `has-${problem.severity}`,
      problem?.code === FAILED && "failed",
      mark && `is-${mark}`,
      this.selected && "selected",
      ...Object.entries(doing).map(([name, holds]) => holds && name),
    ];
    return all.filter(Boolean).join(" ");
  }

  /** Say what it is. @param {string} key @param {string} classes @param {Words} words @param {Words} tip @param {Marks} marks */
  tell(key, classes, words, tip, {problem, mark = ""}) {
    const {group} = this;
    const message = problem && uncoded(problem.message);
    this.words = [...words, MARKS[mark], problem && `${SEVERITIES[problem.severity]}: ${message}`]
      .filter(Boolean)
      .join(", ");
    this.tip = [...tip, message].filter(Boolean).join("\n");
    group.dataset.key = key;
    group.setAttribute("class", classes);
    if (this.selected) group.setAttribute("aria-pressed", "true");
    group.setAttribute("aria-label", this.words);
  }
}
