// Written by `python -m tools.generators.protocol_types` from the types of Python. Do not edit.

/** How success depends on a quantity. */
export interface Dependence {
  name: string;
  parts: PartView[];
}

/** A name in a plan, and what it is in words. */
export interface Fact {
  name: string;
  words: string;
}

/** A way to fail: so many trials, the numbers of some, and the timeline of one. */
export interface FailureView {
  reason: string;
  states: string;
  count: number;
  numbers: number[];
  timeline: TrialTimeline;
}

/** A number over all trials: between two `edges` so many `good` and `bad` trials. */
export interface Histogram {
  name: string;
  median: number;
  lower: number;
  upper: number;
  edges: number[];
  good: number[];
  bad: number[];
}

/** What figures are of, for who prints them. */
export interface Origin {
  document: string;
  seed: number;
  digest: string;
  versions: Record<string, string>;
  date: string;
  commit: string;
}

/** The trials with a value of a quantity, or one in a range, and the means of the plan's own numbers. */
export interface PartView {
  label: string;
  share: Rate;
  means: [string, number][];
}

/** The places of a thing in m, with success and number of each trial, and lines on the floor. */
export interface PlaceMap {
  thing: string;
  places: [number, number, boolean, number][];
  trials: number;
  lines: [number, number, number, number][];
}

/** A plan in words; `file` is empty where there is none, so that everything has its default. */
export interface PlanFacts {
  file: string;
  runs: number;
  seed: number;
  limit: number;
  robot: string;
  state: string;
  varies: Fact[];
  fixed: Fact[];
  happens: Fact[];
  counts: string[];
  measures: string[];
}

/** How many of some trials succeeded, with the interval of Wilson in which the true rate lies. */
export interface Rate {
  successes: number;
  trials: number;
  lowest: number;
  highest: number;
}

/** One of the worst trials; `page` is that of its recording, if there is one. */
export interface Trial {
  number: number;
  success: boolean;
  reason: string;
  time: number;
  states: string;
  values: [string, string][];
  timeline: TrialTimeline;
  page: string;
}

/** The states of a trial up to its end. */
export interface TrialTimeline {
  number: number;
  end: number;
  changes: [time: number, states: string][];
}

/** The trials of a tab's document: their plan, and what those that have ended say. */
export interface TrialsPush {
  push: "view";
  name: string;
  tab: number;
  outdated: boolean;
  status: "idle" | "reading" | "running" | "stopping";
  plan: PlanFacts | null;
  view: TrialsView | null;
  workers: number;
  left: number | null;
  opens: boolean;
  error: string;
  recording: number | null;
  recorded: number | null;
  file: string;
}

/** A series of trials; `planned` are more than `share.trials` while it runs. */
export interface TrialsView {
  name: string;
  planned: number;
  looks: number[];
  share: Rate;
  histograms: Histogram[];
  dependences: Dependence[];
  maps: PlaceMap[];
  ways: FailureView[];
  worst: Trial[];
  fromStart: number;
  equal: boolean;
  origin: Origin | null;
}

declare module "visualhfsm/data/protocol.js" {
  interface Answers {
    lookAtTrials: null;
    recordTrial: null;
    startTrials: null;
    stopTrials: null;
  }
  interface Requests {
    /** Ask for the plan of a document's trials, and what those that were run say, which the view pushes. */
    lookAtTrials: {tab: number; body?: string};
    /** Run one of the trials again, and record it; a push says when that is done, and where. */
    recordTrial: {tab: number; number: number};
    /** Run those trials of a document that were not run yet; pushes of the view report what they say. */
    startTrials: {
      tab: number;
      runs?: number | null;
      state?: string;
      robot?: "" | "fake" | "none" | "sim";
      limit?: number | null;
      body?: string;
      again?: boolean;
    };
    /** Stop the trials of a document; what is done is kept. */
    stopTrials: {tab: number};
  }
}
