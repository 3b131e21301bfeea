/** All actions of the user in one table, for buttons, menus, the palette, keys and help. */

import {canvasActions, drawnSelection} from "../canvas/actions.js";
import * as commands from "../data/commands.js";
import {holdKeys} from "../kit/waiting-keys.js";
import {browserStorage} from "../kit/location.js";
import {monitorActions, monitoredSelection} from "../run/actions.js";
import {monitor} from "../run/monitor.js";
import {page} from "../data/page.js";
import {spoken} from "../kit/keys.js";
import {addActions} from "../kit/registry.js";
import {started} from "../data/component-status.js";
import {n, t} from "../kit/texts.js";

const hasDocument = () => !!page.document;
/** Whether the shown automaton is below a state. */
const isWithin = () => !!page.automaton?.father;

/** The tab whose component was started here and is to be stopped: the shown or the followed one, else 0. */
const startedHere = () => [page.tab, monitor.component && monitor.tab].find((tab) => tab && started.isAlive(tab)) || 0;

/** Stop the component that was started here, or else the followed one. */
function stop() {
  const tab = startedHere();
  if (!tab) return monitor.stop();
  started.stopHere(tab);
  return commands.ask("stop", {tab});
}

const files = () => import("../data/files.js");

/**
 * A part of the data of an automaton or of the behavior, which is found by its name, too.
 *
 * @param {string} id that of the part @param {string} icon
 * @param {{label: string, hint: string, words: string, enabled?: () => boolean}} more
 */
const part = (id, icon, more) => ({id, icon, enabled: hasDocument, ...more, run: () => page.showData(id)});

/** A layout that the user chooses. @param {string} id @param {string} label @param {string} icon @param {string} hint */
const layout = (id, label, icon, hint) => ({
  ...{id, label, icon, hint},
  words: t("panels, views, workspace"),
  run: async (/** @type {import("../kit/registry.js").Context} */ {app}) =>
    (await import("./layouts.js")).choose(app, id),
  checked: () => browserStorage.getItem("visualhfsm.layout") === id,
});

