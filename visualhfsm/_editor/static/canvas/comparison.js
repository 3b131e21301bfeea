/**
 * Show the differences from another version on the canvas: added, removed, changed and moved elements.
 *
 * @import {Automaton, Difference} from "../data/protocol.js"
 */

import {html, nothing, render} from "lit";

import {askTab} from "../data/commands.js";
import {confirm} from "../kit/dialog.js";
import {chooseFile} from "../data/file-dialog.js";
import {ownerOf} from "../data/outline.js";
import {page} from "../data/page.js";
import {wordOf} from "../data/places.js";
import {store} from "../data/store.js";
import {n, t} from "../kit/texts.js";
import {MARKS} from "./glyphs.js";

/** @type {Record<string, number>} */
const RANK = {added: 4, removed: 4, changed: 3, inside: 2, moved: 1};

/** Ask for the version to compare with, and show the differences. @param {import("../kit/registry.js").Context} context */
export async function compare({canvas}) {
  if (canvas.comparison) {
    canvas.comparison.end();
    return;
  }
  /** @type {import("../kit/dialog.js").Choice[]} */
  const saved = page.tabState?.path ? [["saved", t("The saved version"), "primary"]] : [];
  const choice = await confirm({
    title: t("Compare with"),
    text: t("Differences are shown on the canvas, in every automaton."),
    choices: [["file", t("Another file")], ...saved],
  });
  const against =
    choice === "file" ? await chooseFile({title: t("Compare with a document"), verb: t("Compare")}) : choice;
  if (against) await new Comparison(canvas, against).begin();
}

/** Show the differences from a file. @param {import("./canvas.js").HfsmCanvas} canvas @param {string} path */
export const compareWith = (canvas, path) => new Comparison(canvas, path).begin();

/** @type {[kind: string, words: (count: number) => string][]} */
const COUNTED = [
  ["added", (count) => n("{count} added", "{count} added", count)],
  ["removed", (count) => n("{count} removed", "{count} removed", count)],
  ["changed", (count) => n("{count} changed", "{count} changed", count)],
  ["moved", (count) => n("{count} moved", "{count} moved", count)],
];
/** @type {Record<string, (name: string | number) => string>} */
const ELEMENTS = {
  automaton: (name) => t("automaton {name}", {name}),
  document: (name) => t("document {name}", {name}),
  state: (name) => t("state {name}", {name}),
  transition: (name) => t("transition {name}", {name}),
};
/** @type {Record<string, (what: string) => string>} */
const WHOLE = {
  added: (what) => t("{what} added", {what}),
  removed: (what) => t("{what} removed", {what}),
  moved: (what) => t("{what} moved", {what}),
};

export class Comparison {
  /** @param {import("./canvas.js").HfsmCanvas} canvas @param {string} against */
  constructor(canvas, against) {
    this.canvas = canvas;
    this.against = against;
    this.tab = page.tab;
    this.stop = new AbortController();
    this.legend = document.createElement("div");
    this.index = -1;
    /** @type {Difference[]} */
    this.differences = [];
    /** The former automata of all differences. @type {Map<number, Automaton>} */
    this.before = new Map();
    /** The marks in each automaton, by key. @type {Map<number, Map<string, string>>} */
    this.byAutomaton = new Map();
  }

  async begin() {
    if (!(await this.#load()) || page.tab !== this.tab || this.canvas.comparison) return;
    const {signal} = this.stop;
    this.legend.className = "legend";
    this.legend.setAttribute("role", "region");
    this.legend.setAttribute("aria-label", t("Comparison"));
    this.canvas.append(this.legend);
    this.canvas.comparison = this;
    store.addEventListener("document", ({detail}) => detail.tab === this.tab && this.#reload(), {signal});
    page.addEventListener("tab", () => this.end(), {signal});
    this.#show();
  }

  /** Return to drawing. */
  end() {
    this.stop.abort();
    this.legend.remove();
    this.canvas.comparison = undefined;
    this.canvas.redraw();
  }

  /** An automaton with its removed elements. @param {Automaton} automaton @returns {Automaton} */
  merged(automaton) {
    const former = this.before.get(automaton.id);
    if (!former) return automaton;
    /** @template {{id: number}} T @param {T[]} now @param {T[]} then */
    const gone = (now, then) => {
      const there = new Set(now.map(({id}) => id));
      return then.filter(({id}) => !there.has(id));
    };
    return {
      ...automaton,
      states: [...automaton.states, ...gone(automaton.states, former.states)],
      transitions: [...automaton.transitions, ...gone(automaton.transitions, former.transitions)],
      annotations: [...automaton.annotations, ...gone(automaton.annotations, former.annotations)],
    };
  }

  /** The marks in an automaton, by key. @param {Automaton} automaton @returns {Map<string, string>} */
  marks(automaton) {
    return this.byAutomaton.get(automaton.id) ?? new Map();
  }

  async #load() {
    const done = await askTab("diff", {against: this.against});
    if (!done) return false;
    this.differences = done.differences;
    this.before = new Map(done.before.map((each) => [each.id, each]));
    this.byAutomaton = new Map();
    for (const {kind, place} of this.differences) {
      const {automaton = 0} = place;
      if (place.id) this.#mark(automaton, `${place.kind[0]}${place.id}`, kind);
      this.#markAbove(automaton);
    }
    return true;
  }

  /** @param {number} automaton @param {string} key @param {string} kind */
  #mark(automaton, key, kind) {
    let marks = this.byAutomaton.get(automaton);
    if (!marks) this.byAutomaton.set(automaton, (marks = new Map()));
    if (RANK[kind] > (RANK[marks.get(key) ?? ""] ?? 0)) marks.set(key, kind);
  }

  /** The states in which an automaton lies have a difference inside. @param {number} id */
  #markAbove(id) {
    const document = page.shownDocument;
    for (let automaton = document.automata.get(id), steps = 0; automaton && steps < 100; steps++) {
      const owner = ownerOf(document, automaton);
      if (!owner) return;
      this.#mark(automaton.father, `s${owner.id}`, "inside");
      automaton = document.automata.get(automaton.father);
    }
  }

