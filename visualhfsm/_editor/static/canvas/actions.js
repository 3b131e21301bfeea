/**
 * The actions on the drawing; part of the table of all actions.
 *
 * @import {Context} from "../kit/registry.js"
 * @import {Automaton, Commands} from "../data/protocol.js"
 */

import * as commands from "../data/commands.js";
import {notify} from "../kit/notices.js";
import {firstPart, outgoing} from "../data/outline.js";
import {page} from "../data/page.js";
import {required} from "../kit/existence.js";
import {t} from "../kit/texts.js";
import {annotatedSelection, annotationActions} from "./annotation-actions.js";
import {wheelSetting} from "./pointer.js";
import {StateTool, TransitionTool} from "./tools.js";

const hasDocument = () => Boolean(page.document);
const drawable = () => page.automaton !== undefined && !page.automaton.imported;
const isRootless = () => hasDocument() && !page.automaton;
const anySelected = () => page.selectedCount > 0;
/** Whether something is selected that can be copied. */
const anyCopied = () => page.states.size + page.annotations.size > 0;
const anyStates = (count = 1) => page.states.size >= count;
const oneState = () => Boolean(page.state);
const oneTransition = () => Boolean(page.transition);
const oneAnnotation = () => Boolean(page.annotation);
/** Whether elements of an automaton have the same number, in an invalid document. @param {Automaton} automaton */
const sharesNumbers = ({states, transitions}) =>
  [states, transitions].some((all) => new Set(all.map(({id}) => id)).size < all.length);
/** The automaton below the selected state if there is exactly one; without a selection, the shown one. */
const part = () =>
  page.state
    ? page.state.children.length === 1
      ? page.shownDocument.automata.get(page.state.children[0])
      : undefined
    : anySelected()
      ? undefined
      : page.automaton;
/** Whether an automaton is one that the document itself imports. @param {Automaton | undefined} automaton */
const isImport = (automaton) => Boolean(automaton && page.shownDocument.own.get(automaton.id)?.imported);
const canExtract = () => Boolean(part()?.father) && !part()?.imported;
const canInline = () => isImport(part());

/** The selected state, and the result of `part`, for actions that need one. */
const state = () => required(page.state, "selected state");
const thePart = () => required(part(), "sub-automaton");

const layout = () => import("./layout.js");

/** @param {string} [field] */
function editCode(field) {
  if (page.state) page.edit({kind: "state", automaton: page.shownAutomaton.id, id: page.state.id, part: field});
  else if (page.transition)
    page.edit({
      kind: "transition",
      automaton: page.shownAutomaton.id,
      id: page.transition.id,
      part: field ?? firstPart(page.transition.type),
    });
  else if (page.annotation)
    page.edit({kind: "annotation", automaton: page.shownAutomaton.id, id: page.annotation.id, part: "text"});
}

/** @param {Context} context */
function enter({canvas}) {
  if (page.state?.children.length) page.open(page.state.children[0]);
  else if (page.state || page.transition) editCode();
  else if (page.annotation) canvas.beginRename("annotation", page.annotation.id);
  else canvas.focusSelected();
}

const STEP = 10; // pixels by which an arrow key moves
/** @type {{key: string, way: [number, number], move: string, go: string}[]} */
const DIRECTIONS = [
  {key: "Left", way: [-1, 0], move: t("Move left"), go: t("Select to the left")},
  {key: "Right", way: [1, 0], move: t("Move right"), go: t("Select to the right")},
  {key: "Up", way: [0, -1], move: t("Move up"), go: t("Select above")},
  {key: "Down", way: [0, 1], move: t("Move down"), go: t("Select below")},
];
/** @param {number} step */
const goOn =
  (step) =>
  (/** @type {Context} */ {canvas}) =>
    canvas.order.goOn(step);
/** @param {string} side */
const align = (side) => () => {
  const to = /** @type {Commands["alignStates"]["to"]} */ (side.toLowerCase());
  return commands.applyHere("alignStates", {states: [...page.states], to});
};
const SIDES = [
  ["Left", t("Align left")],
  ["Center", t("Align center")],
  ["Right", t("Align right")],
  ["Top", t("Align top")],
  ["Middle", t("Align middle")],
  ["Bottom", t("Align bottom")],
];

