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
import {n, t} from "../kit/texts.js";

const MOST_NAMED = 8;
/** Where more is said of what somebody found. @type {Partial<Record<string, string>>} */
const PANELS = {checks: "hfsm-problems", "model checker": "hfsm-problems", tests: "hfsm-tests-panel"};

/**
 * The last verdict of each tab: on which revision, what it says, and how: an `undecided` one is ready, but nothing shows that
 * it does what it should. It says nothing while it is made.
 *
 * @type {Map<number, {revision?: number, text?: string, kind?: "holds" | "undecided" | "violated"}>}
 */
const verdicts = new Map();

/** The verdict on the shown document, while that is as it was then; its text is empty while it is made. */
export function verdictOf() {
  const verdict = verdicts.get(page.tab);
  return verdict && verdict.revision === page.document?.revision ? verdict : undefined;
}

/**
 * Keep what a verdict says of a tab; without anything it is forgotten.
 *
 * @param {number} tab @param {number} [revision] @param {string} [text] @param {"holds" | "undecided" | "violated"} [kind]
 */
function keep(tab, revision, text, kind) {
  verdicts.set(tab, {revision, text, kind});
  page.dispatchEvent(new Event("verdict"));
}

/** The first of some names, and how many more there are. @param {string[]} names */
function few(names) {
  const name = names.slice(0, MOST_NAMED).join(", ");
  const more = names.length - MOST_NAMED;
  return more > 0 ? n("{name} and {count} more", "{name} and {count} more", more, {name}) : name;
}

/** The next step for a document without a test. @param {HfsmApp} app */
export const toTests = (app) => ({label: t("Tests"), run: () => app.showBottom("hfsm-tests-panel")});

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
  const revision = page.document?.revision ?? 0;
  keep(tab, revision, "");
  const verdict = await askTab("judge", {body: chosenBody()});
  if (!verdict) {
    keep(tab);
    return;
  }
  const {ready, found, place, proved, tests, survived, missed} = verdict;
  if (ready) {
    const shown = proved + tests > 0;
    const text = [
      shown
        ? t("It is ready: it ran {seconds} s on {robot} without an error.", {...verdict})
        : t(
            "It runs, and is not tested yet: it ran {seconds} s on {robot} without an error, but without a test or a proved property nothing shows that it does what it should.",
            {...verdict},
          ),
      missed.length ? t("It never stayed in {states}.", {states: few(missed)}) : "",
      proved ? n("A property was proved.", "{count} properties were proved.", proved) : "",
      survived ? n("It survived a failure.", "It survived {count} failures.", survived) : "",
      tests ? n("A test passed.", "{count} tests passed.", tests) : "",
    ];
    keep(tab, revision, text.filter(Boolean).join(" "), shown ? "holds" : "undecided");
    notify(text[0], "info", shown ? undefined : toTests(app));
    return;
  }
  const text = t("It is not ready for {robot}: {message}", {...verdict});
  keep(tab, revision, text, "violated");
  const panel = PANELS[found];
  const show = () => {
    page.show(tab);
    if (panel) app.showBottom(panel);
    if (place) page.jump(place);
  };
  const link = panel || place ? {label: t("Show"), run: show} : undefined;
  notify(text, "error", link, {tab, about: `judge ${tab}`});
}
