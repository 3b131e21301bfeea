/**
 * The trials of the shown document: what varies, what counts, and what they say while they run.
 *
 * @import {From} from "visualhfsm/data/element.js"
 * @import {ViewPush} from "visualhfsm/data/protocol.js"
 * @import {Fact, PlanFacts, TrialsPush} from "./messages.js"
 * @import {Draft, Robot} from "./asking.js"
 */

import {html, nothing} from "lit";

import {ask} from "visualhfsm/data/commands.js";
import {PageElement} from "visualhfsm/data/element.js";
import {icon} from "visualhfsm/kit/icons.js";
import {messageOf} from "visualhfsm/kit/notices.js";
import {page} from "visualhfsm/data/page.js";
import {chosenBody} from "visualhfsm/data/robot.js";
import {store} from "visualhfsm/data/store.js";
import {offers, wordButton} from "visualhfsm/kit/buttons.js";
import {n, t} from "visualhfsm/kit/texts.js";
import {addStyles} from "visualhfsm/kit/theme.js";
import {monitor} from "visualhfsm/run/monitor.js";
import {MOST_RUNS, duration, endings, requestOf, statePaths, verbOf} from "./asking.js";
import "./trials-view.js";
import {showMarks, showNoMarks} from "visualhfsm/data/marks.js";

await addStyles(new URL("./trials.css", import.meta.url));

/** The trials of the shown document, as far as any were asked for. */
const shownTrials = () => /** @type {TrialsPush | undefined} */ (store.views.get(page.tab)?.get("trials"));

const FIRST_RUNS = 10; // that are offered

/** @type {[Robot, string][]} */
const ROBOTS = [
  ["sim", t("simulated")],
  ["fake", t("without physics")],
  ["none", t("none")],
];

class TrialsPanel extends PageElement {
  static properties = {draft: {state: true}, refusal: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["tab"], store: ["document", "view", "connection"]};

  constructor() {
    super();
    /** What the user has changed, and the trials do not have yet. @type {Draft} */
    this.draft = {};
    /** Why the plan of this document cannot be read. */
    this.refusal = "";
    /** The trial whose run this window is to show. @type {number | undefined} */
    this.wanted = undefined;
    /** The tab whose trial was looked at last. */
    this.origin = 0;
  }

  #body = ""; // of the robot that is chosen in the page

