/** Texts in which names stand between backticks: they are shown as code, and read without the backticks. */

/** The parts of a text, those between backticks as elements. @param {string} text @returns {(string | HTMLElement)[]} */
export const coded = (text) =>
  text.split("`").map((part, index) => {
    if (!(index % 2)) return part;
    const code = document.createElement("code");
    code.textContent = part;
    return code;
  });

/** A text for screen readers and bubbles of the browser, which show no code. @param {string} text */
export const uncoded = (text) => text.replaceAll("`", "");
