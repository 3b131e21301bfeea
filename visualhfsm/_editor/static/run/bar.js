/**
 * Run, pause, step, stop and reload, what the followed component does, and STOP.
 *
 * @import {From} from "../data/element.js"
 * @import {AutomatonSnapshot, Breakpoint} from "../data/protocol.js"
 */

import {html, nothing} from "lit";

import {RUN_MENU} from "./actions.js";
import {icon} from "../kit/icons.js";
import {keyOf, spoken} from "../kit/keys.js";
import {page} from "../data/page.js";
import {isEnabled, perform} from "../kit/registry.js";
import {viewing} from "../kit/viewers.js";
import {lackingOf, needsRobot} from "../data/robot.js";
import {started, spokenEnd} from "../data/component-status.js";
import {coded, n, t, spokenSeconds} from "../kit/texts.js";
import {actionButton, menuButton} from "../kit/buttons.js";
import {store} from "../data/store.js";
import {clockTime, MonitorElement} from "./element.js";
import {monitor, spokenStatus, STATUS} from "./monitor.js";
import {STOP_KEY} from "./stop.js";

const PAUSED = STATUS.indexOf("paused");

/** Places where users write and must not be moved elsewhere. */
const WRITING = "hfsm-code-panel, hfsm-data-panel, dialog";

class MonitorBar extends MonitorElement {
  /** @type {typeof MonitorElement.kinds} */
  static kinds = ["shown", "mode", "structure", "present"];
  /** @type {typeof MonitorElement.watches} */
  static watches = {page: ["change"], store: ["connection", "document", "problems", "robot", "started", "workspace"]};

  /** The breakpoints at which it paused last. */
  #stop = "";
  /** The cycle that hangs, and where it was first seen to: a loop has several lines. */
  #hang = {cycle: "", location: "", line: 0};

  connectedCallback() {
    super.connectedCallback();
    this.listen(monitor, "snapshot", () => {
      this.#arrive();
      this.#findLine();
    });
  }

  render() {
    const paused = monitor.isLive && !monitor.ended && monitor.newest?.component.status === PAUSED;
    return html`<div class="live-bar">
      <div class="controls">
        ${
          viewing.on
            ? nothing
            : html`<div role="group" aria-label=${t("Run and control")}>
                ${actionButton("run", this.context, {label: "short", kind: "primary"})}
                ${menuButton(t("Other ways to run"), "chevron", this.#more)}
                ${this.#button("pauseResume", paused ? {image: "resume", words: t("Resume")} : {words: t("Pause")})}
                ${["stepOne", "stop"].map((id) => this.#button(id))}${this.#reload()}${this.#record()}
              </div>`
        }
        ${monitor.isShownBeside(page.tab) ? this.#followed() : this.#ended()}
      </div>
    </div>`;
  }

  /** The state of the followed component, and further actions on it. */
  #followed() {
    const {status, word, why} = statusOf();
    const {recording, writable, looking} = monitor;
    return html`${spokenWhole(status, word, monitor.ended && monitor.isOver ? t("Ended at {time}", {time: clockTime(monitor.ended.at)}) : why)}
      ${monitor.isOver ? failureLink(failedRun()) : nothing}
      <strong class="component" title=${monitor.recording?.file || monitor.component}
        >${monitor.component.replace(/^recording:\d+:/, "")}</strong
      >
      <span class="time" title=${t("Time of the behavior")}>${spokenSeconds(monitor.time ?? NaN)}</span>
      ${this.#stoppedAt()}${this.#hanging()}${this.#late()}${this.#elsewhere()}
      ${
        recording || viewing.on || monitor.isOver
          ? nothing
          : html`<button
              type="button"
              class="switch"
              role="switch"
              aria-checked=${writable}
              title=${t("Whether this window may control the behavior ({key})", {key: keyOf("steering")})}
              ?disabled=${!isEnabled("steering", this.context)}
              @click=${() => perform("steering", this.context)}
            >
              <span class="knob" aria-hidden="true"></span>${writable ? t("In control") : t("Only watching")}
            </button>`
      }
      ${
        looking && !recording
          ? html`<button type="button" class="button" @click=${() => perform("backToLive", this.context)}>
              ${t("Back to now")}
            </button>`
          : nothing
      }
      ${this.#button("livePanel")}`;
  }

  /** How the run of the shown document has ended if it was too short to be followed. */
  #ended() {
    const run = started.of(page.tab);
    if (run?.status !== "ended" || !run.place) return nothing;
    const failed = started.failed(page.tab);
    return html`${spokenWhole(failed ? "failed" : "ended", spokenEnd(started.endOf(run)))} ${failureLink(failed)}<strong
        class="component"
        >${run.component}</strong
      >`;
  }

  /** The button that reloads the component; it has a label when the document has changed. */
  #reload() {
    const changed = page.tabState?.changed && isEnabled("reload", this.context);
    return changed
      ? actionButton("reload", this.context, {label: "short", kind: "changed", words: t("Changed: reload")})
      : this.#button("reload");
  }

  /** The button that begins and ends a recording; it shows the time of a running one. */
  #record() {
    const {recordedSince: since, newest} = monitor;
    if (!since) return this.#button("record");
    const seconds = Math.max(0, Math.floor((newest?.at ?? since) - since));
    const end = t("End the recording");
    return html`<button
      type="button"
      class="action records"
      data-action="record"
      aria-label=${end}
      title="${end} (${keyOf("record")})"
      @click=${() => perform("record", this.context)}
    >
      ${icon("record")}<span class="elapsed">${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}</span>
    </button>`;
  }

  /** A link to the breakpoint at which it paused. */
  #stoppedAt() {
    const {stoppedAt = []} = monitor.snapshot?.component ?? {};
    const [first] = stoppedAt;
    if (!first) return nothing;
    const {automaton, state, transition} = first;
    const name = state
      ? t("State {name}", {name: monitor.stateName(automaton, state)})
      : t("Transition {name}", {name: monitor.transition(automaton, transition)?.name || transition});
    const more = stoppedAt.length - 1;
    return html`<button type="button" class="link" title=${t("Show where it paused")} @click=${() => this.#goTo(first)}>
      ${more ? n("{name} and {count} more", "{name} and {count} more", more, {name}) : name}
    </button>`;
  }

