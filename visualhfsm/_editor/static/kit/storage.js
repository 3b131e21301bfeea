/**
 * What the browser keeps for this page: one host may serve several editors, each below its own path, and the browser
 * keeps the same for all pages of a host.
 */

/** What comes before each name; files on a disk, and pages at the top of a host, need nothing. */
const folder = location.protocol.startsWith("http") ? location.pathname.replace(/[^/]*$/, "") : "/";
const prefix = folder === "/" ? "" : `${folder} `;

/** @param {() => Storage} storage */
const ofThisPage = (storage) => ({
  /** @param {string} name */
  getItem: (name) => storage().getItem(prefix + name),
  /** @param {string} name @param {string} value */
  setItem: (name, value) => storage().setItem(prefix + name, value),
  /** @param {string} name */
  removeItem: (name) => storage().removeItem(prefix + name),
});

/** Kept until the user deletes it. */
export const browserStorage = ofThisPage(() => localStorage);
/** Kept as long as the window. */
export const windowStorage = ofThisPage(() => sessionStorage);

/** Joins the pages of this browser that have the same address. @param {string} name */
export const channelOf = (name) => new BroadcastChannel(`${prefix}visualhfsm ${name}`);
