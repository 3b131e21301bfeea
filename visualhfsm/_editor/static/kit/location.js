/**
 * What depends on where this page is: the addresses of its server, and what the browser keeps for it. One host may serve
 * several editors, each below its own path, and the browser keeps the same for all pages of a host.
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

/** The address of a websocket of the server, which is beside the page. @param {string} path */
export function socketAddress(path) {
  const address = new URL(path, location.href);
  address.protocol = address.protocol.replace("http", "ws");
  return address.href;
}