  /** A link to the code that does not end. */
  #hanging() {
    const {hanging} = monitor;
    if (!hanging) return nothing;
    const {id: automaton, state} = hanging;
    const {location, line} = this.#hang;
    return html`<button
      type="button"
      class="link"
      title=${t("Show the code that does not end")}
      @click=${() => this.#show({automaton, state, location})}
    >
      ${
        line
          ? t("in {state}, line {line}", {state: monitor.stateName(automaton, state), line})
          : t("in {state}", {state: monitor.stateName(automaton, state)})
      }
    </button>`;
  }

  /** Show the code of a state. @param {import("./failing-code.js").Failing} report */
  async #show(report) {
    (await import("./failing-code.js")).show(report);
  }

  /** A link to the state whose cycles take too long. */
  #late() {
    const {late} = monitor;
    if (!late) return nothing;
    const {id: automaton, state} = late;
    const place = {automaton, state, location: ""};
    return html`<button type="button" class="link" title=${t("Show its code")} @click=${() => this.#show(place)}>
      ${t("in {state}", {state: monitor.stateName(automaton, state)})}
    </button>`;
  }

  /** Look up the line of code that does not end, once for each cycle that hangs. */
  async #findLine() {
    const {hanging} = monitor;
    if (!hanging) return;
    const {id: automaton, state, cycles, hangsAt: location} = hanging;
    const cycle = `${automaton}.${cycles}`;
    if (cycle === this.#hang.cycle) return;
    const hang = (this.#hang = {cycle, location, line: 0});
    const {find} = await import("./failing-code.js");
    hang.line = (await find({automaton, state, location}))?.line ?? 0;
    this.requestUpdate();
  }

  /** Show a breakpoint, if its document is open. @param {Breakpoint} place */
  #goTo({automaton, state, transition}) {
    const {tab} = monitor;
    if (!store.documents.get(tab)?.automata.has(automaton)) return;
    page.show(tab);
    page.jump({kind: state ? "state" : "transition", automaton, id: state || transition});
  }

  /** Show where the component has just paused, unless the user is writing. */
  #arrive() {
    const {stoppedAt = [], startedAt} = monitor.newest?.component ?? {};
    const [first] = stoppedAt;
    const stop = first ? JSON.stringify([startedAt, stoppedAt]) : "";
    if (stop === this.#stop) return;
    this.#stop = stop;
    if (first && monitor.isLive && !document.activeElement?.closest(WRITING)) this.#goTo(first);
  }

  /** @param {MouseEvent & From<HTMLElement>} event */
  #more = async ({currentTarget}) => {
    (await import("../shell/menu.js")).dropMenu(currentTarget, {groups: RUN_MENU, label: t("Run")}, this.context);
  };

  /** @param {string} id @param {{words?: string, image?: string}} [other] */
  #button(id, other = {}) {
    return actionButton(id, this.context, {label: false, ...other});
  }

  /** A link to the component's document, unless that is shown. */
  #elsewhere() {
    const {tab} = monitor;
    if (tab && tab === page.tab) return nothing;
    if (tab)
      return html`<button type="button" class="link" @click=${() => page.show(tab)}>
        ${t("Show {document}", {document: store.workspace.tabs.find((each) => each.tab === tab)?.title})}
      </button>`;
    if (!monitor.structure) return nothing;
    return html`<button type="button" class="link" @click=${() => this.context.app.openFollowed()}>
      ${t("Open {file}", {file: monitor.structure.document || t("its document")})}
    </button>`;
  }
}

/** How it is, as much of it as there is room for, and the rest by a click. @param {string} kind @param {string} word */
const spokenWhole = (kind, word, why = "") =>
  html`<button type="button" class="live-status ${kind}" title=${`${word}\n${why}`} popovertarget="status-words">
      <span class="sign" aria-hidden="true"></span>${coded(word)}
    </button>
    <div id="status-words" class="status-words" popover><strong>${coded(word)}</strong> ${coded(`\n${why}`)}</div>`;

