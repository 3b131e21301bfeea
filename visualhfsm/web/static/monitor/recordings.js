/** Open a recording into the views of a component that runs. */

import {chooseFile} from "../dialogs/files.js";
import {monitor} from "./monitor.js";

/** Ask which one, and open it. */
export async function openRecording() {
  const path = await chooseFile({title: "Open a recording", verb: "Open", kind: "recording"});
  if (path) await monitor.openRecording(path);
}
