/**
 * The tests of the shown document, beside it: run by pytest, with what they passed on the canvas.
 *
 * @import {TestView, TestsPush} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @import {Gap} from "../data/covered.js"
 */

import {html, nothing} from "lit";

import {ask} from "../data/commands.js";
import {PageElement} from "../data/element.js";
import {icon} from "../kit/icons.js";
import {wordButton} from "../kit/buttons.js";
import {tickBox} from "../kit/tick-box.js";
import {monitor} from "../run/monitor.js";
import {messageOf} from "../kit/notices.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {decimal, n, t} from "../kit/texts.js";
import {covered, gapsIn, highlightOf, summary} from "../data/covered.js";
import {showMarks, showNoMarks, showTested} from "../data/marks.js";
import {wordsFor} from "../data/places.js";
import {moveAmongRows, pathOf} from "../kit/rows.js";

const MOST_GAPS = 300; // that are listed
/** @type {Record<string, string>} */
const OUTCOMES = {passed: t("passed"), failed: t("failed"), skipped: t("skipped")};

class TestsPanel extends PageElement {
  static properties = {refusal: {state: true}, marks: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["tab"], store: ["document", "tests", "connection", "workspace"]};

  constructor() {
    super();
    /** Why there are no tests of this document. */
    this.refusal = "";
    /** Whether what they passed is shown on the canvas, and beside the code. */
    this.marks = true;
  }

