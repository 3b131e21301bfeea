// What the page asks of `_view.py`.

import type {Words} from "visualhfsm/data/protocol.js";

/** A task, the marks that came back, and since when a teacher can collect what was handed in. */
export interface Task {
  text: Words;
  marks: Words;
  collected: string;
  handedIn: number | null;
}

declare module "visualhfsm/data/protocol.js" {
  interface Answers {
    task: Task | null;
    handIn: {path: string; collected: boolean};
  }
  interface Requests {
    task: {tab: number};
    handIn: {tab: number; overwrite?: boolean};
  }
}
