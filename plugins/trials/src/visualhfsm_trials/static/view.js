/** The trials of a document: what the page has of them before they are shown. */

import {t} from "visualhfsm/kit/texts.js";
import {addView, isOffered} from "visualhfsm/shell/panels.js";

const isPossible = () => isOffered({name: "trials"});

addView({
  name: "trials",
  tag: "hfsm-trials-panel",
  title: t("Trials"),
  module: new URL("./trials.js", import.meta.url).href,
  before: "hfsm-undo-steps",
  actions: [
    {
      id: "trials",
      after: "tests",
      label: t("Trials"),
      icon: "trials",
      keys: ["Alt+Y"],
      scope: "typing",
      enabled: isPossible,
      run: ({app}) => app.showBottom("hfsm-trials-panel"),
      hint: t("run it many times, and see how often it succeeds"),
    },
  ],
});
