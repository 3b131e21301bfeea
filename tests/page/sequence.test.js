import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {Sequence} = await import(new URL("kit/sequence.js", STATIC).href);

test("each piece of work begins after the one before it, and its caller gets the result", async () => {
  const sequence = new Sequence();
  const order = [];
  const slow = sequence.add(async () => {
    await new Promise((resolve) => setImmediate(resolve));
    order.push("slow");
    return 1;
  });
  const quick = sequence.add(async () => order.push("quick"));
  assert.equal(await slow, 1);
  await quick;
  assert.deepEqual(order, ["slow", "quick"]);
});

test("work that fails does not keep the next from being done", async () => {
  const sequence = new Sequence();
  const failed = sequence.add(() => Promise.reject(new Error("no")));
  const thrown = sequence.add(() => {
    throw new Error("never");
  });
  const done = sequence.add(async () => "done");
  await assert.rejects(failed, /no/);
  await assert.rejects(thrown, /never/);
  assert.equal(await done, "done");
});
