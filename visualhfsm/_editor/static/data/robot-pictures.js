/** Small pictures of robots: ours come with the page, that of one's own is taken when it is saved. */

import {browserStorage} from "../kit/location.js";

/** Pixels along a side, twice as many as it is shown with. */
export const SIZE = 144;

/** @param {string} name */
const keyOf = (name) => `visualhfsm.picture ${name}`;

/** The address of the picture of a robot; null without one. @param {string} name a path for one of the project */
export const pictureOf = (name) =>
  name.includes("/") ? browserStorage.getItem(keyOf(name)) : new URL(`../pictures/${name}.webp`, import.meta.url).href;

/** @param {string} name @param {string} address */
export const keepPicture = (name, address) => browserStorage.setItem(keyOf(name), address);