/** The operator's button. @param {import("../kit/registry.js").Context} context */
export const stopButton = (context) =>
  html`<button
    type="button"
    class="stop-button"
    aria-label=${t("STOP the robot and all that runs")}
    aria-keyshortcuts="Control+Shift+Space"
    title=${t("Stop the robot and all that runs at once ({key})", {key: spoken(STOP_KEY)})}
    @click=${() => perform("stopRobot", context)}
  >
    STOP
  </button>`;

/** @returns {{status: string, word: string, spoken?: string, why?: string}} its style, its name, and details */
export function statusOf() {
  const {since, newest, recording, looking} = monitor;
  if (recording)
    return {status: "recording", word: recording.shortened ? t("Recording, its beginning") : t("Recording")};
  if (!store.online) return {status: "stale", word: t("The editor is offline")};
  if (monitor.ended && monitor.isOver)
    return {status: failedRun() ? "failed" : "ended", word: spokenEnd(monitor.ended.message)};
  if (isStopping()) return {status: "waiting", word: t("Stopping…")};
  if (since && !monitor.ended)
    return {
      status: "stale",
      word: monitor.present.includes(monitor.component)
        ? t("Silent since {time}", {time: clockTime(since)})
        : t("Gone since {time}", {time: clockTime(since)}),
    };
  if (looking) return {status: "past", word: t("Looking back")};
  const robot = store.robot.status;
  if (robot === "lost" && usesRobot() !== false && !monitor.isDryRun)
    return {
      status: "lost",
      word: t("Robot lost since {time}", {time: clockTime(store.robot.since)}),
      why: t("It may come back."),
    };
  if (!newest) return {status: "waiting", word: isStartedHere() ? t("Starting") : t("Waiting")};
  const {hanging} = monitor;
  if (hanging) {
    const name = monitor.automaton(hanging.id)?.name ?? t("automaton {id}", {id: hanging.id});
    return {
      status: "hanging",
      word: t("Hanging for {seconds} s", {seconds: Math.floor(hanging.hangsFor)}),
      spoken: t("Hanging"),
      why: t("A cycle of {name} does not end: its code must not wait or repeat for so long. Stop ends it.", {name}),
    };
  }
  const {status, stoppedAt, refusal, speed} = newest.component;
  const {late} = monitor;
  if (status === 0 && late) return {status: "late", word: t("Running late"), why: spokenDelay(late)};
  if (status === 0 && speed)
    return {status: "running", word: t("Trying, {speed} x", {speed}), why: t("No robot moves.")};
  if (status === 0 && robot !== "present" && usesRobot())
    return {status: "lost", word: t("Running, no robot"), why: t("Start a robot in the header.")};
  const lacks = monitor.isDryRun ? [] : lackingOf(store.documents.get(monitor.tab)?.fields.interfaces ?? []);
  if (status === 0 && lacks.length)
    return {
      status: "lost",
      word: t("Running, parts missing"),
      why: t("This robot has no {names}.", {names: lacks.join(", ")}),
    };
  if (refusal) return {status: "paused", word: t("Paused: command refused"), why: refusal};
  const word = status === 1 && stoppedAt.length ? t("At a breakpoint") : spokenStatus(status);
  const goesOn = status === PAUSED && robot === "present" && !monitor.isDryRun;
  return {status: STATUS[status], word, why: goesOn ? t("The robot and its world go on.") : ""};
}

/** Whether the editor has started the followed component. */
function isStartedHere() {
  return started.of(monitor.tab)?.component === monitor.component;
}

/** Whether the editor is stopping the followed component, which it has started. */
function isStopping() {
  return isStartedHere() && started.of(monitor.tab)?.status === "stopping";
}

/** Whether the followed component uses a robot; undefined when its document is not open. */
function usesRobot() {
  const document = store.documents.get(monitor.tab);
  return document && needsRobot(document.fields);
}

/** By how much an automaton is late. @param {AutomatonSnapshot} late */
function spokenDelay({id, lastCycle}) {
  const {name = t("automaton {id}", {id}), period = 0} = monitor.automaton(id) ?? {};
  const [takes, has] = [lastCycle, period].map((seconds) => `${Math.round(seconds * 1000)} ms`);
  return t("A cycle of {name} takes {takes}, and its period is {has}: its times do not hold.", {name, takes, has});
}

/** The run that the followed component has ended with an error, unless the code has changed since. */
function failedRun() {
  return isStartedHere() ? started.failed(monitor.tab) : undefined;
}

/** A link to where a run has failed. @param {import("../data/protocol.js").StartedPush | undefined} run */
function failureLink(run) {
  if (!run) return nothing;
  return html`<button type="button" class="link" title=${t("Show what failed")} @click=${() => started.showEnd(run)}>
    ${run.line ? t("line {line}", {line: run.line}) : t("show it")}
  </button>`;
}

customElements.define("hfsm-monitor-bar", MonitorBar);