/** @type {import("../kit/registry.js").Action[]} */
export const canvasActions = [
  {
    id: "select",
    label: t("Select"),
    icon: "select",
    keys: ["V"],
    enabled: hasDocument,
    run: ({canvas}) => {
      canvas.useTool(undefined);
      canvas.focusSelected();
    },
    hint: t("and move"),
    help: t("Select and move: put a drawing tool away"),
    checked: ({canvas}) => !canvas.tool,
  },
  {
    id: "newState",
    label: t("State"),
    icon: "state",
    keys: ["S"],
    enabled: () => drawable() || isRootless(),
    run: async ({canvas}) => {
      if (isRootless()) await commands.apply("addRoot");
      canvas.useTool(StateTool);
    },
    hint: t("new"),
    help: t("New state"),
    checked: ({canvas}) => canvas.tool instanceof StateTool,
  },
  {
    id: "newTransition",
    label: t("Transition"),
    icon: "transition",
    keys: ["T"],
    enabled: drawable,
    run: ({canvas}) => canvas.useTool(TransitionTool),
    hint: t("new"),
    help: t("New transition"),
    checked: ({canvas}) => canvas.tool instanceof TransitionTool,
  },
  {
    id: "shelf",
    label: t("Shelf"),
    icon: "shelf",
    keys: ["A"],
    enabled: hasDocument,
    run: ({app}) => app.showShelf(),
    hint: t("draw a ready state, such as Say or Walk to"),
    help: t("Draw a ready state from the shelf"),
  },
  ...annotationActions,
  {
    id: "rename",
    label: t("Rename"),
    icon: "rename",
    keys: ["F2"],
    enabled: () => drawable() && (oneState() || oneTransition() || oneAnnotation()),
    run: ({canvas}) =>
      page.state
        ? canvas.beginRename("state", page.state.id)
        : page.transition
          ? canvas.beginRename("transition", page.transition.id)
          : canvas.beginRename("annotation", required(page.annotation, "selected annotation").id),
  },
  {
    id: "edit",
    label: t("Open or edit"),
    icon: "code",
    keys: ["Enter"],
    scope: "canvas",
    enabled: () => oneState() || oneTransition() || oneAnnotation(),
    run: enter,
    help: t("Open the sub-automaton, or the code where there is none"),
  },
  {
    id: "editCode",
    get label() {
      return page.annotation ? t("Edit text") : t("Edit code");
    },
    icon: "code",
    keys: ["Shift+Enter"],
    scope: "canvas",
    enabled: () => oneState() || oneTransition() || oneAnnotation(),
    run: () => editCode(),
    help: t("Edit code"),
  },
  {id: "editEntry", label: t("Edit entry code"), icon: "entry", enabled: oneState, run: () => editCode("entry")},
  {id: "editExit", label: t("Edit exit code"), icon: "exit", enabled: oneState, run: () => editCode("exit")},
  {
    id: "openChild",
    label: t("Sub-automaton"),
    icon: "child",
    keys: ["Ctrl+Enter"],
    enabled: () => oneState() && (drawable() || state().children.length > 0),
    run: () => commands.openChild(state()),
    hint: t("open it, or create one"),
    help: t("Open the sub-automaton, or create one"),
  },
  {
    id: "addChild",
    label: t("Add a parallel automaton"),
    icon: "parallel",
    enabled: () => drawable() && oneState(),
    run: () => commands.applyHere("addAutomaton", {state: state().id}),
  },
  {
    id: "markInitial",
    label: t("Mark as initial"),
    icon: "initial",
    keys: ["I"],
    enabled: () => drawable() && oneState() && !page.state?.initial,
    run: () => commands.applyHere("markInitial", {state: state().id}),
  },
  {
    id: "toggleFinal",
    label: t("Final state"),
    icon: "final",
    keys: ["E"],
    enabled: () => drawable() && oneState(),
    run: () => commands.applyHere("markFinal", {state: state().id, final: !state().final}),
    hint: t("on or off"),
    checked: () => state().final,
  },
  {
    id: "toggleHistory",
    label: t("Restart on entry"),
    icon: "history",
    enabled: () => drawable() && oneState() && state().children.length > 0,
    run: () =>
      commands.applyHere("setHistory", {state: state().id, history: state().history === "restart" ? "" : "restart"}),
    hint: t("on or off"),
    checked: () => state().history === "restart",
  },
  {
    id: "loop",
    label: t("Transition to itself"),
    icon: "selfLoop",
    enabled: () => drawable() && oneState(),
    run: ({canvas}) => canvas.add("transition", "addTransition", {origin: state().id, destination: state().id}),
  },
  {
    id: "group",
    label: t("Group"),
    icon: "group",
    keys: ["Ctrl+G"],
    enabled: () => drawable() && anyStates(),
    run: ({canvas}) => canvas.add("state", "groupStates", {states: [...page.states]}),
    hint: t("into a sub-automaton of a new state"),
    help: t("Group the selected states into a sub-automaton"),
  },
  {
    id: "extract",
    label: t("Move to a file"),
    icon: "exportFile",
    enabled: canExtract,
    run: () => commands.extract(thePart()),
    hint: t("the sub-automaton; it is imported from there"),
  },
  {
    id: "inline",
    label: t("Inline"),
    icon: "open",
    enabled: canInline,
    run: () => commands.inline(thePart()),
    hint: t("copy the imported content into this document"),
  },
  {
    id: "putOnShelf",
    label: t("Put on the shelf"),
    icon: "shelf",
    enabled: () => drawable() && anyStates(),
    run: async () => (await import("../shelf/putting.js")).putOnShelf(),
    hint: t("of this project, for others to draw"),
  },
  {id: "copy", label: t("Copy"), icon: "copy", keys: ["Ctrl+C"], enabled: anyCopied, run: commands.copy},
  {
    id: "cut",
    label: t("Cut"),
    icon: "cut",
    keys: ["Ctrl+X"],
    enabled: () => drawable() && anyCopied(),
    run: commands.cut,
  },
  {
    id: "paste",
    label: t("Paste"),
    icon: "paste",
    keys: ["Ctrl+V"],
    enabled: drawable,
    run: ({canvas, point, pasted}) =>
      commands.paste(point, pasted, async (text) => (await import("./annotations.js")).writeNote(canvas, text, point)),
  },
  {
    id: "duplicate",
    label: t("Duplicate"),
    icon: "duplicate",
    keys: ["Ctrl+D"],
    enabled: () => drawable() && anyCopied(),
    run: commands.duplicate,
  },
  {
    id: "delete",
    label: t("Delete"),
    words: t("remove, erase"),
    icon: "delete",
    keys: ["Delete"],
    enabled: () => drawable() && anySelected(),
    run: commands.deleteSelected,
  },
  {
    id: "selectAll",
    label: t("Select all"),
    icon: "state",
    keys: ["Ctrl+A"],
    enabled: () => Boolean(page.automaton),
    run: () =>
      page.select({
        states: page.shownAutomaton.states.map((each) => each.id),
        transitions: page.shownAutomaton.transitions.map((each) => each.id),
        annotations: page.shownAutomaton.annotations.map((each) => each.id),
      }),
  },
  {
    id: "tryEarlier",
    label: t("Evaluate earlier"),
    icon: "up",
    keys: ["Ctrl+ArrowUp"],
    scope: "canvas",
    enabled: () => drawable() && oneTransition(),
    run: () => reorder(-1),
    hint: t("among the transitions of its state"),
  },
  {
    id: "tryLater",
    label: t("Evaluate later"),
    icon: "down",
    keys: ["Ctrl+ArrowDown"],
    scope: "canvas",
    enabled: () => drawable() && oneTransition(),
    run: () => reorder(1),
    hint: t("among the transitions of its state"),
  },
  {
    id: "resetHandle",
    label: t("Reset the arc"),
    icon: "transition",
    keys: ["R"],
    enabled: () => drawable() && page.transitions.size > 0,
    run: () => commands.applyHere("resetHandles", {transitions: [...page.transitions]}),
  },
  ...DIRECTIONS.map(({key, way: [x, y], move}) => ({
    id: `move${key}`,
    label: move,
    icon: "",
    keys: [`Arrow${key}`],
    scope: /** @type {const} */ ("canvas"),
    run: () => anySelected() && drawable() && commands.moveSelected(x * STEP, y * STEP),
  })),
  ...DIRECTIONS.map(({key, way, go}) => ({
    id: `go${key}`,
    label: go,
    icon: "",
    keys: [`Alt+Arrow${key}`],
    scope: /** @type {const} */ ("canvas"),
    run: (/** @type {Context} */ {canvas}) => canvas.order.goTo(way),
  })),
  {id: "goNext", label: t("Select next"), icon: "", keys: ["."], scope: "canvas", run: goOn(1)},
  {id: "goBack", label: t("Select previous"), icon: "", keys: [","], scope: "canvas", run: goOn(-1)},
  {
    id: "fit",
    label: t("Fit"),
    words: t("zoom to all of it, whole, center"),
    icon: "fit",
    keys: ["F"],
    enabled: hasDocument,
    run: ({canvas}) => canvas.fit(),
    hint: t("show everything"),
  },
  {
    id: "fitSelection",
    label: t("Fit the selection"),
    words: t("zoom to it, center"),
    icon: "fit",
    keys: ["Shift+F"],
    enabled: hasDocument,
    run: ({canvas}) => canvas.fitSelection(),
  },
  {
    id: "zoomIn",
    label: t("Zoom in"),
    words: t("larger, enlarge, magnify"),
    icon: "add",
    keys: ["+", "="],
    enabled: hasDocument,
    run: ({canvas}) => canvas.viewport.zoom(1.25),
  },
  {
    id: "zoomOut",
    label: t("Zoom out"),
    words: t("smaller, shrink"),
    icon: "minus",
    keys: ["-"],
    enabled: hasDocument,
    run: ({canvas}) => canvas.viewport.zoom(0.8),
  },
  {
    id: "menu",
    label: t("Menu of the selection"),
    icon: "dots",
    keys: ["Shift+F10", "ContextMenu"],
    enabled: hasDocument,
    run: ({canvas}) => canvas.pointer.openMenu(),
  },
  {
    id: "wheelZooms",
    label: t("Always zoom with the wheel"),
    icon: "search",
    run: () => {
      wheelSetting.toggle();
      notify(wheelSetting.zooms ? t("The wheel always zooms.") : t("A mouse's wheel zooms, and a trackpad pans."));
    },
    hint: t("even if it is mistaken for a trackpad"),
    checked: () => wheelSetting.zooms,
  },
  {
    id: "layout",
    label: t("Arrange"),
    words: t("layout, tidy up, clean up, order, organize"),
    icon: "layout",
    keys: ["L"],
    enabled: drawable,
    run: async ({canvas}) => (await layout()).arrange([page.shownAutomaton], canvas),
    hint: t("this automaton"),
  },
  {
    id: "layoutAll",
    label: t("Arrange all automata"),
    words: t("layout, tidy up, clean up, order, organize"),
    icon: "layout",
    keys: ["Shift+L"],
    enabled: hasDocument,
    run: async ({canvas}) => (await layout()).arrange([...page.shownDocument.automata.values()], canvas),
  },
  ...SIDES.map(([to, label]) => ({
    id: `align${to}`,
    label,
    icon: `align${to}`,
    enabled: () => drawable() && anyStates(2),
    run: align(to),
  })),
  ...[
    {along: /** @type {const} */ ("x"), label: t("Distribute horizontally")},
    {along: /** @type {const} */ ("y"), label: t("Distribute vertically")},
  ].map(({along, label}) => ({
    id: `distribute${along.toUpperCase()}`,
    label,
    icon: `distribute${along.toUpperCase()}`,
    enabled: () => drawable() && anyStates(3),
    run: () => commands.applyHere("distributeStates", {states: [...page.states], along}),
  })),
  {
    id: "repairNumbers",
    label: t("Repair numbers"),
    icon: "properties",
    enabled: () => hasDocument() && [...page.shownDocument.automata.values()].some(sharesNumbers),
    run: () => commands.apply("repairNumbers"),
    hint: t("of states and transitions that share a number"),
  },
];

