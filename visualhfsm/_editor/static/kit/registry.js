/**
 * The actions of the user by their ids: what buttons, menus, the palette, keys and help know of them.
 *
 * `actions.js` defines the actions. What they do may show their keys, so that it imports this table and not them.
 *
 * @typedef {{id: string, label: string, icon: string, keys?: string[], run: (context: Context) => unknown,
 *   opens?: boolean, enabled?: (context: Context) => boolean, checked?: (context: Context) => boolean, hint?: string,
 *   scope?: "canvas" | "code" | "drawing" | "page" | "typing", help?: string, words?: string,
 *   before?: string, after?: string, listed?: () => boolean, refused?: () => void}} Action The scope says where its keys
 *   hold: on the canvas, in code, which listens for them itself, also on the tools and the tree, anywhere but in fields, or everywhere. Without one, keys with
 *   Ctrl or Alt hold anywhere but in fields, and others, such as letters and Delete, on the drawing. `hint` says more than the label, `help` stands for both in the list of keys; `checked` says whether a switch
 *   is on, and `opens` that it opens a dialog for what is typed next. An action is also found by its `words`, which are not shown: what else people call it. In menus and lists it stands
 *   `before` or `after` another one, if that is so; menus leave out what is not `listed`.
 *   What is not possible may say why when it is `refused`.
 * @typedef {{app: import("../shell/app.js").HfsmApp, canvas: import("../canvas/canvas.js").HfsmCanvas,
 *   point?: {x: number, y: number}, pasted?: {text?: string, html?: string}}} Context `point` is where in the drawing a
 *   menu was opened, `pasted` what the system's clipboard has
 */

import {holdKeys} from "./waiting-keys.js";
import {required} from "./existence.js";
import {isForbidden} from "./viewers.js";
import {containsWords, folded} from "./texts.js";

/** All actions by their ids, in the order in which they are found. @type {Map<string, Action>} */
export const actions = new Map();

/** Add actions to the table. @param {Action[]} list */
export function addActions(list) {
  for (const action of list) actions.set(action.id, action);
}

/** Ids of actions, with those that stand before or after one of them. @param {string[]} ids */
export const withAdded = (ids) =>
  ids.flatMap((id) => {
    const beside = (/** @type {"before" | "after"} */ side) =>
      [...actions.values()].filter((each) => each[side] === id).map((each) => each.id);
    return [...beside("before"), id, ...beside("after")];
  });

/** An action by its id. @param {string} id */
export const actionOf = (id) => required(actions.get(id), `action ${id}`);

/** Whether an action is possible now. @param {Action} action @param {Context} context */
export const isPossible = (action, context) => !isForbidden(action) && (action.enabled?.(context) ?? true);

/** Whether an action is possible now. @param {string} id @param {Context} context */
export const isEnabled = (id, context) => isPossible(actionOf(id), context);

/** Whether menus have an action now: viewers see none that they may not perform. @param {string} id */
export const isOffered = (id) => !isForbidden(actionOf(id)) && (actionOf(id).listed?.() ?? true);

/** Perform an action, if it is possible now. @param {string} id @param {Context} context */
export function perform(id, context) {
  const {run, opens, refused} = actionOf(id);
  if (!isEnabled(id, context)) return refused?.();
  return opens ? holdKeys(async () => run(context)) : run(context);
}

/**
 * The actions that are possible now and contain all words of a text; those whose label begins with it come first.
 *
 * @param {string} text @param {Context} context
 */
export function findActions(text, context) {
  const sought = folded(text);
  /** @param {Action} action */
  const rank = ({label}) => [folded(label).startsWith(sought), folded(label).includes(sought), true].indexOf(true);
  return [...actions.values()]
    .filter(
      ({id, label, hint = "", help = "", words = ""}) =>
        id !== "palette" &&
        id !== "cancel" &&
        containsWords(`${label} ${hint} ${help} ${words}`, text) &&
        isEnabled(id, context),
    )
    .sort((one, other) => rank(one) - rank(other));
}
