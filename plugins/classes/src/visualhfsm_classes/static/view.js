/** The task of an exercise: what the page has of it before it is shown. */

import {t} from "visualhfsm/kit/texts.js";
import {addView, isOffered} from "visualhfsm/shell/panels.js";

const hasTask = () => isOffered({name: "task"});

addView({
  name: "task",
  tag: "hfsm-task",
  title: t("Task"),
  module: new URL("./task.js", import.meta.url).href,
  actions: [
    {
      id: "task",
      before: "problems",
      label: t("Task"),
      words: t("exercise, homework, points, marks"),
      icon: "file",
      keys: ["Alt+K"],
      scope: "typing",
      enabled: hasTask,
      listed: hasTask,
      run: ({app}) => app.toggleView("hfsm-task"),
      hint: t("what the exercise asks for, its points and your marks"),
      checked: ({app}) => app.side === "hfsm-task",
    },
    {
      id: "handIn",
      after: "saveAs",
      label: t("Hand in"),
      words: t("submit, turn in, send, exercise, homework"),
      icon: "exportFile",
      enabled: hasTask,
      listed: hasTask,
      run: async () => (await import("./task.js")).handIn(),
      hint: t("save it where your teacher collects it"),
    },
  ],
});
