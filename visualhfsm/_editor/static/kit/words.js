/** How texts are found by what is typed of them: neither case nor accents matter, and words come in any order. */

/** A text as it is compared. @param {string} text */
export const folded = (text) => text.trim().normalize("NFD").replace(/\p{M}/gu, "").toLowerCase();

/** Whether a text contains all words of another one, or parts of words. @param {string} text @param {string} sought */
export function containsWords(text, sought) {
  const all = folded(text);
  return folded(sought)
    .split(/\s+/)
    .every((word) => all.includes(word));
}
