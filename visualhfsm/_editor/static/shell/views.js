/**
 * Views of plug-ins: panels beside the drawing, with actions. Their module `view.js` is loaded with the page, and that
 * of a panel when it is first shown.
 *
 * @import {Action} from "../kit/registry.js"
 */

import {messageOf, notifyError} from "../kit/notices.js";
import {addActions} from "../kit/registry.js";
import {t} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";
import {page} from "../data/page.js";

/**
 * @typedef {{name: string, tag: string, title: string, module: string, actions: Action[]}} View `name` is that of its
 *   entry point, `tag` that of the element of its panel, which `module` defines
 */

/** The views by the tags of their panels. @type {Map<string, View>} */
export const views = new Map();

/** Add a view. @param {View} view */
export function addView(view) {
  views.set(view.tag, view);
  addActions(view.actions);
}

/** Whether a view has something to show of the document. @param {{name: string}} view */
export const isOffered = ({name}) => !viewing.on && Boolean(page.tabState?.views.includes(name));

/** Load the views that the page names; what cannot be loaded is reported. */
export async function loadViews() {
  const files = document.querySelector("meta[name=views]")?.getAttribute("content")?.split(" ").filter(Boolean) ?? [];
  await Promise.all(
    files.map((file) =>
      import(new URL(file, document.baseURI).href).catch((error) =>
        notifyError(new Error(t("{file} could not be loaded: {reason}", {file, reason: messageOf(error)}))),
      ),
    ),
  );
}