addActions([
  {
    id: "up",
    label: t("Up"),
    icon: "up",
    keys: ["Backspace"],
    enabled: () => page.path.length > 1,
    run: async ({app, canvas}) => {
      page.up();
      await app.updateComplete;
      // Its button cannot be pressed at the top, and keys would go nowhere.
      if (document.activeElement?.matches(":disabled")) canvas.focusSelected();
    },
    hint: t("to the automaton above"),
  },

  {
    id: "new",
    label: t("New"),
    icon: "file",
    keys: ["Alt+N"],
    scope: "typing",
    // What is typed from now on is meant for the new document.
    run: ({app, canvas}) => {
      canvas.surface.focus({preventScroll: true});
      return holdKeys(async () => {
        const isOpen = await (await files()).openNew();
        await app.updateComplete; // the start page is gone
        return isOpen;
      });
    },
  },
  {id: "startPage", label: t("Start page"), icon: "add", enabled: hasDocument, run: () => page.show(0)},
  {
    id: "example",
    label: t("Open an example"),
    icon: "open",
    run: async () => (await files()).openNew("dance"),
    hint: t("Dance"),
  },
  {
    id: "open",
    label: t("Open"),
    words: t("load a file"),
    icon: "open",
    keys: ["Ctrl+O"],
    scope: "typing",
    opens: true,
    run: async () => (await files()).openFile(),
  },
  {
    id: "save",
    label: t("Save"),
    icon: "save",
    keys: ["Ctrl+S"],
    scope: "typing",
    enabled: hasDocument,
    run: async () => (await files()).save(),
  },
  {
    id: "saveAs",
    label: t("Save as"),
    icon: "saveAs",
    keys: ["Ctrl+Shift+S"],
    scope: "typing",
    enabled: hasDocument,
    opens: true,
    run: async () => (await files()).saveAs(),
  },
  {
    id: "closeTab",
    label: t("Close"),
    icon: "close",
    keys: ["Alt+W"],
    scope: "typing",
    enabled: hasDocument,
    run: async () => (await files()).closeTab(page.tab),
  },
  {
    id: "export",
    label: t("Export"),
    words: t("print the drawing as a page, image, PDF, SVG, PNG, HTML, XML, download"),
    icon: "exportFile",
    keys: ["Ctrl+E"],
    scope: "typing",
    enabled: hasDocument,
    run: async () => (await import("../dialogs/export.js")).showExport(),
    hint: t("pictures, pages for print, one page to send"),
  },
  {
    id: "share",
    label: t("Share to look on"),
    words: t("link, URL, publish, send, viewers"),
    icon: "eye",
    run: async () => (await import("../dialogs/share.js")).showShare(),
    hint: t("an address at which nothing can be changed"),
  },
  {
    id: "compare",
    label: t("Compare"),
    words: t("difference, diff, changes, versions"),
    icon: "diff",
    keys: ["Alt+C"],
    scope: "typing",
    enabled: hasDocument,
    run: async (context) => (await import("../canvas/comparison.js")).compare(context),
  },

  {
    id: "interfaces",
    label: t("Interfaces"),
    icon: "interfaces",
    keys: ["Alt+I"],
    scope: "typing",
    enabled: hasDocument,
    run: () => page.showData("interfaces"),
  },
  {
    id: "timing",
    label: t("Timing"),
    icon: "timing",
    keys: ["Alt+T"],
    scope: "typing",
    enabled: hasDocument,
    run: () => page.showData("timing"),
  },
  {
    id: "variables",
    label: t("Variables"),
    icon: "variables",
    keys: ["Alt+V"],
    scope: "typing",
    enabled: hasDocument,
    run: () => page.showData("variables"),
  },
  {
    id: "functions",
    label: t("Functions"),
    icon: "functions",
    keys: ["Alt+F"],
    scope: "typing",
    enabled: hasDocument,
    run: () => page.showData("functions"),
  },
  {
    id: "component",
    label: t("Behavior"),
    icon: "parameters",
    keys: ["Alt+P"],
    scope: "typing",
    enabled: hasDocument,
    run: () => page.showData("parameters"),
    hint: t("parameters, events, properties"),
    words: t("add a parameter, options, settings, description, world, after an error"),
  },
  part("libraries", "generate", {
    label: t("Libraries"),
    hint: t("what the code imports"),
    words: t("add a library, import, module, package, numpy"),
  }),
  part("ros", "link", {
    label: t("ROS 2"),
    hint: t("topics, services and actions"),
    words: t("add a topic, message, publish, subscribe"),
  }),
  part("events", "events", {
    label: t("Events"),
    hint: t("what may come from outside"),
    words: t("add an event, signal, message"),
  }),
  part("properties", "properties", {
    label: t("Properties"),
    hint: t("what is proved of all runs"),
    words: t("add a property, model checker, prove, requirement"),
  }),
  part("inputs", "entry", {
    label: t("Inputs"),
    hint: t("what the state above sets"),
    words: t("add an input, argument, pass a value"),
    enabled: () => isWithin() && !page.automaton?.imported,
  }),
  part("outputs", "exit", {
    label: t("Outputs"),
    hint: t("what the state above takes"),
    words: t("add an output, result, return a value"),
    enabled: () => hasDocument() && !page.automaton?.imported,
  }),

  {
    id: "generate",
    label: t("Generate"),
    icon: "generate",
    keys: ["F6"],
    scope: "typing",
    enabled: hasDocument,
    run: ({app}) => app.runs.generate(),
  },
  {
    id: "run",
    label: t("Run"),
    words: t("start, play, execute"),
    icon: "run",
    keys: ["F5"],
    scope: "typing",
    enabled: hasDocument,
    run: ({app}) => app.runs.start(),
  },
  {
    id: "stop",
    label: t("Stop"),
    icon: "stop",
    keys: ["Shift+F5"],
    scope: "typing",
    enabled: () => startedHere() > 0 || monitor.steers,
    run: stop,
    hint: t("the behavior of the shown document, or else the followed one"),
  },

  ...canvasActions,

  ...monitorActions,

  {
    id: "undo",
    label: t("Undo"),
    words: t("revert"),
    icon: "undo",
    keys: ["Ctrl+Z"],
    enabled: () => commands.canStep("undo"),
    run: () => commands.step("undo"),
  },
  {
    id: "redo",
    label: t("Redo"),
    icon: "redo",
    keys: ["Ctrl+Shift+Z", "Ctrl+Y"],
    enabled: () => commands.canStep("redo"),
    run: () => commands.step("redo"),
  },

  {
    id: "search",
    label: t("Search"),
    words: t("find and replace"),
    icon: "search",
    keys: ["Ctrl+F"],
    enabled: hasDocument,
    run: ({app}) => app.showBottom("hfsm-search"),
    hint: t("names and code"),
  },
  {
    id: "definition",
    label: t("Go to definition"),
    icon: "search",
    keys: ["F12"],
    scope: "code",
    enabled: hasDocument,
    run: async () => (await import("../code/definitions.js")).goToDefinition(),
    hint: t("of the name at the cursor; also {key}+click", {key: spoken("Ctrl")}),
  },
  {
    id: "fromDefinition",
    label: t("Back from definition"),
    icon: "undo",
    keys: ["Alt+ArrowLeft"],
    scope: "code",
    enabled: hasDocument,
    run: async () => (await import("../code/definitions.js")).goBack(),
  },
  {
    id: "problems",
    label: t("Problems"),
    words: t("errors, warnings, checks"),
    icon: "problems",
    keys: ["Ctrl+M"],
    scope: "typing",
    enabled: hasDocument,
    run: ({app}) => app.showBottom("hfsm-problems"),
  },
  {
    id: "output",
    label: t("Output"),
    words: t("console, log, terminal"),
    icon: "code",
    keys: ["Alt+O"],
    scope: "typing",
    enabled: hasDocument,
    run: ({app}) => app.showBottom("hfsm-output"),
  },
  {
    id: "tests",
    label: t("Tests"),
    icon: "tests",
    keys: ["Alt+X"],
    scope: "typing",
    enabled: hasDocument,
    run: ({app}) => app.showBottom("hfsm-tests-panel"),
    hint: t("run the document's tests, and see what they pass"),
  },
  {
    id: "undoSteps",
    label: t("Undo steps"),
    words: t("history, versions"),
    icon: "history",
    keys: ["Alt+H"],
    scope: "typing",
    enabled: hasDocument,
    run: ({app}) => app.showBottom("hfsm-undo-steps"),
    hint: t("what can be undone and redone"),
  },
  {
    id: "nextTab",
    label: t("Next document"),
    icon: "file",
    keys: ["Alt+PageDown"],
    scope: "typing",
    run: ({app}) => app.showNeighbor(1),
  },
  {
    id: "previousTab",
    label: t("Previous document"),
    icon: "file",
    keys: ["Alt+PageUp"],
    scope: "typing",
    run: ({app}) => app.showNeighbor(-1),
  },
  {
    id: "robot",
    label: t("Robot"),
    icon: "robot",
    keys: ["Alt+B"],
    scope: "typing",
    run: ({app}) => app.showRobotMenu(),
    hint: t("start a simulation, connect to a real one"),
  },
  {
    id: "ownRobot",
    label: t("Your own robot"),
    words: t("URDF, xacro, MJCF, model, body"),
    icon: "add",
    run: async () => (await import("../dialogs/own-robot.js")).makeRobot(),
    hint: t("from its model: see it, correct it, save it"),
  },
  {
    id: "tree",
    label: t("Tree of automata"),
    icon: "child",
    enabled: hasDocument,
    run: ({app}) => app.toggleTree(),
    hint: t("on or off"),
    checked: ({app}) => app.showsTree,
  },
  layout("layoutDraw", t("Draw"), "state", t("the drawing and its code")),
  layout("layoutRun", t("Run and watch"), "run", t("the drawing and the robot")),
  layout("layoutLookBack", t("Look back"), "timing", t("the drawing, the robot, its values and the timeline")),
  {
    id: "theme",
    label: t("Light or dark"),
    words: t("dark mode, colors, settings"),
    icon: "moon",
    keys: ["Alt+D"],
    scope: "typing",
    run: ({app}) => app.toggleTheme(),
  },
  {
    id: "newWindow",
    label: t("Another window"),
    hint: t("such as for the robot on a second screen"),
    icon: "duplicate",
    run: () => open(location.href, "_blank", "popup"),
  },
  {
    id: "language",
    label: t("Language"),
    words: t("translation, settings"),
    icon: "globe",
    run: async () => (await import("../dialogs/language.js")).showLanguages(),
  },
  {
    id: "palette",
    label: t("All actions"),
    icon: "search",
    keys: ["Ctrl+K"],
    scope: "typing",
    opens: true,
    run: async (context) => (await import("./palette.js")).showPalette(context),
    hint: t("find one by its name"),
  },
  {
    id: "tour",
    label: t("Guided tour"),
    icon: "help",
    run: async (context) => (await import("./tour.js")).startTour(context),
  },
  {
    id: "help",
    label: t("Help"),
    words: t("shortcuts, keyboard, manual"),
    icon: "help",
    keys: ["?", "F1"],
    run: async (context) => (await import("../dialogs/help.js")).showHelp(context),
    hint: t("keys and signs"),
  },
  {
    id: "cancel",
    label: t("Cancel"),
    icon: "close",
    keys: ["Escape"],
    scope: "canvas",
    run: ({canvas}) => canvas.cancel() || (canvas.comparison ? canvas.comparison.end() : page.select({})),
  },
]);

