/**
 * The problems of the shown document; each leads to its place.
 *
 * @import {Place, Problem, Step} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @typedef {{key: string, step: number}} Played the problem whose counterexample is played, and the step
 */

import {html, nothing} from "lit";
import {PageElement} from "../data/element.js";
import {page} from "../data/page.js";
import {FAILED, SEVERITIES} from "../data/problems.js";
import {wordButton} from "../kit/buttons.js";
import {coded, n, t} from "../kit/texts.js";
import {fixButtons} from "../code/fixes.js";
import {counterexamplePlayer, showStep} from "./counterexample.js";
import {showNoMarks} from "../data/marks.js";
import {placeOf, wordsFor} from "../data/places.js";
import {moveAmongRows, pathOf} from "../kit/rows.js";
import {judge, toTests, verdictOf} from "./verdict.js";

/** @type {[severity: Problem["severity"], counted: (count: number) => string][]} */
const COUNTED = [
  ["error", (count) => n("{count} Error", "{count} Errors", count)],
  ["warning", (count) => n("{count} Warning", "{count} Warnings", count)],
  ["note", (count) => n("{count} Note", "{count} Notes", count)],
];

/** The problems of names that are not known: what is said of a name is said once, with its places. */
const UNKNOWN = new Set(["W520", "W524"]);

/** More rows are usually repetitions; every state with a problem has its sign. */
const MOST = 1000;

