/** Choose a document among those that the server reaches. */

import {html, nothing} from "lit";

import {icon} from "../icons.js";
import {store} from "../store.js";
import {showDialog} from "./dialog.js";

/**
 * @param {{title: string, verb: string, suggestion?: string, kind?: "document" | "recording"}} options with a
 *   `suggestion` a new name may be typed
 * @returns {Promise<string | undefined>} a path
 */
export async function chooseFile({title, verb, suggestion, kind = "document"}) {
  const saving = suggestion !== undefined;
  const [, folder = "", name = ""] = /^(?:(.*)\/)?([^/]*)$/.exec(suggestion ?? "") ?? [];
  const state = {directory: folder, parent: null, entries: [], error: "", name, chosen: 0};
  let draw = () => {};

  /** List a directory, or the root when that is not possible; `error` is shown besides. */
  const list = async (directory, error = "") => {
    try {
      Object.assign(state, await store.request("listFiles", {directory}), {error, chosen: 0});
    } catch (reason) {
      if (directory) return list("", reason.message);
      state.error = reason.message;
    }
    draw();
    return undefined;
  };

  const rows = () => [
    ...(state.parent === null ? [] : [{name: "..", path: state.parent, kind: "directory"}]),
    ...state.entries.filter(
      (each) => each.kind === "directory" || (each.kind === kind && !(saving && /\.scxml$/i.test(each.name))),
    ),
  ];
  const path = () =>
    (state.directory ? `${state.directory}/` : "") + (/\.xml$/i.test(state.name) ? state.name : `${state.name}.xml`);

  const take = (row, close) => {
    if (row.kind === "directory") list(row.path);
    else if (saving) {
      state.name = row.name;
      draw();
    } else close(row.path);
  };

  const accept = (close) => {
    if (saving) {
      if (state.name.trim()) close(path());
    } else if (rows()[state.chosen]) take(rows()[state.chosen], close);
  };

  const key = (event, close) => {
    const last = rows().length - 1;
    const next = /** @type {Record<string, number>} */ ({
      ArrowDown: Math.min(last, state.chosen + 1),
      ArrowUp: Math.max(0, state.chosen - 1),
      Home: 0,
      End: last,
    })[event.key];
    if (next !== undefined) state.chosen = next;
    else if (event.key === "Enter" && rows()[state.chosen]) take(rows()[state.chosen], close);
    else if (event.key === "Backspace" && state.parent !== null) list(state.parent);
    else return;
    event.preventDefault();
    draw();
    document.getElementById(`file-${state.chosen}`)?.scrollIntoView({block: "nearest"});
  };

  const shown = showDialog({
    title,
    content: (close, redraw) => {
      draw = redraw;
      return html`<p class="folder">${state.directory || store.greeting.root || "."}</p>
        ${state.error ? html`<p role="alert">${state.error}</p>` : nothing}
        <div
          class="files"
          role="listbox"
          tabindex="0"
          aria-label=${kind === "recording" ? "Recordings and folders" : "Documents and folders"}
          aria-activedescendant=${rows().length ? `file-${state.chosen}` : nothing}
          ?autofocus=${!saving}
          @keydown=${(event) => key(event, close)}
        >
          ${rows().map(
            (row, index) =>
              html`<div
                role="option"
                id="file-${index}"
                aria-selected=${index === state.chosen}
                @click=${() => {
                  state.chosen = index;
                  if (saving && row.kind !== "directory") state.name = row.name;
                  redraw();
                }}
                @dblclick=${() => take(row, close)}
              >
                ${icon(row.kind === "directory" ? "folder" : "file")}<span>${row.name}</span>${
                  row.changedAt
                    ? html`<span class="when"
                        >${new Date(row.changedAt * 1000).toLocaleString([], {
                          dateStyle: "medium",
                          timeStyle: "short",
                        })}</span
                      >`
                    : nothing
                }
              </div>`,
          )}
        </div>
        ${
          saving
            ? html`<div class="field">
                <label for="file-name">Name</label
                ><input
                  id="file-name"
                  autofocus
                  .value=${state.name}
                  @focus=${({target}) => target.select()}
                  @input=${(event) => (state.name = event.target.value)}
                  @keydown=${(event) => event.key === "Enter" && (event.preventDefault(), accept(close))}
                />
              </div>`
            : nothing
        }`;
    },
    footer: (close) =>
      html`<button type="button" class="button" @click=${() => close()}>Cancel</button
        ><button type="button" class="button primary" @click=${() => accept(close)}>${verb}</button>`,
  });
  list(folder);
  return shown;
}