  connectedCallback() {
    super.connectedCallback();
    this.listen(page, "tab", () => this.#turn());
    this.listen(store, "connection", () => store.online && this.#look());
    this.listen(store, "robot", () => this.#body !== chosenBody() && this.#look());
    this.listen(store, "view", ({detail}) => detail.name === "trials" && this.#take(detail));
    this.listen(store, "workspace", () => this.refusal && this.#look());
    this.listen(/** @type {import("visualhfsm/kit/events.js").Target<{focus: null}>} */ (window), "focus", () => this.#look());
    this.listen(monitor, "mode", () => this.requestUpdate());
    this.#turn();
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    showNoMarks();
  }

  updated() {
    const trials = shownTrials();
    const runs = monitor.component && monitor.tab === page.tab; // what runs is shown instead
    if (!runs && !trials?.outdated && trials?.view?.ways.length) showMarks(endings(page.document, trials.view.ways));
    else showNoMarks();
  }

  focusFirst() {
    /** @type {HTMLElement | null} */ (this.querySelector("input, button"))?.focus();
  }

  render() {
    const trials = shownTrials();
    if (!page.document) return html`<p class="empty">${t("No document is open.")}</p>`;
    if (page.tabState?.recording) return this.#inRecording();
    if (this.refusal)
      return html`<div class="empty">
        <p>${this.refusal}.</p>
        ${page.tabState?.path ? nothing : offers({save: t("Save")}, this.context)}
      </div>`;
    if (!trials?.plan)
      return trials?.error
        ? html`<pre class="panel-error" role="alert">${trials.error}</pre>`
        : html`<p class="empty" role="status">${t("The plan is being read…")}</p>`;
    return html`<div class="trials-panel">
      <div class="trials-setup">${this.#setup(trials, trials.plan)}</div>
      <div class="trials-results ${trials.outdated ? "outdated" : ""}" tabindex="-1">
        ${this.#notes(trials)} ${trials.view ? nothing : this.#first()}
        <hfsm-trials
          ?hidden=${!trials.view}
          .view=${trials.view}
          .opens=${store.online && trials.opens}
          .busy=${trials.recording !== null}
          @trial=${(/** @type {CustomEvent<number>} */ {detail}) => this.#show(detail)}
        ></hfsm-trials>
      </div>
    </div>`;
  }

  /** What is shown below a recording: the way back, if it is that of a trial. */
  #inRecording() {
    const origin = store.workspace.tabs.find(({tab}) => tab === this.origin);
    return html`<div class="empty">
      <p>${t("A recording contains this document. Save a copy to run trials of it.")}</p>
      ${
        origin
          ? html`<div class="offers">
              ${this.#button("trials", t("Back to the trials of {title}", {title: origin.title}), () => page.show(origin.tab))}
            </div>`
          : nothing
      }
    </div>`;
  }

  /** @param {TrialsPush} trials @param {PlanFacts} plan */
  #setup(trials, plan) {
    const running = trials.status === "running" || trials.status === "stopping";
    return html`<form @submit=${this.#submit}>
        <label class="trials-runs"
          >${t("Trials")}
          <input
            type="number"
            name="runs"
            min="1"
            max=${MOST_RUNS}
            required
            .value=${String(this.draft.runs ?? plan.runs)}
            ?disabled=${running}
            @input=${this.#input}
        /></label>
        ${plan.file ? nothing : this.#choices(plan, running)}
        ${
          running
            ? this.#button("stop", t("Stop"), () => ask("stopTrials", {tab: page.tab}), trials.status === "stopping")
            : html`<button type="submit" class="action primary" ?disabled=${!store.online}>
                ${icon("run")}<span class="text">${verbOf(trials, this.draft)}</span>
              </button>`
        }
      </form>
      ${progress(trials)} ${facts(t("What varies"), plan.varies)} ${facts(t("What happens"), plan.happens)}
      ${this.#counting(plan)} ${facts(t("What stays"), plan.fixed)}
      <p class="faint">
        ${plan.file ? t("By the plan {file}, seed {seed}.", {file: plan.file, seed: plan.seed}) : howToPlan()}
      </p>`;
  }

  /** Where there is no plan, what a pupil wants to choose. @param {PlanFacts} plan @param {boolean} running */
  #choices(plan, running) {
    const {state = plan.state, robot = /** @type {Robot} */ (plan.robot), limit = plan.limit} = this.draft;
    return html`<label
        >${t("Reach")}
        <select name="state" ?disabled=${running} @change=${this.#input}>
          <option value="" .selected=${!state}>${t("no particular state")}</option>
          ${statePaths(page.document).map((path) => html`<option value=${path} .selected=${path === state}>${path}</option>`)}
        </select></label
      ><label
        >${t("Within (s)")}
        <input
          type="number"
          name="limit"
          min="0.1"
          max="86400"
          step="any"
          required
          .value=${String(limit)}
          ?disabled=${running}
          @input=${this.#input} /></label
      ><label
        >${t("Robot")}
        <select name="robot" ?disabled=${running} @change=${this.#input}>
          ${ROBOTS.map(([value, words]) => html`<option value=${value} .selected=${value === robot}>${words}</option>`)}
        </select></label
      >`;
  }

  /** @param {PlanFacts} plan */
  #counting(plan) {
    const {state, limit, counts, measures, file} = plan;
    const goal = state
      ? [t("reaches {state} within {limit} s", {state, limit})]
      : [t("runs for {limit} s without an error", {limit})];
    const all = [...(file ? goal : []), ...counts];
    return html`${
      all.length
        ? html`<h3>${t("It succeeds when")}</h3>
            <ul>
              ${all.map((words) => html`<li>${words}</li>`)}
            </ul>`
        : nothing
    }${
      measures.length
        ? html`<h3>${t("What is measured")}</h3>
            <p>${measures.join(", ")}</p>`
        : nothing
    }`;
  }

  /** @param {TrialsPush} trials */
  #notes({error, outdated, status, recording, view}) {
    const older = view?.share.trials && outdated;
    return html`${error ? html`<pre class="panel-error" role="alert">${error}</pre>` : nothing}${
      older
        ? html`<p class="panel-note">
            ${
              status === "running"
                ? t("The document has changed since: its older version runs here.")
                : t("These are of an older version of the document or of a file beside it, or of another robot.")
            }
          </p>`
        : nothing
    }${
      recording === null
        ? nothing
        : html`<p class="panel-note coming" role="status">
            ${t("Trial {number} runs again and is recorded…", {number: recording})}
            ${
              status === "idle"
                ? html`<button type="button" class="link" @click=${() => ask("stopTrials", {tab: page.tab})}>
                    ${t("Stop")}
                  </button>`
                : nothing
            }
          </p>`
    }`;
  }

  /** @param {Event & From<HTMLInputElement | HTMLSelectElement>} event */
  #input = ({target: {name, value, type}}) => {
    this.draft = {...this.draft, [name]: type === "number" ? Number(value) : value};
  };

  /** @param {SubmitEvent} event */
  #submit = (event) => {
    event.preventDefault();
    this.#run();
  };