  connectedCallback() {
    super.connectedCallback();
    this.listen(page, "tab", () => this.#look());
    this.listen(monitor, "mode", () => this.requestUpdate());
    this.listen(store, "connection", () => store.online && this.#look());
    this.listen(store, "tests", ({detail}) => detail.tab === page.tab && (this.refusal = "")); // saved meanwhile
    this.#look();
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    showNoMarks();
    showTested();
  }

  focusFirst() {
    /** @type {HTMLElement | null} */ (this.querySelector("button"))?.focus();
  }

  updated() {
    const tests = store.tests.get(page.tab);
    const runs = monitor.component && monitor.tab === page.tab; // what runs is shown instead
    if (this.marks && !runs && tests?.passed.length) showMarks(highlightOf(tests.passed));
    else showNoMarks();
    showTested(this.marks && tests?.code.length ? {tab: page.tab, code: tests.code} : undefined);
  }

  render() {
    const {document, tabState} = page;
    if (!document || !tabState) return html`<p class="empty">${t("No document is open.")}</p>`;
    if (tabState.recording) return html`<p class="empty">${t("A recording has no tests: open its document.")}</p>`;
    if (this.refusal) return html`<p class="empty">${this.refusal}.</p>`;
    const tests = store.tests.get(page.tab);
    if (!tests) return html`<p class="empty" role="status">${t("The tests are being looked for…")}</p>`;
    const running = tests.status !== "idle";
    return html`<div class="list-panel">
      <div class="list-tools">
        ${
          running
            ? wordButton(t("Stop"), () => ask("stopTests", {tab: page.tab}), {disabled: tests.status === "stopping"})
            : wordButton(tabState.dirty ? t("Save and run all tests") : t("Run all tests"), () => this.#run([]), {
                disabled: !tests.tests.length || !store.online,
              })
        }
        <span role="status">${running ? t("Tests run…") : summary(tests.tests)}</span>
        <span class="room"></span>
        ${
          tests.passed.length
            ? html`<span class="faint">${covered(document, tests.passed, tests.code)}</span>`
            : nothing
        }
        ${tickBox(t("On canvas and code"), this.marks, ({target}) => (this.marks = target.checked), {
          title: t("Mark what tests passed on the canvas, and beside lines of code"),
        })}
      </div>
      ${
        tests.outdated && tests.passed.length
          ? html`<p class="panel-note">${t("The document has changed since these tests ran.")}</p>`
          : nothing
      }
      ${tests.error ? html`<pre class="panel-error" role="alert">${tests.error}</pre>` : nothing}
      ${
        tests.tests.length
          ? html`<div class="tests-scroll">${this.#list(tests, running)} ${this.#gaps(document, tests)}</div>`
          : this.#none()
      }
    </div>`;
  }

  /** What they have not passed. @param {OpenDocument} document @param {TestsPush} tests */
  #gaps(document, tests) {
    if (!tests.passed.length) return nothing;
    const gaps = gapsIn(document, tests.passed, tests.code);
    return html`<section aria-labelledby="gaps-title">
      <h3 id="gaps-title" class="gaps-title">
        ${gaps.length ? t("Not passed yet") : t("Everything was passed")}
        ${
          tests.code.length
            ? html`<span class="tests-legend">
                <span class="tested-sign passed"></span> ${t("line passed")}
                <span class="tested-sign missed"></span> ${t("not passed")}
                <span class="tested-sign failed">×</span> ${t("a test failed here")}
              </span>`
            : nothing
        }
      </h3>
      ${tests.unmeasured ? html`<p class="panel-note">${t("Lines were not measured: {unmeasured}.", {unmeasured: tests.unmeasured})}</p>` : nothing}
      <ol class="rows" aria-label=${t("Not passed yet")} @keydown=${moveAmongRows}>
        ${gaps.slice(0, MOST_GAPS).map((gap) => gapRow(document, gap))}
      </ol>
      ${gaps.length > MOST_GAPS ? html`<p class="empty">${n("{count} more is not listed.", "{count} more are not listed.", gaps.length - MOST_GAPS)}</p>` : nothing}
    </section>`;
  }

  /** @param {TestsPush} tests @param {boolean} running */
  #list(tests, running) {
    return html`<ol class="rows tests" aria-label=${t("Tests")}>
      ${tests.tests.map((test) => this.#row(test, running))}
    </ol>`;
  }

  /** @param {TestView} test @param {boolean} running */
  #row({name, file, outcome, seconds, reason, timeline}, running) {
    const waits = running && !outcome;
    return html`<li class="test ${outcome}">
      <div class="row">
        <span
          class="test-sign ${outcome}"
          role="img"
          aria-label=${OUTCOMES[outcome] ?? (waits ? t("waits") : t("not run yet"))}
        ></span>
        <span class="message">${words(name)}</span>
        <span class="where">${file}${outcome ? `, ${decimal(seconds, 1)} s` : ""}</span>
        ${wordButton(icon("run"), () => this.#run([`${file}::${name}`]), {
          kind: "link",
          label: t("Run {name}", {name: words(name)}),
          title: t("Run this test"),
          disabled: running || !store.online,
        })}
      </div>
      ${reason ? html`<pre class="test-reason">${reason}</pre>` : nothing}
      ${
        timeline
          ? html`<details class="test-timeline">
              <summary>${t("What happened")}</summary>
              <pre>${timeline}</pre>
            </details>`
          : nothing
      }
    </li>`;
  }

  #none() {
    const name = page.tabState?.path.replace(/^.*\//, "") ?? "";
    return html`<div class="empty">
      <p>
        ${t("No test names {name} yet. Write a file whose name begins with test_, beside the document or in a folder tests.", {name})}
      </p>
    </div>`;
  }

  /** Run tests of the document as it is shown. @param {string[]} names */
  async #run(names) {
    const {tab} = page;
    if (page.tabState?.dirty && !(await (await import("../data/files.js")).save(tab))) return;
    await ask("startTests", {tab, names});
  }

  async #look() {
    const {tab, tabState} = page;
    this.refusal = "";
    if (!tab || !tabState || tabState.recording || !store.online) return;
    try {
      await store.request("lookAtTests", {tab});
    } catch (error) {
      if (tab === page.tab && store.online) this.refusal = messageOf(error);
    }
  }
}

/** @param {OpenDocument} document @param {Gap} gap */
function gapRow(document, {place, line, what, failed}) {
  const path = wordsFor(document, place);
  const isElement = place.kind !== "automaton";
  const name = wordsFor(document, isElement ? {...place, part: ""} : place).at(-1);
  const where = [...(isElement ? path : path.slice(0, -1)), ...(line ? [t("line {line}", {line})] : [])];
  return html`<li>
    <button type="button" class="row" @click=${() => page.jump(place, line ? {line, column: 1} : {})}>
      <span
        class="test-sign ${failed ? "failed" : ""}"
        role="img"
        aria-label=${failed ? t("failed: ") : t("not passed: ")}
      ></span>
      <span class="message"><strong>${name}</strong> ${what}</span>
      ${pathOf(where)}
    </button>
  </li>`;
}

/** The name of a test as a sentence. @param {string} name */
function words(name) {
  const [plain, parameters = ""] = name.split("[", 2);
  const text = plain
    .replace(/^test_/, "")
    .replaceAll("::", ": ")
    .replaceAll("_", " ");
  return parameters ? `${text} (${parameters.replace(/\]$/, "")})` : text;
}

customElements.define("hfsm-tests-panel", TestsPanel);
