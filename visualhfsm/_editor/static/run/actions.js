/** The actions on the followed component; part of the table of all actions. */

import {page} from "../data/page.js";
import {notify} from "../kit/notices.js";
import {required} from "../kit/existence.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {breakpointAt} from "./breakpoints.js";
import {monitor} from "./monitor.js";
import {STOP_KEY, stopRobot} from "./stop.js";

const followed = () => Boolean(monitor.component);
/** Whether there is something to show live: a component, or at least a robot. */
const hasLive = () => followed() || store.robot.status === "present";
/** Whether parts of the present robot can be made to fail: no real one serves that. */
const canFail = () => store.robot.status === "present" && store.robot.serves.includes("Faults");
const steers = () => monitor.steers;
/** Whether the component runs, as far as is known. */
const runs = () => monitor.isLive && !monitor.ended && !monitor.since && store.online;
const recorder = () => import("./recorder.js");
const paused = () => monitor.newest?.component.status !== 0;
/** Whether the selection belongs to the component. */
const here = () => followed() && page.tab === monitor.tab;
const selected = () => page.state ?? page.transition;
/** Whether the selected element can have a breakpoint, now or when the component runs. */
const breakable = () => Boolean(page.document && selected()) && (monitor.breakpoints.arePlanned(page.tab) || steers());
const kind = () => (page.state ? "state" : "transition");

/** The selected element, for actions that need one. */
const theSelected = () => required(selected(), "selected state or transition");

const dialogs = () => import("./dialogs.js");
const refused = async () => (await dialogs()).sayWhyNot();

/** The action with which the shown automaton's selected thing has or has not a breakpoint. */
function toggleBreakpoint() {
  const [automaton, id] = [page.shownAutomaton.id, theSelected().id];
  const known = breakpointAt(monitor.breakpoints.of(page.tab), automaton, kind(), id);
  return monitor.breakpoints.set(page.tab, automaton, kind(), id, known ? undefined : "");
}

/** Run a cycle of the shown automaton, unless the state above it is not the current one. */
function step() {
  const {id} = page.shownAutomaton;
  if (!monitor.now(id)?.ghost) return monitor.steer("step", {automaton: id});
  notify(
    t("{automaton} does not run now: the state above it is not the current one.", {automaton: page.title()}),
    "error",
  );
  return undefined;
}

/** Fire the selected transition, which has to leave the current state. */
function force() {
  const automaton = page.shownAutomaton;
  const transition = required(page.transition, "selected transition");
  const {state} = monitor.now(automaton.id) ?? {};
  if (transition.origin === state)
    return monitor.steer("forceTransition", {automaton: automaton.id, transition: transition.id});
  notify(
    t("{transition} leaves {origin}, and {automaton} is in {state} now.", {
      transition: transition.name || t("The transition"),
      origin: monitor.stateName(automaton.id, transition.origin),
      automaton: page.title(),
      state: monitor.stateName(automaton.id, state ?? 0),
    }),
    "error",
  );
  return undefined;
}

/** Generate the component and reload it. @param {import("../kit/registry.js").Context} context */
async function reload(context) {
  if (!(await context.app.runs.generate({quiet: true}))) return;
  const report = await monitor.steer("reload");
  if (!report) return;
  const {notKept, held} = report;
  const time = held < 0.001 ? "< 1" : Math.round(held * 1000);
  notify(
    notKept.length
      ? t("Reloaded: {notKept}.", {notKept: notKept.join("; ")})
      : t(
          "Reloaded. States and timers were kept, as were variables that code had changed; no cycle began for {time} ms.",
          {time},
        ),
  );
}

/** Run with values of the parameters that the user is asked for. @param {import("../kit/registry.js").Context} context */
async function runWith({app}) {
  const {tab} = page;
  const options = await (await dialogs()).askParameters(tab, page.shownDocument.fields.parameters);
  if (options && page.tab === tab) await app.runs.start(options);
}

