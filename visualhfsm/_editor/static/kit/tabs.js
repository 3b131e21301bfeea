/**
 * Tabs inside a panel, after the pattern of the WAI.
 *
 * @import {From} from "../data/element.js"
 * @import {Problem} from "../data/protocol.js"
 * @typedef {{id: string, label: string, filled?: boolean, problems?: Problem[]}} Tab
 */

import {html, nothing} from "lit";
import {coded, n, t} from "./texts.js";

/**
 * @param {{label: string, tabs: Tab[], chosen: string, choose: (id: string) => void, write?: (id: string) => void,
 *   prefix: string}} options `write` is called instead of `choose` for a click, to put the cursor into the panel of the
 *   tab; `prefix` begins the ids of tabs and their panels
 */
export function tabStrip({label, tabs, chosen, choose, write = choose, prefix}) {
  /** @param {KeyboardEvent & From<HTMLElement>} event */
  const press = (event) => {
    const step = /** @type {Record<string, number>} */ ({ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity})[
      event.key
    ];
    if (step === undefined || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    const index = tabs.findIndex((each) => each.id === chosen);
    const next = Number.isFinite(step) ? (index + step + tabs.length) % tabs.length : step < 0 ? 0 : tabs.length - 1;
    choose(tabs[next].id);
    /** @type {HTMLElement} */ (event.currentTarget.children[next]).focus();
  };
  /** @param {Tab} tab */
  const words = ({label: text, filled, problems = []}) =>
    [text, filled && t("not empty"), problems.length && counted(problems)].filter(Boolean).join(", ");
  return html`<div class="inner-tabs" role="tablist" aria-label=${label} @keydown=${press}>
    ${tabs.map(
      (each) =>
        html` <button
          type="button"
          role="tab"
          id="${prefix}-tab-${each.id}"
          aria-controls="${prefix}-panel"
          aria-selected=${each.id === chosen}
          tabindex=${each.id === chosen ? 0 : -1}
          aria-label=${words(each)}
          @click=${() => write(each.id)}
        >
          ${each.label}${
            each.filled ? html`<span class="filled" title=${t("not empty")}></span>` : nothing
          }${badge(each.problems ?? [])}
        </button>`,
    )}
  </div>`;
}

/** The messages of problems, below the field that has them. @param {Problem[]} problems */
export const problemLines = (problems) =>
  problems.length
    ? html`<p class="field-problems">
        ${problems.map((each) => html`<span class=${each.severity}>${coded(each.message)}</span>`)}
      </p>`
    : nothing;

/** @param {Problem[]} problems */
const counted = (problems) => n("{count} problem", "{count} problems", problems.length);

/** How many problems there are, colored by the gravest; not for screen readers. @param {Problem[]} problems */
export function badge(problems) {
  if (!problems.length) return nothing;
  const gravest = ["error", "warning", "note"].find((severity) => problems.some((each) => each.severity === severity));
  return html`<span
    class="count-badge ${gravest}"
    aria-hidden="true"
    data-count=${problems.length}
    title=${counted(problems)}
  ></span>`;
}
