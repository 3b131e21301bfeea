/**
 * Starts components, and shows what they write until they are followed.
 *
 * @import {HfsmApp} from "./app.js"
 */

import {askBy, askTab} from "../data/commands.js";
import {page} from "../data/page.js";
import {chosenBody, isReadyFor} from "../data/robot.js";
import {started} from "../data/component-status.js";
import {store} from "../data/store.js";
import {notify} from "../kit/notices.js";
import {t} from "../kit/texts.js";
import {holdKeys} from "../kit/waiting-keys.js";
import {monitor} from "../run/monitor.js";

export class Runs {
  #app;
  /** The tab with a run that is not followed yet: what it writes is shown. */
  starting = -1;

  /** @param {HfsmApp} app */
  constructor(app) {
    this.#app = app;
  }

  /** Write the component; returns undefined when that was not possible. */
  async generate({quiet = false} = {}) {
    const done = await askTab("generate");
    if (!done) this.#showErrors();
    else if (!quiet) notify(t("Generated {path}.", {path: done.path}));
    return done;
  }

  /**
   * Start the component of the shown tab, and follow it; `options` are those of its command line. A `dryRun` needs no
   * robot.
   *
   * @param {string[]} options
   */
  async start(options = [], {record = false, dryRun = false} = {}) {
    const {tab, document: shown} = page;
    if (!shown) return;
    const serves = !options.length && !record && !dryRun;
    const may = await holdKeys(async () => (await import("./before-run.js")).mayRun(tab, this.#app.context, serves));
    if (!may || monitor.starting === tab) return;
    page.dispatchEvent(new Event("run")); // what helps to type would cover what runs
    if (!dryRun && !isReadyFor(shown.fields)) {
      const {settle} = await import("./robot-run.js");
      const settled = await settle(shown.fields);
      if (!settled) return;
      dryRun = settled === "dryRun";
      page.show(tab);
    }
    started.dismiss(tab);
    import("../run/spoken.js");
    if (dryRun) this.#app.showLive("dryRun");
    this.starting = tab;
    const body = dryRun ? chosenBody() : "";
    const request = {tab, arguments: options, record, dryRun, body};
    const {startWithBreakpoints} = await import("./before-run.js");
    const answer = await monitor.start(tab, () => askBy("start", tab, () => startWithBreakpoints(request)));
    if (answer === undefined && store.online) this.#showErrors();
    if (answer?.recording) (await import("../run/documents.js")).awaitRecording(tab, answer.recording);
  }

  /** Show what a run writes while it starts, such as why it cannot. @param {{tab: number, lines: object[]}} written */
  showOutput({tab, lines}) {
    if (tab !== this.starting || !lines.length || this.#app.isBottomWanted) return;
    this.#app.showBottom("hfsm-output", {focuses: false}); // what was selected can be edited meanwhile
  }

  /** Show the errors of the document, for which no component was generated; they may not be known yet. */
  #showErrors() {
    const {document} = page;
    if (document && (document.checked !== document.revision || document.counts.error))
      this.#app.showBottom("hfsm-problems", {focuses: !globalThis.document.activeElement?.closest("hfsm-code-field")});
  }
}
