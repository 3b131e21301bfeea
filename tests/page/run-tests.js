/**
 * Run the unit tests of the page: `node run-tests.js [NAME...]`.
 *
 * Each file has a thread of this process, and so modules and surroundings of its own. The runner of Node.js would
 * start a process for each file, which takes twice as much work.
 */

import {readdirSync} from "node:fs";
import {Worker} from "node:worker_threads";

const HERE = new URL("./", import.meta.url);
const asked = process.argv.slice(2);
const names = asked.length ? asked : readdirSync(HERE).filter((name) => name.endsWith(".test.js"));
/** @type {string[]} */
const failed = [];
for (const name of names) {
  const thread = new Worker(new URL(name, HERE));
  thread.on("error", (error) => process.stderr.write(`${name}: ${error.stack ?? error}\n`));
  const code = await new Promise((ended) => thread.on("exit", ended));
  if (code !== 0) failed.push(name);
}
process.stdout.write(`# ${names.length} files${failed.map((name) => `, failed: ${name}`).join("")}\n`);
process.exitCode = failed.length || !names.length ? 1 : 0;
