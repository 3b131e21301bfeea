/** Which component is that of which open document. */

import {store} from "../store.js";

/** What the component of a document without a file is called when its title can be no name of a module. */
const UNTITLED = "untitled";

/** What a file is called without its directories and its extension. */
const stemOf = (path) => path.replace(/^.*\//, "").replace(/\.xml$/i, "");
/** What the component of an open document is called when it runs. */
const componentOf = ({path, title}) => (path ? stemOf(path) : /^[A-Za-z_]\w*$/.test(title) ? title : UNTITLED);

/** What the component of a tab is called; "" when it is not open. */
export function componentOfTab(tab) {
  const found = store.workspace.tabs.find((each) => each.tab === tab);
  return found ? componentOf(found) : "";
}

/**
 * The tab of the document of a component; 0 when it is not open.
 *
 * @param {string} file of the document, or the name of the component
 * @param {number} preferred tab, if it fits
 */
export function tabOf(file, preferred) {
  const {tabs} = store.workspace;
  const wanted = stemOf(file);
  const fits = (each) => componentOf(each) === wanted || (!each.path && stemOf(each.title) === wanted);
  return (tabs.find((each) => each.tab === preferred && fits(each)) ?? tabs.find(fits))?.tab ?? 0;
}