/** @type {import("../kit/registry.js").Action[]} */
export const monitorActions = [
  {
    id: "followComponent",
    label: t("Follow"),
    icon: "link",
    keys: ["Alt+A"],
    scope: "typing",
    run: ({app}) => app.showRunning(),
    hint: t("a behavior that runs elsewhere"),
  },
  {
    id: "unfollow",
    label: t("Unfollow"),
    icon: "unlink",
    keys: ["Alt+Shift+A"],
    scope: "typing",
    enabled: followed,
    run: () => monitor.leave(),
    hint: t("it keeps running"),
  },
  {
    id: "tryIt",
    label: t("Try it without a robot"),
    words: t("simulate, dry run, debug"),
    icon: "flask",
    keys: ["Alt+Shift+T"],
    scope: "typing",
    enabled: () => Boolean(page.document),
    run: ({app}) => app.runs.start([], {dryRun: true}),
    hint: t("you set the time, send the events and force transitions"),
  },
  {
    id: "record",
    label: t("Record"),
    icon: "record",
    keys: ["Alt+Shift+R"],
    scope: "typing",
    enabled: () => runs() || Boolean(page.document),
    run: async ({app}) => (runs() ? (await recorder()).toggleRecording() : app.runs.start([], {record: true})),
    hint: t("the followed behavior, until pressed again; or run and record the document"),
  },
  {
    id: "recordRun",
    label: t("Run and record"),
    icon: "film",
    enabled: () => Boolean(page.document),
    run: ({app}) => app.runs.start([], {record: true}),
    hint: t("everything it reads, for a replay, and the pictures it uses; reloading is not possible"),
  },
  {
    id: "pictureRate",
    label: t("Pictures in recordings"),
    icon: "film",
    run: async () => (await recorder()).chooseRate(),
    hint: t("how many per second Record takes"),
  },
  {
    id: "runWith",
    label: t("Run with parameters"),
    icon: "parameters",
    keys: ["Alt+Shift+F5"],
    scope: "typing",
    enabled: () => Boolean(page.document?.fields.parameters.length),
    opens: true,
    run: runWith,
    hint: t("values for this run instead of the defaults"),
  },
  {
    id: "openRecording",
    label: t("Open a recording"),
    icon: "film",
    keys: ["Alt+R"],
    scope: "typing",
    opens: true,
    run: async () => (await import("./documents.js")).openRecording(),
  },
  {
    id: "exportRun",
    label: t("Export as a page…"),
    words: t("share, send, HTML, report"),
    icon: "exportFile",
    enabled: () => Boolean(monitor.snapshot),
    run: async () => (await import("./documents.js")).exportRun(),
    hint: t("the followed run or recording, in one file"),
  },
  {
    id: "pauseResume",
    label: t("Pause or resume"),
    icon: "pause",
    keys: ["F8"],
    scope: "typing",
    enabled: steers,
    refused,
    run: () => monitor.steer(paused() ? "resume" : "pause"),
  },
  {
    id: "stepOne",
    label: t("Step"),
    icon: "step",
    keys: ["F10"],
    scope: "typing",
    enabled: () => steers() && paused() && here(),
    refused,
    run: step,
    hint: t("one cycle of the shown automaton"),
  },
  {
    id: "stepAll",
    label: t("Step all"),
    icon: "stepAll",
    keys: ["Ctrl+F10"],
    scope: "typing",
    enabled: () => steers() && paused(),
    refused,
    run: () => monitor.steer("step", {automaton: 0}),
    hint: t("one cycle of each automaton"),
  },
  {
    id: "reload",
    label: t("Reload"),
    icon: "reload",
    keys: ["F9"],
    scope: "typing",
    enabled: () => steers() && here(),
    refused,
    run: reload,
    hint: t("continue in the changed document, in the same states"),
  },
  {
    id: "sendEvent",
    label: t("Send an event"),
    icon: "events",
    keys: ["Alt+E"],
    scope: "typing",
    enabled: steers,
    refused,
    opens: true,
    run: async () => (await dialogs()).askEvent(),
  },
  {
    id: "steering",
    label: t("Control, or only watch"),
    icon: "lock",
    keys: ["Alt+U"],
    scope: "typing",
    enabled: () => monitor.writable || (Boolean(monitor.newest) && !monitor.recording),
    run: () => monitor.allowSteering(!monitor.writable),
  },
  {
    id: "follow",
    label: t("Keep what is active in view"),
    icon: "target",
    keys: ["G"],
    enabled: followed,
    run: () => monitor.setFollows(!monitor.follows),
    hint: t("open sub-automata as they become active"),
    checked: () => monitor.follows,
  },
  {
    id: "livePanel",
    label: t("Live values"),
    icon: "variables",
    keys: ["Alt+L"],
    scope: "typing",
    enabled: hasLive,
    run: ({app}) => app.showSide("hfsm-monitor-panel"),
    hint: t("variables, plots, cameras, the robot"),
    words: t("graph, chart, joints, cycles, errors"),
  },
  {
    id: "robotDock",
    label: t("See the robot"),
    icon: "robot",
    keys: ["Alt+Shift+B"],
    scope: "typing",
    enabled: () => Boolean(page.document) && monitor.hasRobot,
    run: ({app}) => app.foldRobot(),
    hint: t("beside the drawing, in 3D or as a camera sees it"),
    checked: ({app}) => app.showsRobot,
  },
  {id: "robotView", label: t("Robot in 3D"), icon: "robot", enabled: hasLive, run: ({app}) => app.showLive("view")},
  {
    id: "whatIf",
    label: t("What if…"),
    icon: "flask",
    enabled: () => canFail() && !monitor.looking && !monitor.recording && !monitor.isDryRun && store.online,
    listed: canFail,
    opens: true,
    run: async ({app}) => {
      await app.showLive("view");
      return (await import("../robot3d/robot-view.js")).theView().whatIf.ask();
    },
    hint: t("let a part of the robot fail, and heal it"),
    words: t("fault, failure, broken, stuck, limp, defect"),
  },
  {
    id: "cameras",
    label: t("Cameras"),
    icon: "film",
    enabled: hasLive,
    run: ({app}) => app.showLive("cameras"),
    hint: t("what the robot sees"),
  },
  {
    id: "timeline",
    label: t("Timeline"),
    icon: "timing",
    enabled: () => Boolean(page.document) && followed(),
    run: ({app}) => app.showBottom("hfsm-monitor-timeline"),
    hint: t("the run over time"),
  },
  {
    id: "backToLive",
    label: t("Back to now"),
    icon: "live",
    keys: ["Alt+End"],
    scope: "typing",
    enabled: () => Boolean(monitor.looking) && !monitor.recording,
    run: async () => (await import("./scrubbing.js")).scrubbing.to(Infinity),
  },
  {
    id: "whyNot",
    label: t("Why not?"),
    icon: "help",
    keys: ["W"],
    enabled: () => here() && (monitor.isLive || Boolean(monitor.looking)),
    run: async ({canvas}) => (await import("./why-not.js")).explainSelected(canvas),
    hint: t("what keeps transitions from firing"),
    help: t("Why not: what keeps transitions from firing"),
  },
  {
    id: "breakpoint",
    label: t("Breakpoint"),
    icon: "breakpoint",
    keys: ["B"],
    enabled: breakable,
    refused: () => selected() && refused(),
    run: toggleBreakpoint,
    hint: t("on or off; also before the start"),
  },
  {
    id: "breakpointIf",
    label: t("Breakpoint with a condition"),
    icon: "breakpointIf",
    keys: ["Shift+B"],
    enabled: breakable,
    refused: () => selected() && refused(),
    opens: true,
    run: async () => (await dialogs()).askCondition(page.shownAutomaton.id, kind(), theSelected()),
  },
  {
    id: "startHere",
    label: t("Start from here"),
    icon: "run",
    keys: ["Alt+F5"],
    scope: "typing",
    enabled: () => Boolean(page.state),
    run: ({app}) => app.runs.start(["--begin-at", `${page.shownAutomaton.id}.${page.state?.id}`]),
    hint: t("run the behavior with this state as its first"),
  },
  {
    id: "force",
    label: t("Force the transition"),
    icon: "force",
    keys: ["Alt+Enter"],
    scope: "canvas",
    enabled: () => steers() && here() && Boolean(page.transition),
    refused,
    run: force,
    hint: t("fire at the next cycle, whatever its condition"),
  },
  {
    id: "stopRobot",
    label: "STOP",
    icon: "stop",
    keys: [STOP_KEY],
    scope: "typing",
    run: stopRobot,
    hint: t("stop the robot and all that runs at once, whatever is shown"),
  },
];

/** The actions on the selected state or transition of a component. @returns {string[][]} */
export const monitoredSelection = () =>
  [
    [
      ...(page.state ? ["startHere"] : []),
      ...(here() && selected() ? ["whyNot"] : []),
      ...(selected() ? ["breakpoint", "breakpointIf"] : []),
      ...(here() && page.transition ? ["force"] : []),
    ],
  ].filter((group) => group.length);

/** The groups of the list of keys. */
export const MONITOR_KEYS = [
  "followComponent",
  "unfollow",
  "tryIt",
  "record",
  "runWith",
  "openRecording",
  "pauseResume",
  "stepOne",
  "stepAll",
  "reload",
  "sendEvent",
  "steering",
  "startHere",
  "breakpoint",
  "breakpointIf",
  "force",
  "whyNot",
  "follow",
  "livePanel",
  "robotDock",
  "backToLive",
  "stopRobot",
];

/** The menu beside Run. */
export const RUN_MENU = [
  ["tryIt", "tests", "runWith", "startHere", "recordRun", "generate"],
  ["stepAll", "sendEvent"],
  ["followComponent", "unfollow", "openRecording", "exportRun", "pictureRate"],
];
