/** Open a recording into the views of a component that runs. */

import {ask} from "../commands.js";
import {chooseFile} from "../dialogs/files.js";
import {notify} from "../notices.js";
import {page} from "../page.js";
import {monitor} from "./monitor.js";

/** Ask which one, and open it. */
export async function openRecording() {
  const path = await chooseFile({title: "Open a recording", verb: "Open", kind: "recording"});
  const found = path && (await ask("recording", {path}));
  if (found) await show(path, found);
}

async function show(path, found) {
  await monitor.lookAtRecording(path, found);
  await showDocument(found);
  if (!found.complete) notify("The recording is long: only its beginning was read.");
}

/** Show the document that a recording holds, unless it is open. */
async function showDocument({document, structure: {structure}}) {
  if (monitor.tab) page.show(monitor.tab);
  else if (document) {
    const name = structure.document || `${structure.name}.xml`;
    const opened = await ask("openText", {name: name.replace(/^.*\//, ""), text: document});
    if (opened) page.show(opened.tab);
  } else notify("The recording does not hold its document: open it to see the states.");
}
