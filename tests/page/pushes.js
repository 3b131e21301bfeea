// Apply the pushes of each line of stdin, a JSON array of them, as the page does; print the document that is shown
// then. The Python tests compare it with the one that the server has.

import {createInterface} from "node:readline";

import {Socket, STATIC} from "./page.js";

const {store} = await import(new URL("data/store.js", STATIC).href);

store.connect();
const socket = Socket.made[0];
socket.open();
socket.push({re: socket.sent[0].id, ok: {}});

for await (const line of createInterface({input: process.stdin})) {
  for (const push of JSON.parse(line)) socket.push(push);
  const {fields, own} = store.documents.get(1);
  process.stdout.write(`${JSON.stringify({...fields, automata: [...own.values()]})}\n`);
}
process.exit(); // it would connect again
