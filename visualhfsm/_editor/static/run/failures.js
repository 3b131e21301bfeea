/**
 * What was made to fail, in words.
 *
 * @import {Fault} from "../data/protocol.js"
 */

import {language, t} from "../kit/texts.js";

/** The kinds of failures that we know; others have their own names. @type {Record<string, string>} */
const WORDS = {
  backlash: t("backlash"),
  black: t("black"),
  blurred: t("blurred"),
  dark: t("dark"),
  dead: t("dead"),
  drifting: t("drifting"),
  frozen: t("frozen"),
  halved: t("halved"),
  held: t("held"),
  hot: t("hot"),
  late: t("late"),
  limp: t("limp"),
  loaded: t("loaded"),
  low: t("low"),
  noisy: t("noisy"),
  offset: t("offset"),
  silent: t("silent"),
  slow: t("slow"),
  stuck: t("stuck"),
  weak: t("weak"),
};

/** @param {Fault[]} faults */
export const spokenFailures = (faults) =>
  faults
    .map(({part, kind, amount}) => `${part} ${WORDS[kind] ?? kind} ${amount ? amount.toLocaleString(language) : ""}`)
    .map((each) => each.trim())
    .join(", ");

/** What fails at a moment, as a sentence; "" for nothing. @param {Fault[]} faults */
export const spokenFailing = (faults) =>
  faults.length ? t("Made to fail: {what}", {what: spokenFailures(faults)}) : "";
