// What the page asks of `_view.py`.

/** The run that an agent asks for: a document, for at most some s, and when it asked, in s since 1970. */
export interface AskedRun {
  path: string;
  seconds: number;
  at: number;
}

declare module "visualhfsm/data/protocol.js" {
  interface Answers {
    agentAsked: AskedRun | null;
    answerAgent: null;
  }
  interface Requests {
    agentAsked: {tab: number};
    answerAgent: {tab: number; at: number; allowed: boolean};
  }
}
