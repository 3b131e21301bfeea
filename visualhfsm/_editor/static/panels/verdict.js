/**
 * Says whether the shown document is ready to drive a robot, and leads to what to fix first.
 *
 * @import {HfsmApp} from "../shell/app.js"
 */

import {confirm} from "../kit/dialog.js";
import {askTab} from "../data/commands.js";
import {save} from "../data/files.js";
import {page} from "../data/page.js";
import {chosenBody} from "../data/robot.js";
import {notify} from "../kit/notices.js";
import {t} from "../kit/texts.js";

/** Where more is said of what somebody found. @type {Partial<Record<string, string>>} */
const PANELS = {checks: "hfsm-problems", "model checker": "hfsm-problems", tests: "hfsm-tests-panel"};

/** @param {HfsmApp} app */
export async function judge(app) {
  const {tab} = page;
  const {dirty, title = ""} = page.tabState ?? {};
  if (dirty) {
    const choice = await confirm({
      title: t("Save {title} first?", {title}),
      text: t("It has unsaved changes."),
      choices: [["save", t("Save"), "primary"]],
    });
    if (choice !== "save" || !(await save(tab))) return;
  }
  notify(t("Checks, a run and tests of the saved document have begun."));
  const verdict = await askTab("judge", {body: chosenBody()});
  if (!verdict) return;
  const {ready, found, place} = verdict;
  if (ready) {
    notify(t("It is ready: it ran {seconds} s on {robot}, {proved} proved, {tests} tests passed.", {...verdict}));
    return;
  }
  const panel = PANELS[found];
  const show = () => {
    page.show(tab);
    if (panel) app.showBottom(panel);
    if (place) page.jump(place);
  };
  const link = panel || place ? {label: t("Show"), run: show} : undefined;
  notify(t("It is not ready for {robot}: {message}", {...verdict}), "error", link, {tab, about: `judge ${tab}`});
}
