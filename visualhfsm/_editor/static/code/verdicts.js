/** The verdicts of the model checker on the properties of a document. */

import {FAILED} from "../data/problems.js";
import {t} from "../kit/texts.js";
import {placeOf} from "../data/places.js";

/**
 * @import {Problem} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @typedef {{kind: "holds" | "violated" | "undecided" | "invalid" | "unknown", words: string}} Verdict
 */

/** What the model checker assumes; `visualhfsm check` has the same words. */
export const ASSUMPTIONS = t(
  "Proofs, and what is called impossible, hold as long as cycles begin and end within their periods, automata " +
    "side by side change on time, code raises no errors, libraries use only what code passes to them, and " +
    "nobody pauses, forces, sets or reloads anything.",
);

/** @type {Record<string, Verdict>} */
const BY_CODE = {
  E610: {kind: "violated", words: t("Violated.")},
  W611: {kind: "undecided", words: t("Undecided: the search took too long, or some code cannot be followed.")},
  E612: {kind: "invalid", words: t("Not understood.")},
  E613: {kind: "invalid", words: t("Not understood.")},
};

/** Whether a problem is the verdict on a valid property. @param {Problem} problem */
export const isVerdict = ({code}) => code === "E610" || code === "W611";

/**
 * The verdict on the property at an index; undefined where there is none.
 *
 * The checker does not run on a document with other errors. It does not report proven properties: one that is not among
 * the problems of the present revision holds.
 *
 * @param {OpenDocument} document
 * @returns {Verdict | undefined}
 * @param {number} index
 */
export function verdictOf(document, index) {
  const {problems, revision, proved} = document;
  /** @param {Problem} problem */
  const isOfProperty = (problem) => problem.code in BY_CODE;
  const own = problems.find(
    (each) => isOfProperty(each) && placeOf(each).part === "properties" && (placeOf(each).index ?? 0) === index,
  );
  if (own) return BY_CODE[own.code];
  if (!document.fields.properties?.[index]?.expression.trim()) return undefined;
  if (proved !== revision) return {kind: "unknown", words: t("Checking…")};
  if (problems.some((each) => each.severity === "error" && each.code !== FAILED && !isOfProperty(each)))
    return {kind: "unknown", words: t("Not checked: the document has errors.")};
  if (problems.some(({code}) => !code))
    return {kind: "unknown", words: t("Not checked: the model checker took too long or failed.")};
  return {kind: "holds", words: t("Holds in every run.")};
}
