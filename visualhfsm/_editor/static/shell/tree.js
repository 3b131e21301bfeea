/** The whole hierarchy at the left: every state of every automaton. */

import {guard, html, nothing} from "lit";

import {drawn, PageElement} from "../data/element.js";
import {lostIn, rootOf} from "../data/outline.js";
import {page} from "../data/page.js";
import {problemOf, problemOfAutomaton, SEVERITIES} from "../data/problems.js";
import {t, visible} from "../kit/texts.js";

const MOST = 4000; // rows; a larger tree is folded below the first level
const BLOCK = 50; // rows that are drawn together, and not laid out while none of them is visible

/**
 * @import {From} from "../data/element.js"
 * @import {Automaton, State} from "../data/protocol.js"
 * @typedef {{key: string, level: number, name: string, kind: string, automaton: number, state?: number, open?: boolean,
 *   child?: number, count: number, index: number}} Row
 */

export class Tree extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["change"], store: ["document", "workspace", "problems"]};

  /** The visible rows, from top to bottom. @type {Row[]} */
  rows = [];
  /** Keys of rows. @type {Set<string>} */
  #folded = new Set();
  #focused = "";
  /** @type {string | undefined} */
  #revealed = "";

  /** Draw changes made in the tree at once, others after the canvas, where the user then looks. */
  async scheduleUpdate() {
    if (this.hasUpdated && !this.contains(document.activeElement)) await drawn();
    super.scheduleUpdate();
  }

  #rows() {
    const document = page.shownDocument;
    /** @type {Row[]} */
    const rows = [];
    /** @type {Set<number>} */
    const seen = new Set();
    /** @param {Automaton | undefined} automaton @param {number} level @param {string} prefix */
    const visit = (automaton, level, prefix) => {
      if (!automaton || seen.has(automaton.id) || rows.length > MOST) return;
      seen.add(automaton.id);
      automaton.states.forEach((state, index) => {
        const children = state.children.filter((id) => document.automata.has(id));
        const key = `${prefix}/${automaton.id}.${state.id}`;
        const opens = children.length > 1 || children.some((id) => document.automata.get(id)?.states.length);
        const open = opens && !this.#folded.has(key);
        rows.push({
          key,
          level,
          name: state.name || t("state {id}", {id: state.id}),
          kind: kindOf(state),
          automaton: automaton.id,
          state: state.id,
          child: children[0],
          open: opens ? open : undefined,
          count: automaton.states.length,
          index,
        });
        if (!open) return;
        if (children.length === 1) visit(document.automata.get(children[0]), level + 1, key);
        else
          children.forEach((id, number) => {
            const branch = `${key}:${id}`;
            const child = document.automata.get(id);
            const unfolded = !this.#folded.has(branch);
            rows.push({
              key: branch,
              level: level + 1,
              name: t("automaton {id}", {id: number + 1}),
              kind: "automaton",
              automaton: id,
              child: id,
              open: child?.states.length ? unfolded : undefined,
              count: children.length,
              index: number,
            });
            if (unfolded) visit(child, level + 2, branch);
          });
      });
    };
    const root = rootOf(document);
    const open = !this.#folded.has("root");
    if (root)
      rows.push({
        key: "root",
        level: 1,
        name: page.component,
        kind: "root",
        automaton: root.id,
        child: root.id,
        open: root.states.length ? open : undefined,
        count: 1,
        index: 0,
      });
    if (open) visit(root, 2, "root");
    for (const lost of lostIn(document)) {
      rows.push({
        key: `lost:${lost.id}`,
        level: 1,
        name: t("automaton {id}, of no state", {id: lost.id}),
        kind: "lost",
        automaton: lost.id,
        child: lost.id,
        open: undefined,
        count: 1,
        index: 0,
      });
    }
    return rows;
  }

  render() {
    if (!page.document) return nothing;
    const rows = (this.rows = this.#rows());
    const current = page.automaton?.id;
    const focused =
      rows.find((row) => row.key === this.#focused) ??
      rows.find(isSelected) ??
      rows.find((row) => row.child === current) ??
      rows[0];
    return html`<h2 id="tree-title">${t("Automata")}</h2>
      <div role="tree" aria-labelledby="tree-title" @keydown=${this.#key} @click=${this.#click} @dblclick=${this.#open}>
        ${inBlocks(
          rows.map((row) => ({
            row,
            selected: isSelected(row),
            problem: problemAt(row),
            shown: row.child === current && row.child !== undefined,
            focused: row === focused,
          })),
        ).map(
          (block, index) =>
            html`<div role="presentation" class="block">
              ${guard([JSON.stringify(block)], () => block.map((each, at) => branch(each, index * BLOCK + at)))}
            </div>`,
        )}
      </div>`;
  }

  /** @type {Map<string, "active" | "ghost">} */
  #live = new Map();

  /** Mark what runs. @param {Map<string, "active" | "ghost">} live by automaton and state, such as `1.2` */
  showLive(live) {
    this.#live = live;
    this.#markLive();
  }

  /** Update the marks alone: states may change many times a second. */
  #markLive() {
    /** @type {NodeListOf<HTMLElement>} */
    const branches = this.querySelectorAll("[role=treeitem]");
    for (const branch of branches) {
      const row = this.rows[Number(branch.dataset.index)];
      const status = row && row.state !== undefined ? (this.#live.get(`${row.automaton}.${row.state}`) ?? "") : "";
      if ((branch.dataset.live ?? "") === status) continue;
      branch.dataset.live = status;
      if (status === "active") branch.setAttribute("aria-current", "true");
      else branch.removeAttribute("aria-current");
    }
  }

  updated() {
    if (this.#live.size) this.#markLive();
    const key = this.rows.find(isSelected)?.key;
    if (key === this.#revealed) return; // scrolling makes the browser lay out everything at once
    this.#revealed = key;
    this.querySelector('[aria-selected="true"] .dot')?.scrollIntoView({block: "nearest", inline: "nearest"});
  }

  /** @param {From<HTMLElement>} event */
  #row(event) {
    /** @type {HTMLElement | null} */
    const element = event.target.closest("[role=treeitem]");
    return element ? this.rows[Number(element.dataset.index)] : undefined;
  }

  /** @param {From<HTMLElement>} event */
  #click(event) {
    const row = this.#row(event);
    if (!row) return;
    this.#focused = row.key;
    if (event.target.classList.contains("twist") && row.open !== undefined) this.#fold(row, row.open);
    else choose(row);
  }

  /** @param {From<HTMLElement>} event */
  #open(event) {
    const row = this.#row(event);
    if (row && !event.target.classList.contains("twist")) enter(row);
  }

  /** @param {Row} row @param {boolean} folded */
  #fold(row, folded) {
    if (folded) this.#folded.add(row.key);
    else this.#folded.delete(row.key);
    this.requestUpdate();
  }

  /** @param {KeyboardEvent & From<HTMLElement>} event */
  #key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const row = this.#row(event);
    if (!row) return;
    const index = this.rows.indexOf(row);
    let next;
    switch (event.key) {
      case "ArrowDown":
        next = this.rows[index + 1];
        break;
      case "ArrowUp":
        next = this.rows[index - 1];
        break;
      case "Home":
        next = this.rows[0];
        break;
      case "End":
        next = this.rows.at(-1);
        break;
      case "ArrowRight":
        if (row.open === false) this.#fold(row, false);
        else if (row.open) next = this.rows[index + 1];
        break;
      case "ArrowLeft":
        if (row.open) this.#fold(row, true);
        else next = this.rows.slice(0, index).findLast((each) => each.level < row.level);
        break;
      case "Enter":
        enter(row);
        break;
      case " ":
        choose(row);
        break;
      default:
        return;
    }
    event.preventDefault();
    event.stopPropagation();
    if (!next) return;
    this.#focused = next.key;
    choose(next);
    this.requestUpdate();
    // At once: the next key may arrive before the tree is redrawn, and must find the row that this one selected.
    /** @type {HTMLElement | null} */ (this.querySelector(`[data-index="${this.rows.indexOf(next)}"]`))?.focus();
  }
}