/** The menus of the header. @type {{title: string, groups: string[][]}[]} */
export const MENUS = [
  {
    title: t("File"),
    groups: [
      ["new", "open", "example", "startPage", "openRecording", "ownRobot"],
      ["save", "saveAs"],
      ["compare", "export", "exportRun", "share", "generate"],
      ["closeTab"],
    ],
  },
  {
    title: t("Edit"),
    groups: [
      ["undo", "redo"],
      ["cut", "copy", "paste", "duplicate", "delete"],
      ["selectAll", "search", "definition", "fromDefinition"],
      ["rename", "editCode", "openChild", "group"],
      ["newNote", "frame"],
      ["layout", "layoutAll"],
    ],
  },
  {
    title: t("Data"),
    groups: [
      ["interfaces", "ros", "libraries"],
      ["component", "events", "properties"],
      ["timing", "variables", "functions", "inputs", "outputs"],
    ],
  },
  {
    title: t("View"),
    groups: [
      ["layoutDraw", "layoutRun", "layoutLookBack"],
      ["robotDock", "robotView", "whatIf", "cameras", "livePanel", "timeline"],
      ["problems", "output", "tests", "undoSteps", "tree", "shelf"],
      ["up", "fit", "fitSelection", "zoomIn", "zoomOut"],
      ["follow", "wheelZooms", "theme", "language", "newWindow"],
    ],
  },
  {title: t("Help"), groups: [["help", "tour", "palette"]]},
];

/** The selection in words. */
export function selectionTitle() {
  if (page.state) return t("State {name}", {name: page.state.name});
  if (page.annotation) return page.annotation.kind === "frame" ? t("Frame") : t("Note");
  if (page.transition) return t("Transition {name}", {name: page.transition.name});
  const parts = [
    page.states.size && n("{count} state", "{count} states", page.states.size),
    page.transitions.size && n("{count} transition", "{count} transitions", page.transitions.size),
    page.annotations.size && n("{count} note", "{count} notes", page.annotations.size),
  ];
  return parts.filter(Boolean).join(", ");
}

/** The actions on the selection, in groups, the most usual first. @returns {string[][]} */
export function selectionActions() {
  const drawing = drawnSelection();
  const [usual, ...more] = drawing;
  return usual ? [usual, ...monitoredSelection(), ...more] : drawing;
}