  async #reload() {
    if (await this.#load()) this.#show();
    else this.end();
  }

  #show() {
    this.canvas.redraw();
    /** @param {string} kind */
    const count = (kind) => this.differences.filter((each) => each.kind === kind).length;
    const shown = this.differences[this.index];
    render(
      html`<span
          >${this.against === "saved" ? t("Compared with the saved version:") : t("Compared with {file}:", {file: this.against})}
          ${
            this.differences.length
              ? COUNTED.filter(([kind]) => count(kind)).map(
                  ([kind, words]) => html`<span class="sign ${kind}">${words(count(kind))}</span>`,
                )
              : t("no difference")
          }</span
        >
        ${
          this.differences.length
            ? html`<button type="button" class="button" @click=${() => this.#go(-1)}>${t("Previous")}</button
                ><button type="button" class="button" @click=${() => this.#go(1)}>${t("Next")}</button>`
            : nothing
        }
        <button type="button" class="button primary" @click=${() => this.end()}>${t("Done")}</button>
        ${
          shown
            ? html`<p aria-live="polite">${this.index + 1}. ${describe(shown)}</p>
                ${shown.lines ? lineDiff(shown.lines) : nothing}`
            : nothing
        }`,
      this.legend,
    );
  }

  /** @param {number} step */
  #go(step) {
    const {length} = this.differences;
    this.index = (this.index + step + length) % length;
    const {kind, place} = this.differences[this.index];
    const there = place.automaton && page.shownDocument.automata.has(place.automaton);
    if (there) page.jump(kind === "removed" ? {kind: "automaton", automaton: place.automaton} : {...place, part: ""});
    this.#show();
    if (there && place.id)
      this.canvas.viewport.reveal(this.canvas.drawing.places.get(`${place.kind[0]}${place.id}`) ?? {x: 0, y: 0});
  }
}

/** @param {Difference} difference */
function describe({kind, place, part = "", before = "", after = "", lines}) {
  const automaton = page.shownDocument.automata.get(place.automaton ?? 0);
  const list =
    place.kind === "state" ? automaton?.states : place.kind === "transition" ? automaton?.transitions : undefined;
  const name = list?.find((each) => each.id === place.id)?.name ?? (kind === "removed" ? before : place.id) ?? "";
  const title = place.kind === "automaton" ? (automaton ? page.title(automaton) : place.automaton) : name;
  const what = ELEMENTS[place.kind](title ?? "");
  if (kind !== "changed") {
    const inner = place.name ? `: ${wordOf(place.part ?? "")} ${place.name}` : "";
    return `${WHOLE[kind](what)}${inner}`;
  }
  const changed = {what, part: wordOf(part), before, after};
  return lines || (!before && !after)
    ? `${what}: ${changed.part}`
    : t("{what}: {part} was “{before}”, is “{after}”", changed);
}

/** Lines that were removed and added, with those around them. @param {string[]} lines */
function lineDiff(lines) {
  const kinds = /** @type {Record<string, [string, string]>} */ ({"-": ["removed", "−"], "+": ["added", "+"]});
  return html`<ol class="line-diff" tabindex="0" aria-label=${t("Lines that differ")}>
    ${lines.map((line) => {
      const [kind, sign] = kinds[line[0]] ?? ["", ""];
      return html`<li class=${kind}>
        <span class="diff-sign" aria-label=${kind ? MARKS[kind] : nothing} role=${kind ? "img" : nothing}>${sign}</span
        ><code>${line.slice(1)}</code>
      </li>`;
    })}
  </ol>`;
}
