/** Times for people: documents have them as texts of milliseconds. */

/** @type {Record<string, number>} */
const UNITS = {"": 1, ms: 1, s: 1000, min: 60_000};

/** A time in minutes, seconds or milliseconds; other text stays as it is. @param {string} milliseconds */
export function spokenTime(milliseconds) {
  const value = Number(milliseconds);
  if (!milliseconds.trim() || !Number.isFinite(value)) return milliseconds.trim();
  if (value >= UNITS.min && value % UNITS.min === 0) return `${value / UNITS.min} min`;
  return value >= UNITS.s && Number.isInteger(value) ? `${value / UNITS.s} s` : `${value} ms`;
}

/** A typed time such as `1.5 s` or `500 ms` in milliseconds; other text stays as it is. @param {string} typed */
export function toMilliseconds(typed) {
  const [, number, unit] = /^(\d+(?:[.,]\d+)?)\s*(ms|s|min|)$/i.exec(typed.trim()) ?? [];
  if (number === undefined) return typed;
  return String(+(Number(number.replace(",", ".")) * UNITS[unit.toLowerCase()]).toFixed(6));
}
