/**
 * The state of the page itself: the shown tab and automaton, and the selection.
 *
 * Tree, canvas and panels share this state. It is not part of the document.
 */

import {ownerOf, pathTo, rootOf, titleOf} from "./outline.js";
import {required} from "../kit/existence.js";
import {store} from "./store.js";

/** Parts of a place that are edited as code beside the canvas. */
const CODE_PARTS = new Set(["code", "entry", "exit", "trigger", "guard", "fired", "argument", "result"]);
/** The section in which the data of other parts is shown. @type {Record<string, string>} */
const SECTIONS = {
  period: "timing",
  onError: "description",
  onRefused: "description",
  world: "description",
  language: "description",
  import: "inputs",
};

/**
 * @import {Target} from "../kit/events.js"
 * @import {Place} from "./protocol.js"
 * @typedef {{automaton: number, states: Set<number>, transitions: Set<number>, annotations: Set<number>,
 *   visited: number[]}} Spot
 * @typedef {{states?: Iterable<number>, transitions?: Iterable<number>, annotations?: Iterable<number>}} Chosen
 * @typedef {{line?: number, column?: number, length?: number, selects?: boolean, focus?: boolean}} At position of the
 *   cursor in the text at a place, with how many characters it selects; or whether the value there is selected, so that
 *   typing replaces it. Without `focus`, the focus stays where it is
 * @typedef {{tab: number, code: readonly import("./protocol.js").PassedCode[]}} Tested
 * @typedef {{tab: null, automaton: null, selection: null, change: null, highlight: null, tested: null, verdict: null,
 *   reveal: {legible: boolean} | null, save: null, run: null, "focus-canvas": null, say: string, alert: string, edit: Place & At,
 *   data: {section: string, place?: Place & At}}} PageEvents
 */

/** Events: `tab`, `automaton`, `selection`; each is followed by `change`. */
class Page extends /** @type {new () => Target<PageEvents>} */ (EventTarget) {
  /** The shown tab; 0 is the start page. */
  tab = 0;
  /**
   * Marks on the canvas that do not come from a run, such as a step of a counterexample: for each automaton, those of
   * its states and transitions. The event `highlight` reports a change.
   *
   * @type {Map<number, Map<string, import("../canvas/live-marks.js").Live>> | undefined}
   */
  highlight = undefined;
  /** What tests passed of the code of a tab, shown beside it. The event `tested` reports it. @type {Tested | undefined} */
  tested = undefined;
  /** @type {Map<number, Spot>} */
  #spots = new Map();

  get document() {
    return store.documents.get(this.tab);
  }

  /** The shown document, for actions that need one. */
  get shownDocument() {
    return required(this.document, "document");
  }

  /** The shown automaton, for actions that need one. */
  get shownAutomaton() {
    return required(this.automaton, "automaton");
  }

