/** What an agent asks a person for: it may run nothing on a robot before that. */

import {t} from "visualhfsm/kit/texts.js";
import {addView, isOffered} from "visualhfsm/shell/panels.js";

const isAllowed = () => isOffered({name: "agent"});

addView({
  name: "agent",
  tag: "hfsm-agent",
  title: t("Agent"),
  module: new URL("./agent.js", import.meta.url).href,
  actions: [
    {
      id: "agent",
      before: "problems",
      label: t("Agent"),
      words: t("assistant, model, allow, permission"),
      icon: "robot",
      enabled: isAllowed,
      listed: isAllowed,
      run: ({app}) => app.toggleView("hfsm-agent"),
      hint: t("what an agent asks you to allow"),
      checked: ({app}) => app.side === "hfsm-agent",
    },
  ],
});
