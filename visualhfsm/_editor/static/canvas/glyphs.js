/** The glyphs of the drawing, as paths around (0, 0), and their labels. */

import {t} from "../kit/texts.js";

/** The triggers of transitions. @type {Record<string, {path: string, word: string, filled: boolean}>} */
export const TRIGGERS = {
  time: {path: "M0-5A5 5 0 1 1-.01-5M0-2.7V0L2 1.3", word: t("after a time"), filled: false},
  condition: {path: "M0-5L5 0L0 5L-5 0Z", word: t("on a condition"), filled: false},
  event: {path: "M1.5-5.5L-3.5 1H-.5L-1.5 5.5L3.5-1H.5Z", word: t("on an event"), filled: true},
  finished: {path: "M-4.5.5L-1.5 3.5L4.5-3.5", word: t("when finished below"), filled: false},
};
/** Marks of a comparison in words. @type {Record<string, string>} */
export const MARKS = {
  added: t("added"),
  removed: t("removed"),
  changed: t("changed"),
  moved: t("moved"),
  inside: t("changed inside"),
};
export const UNKNOWN_TRIGGER = {path: "M-3-3L3 3M3-3L-3 3", word: t("trigger unknown"), filled: false};

/** The badges of a state. @satisfies {Record<string, {path: string, word: string}>} */
export const BADGES = {
  child: {path: "M-4.5-1.5L0-4.5L4.5-1.5L0 1.5ZM-4.5 1.5L0 4.5L4.5 1.5", word: t("sub-automaton")},
  imported: {path: "M-4-4H1M-4-4V4H4V1M4-4L-1 1M-1-2.5V1H2.5", word: t("imported from another file")},
  resume: {path: "M-2.5-4V4M2.5-4V4M-2.5 0H2.5", word: t("resumes where it was")},
  error: {path: "M0-4.5V.8M0 4.2V4.3", word: t("error")},
  warning: {path: "M0-4.6L4.8 3.8H-4.8ZM0-1.6V1M0 2.5V2.6", word: t("warning")},
  restart: {path: "M3.6-1.5A4 4 0 1 0 4 1M4-4.5V-1.2H.8", word: t("restarts on entry")},
};
