/**
 * A value that must exist.
 *
 * @template T
 * @param {T | null | undefined} value
 * @param {string} what it is, for the error
 * @returns {T}
 */
export function required(value, what) {
  if (value === undefined || value === null) throw new Error(`there is no ${what}`);
  return value;
}
