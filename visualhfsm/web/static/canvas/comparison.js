/** Show on the canvas what differs from another version: added, removed, changed and moved things. */

import {html, nothing, render} from "lit";

import {askTab} from "../commands.js";
import {confirm} from "../dialogs/dialog.js";
import {chooseFile} from "../dialogs/files.js";
import {ownerOf} from "../outline.js";
import {page} from "../page.js";
import {store} from "../store.js";

const RANK = {added: 4, removed: 4, changed: 3, inside: 2, moved: 1};

/**
 * @typedef {{kind: string, place: {kind: string, automaton?: number, id?: number, part?: string}, before?: string,
 *   after?: string}} Difference
 */

/** Ask with what to compare, and show it. @param {import("../actions.js").Context} context */
export async function compare({canvas}) {
  if (canvas.comparison) {
    canvas.comparison.end();
    return;
  }
  const saved = page.tabState.path ? [["saved", "The saved version", "primary"]] : [];
  const choice = await confirm({
    title: "Compare with",
    text: "What differs is shown on the canvas, in every automaton.",
    choices: [["file", "Another file"], ...saved],
  });
  const against = choice === "file" ? await chooseFile({title: "Compare with a document", verb: "Compare"}) : choice;
  if (against) await new Comparison(canvas, against).begin();
}

class Comparison {
  constructor(canvas, against) {
    this.canvas = canvas;
    this.against = against;
    this.tab = page.tab;
    this.stop = new AbortController();
  }

  async begin() {
    if (!(await this.#load()) || page.tab !== this.tab || this.canvas.comparison) return;
    const {signal} = this.stop;
    this.legend = document.createElement("div");
    this.legend.className = "legend";
    this.legend.setAttribute("role", "region");
    this.legend.setAttribute("aria-label", "Comparison");
    this.canvas.append(this.legend);
    this.canvas.comparison = this;
    this.canvas.compares = true;
    store.addEventListener("document", ({detail}) => detail.tab === this.tab && this.#reload(), {signal});
    page.addEventListener("tab", () => this.end(), {signal});
    this.index = -1;
    this.#show();
  }

  /** Back to drawing. */
  end() {
    this.stop.abort();
    this.legend.remove();
    this.canvas.comparison = undefined;
    this.canvas.compares = false;
    this.canvas.redraw();
  }

  /** An automaton with what is gone from it. */
  merged(automaton) {
    const former = this.before.get(automaton.id);
    if (!former) return automaton;
    const gone = (now, then) => {
      const there = new Set(now.map(({id}) => id));
      return then.filter(({id}) => !there.has(id));
    };
    return {
      ...automaton,
      states: [...automaton.states, ...gone(automaton.states, former.states)],
      transitions: [...automaton.transitions, ...gone(automaton.transitions, former.transitions)],
    };
  }

  /** The marks in an automaton, by key. @returns {Map<string, string>} */
  marks(automaton) {
    return this.byAutomaton.get(automaton.id) ?? new Map();
  }

  async #load() {
    const done = await askTab("diff", {against: this.against});
    if (!done) return false;
    /** @type {Difference[]} */
    this.differences = done.differences;
    this.before = new Map(done.before.map((each) => [each.id, each]));
    this.byAutomaton = new Map();
    for (const {kind, place} of this.differences) {
      if (place.id) this.#mark(place.automaton, `${place.kind === "state" ? "s" : "t"}${place.id}`, kind);
      this.#markAbove(place.automaton);
    }
    return true;
  }

  #mark(automaton, key, kind) {
    if (!this.byAutomaton.has(automaton)) this.byAutomaton.set(automaton, new Map());
    const marks = this.byAutomaton.get(automaton);
    if (RANK[kind] > (RANK[marks.get(key)] ?? 0)) marks.set(key, kind);
  }

  /** The states in which an automaton lies have a difference inside. */
  #markAbove(id) {
    const {document} = page;
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
    const count = (kind) => this.differences.filter((each) => each.kind === kind).length;
    const shown = this.differences[this.index];
    render(
      html`<span
          >Compared with ${this.against === "saved" ? "the saved version" : this.against}:
          ${
            this.differences.length
              ? ["added", "removed", "changed", "moved"]
                  .filter(count)
                  .map((kind) => html`<span class="sign ${kind}">${count(kind)} ${kind}</span>`)
              : "no difference"
          }</span
        >
        ${
          this.differences.length
            ? html`<button type="button" class="button" @click=${() => this.#go(-1)}>Previous</button
                ><button type="button" class="button" @click=${() => this.#go(1)}>Next</button>`
            : nothing
        }
        <button type="button" class="button primary" @click=${() => this.end()}>Done</button>
        ${shown ? html`<p aria-live="polite">${this.index + 1}. ${describe(shown)}</p>` : nothing}`,
      this.legend,
    );
  }

  #go(step) {
    const {length} = this.differences;
    this.index = (this.index + step + length) % length;
    const {kind, place} = this.differences[this.index];
    const there = place.automaton && page.document.automata.has(place.automaton);
    if (there) page.jump(kind === "removed" ? {kind: "automaton", automaton: place.automaton} : {...place, part: ""});
    this.#show();
    if (there && place.id)
      this.canvas.viewport.reveal(
        this.canvas.scene.places.get(`${place.kind === "state" ? "s" : "t"}${place.id}`) ?? {x: 0, y: 0},
      );
  }
}

function describe({kind, place, part = "", before = "", after = ""}) {
  const automaton = page.document.automata.get(place.automaton);
  const list = {state: automaton?.states, transition: automaton?.transitions}[place.kind];
  const name = list?.find((each) => each.id === place.id)?.name ?? (kind === "removed" ? before : place.id) ?? "";
  const what = `${place.kind} ${
    place.kind === "automaton" ? (automaton ? page.title(automaton) : place.automaton) : name
  }`;
  if (kind === "moved") return `${what} moved`;
  if (kind !== "changed") return `${what} ${kind}${place.name ? `: ${place.part} ${place.name}` : ""}`;
  const short = (text) => (text.length > 60 ? `${text.slice(0, 60)}…` : text).replaceAll("\n", "⏎");
  if (!before && !after) return `${what}: ${part}`;
  return `${what}: ${part} was “${short(before)}”, is “${short(after)}”`;
}
