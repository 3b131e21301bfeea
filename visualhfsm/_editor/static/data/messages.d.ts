// Messages that Python makes as dictionaries, so that `protocol.d.ts`, which is generated, does not have them.

import type {Described} from "../robot3d/robot-drawing.js";
import type {WorldShape} from "../robot3d/world-drawing.js";
import type * as protocol from "./protocol.js";
import type {
  Annotation,
  Automaton,
  DocumentFields,
  Hit,
  InterfaceDescription,
  KnownBody,
  LiveSnapshot,
  LiveStructure,
  Place,
  RobotFacts,
  State,
  Timeline,
  Transition,
  World,
} from "./protocol.js";

/** The last parameters of a function that takes the fields of a message, which may have none. */
export type FieldsOf<Message> = {} extends Message ? [Message?] : [Message];

// Pushes, of which the parts below are made by visualhfsm/_editor/window.py and workspace.py.

/** A document without its automata. */
export type Fields = DocumentFields & {name: string};

/** A document as a whole, or what has changed in it. */
export type DocumentPush = Omit<protocol.DocumentPush, "full" | "patch"> & {
  full?: Fields & {automata: Automaton[]};
  patch?: Patch;
};

export interface Patch {
  document?: Partial<Fields>;
  automata?: Automaton[];
  removed?: number[];
  order?: number[];
  parts?: Part[];
}

/** What changed in an automaton. */
export interface Part {
  id: number;
  fields?: Partial<Automaton>;
  states?: Change<State>;
  transitions?: Change<Transition>;
  annotations?: Change<Annotation>;
}

/** What changed in a list of items. */
export interface Change<Item> {
  changed?: Item[];
  removed?: number[];
  order?: number[];
}

/** A component that is present; the file into which it is recorded, and since when. */
export interface Present {
  component: string;
  recording?: string;
  since?: number;
}

export type WorkspacePush = Omit<protocol.WorkspacePush, "present"> & {present: Present[]};
export type Workspace = Omit<WorkspacePush, "push">;
export type Push =
  Exclude<protocol.Push, protocol.DocumentPush | protocol.WorkspacePush> | DocumentPush | WorkspacePush;

// Answers.

export interface Answer {
  push?: undefined;
  re: number;
  ok?: unknown;
  error?: string;
  kind: string;
}

/** `instance` is another one after a restart of the editor, `key` that of `Resumption`. */
export interface Greeting {
  root?: string;
  demo?: boolean;
  recording?: string;
  templates?: {name: string; description: string}[];
  worlds?: World[];
  bodies?: KnownBody[];
  instance?: string;
  key?: string;
  viewer?: boolean;
}

/** A step; `conflict` if somebody else had typed over the same words. */
export interface Done {
  name: string;
  revision: number;
  added: {automaton: number; states: number[]; transitions: number[]; annotations: number[]}[];
  conflict?: boolean;
}

/** A step that was undone or redone, and where. */
export type Undone = Done & {place: Place | null};

export interface Opened {
  tab: number;
  remarks?: string[];
}

/** An entry of a directory. */
export interface Entry {
  name: string;
  path: string;
  kind: "document" | "recording" | "model" | "directory";
  size?: number;
  changedAt?: number;
}

/** A robot of the user's own, and how it is drawn. */
export type OwnRobot = Omit<protocol.OwnRobot, "robot"> & {robot?: Described};

/** A difference with the `lines` of longer texts as `diff -u` has them. */
export type Difference = protocol.Difference & {lines?: string[]};

/** What following a component, or opening a recording, answers. */
export interface Followed {
  structure: LiveStructure | null;
  snapshot: LiveSnapshot | null;
  timeline: Timeline;
  since: number | null;
  facts?: RobotFacts;
}

export type Recording = Followed & {
  component: string;
  document: string;
  shortened: string;
  tab: number;
  world: WorldShape[];
  cameras: string[];
  body: string;
};

/** A text as elements: their tags, attributes and content. */
export type Words = (string | [tag: string, attributes: Record<string, string>, content: Words])[];

/** The answers by request; `codeHelp` answers what is asked for. */
export interface Answers {
  hello: Greeting;
  do: Done;
  undo: Undone;
  redo: Undone;
  goTo: Undone;
  copy: {text: string};
  cut: Done & {text: string};
  paste: Done;
  duplicate: Done;
  addReady: Done;
  extract: Done;
  putOnShelf: {path: string};
  inline: Done;
  open: Opened;
  new: Opened;
  openText: Opened;
  recover: Opened;
  discard: null;
  close: null;
  save: {path: string};
  saveAs: {path: string; tab?: number};
  resolve: {conflicts?: string[]} | null;
  listFiles: {directory: string; parent: string | null; entries: Entry[]};
  share: {address: string};
  export: {name: string; text: string};
  exportRun: {name: string; text: string};
  search: {tab: number; hits: Hit[]}[];
  diff: {differences: Difference[]; before: Automaton[]};
  imported: Automaton[];
  locate: {place: Place; line: number} | null;
  codeHelp: unknown;
  interfaces: InterfaceDescription[];
  generate: {path: string};
  start: Followed & {component: string; recording?: string};
  stop: null;
  outputShown: null;
  lookAtTrials: null;
  startTrials: null;
  stopTrials: null;
  recordTrial: null;
  lookAtTests: null;
  startTests: null;
  stopTests: null;
  saveTest: {name: string; complete: boolean};
  simulate: null;
  record: {recording: string} | null;
  guessRobot: OwnRobot;
  checkRobot: OwnRobot;
  saveRobot: {path: string; bodies: KnownBody[]};
  connectRobot: null;
  moveBalls: null;
  endRobot: null;
  follow: Followed;
  unfollow: null;
  recording: Recording;
  facts: RobotFacts;
  identities: Record<string, string[]>;
  rosGraph: unknown;
  body: Described | null;
  moment: LiveSnapshot | null;
  explain: protocol.Explanation;
  pause: null;
  resume: null;
  step: null;
  series: {times: number[]; values: Record<string, (number | null)[]>};
  setBreakpoints: null;
  setVariable: null;
  forceTransition: null;
  sendEvent: null;
  setSpeed: null;
  stopPresent: null;
  standRobot: null;
  resetEmergencyStop: null;
  placeObject: null;
  pushRobot: null;
  sayToRobot: string;
  picture: string | null;
  reload: protocol.ReloadReport;
  emergencyStop: protocol.StopReport;
}
