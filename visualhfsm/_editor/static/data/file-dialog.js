/**
 * Choose a document among those that the server can reach.
 *
 * @import {From} from "./element.js"
 * @import {ListedEntry} from "./protocol.js"
 * @typedef {import("../kit/dialog.js").Close<string>} Close
 * @typedef {Pick<ListedEntry, "name" | "path" | "kind"> & Partial<ListedEntry>} Entry
 */

import {html, nothing} from "lit";

import {icon} from "../kit/icons.js";
import {messageOf} from "../kit/notices.js";
import {store} from "./store.js";
import {containsWords, language, rich, t, visible} from "../kit/texts.js";
import {Finder} from "../kit/finder.js";
import {showDialog} from "../kit/dialog.js";

/**
 * @param {{title: string, verb: string, suggestion?: string, start?: string, kind?: "document" | "recording" | "model", hint?: string,
 *   attempt?: (path: string) => Promise<string>}} options with a `suggestion` a new name may be typed; `attempt` uses
 *   the path, and returns why that failed: the dialog stays open until it succeeds
 * @returns {Promise<string | undefined>} a path
 */
export async function chooseFile({title, verb, suggestion, start = "", kind = "document", hint = "", attempt}) {
  const saving = suggestion !== undefined;
  const [, folder = start, name = ""] = /^(?:(.*)\/)?([^/]*)$/.exec(suggestion ?? "") ?? [];
  /** @type {{directory: string, parent: string | null, entries: Entry[], error: string, name: string}} */
  const state = {directory: folder, parent: null, entries: [], error: "", name};
  const finder = new Finder("file");
  let draw = () => {};
  /** Resolves once the list is that of the directory. */
  let listed = Promise.resolve();
  /** Resolves once what was chosen before is opened. */
  let opened = Promise.resolve();

  /** The entry of a directory that is chosen first: what is in it, not the way up; or the best of what is found. */
  const first = (text = finder.text) => (state.parent !== null && !text ? 1 : 0);

  /** List a directory, in which any name may be typed. @param {string} directory */
  const show = (directory) => {
    listed = list(directory);
  };

  /**
   * List a directory, or the root when that is not possible; `error` is shown besides.
   *
   * @param {string} directory
   * @returns {Promise<void>}
   */
  const list = async (directory, error = "") => {
    state.error = error; // and not once the files have come: what failed meanwhile has to stay
    try {
      Object.assign(state, await store.request("listFiles", {directory, below: !saving}));
      finder.chosen = Math.max(0, Math.min(first(), rows().length - 1));
    } catch (reason) {
      finder.chosen = 0;
      if (directory) return list("", directory === start ? "" : messageOf(reason));
      state.error = messageOf(reason);
    }
    draw();
    return undefined;
  };

  /** @returns {Entry[]} */
  const all = () => [
    ...(state.parent === null ? [] : [{name: "..", path: state.parent, kind: /** @type {const} */ ("directory")}]),
    ...state.entries.filter(
      (each) => each.kind === "directory" || (each.kind === kind && !(saving && /\.scxml$/i.test(each.name))),
    ),
  ];
  const rows = (text = finder.text) => (text ? all().filter((each) => containsWords(each.name, text)) : all());
  const typed = () =>
    (state.directory ? `${state.directory}/` : "") + (/\.xml$/i.test(state.name) ? state.name : `${state.name}.xml`);

  /** @param {Entry} row @param {Close} close */
  const take = (row, close) => {
    if (row.kind === "directory") show(row.path);
    else if (saving) {
      state.name = row.name;
      draw();
    } else close(row.path);
  };

  /** @param {Close} close */
  const accept = async (close) => {
    if (saving) {
      if (!state.name.trim()) return;
      const wanted = typed();
      state.error = (await attempt?.(wanted)) ?? "";
      if (state.error) draw();
      else close(wanted);
      return;
    }
    // Enter may come before the folder is listed: it takes the first row then, and later letters search in that.
    const {text, chosen} = finder;
    const {entries} = state;
    finder.clear();
    draw();
    opened = opened.then(async () => {
      await listed;
      const row = rows(text)[state.entries === entries ? chosen : first(text)];
      if (row) return take(row, close);
      finder.text = text + finder.text;
      return draw();
    });
  };

  /** What keys do in the field above the list, and in the list. @param {KeyboardEvent} event @param {Close} close */
  const press = ({key}, close) => {
    if (key === "Enter" && !saving) accept(close);
    else if (key === "Enter" && rows()[finder.chosen]) take(rows()[finder.chosen], close);
    else if (key === "Backspace" && !finder.text && state.parent !== null) show(state.parent);
    else return false;
    return true;
  };

  /** Keys in the list itself, beside a field for a new name. @param {KeyboardEvent} event @param {Close} close */
  const move = (event, close) => {
    const last = rows().length - 1;
    const next = /** @type {Record<string, number>} */ ({
      ArrowDown: Math.min(last, finder.chosen + 1),
      ArrowUp: Math.max(0, finder.chosen - 1),
      Home: 0,
      End: last,
    })[event.key];
    if (next !== undefined) finder.choose(next, draw);
    else if (!press(event, close)) return;
    event.preventDefault();
  };

  /** @param {KeyboardEvent} event @param {Close} close */
  const enter = (event, close) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    accept(close);
  };

  const [nothingHere, listName] = {
    document: [t("No documents in this folder."), t("Documents and folders")],
    recording: [t("No recordings in this folder."), t("Recordings and folders")],
    model: [t("No models of robots in this folder."), t("Models of robots and folders")],
  }[kind];
  const path = showDialog({
    title,
    content: (/** @type {Close} */ close, redraw) => {
      draw = redraw;
      const shown = rows();
      const nothingShown = finder.text ? t("No matches for “{text}”.", {text: finder.text}) : nothingHere;
      return html`${hint ? html`<p class="explain">${hint}</p>` : nothing}
        <p class="folder">${state.directory || store.greeting.root || "."}</p>
        ${state.error ? html`<p role="alert">${state.error}</p>` : nothing}
        ${
          saving
            ? nothing
            : finder.field({
                label: t("Part of the name"),
                count: shown.length,
                press: (event) => press(event, close),
                redraw,
              })
        }
        <div
          class="files"
          id=${finder.listId}
          role=${shown.length ? "listbox" : "group"}
          tabindex=${saving ? 0 : nothing}
          aria-label=${listName}
          aria-activedescendant=${saving && shown.length ? finder.entryId(finder.chosen) : nothing}
          @keydown=${(/** @type {KeyboardEvent} */ event) => move(event, close)}
          @mousedown=${(/** @type {MouseEvent} */ event) => saving || event.preventDefault()}
        >
          ${shown.some((row) => row.name !== "..") ? nothing : html`<p class="empty">${nothingShown}</p>`}
          ${shown.map(
            (row, index) =>
              html`<div
                role="option"
                id=${finder.entryId(index)}
                aria-selected=${index === finder.chosen}
                @click=${() => {
                  finder.chosen = index;
                  if (saving && row.kind !== "directory") state.name = row.name;
                  redraw();
                }}
                @dblclick=${() => {
                  finder.clear();
                  take(row, close);
                }}
              >
                ${icon(row.kind === "directory" ? "folder" : "file")}<span>${visible(row.name)}</span>${
                  row.changedAt
                    ? html`<span class="when"
                        >${new Date(row.changedAt * 1000).toLocaleString(language, {
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
                  <label for="file-name">${t("Name")}</label
                  ><input
                    id="file-name"
                    autofocus
                    .value=${state.name}
                    @input=${(/** @type {From<HTMLInputElement>} */ {target}) => (state.name = target.value)}
                    @keydown=${(/** @type {KeyboardEvent} */ event) => enter(event, close)}
                  />
                </div>
                <p class="explain">
                  ${rich("A missing folder in the name, as in {example}, is created.", {example: html`<code>dances/wave</code>`})}
                </p>`
            : nothing
        }`;
    },
    footer: (close) =>
      html`<button type="button" class="button" @click=${() => close()}>${t("Cancel")}</button
        ><button type="button" class="button primary" @click=${() => accept(close)}>${verb}</button>`,
  });
  show(folder);
  return path;
}