class Problems extends PageElement {
  static properties = {played: {state: true}};
  #isWaiting = false;
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["tab", "verdict"], store: ["document", "problems", "fixes"]};

  constructor() {
    super();
    /** Severities that are left out. @type {Set<string>} */
    this.left = new Set();
    /** @type {Played | null} */
    this.played = null;
  }

  connectedCallback() {
    super.connectedCallback();
    this.listen(page, "tab", () => this.#play(null));
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    this.#play(null);
  }

  willUpdate() {
    const {played} = this;
    if (played && !page.document?.problems.some((each) => keyOf(each) === played.key)) this.#play(null);
  }

  /** Focus the first error, else the first problem, even if the checks are not complete yet. */
  focusFirst() {
    const {document} = page;
    const rows = /** @type {NodeListOf<HTMLElement>} */ (this.querySelectorAll("button.row"));
    const row = [...rows].find((each) => each.querySelector(".severity-sign.error")) ?? rows[0];
    this.#isWaiting = !!document && document.checked !== document.revision && !document.counts.error;
    if (row) row.focus();
    else /** @type {HTMLElement | null} */ (this.querySelector(".list-panel"))?.focus();
  }

  updated() {
    if (this.#isWaiting && this.contains(document.activeElement)) this.focusFirst();
  }

  render() {
    const {document} = page;
    if (!document) return html`<p class="empty">${t("No document is open.")}</p>`;
    const {problems} = document;
    const verdict = verdictOf();
    const shown = problems.filter((each) => !this.left.has(each.severity)).slice(0, MOST);
    const counts = COUNTED.map(([severity]) => (this.left.has(severity) ? 0 : (document.counts[severity] ?? 0)));
    /** Each once, below all that holds under it. */
    const assumptions = new Set(shown.flatMap(({assumes}) => assumes || []));
    const all = counts.reduce((sum, each) => sum + each);
    return html`<div class="list-panel" tabindex="-1">
      <div class="list-tools" role="group" aria-label=${t("Shown problems")}>
        ${COUNTED.map(([severity, counted]) => {
          const count = document.counts[severity] ?? 0;
          return html`<button
            type="button"
            class="filter ${severity}"
            aria-pressed=${!this.left.has(severity)}
            ?disabled=${!count}
            @click=${() => this.#toggle(severity)}
          >
            <span class="severity-sign ${severity}" aria-hidden="true"></span>${counted(count)}
          </button>`;
        })}${
          all > shown.length
            ? html`<span class="faint">${t("{count} of {all} are listed", {count: shown.length, all})}</span>`
            : nothing
        }<span class="room"></span>${
          document.checked !== undefined && document.proved !== document.revision
            ? html`<span class="faint" role="status">${t("Being checked…")}</span>`
            : nothing
        }<button
          type="button"
          class="button"
          title=${t("Check, run and test the saved document: is it ready for a robot?")}
          ?disabled=${verdict?.text === ""}
          @click=${() => judge(this.context.app)}
        >
          ${verdict?.text === "" ? t("Being tried…") : t("Is it ready?")}
        </button>
      </div>
      ${
        verdict?.text
          ? html`<p class="explain verdict ${verdict.kind}">
              <span class="dot" aria-hidden="true"></span><span>${coded(verdict.text)}</span>
              ${verdict.kind === "undecided" ? linkTo(toTests(this.context.app)) : nothing}
            </p>`
          : nothing
      }
      ${
        problems.length
          ? html`<ol class="rows" aria-label=${t("Problems")} @keydown=${moveAmongRows}>
                ${rowsOf(shown).map((each) => this.#row(document, each))}
              </ol>
              ${[...assumptions].map((each) => html`<p class="explain">${coded(each)}</p>`)}`
          : verdict?.kind === "violated"
            ? nothing
            : html`<p class="empty" role="status">${t("The checks found nothing wrong.")}</p>`
      }
    </div>`;
  }

  /** @param {OpenDocument} document @param {Problem[]} problems the same at several places */
  #row(document, [problem, ...others]) {
    const place = placeOf(problem);
    const key = keyOf(problem);
    const {played} = this;
    const {counterexample} = problem;
    const {steps = []} = counterexample ?? {};
    const notes = (problem.notes ?? []).filter((each) => !steps.length || !each.includes("\n"));
    return html`<li>
      <button type="button" class="row" @click=${() => this.#go(problem, place)}>
        <span
          class="severity-sign ${problem.severity}"
          role="img"
          aria-label="${SEVERITIES[problem.severity]}: "
        ></span>
        <span class="message">${coded(problem.message)}</span
        ><span class="code-name">${problem.code === FAILED ? t("last run") : problem.code}</span>
        ${pathOf(whereOf(document, problem))}
      </button>
      ${
        others.length
          ? html`<details class="more-places">
              <summary>${n("in {count} other place", "in {count} other places", others.length)}</summary>
              ${others.map((each) =>
                wordButton(whereOf(document, each).join(" › "), () => this.#go(each, placeOf(each)), {kind: "link"}),
              )}
            </details>`
          : nothing
      }
      ${
        notes.length
          ? html`<ul class="notes">
              ${notes.map((each) => html`<li>${coded(each)}</li>`)}
            </ul>`
          : nothing
      }
      ${fixButtons(document, [problem])}
      ${
        counterexample && steps.length
          ? played?.key === key
            ? counterexamplePlayer(counterexample, played.step, (step) =>
                this.#play(step === null ? null : {key, step}, steps),
              )
            : html`<button type="button" class="play" @click=${() => this.#play({key, step: 0}, steps)}>
                ${n("Play the step on the canvas", "Play the {count} steps on the canvas", steps.length)}
              </button>`
          : nothing
      }
    </li>`;
  }

  /** @param {string} severity */
  #toggle(severity) {
    if (!this.left.delete(severity)) this.left.add(severity);
    this.requestUpdate();
  }

  /** @param {Problem} problem @param {Place} place */
  async #go({file, source, owners: [owner] = [], line = 0, column = 1}, place) {
    if (file && owner) {
      page.jump(owner);
      const {openImport} = await import("../data/files.js");
      await openImport(file, source ?? undefined, line ? {line, column} : {});
      return;
    }
    page.jump(place, {line: line || 1, column: column || 1});
    if (place.id !== undefined && !place.part) page.dispatchEvent(new Event("focus-canvas"));
  }

  /** @param {Played | null} played @param {Step[]} steps */
  #play(played, steps = []) {
    this.played = played;
    if (played) showStep(page.shownDocument, steps, played.step);
    else showNoMarks();
  }
}

/** @param {{label: string, run: () => void}} link */
const linkTo = ({label, run}) => wordButton(label, run, {kind: "link"});

/** The problems of each row: one, or those of the same name. @param {Problem[]} problems */
function rowsOf(problems) {
  /** @type {Map<unknown, Problem[]>} */
  const rows = new Map();
  for (const each of problems) {
    const key = UNKNOWN.has(each.code) ? `${each.code} ${each.file ?? ""} ${each.message}` : each;
    const row = rows.get(key);
    if (row) row.push(each);
    else rows.set(key, [each]);
  }
  return [...rows.values()];
}

/** The place of a problem in words. @param {OpenDocument} document @param {Problem} problem */
function whereOf(document, problem) {
  const words = problem.file ? [problem.file, problem.where ?? ""] : wordsFor(document, placeOf(problem));
  if (!problem.where && problem.line) words.push(t("line {line}", {line: problem.line}));
  return words.filter(Boolean);
}

/** The key of a problem, which stays the same when the checks run again. @param {Problem} problem */
const keyOf = (problem) => `${problem.code} ${JSON.stringify(placeOf(problem))} ${problem.line} ${problem.message}`;

customElements.define("hfsm-problems", Problems);
