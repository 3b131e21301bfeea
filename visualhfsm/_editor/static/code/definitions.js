/**
 * From a name in code to where it is defined, and back.
 *
 * @import {Place} from "../data/protocol.js"
 * @import {At} from "../data/page.js"
 * @typedef {{tab: number, place: Place}} About a piece of code
 */

import {EditorView, keymap} from "codemirror";
import {ask} from "../data/commands.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {isMac, written} from "../kit/keys.js";
import {notify} from "../kit/notices.js";
import {t} from "../kit/texts.js";

/** Where names were followed from, the last one at the end. @type {(About & At)[]} */
const left = [];
/** Follows the name at the cursor of the code that had the focus last. @type {() => unknown} */
let follow = () => notify(t("Put the cursor on a name in code first."));

/** The keys and clicks of one piece of code. @param {About} about */
export const definitions = (about) => [
  keymap.of([
    {key: "F12", run: (view) => goFrom(about, view, view.state.selection.main.head)},
    {mac: "Ctrl--", run: goBack},
  ]),
  EditorView.domEventHandlers({
    focus: (_, view) => {
      follow = () => goFrom(about, view, view.state.selection.main.head);
    },
    mousedown(event, view) {
      const position = view.posAtCoords(event);
      const isAsked = (isMac ? event.metaKey : event.ctrlKey) && !event.button && !event.shiftKey && !event.altKey;
      return isAsked && position !== null && view.state.wordAt(position) !== null && goFrom(about, view, position);
    },
  }),
];

/** @param {About} about @param {EditorView} view @param {number} position */
function goFrom({tab, place}, {state: {doc}}, position) {
  const {number: line, from} = doc.lineAt(position);
  const column = position - from;
  const about = {tab, place, code: doc.toString(), line, column};
  ask("codeHelp", {wanted: "define", ...about}).then((answer) => {
    const found = /** @type {(At & {place: Place}) | null | undefined} */ (answer);
    if (found === null) notify(t("Nothing in this document defines that."));
    if (!found) return;
    left.push({tab, place, line, column: column + 1});
    page.jump(found.place, found);
  });
  return true;
}

/** Go to the definition of the name at the cursor, for the menu. */
export const goToDefinition = () => follow();

/** Go back to where a name was followed from; false if there is no such place. */
export function goBack() {
  const {tab = 0, place, ...at} = left.pop() ?? {};
  if (!place || !store.documents.has(tab)) return false;
  page.show(tab);
  page.jump(place, at);
  return true;
}

// It is the browser's key as long as there is no way back, the drawing's on it, and moves by words in a text on a Mac.
addEventListener(
  "keydown",
  (event) => {
    const isOurs = event.target instanceof Element && !event.target.closest("hfsm-canvas, dialog, [role=menu]");
    if (isMac || !isOurs || written(event) !== "Alt+ArrowLeft" || !goBack()) return;
    event.preventDefault();
    event.stopPropagation();
  },
  {capture: true},
);