  /** The shown automaton, or undefined. */
  get automaton() {
    const document = this.document;
    if (!document) return undefined;
    return document.automata.get(this.#spot().automaton) ?? rootOf(document);
  }

  /** Ids of the selected states. @returns {Set<number>} */
  get states() {
    return this.#spot().states;
  }

  /** Ids of the selected transitions. @returns {Set<number>} */
  get transitions() {
    return this.#spot().transitions;
  }

  /** Ids of the selected notes and frames. @returns {Set<number>} */
  get annotations() {
    return this.#spot().annotations;
  }

  /** How many elements are selected. */
  get selectedCount() {
    return this.states.size + this.transitions.size + this.annotations.size;
  }

  /** The selected state if nothing else is selected. */
  get state() {
    if (this.states.size !== 1 || this.selectedCount > 1) return undefined;
    const [id] = this.states;
    return this.automaton?.states.find((each) => each.id === id);
  }

  /** The selected transition if nothing else is selected. */
  get transition() {
    if (this.transitions.size !== 1 || this.selectedCount > 1) return undefined;
    const [id] = this.transitions;
    return this.automaton?.transitions.find((each) => each.id === id);
  }

  /** The selected note or frame if nothing else is selected. */
  get annotation() {
    if (this.annotations.size !== 1 || this.selectedCount > 1) return undefined;
    const [id] = this.annotations;
    return this.automaton?.annotations.find((each) => each.id === id);
  }

  /** The automata from the root to the shown one. */
  get path() {
    return this.automaton ? pathTo(this.shownDocument, this.automaton) : [];
  }

  /** The open tab as the workspace knows it. */
  get tabState() {
    return store.workspace.tabs.find((each) => each.tab === this.tab);
  }

  /** The name of the component. */
  get component() {
    return this.tabState?.title.replace(/\.xml$/i, "") ?? "root";
  }

  /**
   * The name of the shown automaton, or of another one of the document.
   *
   * @param {import("./protocol.js").Automaton} [automaton]
   */
  title(automaton = this.automaton) {
    return automaton ? titleOf(this.shownDocument, automaton, this.component) : "";
  }

  /** @param {number} tab */
  show(tab) {
    if (tab === this.tab) return;
    this.tab = tab;
    this.#emit("tab");
  }

  /** Show an automaton, and select in it. @param {number} automaton @param {Chosen} [selection] */
  open(automaton, selection = {}) {
    const spot = this.#spot();
    const differs = this.automaton?.id !== automaton;
    if (differs && this.automaton) spot.visited.push(this.automaton.id);
    spot.automaton = automaton;
    choose(spot, selection);
    this.#emit(differs ? "automaton" : "selection");
  }

  /** Show the automaton above, with the state selected that owns the one that was shown. */
  up() {
    const child = this.automaton;
    const father = child && this.shownDocument.automata.get(child.father);
    if (!father) return;
    const owner = ownerOf(this.shownDocument, child);
    this.open(father.id, {states: owner ? [owner.id] : []});
  }

  /** @param {Chosen} selection */
  select(selection) {
    const spot = this.#spot();
    const {states = [], transitions = [], annotations = []} = selection;
    const same =
      sameSet(spot.states, states) && sameSet(spot.transitions, transitions) && sameSet(spot.annotations, annotations);
    if (same) return;
    choose(spot, selection);
    this.#emit("selection");
  }

  /**
   * Edit a piece of code beside the canvas.
   *
   * @param {Place & At} place as in the protocol, and the position of the cursor
   */
  edit(place) {
    this.dispatchEvent(new CustomEvent("edit", {detail: place}));
  }

  /**
   * Show a part of the data of the automaton or the component.
   *
   * @param {string} section `interfaces`, `timing`, `variables`, `functions`, `inputs`, `parameters`, `events`,
   *   `properties`, `libraries` or `description`
   * @param {Place & At} [place] to focus in it
   */
  showData(section, place) {
    this.dispatchEvent(new CustomEvent("data", {detail: {section, place}}));
  }

  /**
   * Show a place of the document, such as that of a problem, a hit of a search or a line of a traceback, large enough
   * to be read.
   *
   * @param {Place} place
   * @param {At} at position in its text
   */
  jump(place, at = {}) {
    const {kind, automaton, id, part = ""} = place;
    if (automaton) {
      const ids = id === undefined ? [] : [id];
      this.open(automaton, {[`${kind}s`]: ids});
      this.dispatchEvent(new CustomEvent("reveal", {detail: {legible: true}}));
    }
    if (CODE_PARTS.has(part)) this.edit({...place, ...at});
    else if (part && part !== "name" && (kind === "automaton" || kind === "document"))
      this.showData(SECTIONS[part] ?? part, {...place, ...at});
  }

  /** Forget removed elements, after the document has changed. */
  prune() {
    const spot = this.#spot();
    const automaton = this.automaton;
    if (!automaton) return;
    if (spot.automaton !== automaton.id) {
      const back = spot.visited.findLast((id) => this.shownDocument.automata.has(id));
      spot.automaton = back ?? automaton.id;
      choose(spot, {});
      this.#emit("automaton");
      return;
    }
    const states = automaton.states.filter((each) => spot.states.has(each.id)).map((each) => each.id);
    const transitions = automaton.transitions.filter((each) => spot.transitions.has(each.id)).map((each) => each.id);
    const annotations = automaton.annotations.filter((each) => spot.annotations.has(each.id)).map(({id}) => id);
    this.select({states, transitions, annotations});
  }

  /** Forget a tab: a document that is opened again begins at its root with nothing selected. @param {number} tab */
  forget(tab) {
    this.#spots.delete(tab);
  }

  #spot() {
    let spot = this.#spots.get(this.tab);
    if (!spot) {
      spot = {automaton: 0, states: new Set(), transitions: new Set(), annotations: new Set(), visited: []};
      const root = this.document && rootOf(this.document);
      if (root) spot.automaton = root.id;
      if (this.document) this.#spots.set(this.tab, spot);
    }
    return spot;
  }

  /** @param {keyof PageEvents} kind */
  #emit(kind) {
    this.dispatchEvent(new Event(kind));
    this.dispatchEvent(new Event("change"));
  }
}

/** @param {Spot} spot @param {Chosen} selection */
function choose(spot, {states = [], transitions = [], annotations = []}) {
  spot.states = new Set(states);
  spot.transitions = new Set(transitions);
  spot.annotations = new Set(annotations);
}

/** @param {Set<number>} set @param {Iterable<number>} items */
const sameSet = (set, items) => set.size === [...items].length && [...items].every((item) => set.has(item));

export const page = new Page();