  /** What is offered before the first trial. */
  #first() {
    const words = n("Run {count} trial", "Run {count} trials", FIRST_RUNS);
    return html`<div class="empty">
      <p>${t("There are no trials yet.")}</p>
      <div class="offers">
        ${this.#button("run", words, () => this.#run({...this.draft, runs: FIRST_RUNS}), !store.online)}
      </div>
    </div>`;
  }

  /** @param {string} image @param {string} words @param {() => unknown} act */
  #button(image, words, act, disabled = false) {
    return wordButton(html`${icon(image)}<span class="text">${words}</span>`, act, {kind: "action", disabled});
  }

  async #run(draft = this.draft) {
    const trials = shownTrials();
    if (!trials?.plan) return;
    if (
      (await ask("startTrials", {tab: page.tab, body: this.#body, ...requestOf(trials, trials.plan, draft)})) !==
      undefined
    )
      this.draft = {};
  }

  /** Show another document. */
  #turn() {
    this.draft = {};
    this.refusal = "";
    this.#look();
  }

  /** Ask for the plan and what the trials say; both may have changed. */
  async #look() {
    const {tab, tabState} = page;
    if (!tab || !tabState || tabState.recording || !store.online) return;
    try {
      this.#body = chosenBody();
      await store.request("lookAtTrials", {tab, body: this.#body});
      if (tab === page.tab) this.refusal = "";
    } catch (error) {
      if (tab === page.tab && store.online) this.refusal = upperFirst(messageOf(error));
    }
  }

  /** Run a trial again, to look back at it. @param {number} number */
  async #show(number) {
    this.origin = page.tab;
    if ((await ask("recordTrial", {tab: page.tab, number})) !== undefined) this.wanted = number;
  }

  /** @param {ViewPush} push */
  async #take(push) {
    const {tab, recorded, file, recording} = /** @type {TrialsPush} */ (push);
    const {wanted} = this;
    if (wanted === undefined || recording !== null || tab !== this.origin) return;
    this.wanted = undefined;
    if (recorded === wanted) await (await import("visualhfsm/run/documents.js")).play(file);
  }
}

/** How many are done, and how long the others take. @param {TrialsPush} trials */
function progress({status, view, left, plan, workers}) {
  if (status === "reading" || status === "idle" || !plan) return nothing;
  const done = view?.share.trials ?? 0;
  const at = workers > 1 ? t("{count} at a time", {count: workers}) : "";
  const now = left === null ? t("starting") : t("{time} left", {time: duration(left)});
  const words = status === "stopping" ? t("stopping") : [now, at].filter(Boolean).join(", ");
  return html`<div class="trials-progress">
    <progress max=${plan.runs} value=${done} aria-label=${t("Trials that have ended")}></progress>
    <p class="between" role="status">
      <span>${t("{done} of {runs}", {done, runs: plan.runs})}</span><span>${words}</span>
    </p>
  </div>`;
}

/** @param {string} title @param {Fact[]} list */
function facts(title, list) {
  if (!list.length) return nothing;
  return html`<h3>${title}</h3>
    <dl>
      ${list.map(
        ({name, words}) =>
          html`<div>
            <dt>${name}</dt>
            <dd>${words}</dd>
          </div>`,
      )}
    </dl>`;
}

function howToPlan() {
  const name = page.tabState?.path.replace(/^.*\//, "").replace(/\.xml$/i, "") ?? "";
  return t(
    "Nothing varies yet. A file {name}.trials.toml beside the document says what does: places, light, noise, pushes, parameters.",
    {name},
  );
}

/** @param {string} text */
const upperFirst = (text) => text.charAt(0).toUpperCase() + text.slice(1);

customElements.define("hfsm-trials-panel", TrialsPanel);
