/** What CodeMirror itself says in a code field; `$` stands for a number. */

import {t} from "../kit/texts.js";

/** @type {Record<string, string>} */
export const PHRASES = {
  "Control character": t("Control character"),
  "Selection deleted": t("Selection deleted"),
  // Completion and problems.
  Completions: t("Completions"),
  Diagnostics: t("Problems"),
  "No diagnostics": t("No problems"),
  // Folded lines.
  "Fold line": t("Fold line"),
  "Unfold line": t("Unfold line"),
  "Folded lines": t("Folded lines"),
  "Unfolded lines": t("Unfolded lines"),
  "folded code": t("folded code"),
  unfold: t("unfold"),
  to: t("to"),
  // Search.
  Find: t("Find"),
  Replace: t("Replace"),
  all: t("all"),
  "by word": t("by word"),
  close: t("close"),
  "current match": t("current match"),
  "match case": t("match case"),
  next: t("next"),
  "on line": t("on line"),
  previous: t("previous"),
  regexp: t("regexp"),
  replace: t("replace"),
  "replace all": t("replace all"),
  "replaced $ matches": t("replaced $ matches"),
  "replaced match on line $": t("replaced match on line $"),
  "Go to line": t("Go to line"),
  go: t("go"),
};