/** The actions on the selection, in groups, the most usual first. @returns {string[][]} */
export function drawnSelection() {
  if (page.state)
    return [
      ["openChild", "editCode", "rename", "markInitial", "delete"],
      ["editEntry", "editExit", "toggleFinal", "addChild", "toggleHistory", "loop"],
      [
        "copy",
        "cut",
        "duplicate",
        "group",
        "frame",
        "putOnShelf",
        ...(canExtract() ? ["extract"] : []),
        ...(canInline() ? ["inline"] : []),
      ],
    ];
  if (page.transition)
    return [
      ["editCode", "rename", "delete"],
      ["tryEarlier", "tryLater", "resetHandle"],
    ];
  if (page.annotations.size && !page.states.size) return annotatedSelection();
  if (page.states.size > 1)
    return [
      ["copy", "cut", "group", "frame", "putOnShelf", "delete"],
      [...SIDES.map(([to]) => `align${to}`), "distributeX", "distributeY", "duplicate"],
    ];
  if (anySelected()) return [["delete"], ["resetHandle"]];
  return [];
}

/** @param {number} step */
async function reorder(step) {
  const chosen = required(page.transition, "selected transition");
  const order = outgoing(page.shownAutomaton.transitions.filter(({origin}) => origin === chosen.origin));
  const index = order.indexOf(chosen) + step;
  if (index >= 0 && index < order.length) await commands.applyHere("reorderTransition", {transition: chosen.id, index});
}