/** @template T @param {T[]} rows */
const inBlocks = (rows) =>
  Array.from({length: Math.ceil(rows.length / BLOCK)}, (_, index) => rows.slice(index * BLOCK, (index + 1) * BLOCK));

/**
 * A row of the tree, `index` among all.
 *
 * @param {{row: Row, selected: boolean, problem: string, shown: boolean, focused: boolean}} each
 * @param {number} index
 */
const branch = ({row, selected, problem, shown, focused}, index) =>
  html` <div
    role="treeitem"
    class="branch ${row.kind} ${shown ? "shown" : ""}"
    data-index=${index}
    data-level=${row.level}
    aria-level=${row.level}
    aria-setsize=${row.count}
    aria-posinset=${row.index + 1}
    aria-selected=${selected}
    aria-expanded=${row.open ?? nothing}
    aria-label=${visible(row.name) + (problem ? `, ${SEVERITIES[problem]}` : "")}
    tabindex=${focused ? 0 : -1}
  >
    ${Array.from({length: row.level - 1}, () => html`<span class="indent"></span>`)}<span class="twist"></span
    ><span class="dot"></span
    ><span class="text" title=${row.kind === "root" ? visible(row.name) : nothing}>${visible(row.name)}</span>
    ${problem ? html`<span class="problem ${problem}" title=${SEVERITIES[problem]}></span>` : nothing}
  </div>`;

/** @param {State} state */
const kindOf = (state) =>
  `${state.children.length ? "parent" : "plain"}${state.initial ? " initial" : ""}${state.final ? " final" : ""}`;

/** @param {Row} row */
function isSelected(row) {
  if (row.state === undefined) return row.automaton === page.automaton?.id && page.selectedCount === 0;
  return row.automaton === page.automaton?.id && page.states.has(row.state);
}

/** @param {Row} row */
function choose(row) {
  page.open(row.automaton, row.state === undefined ? {} : {states: [row.state]});
  page.dispatchEvent(new Event("reveal"));
}

/** Open the sub-automaton of a row, or the code of a state without one. @param {Row} row */
function enter(row) {
  if (row.child !== undefined) page.open(row.child);
  else page.edit({kind: "state", automaton: row.automaton, id: row.state});
}

/**
 * The severity of the worst problem of a row: of a state, and of the automaton that the row opens, such as an import
 * that is not found.
 *
 * @param {Row} row
 */
function problemAt({automaton, state, child}) {
  const {problems} = page.shownDocument;
  const found = [
    state !== undefined && problemOf(problems, automaton, "state", state),
    child !== undefined && problemOfAutomaton(problems, child),
  ].flatMap((each) => each || []);
  return found.find(({severity}) => severity === "error")?.severity ?? found[0]?.severity ?? "";
}

customElements.define("hfsm-tree", Tree);
