/** Icons of 24 by 24, drawn with lines. */

import {svg, html} from "lit";

/** @type {Record<string, string>} */
const PATHS = {
  add: "M12 5v14M5 12h14",
  ball: "M12 20a8 8 0 1 0 0-16 8 8 0 0 0 0 16zM12 8.500l3.500 2.500-1.300 4h-4.400l-1.300-4zM12 4v4.500M4.400 10.500l4.100.5M19.600 10.500l-4.100.5M7.500 18.500l2.300-3.500M16.500 18.500l-2.300-3.500",
  ear: "M7 10a5.500 5.500 0 0 1 11 0c0 4-4 4.500-4 8a3 3 0 0 1-5.500 1.500M10 10.500a2.500 2.500 0 0 1 5 0c0 2-2 2-2 3.500",
  eye: "M2.500 12c2.500-4.500 5.800-6.500 9.500-6.500s7 2 9.500 6.500c-2.500 4.500-5.800 6.500-9.500 6.500S5 16.500 2.500 12zM12 15a3 3 0 1 0 0-6 3 3 0 0 0 0 6z",
  kick: "M8 3v7l-3 8M8 10l6 3 3 5M17.500 21a2 2 0 1 0 0-4 2 2 0 0 0 0 4zM8 3a1.500 1.500 0 1 0 0-.01",
  light:
    "M9 18h6M10 21h4M12 3a6 6 0 0 0-3.500 10.900c.5.400.8.900.8 1.600h5.400c0-.7.300-1.200.8-1.600A6 6 0 0 0 12 3z",
  shelf:
    "M3 4v16M21 4v16M3 11h18M3 19h18M6.500 6.500h4V11h-4zM13 8.500h4.500V11H13zM6.500 15h5v4h-5zM14.500 13.500h3V19h-3z",
  sit: "M9 5.500a1.800 1.800 0 1 0 0-.01M9 8v6h6l1 6M9 14l-3 6M9 10.500h4M4 20h2M16 20h2",
  speech: "M4 5h16v11h-8l-4.500 4V16H4zM8 9h8M8 12h5",
  stand: "M12 5.500a1.800 1.800 0 1 0 0-.01M12 8v6M12 14l-2.500 7M12 14l2.500 7M12 9l-4 4M12 9l4 4",
  touch:
    "M9 12V5.500a1.500 1.500 0 0 1 3 0V11l5.500 1.200c1 .3 1.500 1 1.400 2l-.7 6.300H10.500L6 15.500c-1-1.200.4-2.600 1.600-1.800L9 15M5.500 6a4.500 4.500 0 0 1 9.500-1",
  turn: "M19.500 9A8 8 0 1 0 20 13M20 4v5h-5",
  walk: "M13 5.500a1.800 1.800 0 1 0 0-.01M12.500 8.500l-2 5.500 3.500 3 1 4.500M10.500 14l-1.500 4-3 3M12.500 8.500l-4 1.500-1 3.500M12.500 8.500l2.500 3.500 3 1",
  wave: "M7.500 13V7a1.300 1.300 0 0 1 2.600 0v5M10.100 11V5a1.300 1.300 0 0 1 2.600 0v6M12.700 11V6a1.300 1.300 0 0 1 2.600 0v6M15.300 12V8.500a1.300 1.300 0 0 1 2.600 0V15c0 3.500-2 6-5.200 6-2.800 0-4-1.500-5.200-4l-2-3.500c-.6-1.200.8-2.200 1.700-1.200L8.500 14M20 4.500a5 5 0 0 1 1.500 3.500M3.500 4.500A5 5 0 0 0 2 8",
  alignBottom: "M4 20h16M7 16V6h3v10zM14 16v-6h3v6z",
  alignCenter: "M12 3v18M6 6h12v4H6zM8 14h8v4H8z",
  alignLeft: "M4 3v18M8 6h12v4H8zM8 14h7v4H8z",
  alignMiddle: "M3 12h18M6 6h4v12H6zM14 8h4v8h-4z",
  alignRight: "M20 3v18M4 6h12v4H4zM9 14h7v4H9z",
  alignTop: "M4 4h16M7 8v10h3V8zM14 8v6h3V8z",
  chevron: "M6 9l6 6 6-6",
  child: "M12 3l9 5-9 5-9-5zM3 13l9 5 9-5",
  close: "M6 6l12 12M18 6L6 18",
  code: "M9 7l-5 5 5 5M15 7l5 5-5 5",
  collapse: "M15 5l-7 7 7 7",
  copy: "M9 9h11v11H9zM15 9V4H4v11h5",
  cut: "M20 4L8.5 15.5M8.5 8.5L20 20M6 9.5A2.5 2.5 0 1 0 6 4.5a2.5 2.5 0 0 0 0 5zM6 19.5a2.5 2.5 0 1 0 0-5 2.5 2.5 0 0 0 0 5z",
  delete: "M4 7h16M10 11v6M14 11v6M6 7l1 13h10l1-13M9 7V4h6v3",
  diff: "M7 4v10M3.5 8h7M4 19h6M14 19h7M14 5l6.5 6.5M20.5 5L14 11.5",
  distributeX: "M4 4v16M20 4v16M10 7h4v10h-4z",
  distributeY: "M4 4h16M4 20h16M7 10v4h10v-4z",
  dots: "M5 12h.01M12 12h.01M19 12h.01",
  down: "M12 4v15M6 13l6 6 6-6",
  duplicate: "M9 9h11v11H9zM15 9V4H4v11h5M14.5 12v5M12 14.5h5",
  entry: "M3 12h11M10 8l4 4-4 4M19 5v14",
  exit: "M5 5v14M9 12h11M16 8l4 4-4 4",
  events: "M13 3L5 13h6l-1 8 8-10h-6z",
  exportFile: "M12 15V3M8 7l4-4 4 4M5 13v7h14v-7",
  file: "M6 3h8l4 4v14H6zM14 3v4h4",
  final: "M12 20a8 8 0 1 0 0-16 8 8 0 0 0 0 16zM12 15.5a3.5 3.5 0 1 0 0-7 3.5 3.5 0 0 0 0 7z",
  expand: "M14 4h6v6M20 4l-7 7M10 20H4v-6M4 20l7-7",
  fit: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  flask: "M10 3v6L5 19l1 2h12l1-2-5-10V3M8 3h8M7.5 14.5h9",
  folder: "M3 6h6l2 2h10v11H3z",
  frame: "M4 4h16v16H4zM4 9h16",
  color:
    "M12 20a8 8 0 1 1 8-8c0 2.500-2 3-3.500 3H15a1.800 1.800 0 0 0-1 3.300c.6.6-.4 1.700-2 1.700zM8 11h.01M11 7.500h.01M15.500 8.500h.01",
  functions: "M15 5c-3-1-4 1-4 4v6c0 3-1 5-4 4M7 11h8",
  globe: "M12 21a9 9 0 1 0 0-18 9 9 0 0 0 0 18zM3 12h18M12 3c-5 5-5 13 0 18 5-5 5-13 0-18z",
  generate:
    "M4 5h16M4 10h9M4 15h6M4 20h6M17 11l1.300 3.200L21.5 15.5l-3.200 1.300L17 20l-1.300-3.200L12.5 15.5l3.200-1.300z",
  group:
    "M3 3h18v18H3zM9.5 12.500a2.500 2.500 0 1 0 0-5 2.500 2.500 0 0 0 0 5zM15.500 17.500a2.500 2.500 0 1 0 0-5 2.500 2.500 0 0 0 0 5z",
  help: "M9 9a3 3 0 1 1 4 2.800c-.8.4-1 .9-1 2.200M12 18h.01M12 21a9 9 0 1 0 0-18 9 9 0 0 0 0 18z",
  history: "M4 12a8 8 0 1 0 3-6.200M7 2v4h4M12 8v4l3 2",
  initial: "M12 20a8 8 0 1 0 0-16 8 8 0 0 0 0 16zM12 16.5a4.5 4.5 0 1 0 0-9 4.5 4.5 0 0 0 0 9z",
  interfaces: "M9 3v5M15 3v5M6 8h12v3a6 6 0 0 1-12 0zM12 17v4",
  breakpoint: "M12 18.500a6.500 6.500 0 1 0 0-13 6.500 6.500 0 0 0 0 13zM12 9v6",
  breakpointIf: "M12 18.500a6.500 6.500 0 1 0 0-13 6.500 6.500 0 0 0 0 13zM9 10.500h6M9 13.500h6",
  film: "M4 5h16v14H4zM8 5v14M16 5v14M4 9.500h4M4 14.500h4M16 9.500h4M16 14.500h4",
  force: "M3 12h9M9 8l4 4-4 4M17 5v14M21 5v14",
  link: "M10 14a4 4 0 0 0 5.700 0l3-3a4 4 0 0 0-5.700-5.700l-1 1M14 10a4 4 0 0 0-5.700 0l-3 3a4 4 0 0 0 5.700 5.700l1-1",
  live: "M12 14a2 2 0 1 0 0-4 2 2 0 0 0 0 4zM7.500 16.500a6.400 6.400 0 0 1 0-9M16.500 7.500a6.400 6.400 0 0 1 0 9",
  lock: "M6 11h12v9H6zM8.500 11V8a3.500 3.500 0 0 1 7 0v3",
  note: "M4 4h16v11l-5 5H4zM15 20v-5h5M8 8.500h8M8 12h5",
  next: "M6 5l9 7-9 7zM18 5v14",
  pause: "M8 5v14M16 5v14",
  previous: "M18 5l-9 7 9 7zM6 5v14",
  reload: "M20 12a8 8 0 1 1-2.500-5.800M20 3v4h-4",
  resume: "M5 5v14M9 5l11 7-11 7z",
  step: "M5 5l9 7-9 7zM18 5v14",
  stepAll: "M3 6l6 6-6 6zM11 6l6 6-6 6zM20 6v12",
  target: "M12 16a4 4 0 1 0 0-8 4 4 0 0 0 0 8zM12 2v4M12 18v4M2 12h4M18 12h4",
  unlink:
    "M10 14a4 4 0 0 0 5.700 0l3-3a4 4 0 0 0-5.700-5.700l-1 1M14 10a4 4 0 0 0-5.700 0l-3 3a4 4 0 0 0 5.700 5.700l1-1M4 4l16 16",
  layout: "M9 3h6v5H9zM3 16h6v5H3zM15 16h6v5h-6zM12 8v4M6 16v-4h12v4",
  menu: "M4 6h16M4 12h16M4 18h16",
  minus: "M5 12h14",
  moon: "M20 14.5A8.5 8.5 0 0 1 9.5 4 8.5 8.5 0 1 0 20 14.5z",
  open: "M3 19V6h6l2 2h8v3M3 19l3-8h16l-3 8z",
  parallel: "M8 4v16M13 4v16M19 9v6M16 12h6",
  paste: "M8 5H5v16h14V5h-3M9 3h6v4H9z",
  problems: "M12 3l10 18H2zM12 10v5M12 18h.01",
  properties: "M5 12l4 4L19 6",
  record: "M12 18a6 6 0 1 0 0-12 6 6 0 0 0 0 12z",
  redo: "M20 8H9a5 5 0 0 0 0 10h4M16 4l4 4-4 4",
  rename: "M4 20l1-4L16 5l3 3L8 19zM14 7l3 3",
  robot: "M5 9h14v10H5zM9 13.500v1M15 13.500v1M12 9V5M12 5h.01M2.500 12v4M21.500 12v4",
  run: "M7 4l13 8-13 8z",
  save: "M4 4h13l3 3v13H4zM8 4v5h8V4M8 20v-6h8v6",
  saveAs: "M12 20H4V4h13l3 3v4M8 4v5h8V4M14 21l1-3 5-5 2 2-5 5z",
  search: "M10.5 17a6.5 6.5 0 1 0 0-13 6.5 6.5 0 0 0 0 13zM15.5 15.5L21 21",
  select: "M6 3l13 8-6 1.500L9.500 19z",
  selfLoop: "M9 13a5 5 0 1 0 6 0M9 13c-5-9 11-9 6 0",
  state: "M12 20a8 8 0 1 0 0-16 8 8 0 0 0 0 16z",
  stop: "M6 6h12v12H6z",
  sun: "M12 16a4 4 0 1 0 0-8 4 4 0 0 0 0 8zM12 2v3M12 19v3M2 12h3M19 12h3M5 5l2 2M17 17l2 2M19 5l-2 2M7 17l-2 2",
  timing: "M12 21a8 8 0 1 0 0-16 8 8 0 0 0 0 16zM12 9v4l3 2M9 2h6",
  transition: "M3 17C6 7 14 5 20 9M15 5l5 4-3 5.5",
  tests: "M4 6l2 2 3-4M4 13l2 2 3-4M4 20l2 2 3-4M13 6h7M13 13h7M13 20h7",
  trials: "M3 20.5h18M6 20V11M12 20V4M18 20v-5",
  undo: "M4 8h11a5 5 0 0 1 0 10h-4M8 4L4 8l4 4",
  up: "M12 20V5M6 11l6-6 6 6",
  variables:
    "M7 4c-2 0-2 1-2 3v2c0 2-1 3-2 3 1 0 2 1 2 3v2c0 2 0 3 2 3M17 4c2 0 2 1 2 3v2c0 2 1 3 2 3-1 0-2 1-2 3v2c0 2 0 3-2 3M9.5 9.5l5 5M14.5 9.5l-5 5",
  parameters:
    "M4 7h10M18 7h2M4 17h2M10 17h10M16 9.5a2.5 2.5 0 1 0 0-5 2.5 2.5 0 0 0 0 5zM8 19.5a2.5 2.5 0 1 0 0-5 2.5 2.5 0 0 0 0 5z",
};

/**
 * A button with an icon alone.
 *
 * @param {string} image the name of the icon
 * @param {string} label for screen readers, and beside the pointer unless there is another `title`
 * @param {() => unknown} act @param {{title?: string, kind?: string, disabled?: boolean}} more
 */
export const iconButton = (image, label, act, {title = label, kind = "", disabled = false} = {}) =>
  html`<button
    type="button"
    class="action bare ${kind}"
    aria-label=${label}
    title=${title}
    ?disabled=${disabled}
    @click=${act}
  >
    ${icon(image)}
  </button>`;

/** Whether there is an icon of a name. @param {string} name */
export const isIcon = (name) => Object.hasOwn(PATHS, name);

/** An icon by its name, for a template of Lit; screen readers do not see it. @param {string} name */
export function icon(name) {
  return html`<svg class="icon" viewBox="0 0 24 24" aria-hidden="true" focusable="false">
    ${svg`<path d=${PATHS[name] ?? ""}></path>`}
  </svg>`;
}
