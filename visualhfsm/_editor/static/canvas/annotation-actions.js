/**
 * The actions on notes and frames; part of the table of all actions.
 *
 * @import {Action} from "../kit/registry.js"
 * @import {Commands} from "../data/protocol.js"
 */

import {applyHere} from "../data/commands.js";
import {holdKeys} from "../kit/waiting-keys.js";
import {page} from "../data/page.js";
import {t} from "../kit/texts.js";
import {colorOf, COLORS} from "../measures/areas.js";

const editing = () => import("./annotations.js");
const drawable = () => page.automaton !== undefined && !page.automaton.imported;
const isAnnotated = () => drawable() && page.annotations.size > 0;
const isOne = () => drawable() && Boolean(page.annotation);

/** @type {Record<string, string>} */
const NAMES = {yellow: t("Yellow"), blue: t("Blue"), green: t("Green"), pink: t("Pink"), gray: t("Gray")};

/** @param {string} color @returns {Action} */
const colored = (color) => ({
  id: `color${color[0].toUpperCase()}${color.slice(1)}`,
  label: NAMES[color],
  icon: "color",
  enabled: isAnnotated,
  run: () =>
    applyHere("setAnnotationColor", {
      annotations: [...page.annotations],
      color: /** @type {Commands["setAnnotationColor"]["color"]} */ (color),
    }),
  hint: t("color of the note or the frame"),
  checked: () => page.annotation !== undefined && colorOf(page.annotation) === color,
});

/** @param {string} id @param {string} label @param {string} key @param {number} dx @param {number} dy @returns {Action} */
const grown = (id, label, key, dx, dy) => ({
  id,
  label,
  icon: "",
  keys: [key],
  scope: "canvas",
  enabled: isOne,
  run: async () => (await editing()).grow(dx, dy),
});

/** @type {Action[]} */
export const annotationActions = [
  {
    id: "newNote",
    label: t("Note"),
    words: t("comment, remark, text"),
    icon: "note",
    keys: ["N"],
    enabled: drawable,
    run: ({canvas}) =>
      holdKeys(async () => {
        canvas.useTool((await editing()).NoteTool);
        return canvas.tool;
      }),
    hint: t("write why it is so"),
    help: t("New note"),
  },
  {
    id: "frame",
    label: t("Frame"),
    icon: "frame",
    keys: ["Ctrl+Shift+G"],
    enabled: drawable,
    run: ({canvas}) =>
      holdKeys(async () => {
        const {FrameTool, frameSelection} = await editing();
        if (page.states.size + page.annotations.size) return frameSelection(canvas);
        canvas.useTool(FrameTool);
        return canvas.tool;
      }),
    hint: t("group the selected states below a title; they move together"),
    help: t("New frame around the selection: its states move together"),
  },
  {
    id: "write",
    label: t("Edit the text"),
    icon: "rename",
    enabled: isOne,
    run: ({canvas}) => page.annotation && canvas.beginRename("annotation", page.annotation.id),
  },
  ...COLORS.map(colored),
  grown("wider", t("Make wider"), "Shift+ArrowRight", 20, 0),
  grown("narrower", t("Make narrower"), "Shift+ArrowLeft", -20, 0),
  grown("higher", t("Make higher"), "Shift+ArrowDown", 0, 20),
  grown("lower", t("Make lower"), "Shift+ArrowUp", 0, -20),
];

/** The actions on the selected notes and frames, in groups. @returns {string[][]} */
export const annotatedSelection = () => [
  [...(page.annotation ? ["write"] : []), "delete"],
  annotationActions.filter(({id}) => id.startsWith("color")).map(({id}) => id),
  ["copy", "cut", "duplicate", "frame"],
];
