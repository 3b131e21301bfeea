// Written by `python -m tools.generators.protocol_types` from the types of Python. Do not edit.

/** The last parameters of a function that takes the fields of a message, which may have none. */
export type FieldsOf<Message> = {} extends Message ? [Message?] : [Message];

/** What the server answers: the value of a request, or why it was refused. */
export interface Answer {
  push?: undefined;
  re: number;
  ok?: unknown;
  error?: string;
  kind: string;
}

export type Workspace = Omit<WorkspacePush, "push">;

/** A text as elements: their tags, attributes and content. */
export type Words = (string | [tag: string, attributes: Record<string, string>, content: Words])[];

/** A document without its automata. */
export type Fields = DocumentFields & {name: string};

/** What is new in one automaton, by id; the automaton itself may be new. */
export interface Added {
  automaton: number;
  states: number[];
  transitions: number[];
  annotations: number[];
}

/** The address for viewers, relative to the page. */
export interface Address {
  address: string;
}

/** A text that people wrote on the canvas for each other; nothing that runs depends on it. */
export interface Annotation {
  id: number;
  kind: string;
  x: number;
  y: number;
  width: number;
  height: number;
  color: string;
  text: string;
}

/** The answer to each request. */
export interface Answers {
  addReady: Done;
  body: import("../robot3d/robot-drawing.js").Described | null;
  checkRobot: OwnRobot;
  close: null;
  codeHelp: Completions | NameExplanation | Signature | Definition | null;
  connectRobot: null;
  copy: Copied;
  cut: CutOut;
  diff: Comparison;
  discard: null;
  do: Done;
  duplicate: Done;
  emergencyStop: StopReport;
  endRobot: null;
  explain: Explanation;
  explainMoment: Explanation | null;
  export: Download;
  exportRun: Download;
  extract: Done;
  facts: RobotFacts;
  failures: Record<string, string[]>;
  fixes: Fixes;
  follow: Followed;
  forceTransition: null;
  generate: Written;
  goTo: Undone;
  guessRobot: OwnRobot;
  heal: null;
  hello: Greeting;
  identities: Record<string, string[]>;
  imported: Automaton[];
  inject: null;
  inline: Done;
  interfaces: InterfaceDescription[];
  judge: Judged;
  listFiles: Listing;
  locate: Located | null;
  lookAtTests: null;
  moment: LiveSnapshot | null;
  moveBalls: null;
  new: Opened;
  open: Opened;
  openText: Opened;
  outputShown: null;
  paste: Done;
  pause: null;
  picture: string | null;
  placeObject: null;
  pushRobot: null;
  putOnShelf: Written;
  record: Recorded | null;
  recording: ShownRecording;
  recover: Opened;
  redo: Undone;
  reload: ReloadReport;
  resetEmergencyStop: null;
  resolve: Resolved;
  resume: null;
  rosGraph: Record<string, unknown>;
  save: Written;
  saveAs: SavedAs;
  saveRobot: SavedRobot;
  sayToRobot: string;
  search: Hits[];
  sendEvent: null;
  series: Numbers;
  setBreakpoints: null;
  setSpeed: null;
  setVariable: null;
  share: Address;
  simulate: null;
  standRobot: null;
  start: StartedRun;
  startTests: null;
  step: null;
  stop: null;
  stopPresent: null;
  stopTests: null;
  undo: Undone;
  unfollow: null;
}

/** The expression that a state passes to the input `name` of one of its automata. */
export interface Argument {
  name: string;
  child: number;
  value: string;
}

/** An automaton; `father` is the id of the automaton above it, 0 for the root. */
export interface Automaton {
  id: number;
  father: number;
  states: State[];
  transitions: Transition[];
  annotations: Annotation[];
  inputs: Parameter[];
  outputs: Parameter[];
  imported: Import | null;
  period: string;
  variables: string;
  functions: string;
}

/** An automaton at one moment. */
export interface AutomatonSnapshot {
  id: number;
  state: number;
  ghost: boolean;
  finished: boolean;
  lastTransition: number;
  enteredAt: number;
  timers: TimerSnapshot[];
  guards: GuardSnapshot[];
  variables: Record<string, string>;
  cycles: number;
  overruns: number;
  lastCycle: number;
  longestCycle: number;
  inCycle: boolean;
  hangsFor: number;
  hangsAt: string;
}

/** An automaton with its states and transitions in document order. */
export interface AutomatonStructure {
  id: number;
  name: string;
  parent: number;
  owner: number;
  period: number;
  source: string;
  states: StateStructure[];
  transitions: TransitionStructure[];
}

/** Where a component is to pause: at a state or at a transition; the other is 0. */
export interface Breakpoint {
  automaton: number;
  state: number;
  transition: number;
  condition: string;
}

/** A tab is closed. */
export interface ClosedPush {
  push: "closed";
  tab: number;
}

export type Command = {[Name in keyof Commands]: {command: Name} & Commands[Name]}[keyof Commands];

/** The fields of each command. */
export interface Commands {
  /** Add an empty automaton to a state. */
  addAutomaton: {automaton: number; state: number};
  /** Add the root automaton to a document that has none. */
  addRoot: {};
  /** Set the period of an automaton in milliseconds, as it was typed. */
  setPeriod: {automaton: number; period: string};
  /** Import the content of an empty automaton from another file, or remove the import when `file` is blank. */
  setImport: {automaton: number; file: string; source?: number};
  /** Import an automaton from a file to which its content was moved; all automata below it are removed. */
  extractAutomaton: {automaton: number; file: string};
  /** Give automata, states and transitions that share a number different ones. */
  repairNumbers: {};
  /** Set a component's description, world, language, or its policy after an error or a refused command. */
  setComponentText: {part: "description" | "language" | "onError" | "onRefused" | "world"; text: string};
  /** Add an entry to a list; without a name it gets a free one. */
  addEntry: {
    list: "events" | "inputs" | "interfaces" | "libraries" | "outputs" | "parameters" | "properties" | "ros" | "survives";
    automaton?: number;
    fields?: Record<string, string>;
    language?: string;
  };
  /** Change fields of an entry. */
  changeEntry: {
    list: "events" | "inputs" | "interfaces" | "libraries" | "outputs" | "parameters" | "properties" | "ros" | "survives";
    automaton?: number;
    index: number;
    fields: Record<string, string>;
  };
  /** Remove an entry of a list. */
  removeEntry: {
    list: "events" | "inputs" | "interfaces" | "libraries" | "outputs" | "parameters" | "properties" | "ros" | "survives";
    automaton?: number;
    index: number;
  };
  /** Move an entry of a list to another index. */
  reorderEntry: {
    list: "events" | "inputs" | "interfaces" | "libraries" | "outputs" | "parameters" | "properties" | "ros" | "survives";
    automaton?: number;
    index: number;
    to: number;
  };
  /** Move states into a new automaton below a new state that takes their place. */
  groupStates: {automaton: number; states: number[]; name?: string; language?: string};
  /** Delete states, transitions and annotations. */
  deleteItems: {automaton: number; states?: number[]; transitions?: number[]; annotations?: number[]; cut?: boolean};
  /** Move states, handles and annotations by some pixels. */
  moveItems: {
    automaton: number;
    states?: number[];
    transitions?: number[];
    annotations?: number[];
    dx: number;
    dy: number;
  };
  /** Align states at the outermost of them, or in the middle between both ends. */
  alignStates: {automaton: number; states: number[]; to: "bottom" | "center" | "left" | "middle" | "right" | "top"};
  /** Distribute states at equal distances between the two outermost. */
  distributeStates: {automaton: number; states: number[]; along: "x" | "y"};
  /** Move handles to their default places. */
  resetHandles: {automaton: number; transitions: number[]};
  /** Place states, handles and annotations of any number of automata, as after an automatic layout. */
  placeItems: {placements: Placement[]; name?: string};
  /** Add a note or a frame with its upper left corner at `x`, `y`. */
  addAnnotation: {
    automaton: number;
    kind: "frame" | "note";
    x: number;
    y: number;
    width: number;
    height: number;
    color?: "" | "blue" | "gray" | "green" | "pink" | "yellow";
    text?: string;
  };
  /** Set the text of a note, or the title of a frame. */
  setAnnotationText: {automaton: number; annotation: number; text: string};
  /** Set the upper left corner and the size of a note or a frame. */
  resizeAnnotation: {automaton: number; annotation: number; x: number; y: number; width: number; height: number};
  /** Set the color of notes and frames. */
  setAnnotationColor: {
    automaton: number;
    annotations: number[];
    color: "" | "blue" | "gray" | "green" | "pink" | "yellow";
  };
  /** Paste a fragment into an automaton, with new numbers. */
  pasteStates: {automaton: number; content: string; x?: number | null; y?: number | null; name?: string};
  /** Add a state whose automaton is a copy of a whole document, as one of the shelf is. */
  addReadyState: {
    automaton: number;
    content: string;
    name: string;
    x: number;
    y: number;
    origin?: number | null;
    trigger?: "condition" | "event" | "finished" | "time";
    language?: string;
  };
  /** Replace the content of an automaton by that of the first one of a document, with all below it. */
  fillAutomaton: {automaton: number; content: string; name?: string};
  /** Replace the whole document, such as by the result of a merge. */
  replaceDocument: {content: string; name?: string};
  /** Add a state, and a transition to it from `origin`; the first state of an automaton is initial. */
  addState: {
    automaton: number;
    x: number;
    y: number;
    name?: string;
    origin?: number | null;
    trigger?: "condition" | "event" | "finished" | "time";
    language?: string;
  };
  /** Rename a state. */
  renameState: {automaton: number; state: number; name: string};
  /** Make a state the only initial state of its automaton. */
  markInitial: {automaton: number; state: number};
  /** Set whether a state is final. */
  markFinal: {automaton: number; state: number; final: boolean};
  /** Set whether the automata of a state resume or restart when it is entered again. */
  setHistory: {automaton: number; state: number; history: "" | "restart" | "resume"};
  /** Remove the argument for an input. */
  removeArgument: {automaton: number; state: number; name: string; child?: number};
  /** Take an output no longer. */
  removeResult: {automaton: number; state: number; name: string; child?: number};
  /** Set the text at a place with code: of an automaton, a state or a transition. */
  setText: {place: Place; text: string};
  /** Set the arguments of a state for several inputs, such as the place at which somebody pointed. */
  setArguments: {automaton: number; state: number; child?: number; values: Record<string, string>};
  /** Replace a text in all code of the document, or in a `line` of it, from 1, at a `place`. */
  replaceText: {text: string; by: string; whole?: boolean; place?: Place | null; line?: number};
  /** Replace a name by the one that is meant, once at each of some places. */
  correctName: {name: string; meant: string; at: Correction[]};
  /** Write straight quotes, hyphens and spaces in the code, the value or the expression at a place. */
  straightenText: {place: Place};
  /** Add a transition between two states, or from one to itself; its handle gets a default place. */
  addTransition: {
    automaton: number;
    origin: number;
    destination: number;
    type?: "condition" | "event" | "finished" | "time";
    name?: string;
    x?: number | null;
    y?: number | null;
    language?: string;
  };
  /** Rename a transition. */
  renameTransition: {automaton: number; transition: number; name: string};
  /** Make a transition leave or enter another state; its handle moves to its default place. */
  retargetTransition: {automaton: number; transition: number; origin?: number | null; destination?: number | null};
  /** Set the type of a transition, and its `trigger` unless that is kept. */
  setTransitionType: {
    automaton: number;
    transition: number;
    type: "condition" | "event" | "finished" | "time";
    trigger?: string | null;
  };
  /** Set the priority of a transition as it was typed: a number from 1, or nothing. */
  setPriority: {automaton: number; transition: number; priority: string};
  /** Evaluate a transition at position `index`, from 0, among those out of its state. */
  reorderTransition: {automaton: number; transition: number; index: number};
  /** Take an output below a state into a new variable, which begins with the default of the output. */
  takeOutput: {automaton: number; state: number; name: string; child?: number};
  /** Keep a variable of the nearest automaton above that has it in the component, as `self.name`. */
  shareVariable: {automaton: number; name: string};
}

/** Differences, and the former automata in which they are. */
export interface Comparison {
  before: Automaton[];
  differences: Difference[];
}

/** A completion; `type` is its kind in the terms of CodeMirror, `boost` moves it up in the list. */
export interface Completion {
  label: string;
  type?: string;
  detail?: string;
  info?: string;
  boost?: number;
}

/** Completions; the prefix that was typed starts `typed` characters before the cursor. */
export interface Completions {
  typed: number;
  options: Completion[];
}

/** A component at one moment. */
export interface ComponentSnapshot {
  startedAt: number;
  time: number;
  status: number;
  generation: number;
  automata: AutomatonSnapshot[];
  parameters: Record<string, string>;
  stoppedAt: Breakpoint[];
  errors: ErrorReport[];
  marks: Mark[];
  refusal: string;
  speed: number;
  joints: Record<string, number>;
}

/** The automata of a component, the root first, each before its children. */
export interface ComponentStructure {
  name: string;
  document: string;
  generation: number;
  parameters: ParameterStructure[];
  automata: AutomatonStructure[];
  events: string[];
}

/** States as a document, for the clipboard of the system. */
export interface Copied {
  text: string;
}

/** Where a name is written: from a `column` of a line on, both from 1, or as the value of a `field`. */
export interface Correction {
  place: Place;
  line?: number;
  column?: number;
  field?: string;
}

/** The steps until a property is violated; from the index `repeats` on they may go on forever. */
export interface Counterexample {
  steps: Step[];
  repeats?: number | null;
  guards?: string[];
}

/** The same of states that were cut. */
export interface CutOut {
  added: Added[];
  conflict?: boolean;
  name: string;
  revision: number;
  text: string;
}

/** Where a name is defined: a text of the document, and in it line and column, from 1. */
export interface Definition {
  place: Place;
  line: number;
  column: number;
  length: number;
}

/** A difference: a whole element, or a `part` of one with its text before and after. */
export interface Difference {
  kind: "added" | "changed" | "moved" | "removed";
  place: Place;
  part?: string;
  before?: string;
  after?: string;
  lines?: string[];
}

/** An event that may come from outside; events that only automata send need no declaration. */
export interface DocumentEvent {
  name: string;
  description: string;
}

/** A component as a tree of automata, with the libraries and interfaces that its code uses. */
export interface DocumentFields {
  description: string;
  onError: string;
  onRefused: string;
  world: string;
  language: string;
  parameters: Parameter[];
  events: DocumentEvent[];
  properties: Property[];
  survives: Survives[];
  libraries: Library[];
  interfaces: Interface[];
  ros: RosInterface[];
}

/** A document, whole in `full` each time that it changes; the steps come latest first. */
export interface DocumentPush {
  push: "document";
  tab: number;
  revision: number;
  undo: UndoStep[];
  redo: UndoStep[];
  dirty: boolean;
  full: Fields & {automata: Automaton[]};
}

/** A step; `conflict` if somebody else had typed over the same words. */
export interface Done {
  added: Added[];
  conflict?: boolean;
  name: string;
  revision: number;
}

/** A file to download. */
export interface Download {
  name: string;
  text: string;
}

/** An error in user code or in the hand-over between automata. */
export interface ErrorReport {
  time: number;
  automaton: number;
  state: number;
  location: string;
  message: string;
}

/** Why an automaton is where it is. */
export interface Explanation {
  automaton: number;
  state: number;
  ghost: boolean;
  enteredBy: number;
  transitions: TransitionExplanation[];
  summary: string;
}

/** What failed together from one component time in s to another. */
export interface FailureSpan {
  faults: Fault[];
  start: number;
  end: number;
}

/** A failure that somebody injected into a part of a robot, by a kind of `nao::FaultKind`. */
export interface Fault {
  part: string;
  kind: string;
  amount: number;
}

/** A change that fixes a problem, and its name on a button. */
export interface Fix {
  name: string;
  command: Command;
}

/** A problem, by its code and where it is, and the indices of its fixes, the surest first. */
export interface FixedProblem {
  code: string;
  column: number;
  fixes: number[];
  line: number;
  place: Place | null;
}

/** What fixes the problems of a document; several may have the same fix. */
export interface Fixes {
  fixes: Fix[];
  problems: FixedProblem[];
}

/** What is known of a component that is followed: its latest data, and when it went silent. */
export interface Followed {
  facts?: RobotFacts;
  since?: number | null;
  snapshot: LiveSnapshot | null;
  structure: LiveStructure | null;
  timeline: Timeline;
}

/** The state of the editor; `instance` is another one after a restart, `key` lets the page in then. */
export interface Greeting {
  bodies: KnownBody[];
  demo: boolean;
  instance: string;
  key: string;
  recording: string;
  root: string;
  templates: Template[];
  viewer: boolean;
  worlds: WorldFacts[];
}

/** The last value of a condition out of the current state. */
export interface GuardSnapshot {
  transition: number;
  value: boolean;
}

/** Something that an operator should know: a command limited, a velocity timed out, a fall. */
export interface HealthEvent {
  time: number;
  level: number;
  source: string;
  message: string;
}

/** The state of a robot server. */
export interface HealthReport {
  time: number;
  uptime: number;
  realTimeFactor: number;
  lag: number;
  torsoTilt: number;
  fallen: boolean;
  cameraRates: Record<string, number>;
  limitedCommands: number;
  velocityTimeouts: number;
  events: HealthEvent[];
}

/** A match of a search: line and column in the text at the place, from 1, and the text of that line. */
export interface Hit {
  place: Place;
  line: number;
  column: number;
  length: number;
  excerpt: string;
  start: number;
}

/** What was found in a document. */
export interface Hits {
  hits: Hit[];
  tab: number;
}

/** The source of an imported automaton: another document, by its path relative to this one. */
export interface Import {
  file: string;
  automaton: number;
}

/** A servant that the component uses. */
export interface Interface {
  name: string;
  proxy: string;
  type: string;
  identity: string;
}

/** An interface that a document may declare. */
export interface InterfaceDescription {
  name: string;
  scoped: string;
  operations: OperationDescription[];
}

/** How far, how fast and how strongly a joint moves. */
export interface JointLimits {
  name: string;
  lower: number;
  upper: number;
  maxVelocity: number;
  maxTorque: number;
}

/** Whether a document is ready, or the first reason why not, who found it, and which `robot` was tried. */
export interface Judged {
  found: "" | "checks" | "model checker" | "run" | "survives" | "tests";
  message: string;
  missed: string[];
  place: Place | null;
  proved: number;
  ready: boolean;
  robot: string;
  seconds: number;
  survived: number;
  tests: number;
}

/** A body that can be simulated: its name, or the path of its TOML file below the root, and its title. */
export interface KnownBody {
  name: string;
  title: string;
}

/** A library that the code imports: `cv2`, `numpy as np`, or `from math import pi`. */
export interface Library {
  name: string;
  kind: string;
}

/** An entry of a directory, or below it; its size in bytes, when it was changed in s since 1970. */
export interface ListedEntry {
  changedAt: number;
  kind: "directory" | "document" | "model" | "recording";
  name: string;
  path: string;
  size: number;
}

/** The content of a directory. */
export interface Listing {
  directory: string;
  entries: ListedEntry[];
  parent: string | null;
}

/** A component at one moment, in the words of `interfaces/hfsm.idl`, and its robot. */
export interface LiveSnapshot {
  at: number;
  component: ComponentSnapshot;
  robot: RobotState;
}

/** The constant data of a component; `run` counts how many times it was started. */
export interface LiveStructure {
  structure: ComponentStructure;
  run: number;
  breakpoints: Breakpoint[];
  cameras: string[];
  body: string;
}

/** A line of a piece of code. */
export interface Located {
  line: number;
  place: Place;
}

/** What a component marks on a camera's picture, such as where it sees a ball. */
export interface Mark {
  camera: string;
  u: number;
  v: number;
  label: string;
}

/** The `name` that is written at a place, and the one that is probably meant. */
export interface Misspelt {
  name: string;
  meant: string;
  field?: string;
}

/** The explanation of a name: its parameters and result, and its documentation. */
export interface NameExplanation {
  name: string;
  detail: string;
  documentation: string;
}

/** A servant that a ready state calls: its identity, and its interface. */
export interface Need {
  identity: string;
  type: string;
}

/** Numbers over time, by their names. */
export interface Numbers {
  times: number[];
  values: Record<string, (number | null)[]>;
}

/** A document that is open, with what is missing of a foreign one. */
export interface Opened {
  remarks?: string[];
  tab: number;
}

/** An operation as a method of a proxy; its signature begins with `(self`. */
export interface OperationDescription {
  name: string;
  signature: string;
  result: string;
  documentation: string;
  streamed: boolean;
}

/** Another robot of the world, which has another realm. */
export interface OtherRobot {
  realm: string;
  title: string;
}

/** A line that a component wrote, and the piece of code to which it refers, if any. */
export interface OutputLine {
  text: string;
  stream: "err" | "out";
  place: Place | null;
  line: number;
}

/** Lines that a component wrote; `dropped` older ones were too many for this window. */
export interface OutputPush {
  push: "output";
  tab: number;
  lines: OutputLine[];
  dropped: number;
  whole: boolean;
}

/** The change of the file of a document by another program. */
export interface OutsidePush {
  push: "outside";
  tab: number;
  state: "changed" | "deleted" | "reloaded" | "same";
  message: string;
}

/** A body of the user's own: the name and the text of its file, and how the robot is drawn. */
export interface OwnRobot {
  name: string;
  text: string;
  took?: string[];
  notes?: string[];
  problem?: string;
  line?: number;
  robot?: import("../robot3d/robot-drawing.js").Described | null;
}

/** A typed value: a parameter of a component (`self.name`, `--name`), an input or output of an automaton. */
export interface Parameter {
  name: string;
  type: string;
  default: string;
  description: string;
}

/** A parameter of a component. */
export interface ParameterStructure {
  name: string;
  type: string;
  description: string;
}

/** A state or a transition that tests passed, how often, and whether one failed there. */
export interface Passed {
  automaton: number;
  kind: "state" | "transition";
  id: number;
  count: number;
  asked: number;
  held: number;
  failed: boolean;
}

/** The lines of a piece of code that tests passed, did not pass, and where one failed. */
export interface PassedCode {
  place: Place;
  version: number;
  passed: number[];
  missed: number[];
  failed: number[];
}

/** A place in a document. */
export interface Place {
  kind: "annotation" | "automaton" | "document" | "state" | "transition";
  automaton?: number;
  id?: number;
  part?: string;
  index?: number;
  name?: string;
  child?: number;
}

/** New places of one automaton's states and handles, each `[id, x, y]`, and of its annotations. */
export interface Placement {
  automaton: number;
  states?: [number, number, number][];
  transitions?: [number, number, number][];
  annotations?: [number, number, number, number, number][];
}

/** A component of the realm; the file into which it is recorded here, and since when. */
export interface PresentComponent {
  component: string;
  recording?: string;
  since?: number;
}

/** One thing that is wrong, doubtful or worth knowing: `error`, `warning` or `note`. */
export interface Problem {
  code: string;
  severity: "error" | "warning" | "note";
  message: string;
  notes?: string[];
  place?: Place | null;
  line?: number;
  column?: number;
  length?: number;
  file?: string;
  source?: Place | null;
  where?: string;
  copies?: Place[];
  owners?: Place[];
  counterexample?: Counterexample | null;
  misspelt?: Misspelt | null;
  library?: string;
  assumes?: string;
}

/** The problems of a revision of a document; of very many not all `items`, but the `counts` of all. */
export interface ProblemsPush {
  push: "problems";
  tab: number;
  revision: number;
  items: Problem[];
  counts: Record<string, number>;
  imports: number;
  complete: boolean;
}

/** A property of the automata that the model checker tries to prove. */
export interface Property {
  name: string;
  kind: string;
  within: string;
  expression: string;
}

export type Push =
  | ClosedPush
  | DocumentPush
  | OutputPush
  | OutsidePush
  | ProblemsPush
  | RobotPush
  | ShelfPush
  | SnapshotPush
  | StalePush
  | StartedPush
  | StructurePush
  | TestsPush
  | ViewPush
  | WorkspacePush;

/** A document of a shelf, as people see it there. */
export interface ReadyState {
  id: string;
  path: string;
  title: string;
  category: string;
  own: boolean;
  summary: string;
  text: string;
  icon: string;
  words: string;
  inputs: ReadyValue[];
  outputs: ReadyValue[];
  needs: Need[];
  postures: string[];
  ends: boolean;
  trouble: string;
}

/** What can be set of a ready state, or taken from it: an input or an output of its automaton. */
export interface ReadyValue {
  name: string;
  type: string;
  default: string;
  description: string;
}

/** The file of a recording. */
export interface Recorded {
  recording: string;
}

/** A document with unsaved changes that was open when its editor ended; `changed_at` in s since 1970. */
export interface Recoverable {
  journal: string;
  name: string;
  path: string;
  changedAt: number;
}

/** What became of a component that was reloaded. */
export interface ReloadReport {
  generation: number;
  held: number;
  notKept: string[];
}

/** The fields of each request. */
export interface Requests {
  /** Draw a state of the shelf into an automaton, with a transition to it from `origin` if given. */
  addReady: {
    tab: number;
    state: string;
    automaton: number;
    x: number;
    y: number;
    origin?: number | null;
    trigger?: "condition" | "event" | "finished" | "time";
    name?: string;
  };
  /** Ask for a robot as it is drawn, by the hash of its description; null if it is not known any more. */
  body: {hash: string};
  /** Read the text of a robot's file, as that of `name` in the folder `robots`: an `OwnRobot`. */
  checkRobot: {name: string; text: string};
  /** Close a tab; one with unsaved changes only with `discard`. */
  close: {tab: number; discard?: boolean};
  /** Ask about a piece of code, as it is being typed; `line` counts from 1, `column` from 0. */
  codeHelp: {
    tab: number;
    wanted: "complete" | "define" | "explain" | "signature";
    place: Place;
    code: string;
    line?: number;
    column?: number;
  };
  /** Connect to a real robot at an address such as `nao.local`; `start` is its first action. */
  connectRobot: {address: string; start?: "leave" | "stand" | "stiffen"};
  /** Put states, their sub-trees, the transitions among them and annotations into the window's clipboard. */
  copy: {tab: number; automaton: number; states: number[]; annotations?: number[]};
  /** Copy, and delete. */
  cut: {tab: number; automaton: number; states: number[]; annotations?: number[]};
  /** Compare a document with another version: a file, or `saved`. */
  diff: {tab: number; against: string};
  /** Discard the changes of such a document. */
  discard: {journal: string};
  /** Apply a command of `visualhfsm._document.commands` to the document. */
  do: {tab: number; command: Command; base?: string | null};
  /** Copy and paste in one step, beside the clipboard. */
  duplicate: {tab: number; automaton: number; states: number[]; annotations?: number[]};
  /** Stop the robot and all components of the realm: a `StopReport`. */
  emergencyStop: {};
  /** End the simulation, or the connection to the real robot, that was started here. */
  endRobot: {};
  /** Ask why each transition out of the current state has not fired: an `Explanation`. */
  explain: {component: string; automaton: number};
  /** Ask the same about a component time in s of a component, or a recording; None if it is not known. */
  explainMoment: {component: string; automaton: number; time: number};
  /** Ask for the document as its file would hold it, or as one `page` of HTML, to download it. */
  export: {tab: number; page?: boolean};
  /** Ask for the run of a followed component, or of an open recording, as one page of HTML, to download it. */
  exportRun: {component: string; tab?: number};
  /** Move an automaton with all below it to a new file, and import it from there. */
  extract: {tab: number; automaton: number; path: string};
  /** Ask for the constants of the robot: `RobotFacts`. */
  facts: {};
  /** Ask how each part of a robot with this `body` can fail. */
  failures: {body?: string};
  /** Ask for what fixes the problems of a document. */
  fixes: {tab: number};
  /** Follow a running component. */
  follow: {component: string};
  /** Fire a transition in the next cycle. */
  forceTransition: {component: string; automaton: number; transition: number};
  /** Generate the component's Python. */
  generate: {tab: number};
  /** Undo or redo up to a step of the document; `revision` is that of the step. */
  goTo: {tab: number; revision: number};
  /** Take a model of a robot, a URDF, xacro or MJCF below the root, for what it seems to be. */
  guessRobot: {path: string};
  /** End all failures of a part, and of every part where none is named. */
  heal: {part?: string | null};
  /** Ask for the whole state, in a language such as `es`; the first request of a window. */
  hello: {language?: string};
  /** Ask for the servants of the realm, each with the type ids of its interfaces. */
  identities: {};
  /** Ask for the content of the automata that a document imports from other files. */
  imported: {tab: number};
  /** Let a part fail until it is healed, by its usual amount if none is given. */
  inject: {part: string; kind: string; amount?: number | null};
  /** Copy the content of an imported automaton into the document. */
  inline: {tab: number; automaton: number};
  /** Ask for the interfaces that documents may declare, with their operations. */
  interfaces: {};
  /** Ask whether a document, as it was saved, is ready to drive a robot, or what to fix first. */
  judge: {tab: number; body?: string};
  /** List a directory, the root for an empty one; with `below` also the files in directories below it. */
  listFiles: {directory?: string; below?: boolean};
  /** Ask which line of which piece of code a line of a log, or of an error's report, refers to. */
  locate: {tab: number; text: string; automaton?: number; state?: number};
  /** Ask for the tests of a document: the push `tests` names them. */
  lookAtTests: {tab: number};
  /** Ask for the snapshot of a component, or a recording, at a component time in s. */
  moment: {component: string; time: number};
  /** Move the balls of the simulation along their routes, or leave them where they are. */
  moveBalls: {moving: boolean};
  /** Create a document from a template. */
  new: {template?: string};
  /** Open a document in a tab. */
  open: {path: string};
  /** Open a document whose text the page has, such as a dropped file; it has no path yet. */
  openText: {name: string; text: string};
  /** Say that the last push `output` was shown, so that the next one may come. */
  outputShown: {};
  /** Paste into an automaton, with the upper left corner at `x`, `y` if given. */
  paste: {tab: number; automaton: number; x?: number | null; y?: number | null};
  /** Let running cycles end, and start none. */
  pause: {component: string};
  /** Ask for the picture of a camera at a wall time, as JPEG; null if that was not kept. */
  picture: {component: string; camera: string; at: number};
  /** Put something somewhere, at rest. */
  placeObject: {name: string; position: Vector3};
  /** Push the torso with a force in N; refused as a command of the robot is. */
  pushRobot: {force: Vector3; seconds: number};
  /** Write states with all below them as a ready state of the project. */
  putOnShelf: {
    tab: number;
    automaton: number;
    states: number[];
    title: string;
    category?: string;
    words?: string;
    description?: string;
  };
  /** Record a followed component into a new file below the root, whose path is the answer; or end that. */
  record: {component: string; pictures?: number | null};
  /** Open the recording of a run. */
  recording: {path: string};
  /** Open a document that was still open when its editor ended: one of `recoverable`. */
  recover: {journal: string};
  /** Redo the step that was undone last, perhaps what this window had typed at a place. */
  redo: {tab: number; place?: Place | null};
  /** Load the component's file again, and go on in it: a `ReloadReport`. */
  reload: {component: string};
  /** Let the robot accept commands again. */
  resetEmergencyStop: {};
  /** Decide about a document whose file another program changed: keep it, read the file, or merge both. */
  resolve: {tab: number; choice: "merge" | "mine" | "theirs"};
  /** Go on after a pause. */
  resume: {component: string};
  /** Ask for the graph of ROS, which takes a second. */
  rosGraph: {};
  /** Save to the file that the document came from, with `overwrite` also over an older dialect. */
  save: {tab: number; overwrite?: boolean};
  /** Save to another file, which is the document's from then on. */
  saveAs: {tab: number; path: string; overwrite?: boolean};
  /** Write the file of a robot in the folder `robots`, with `overwrite` also over another one. */
  saveRobot: {name: string; text: string; overwrite?: boolean};
  /** Say something to the robot; the answer is what programs recognized in it. */
  sayToRobot: {text: string};
  /** Search names and code, in one document or in all open ones, for a text or a whole word. */
  search: {text: string; whole?: boolean; tab?: number | null};
  /** Send an event, with data in JSON or blank. */
  sendEvent: {component: string; name: string; data: string};
  /** Ask for numbers over time, by their names: at most `points`, so that no peak is lost. */
  series: {component: string; names: string[]; start?: number; end?: number; points?: number};
  /** Replace all breakpoints. */
  setBreakpoints: {component: string; breakpoints: Breakpoint[]};
  /** Let time pass faster or slower in a dry run: seconds in one of wall time. */
  setSpeed: {component: string; speed: number};
  /** Set a variable of an automaton, or with 0 a parameter, to a value in JSON. */
  setVariable: {component: string; automaton: number; name: string; value: string};
  /** Ask for the read-only address of the page, relative to it; or withdraw it, so that all viewers go. */
  share: {shared?: boolean};
  /** Start a simulated robot, or start it again with other options; what was started here before is ended. */
  simulate: {world?: string; speed?: string; balls?: boolean; body?: string};
  /** Put a simulated robot on its feet where it is. */
  standRobot: {};
  /** Generate and start the component as a process; `arguments` are those of its command line. */
  start: {tab: number; arguments?: string[]; record?: boolean; dryRun?: boolean; body?: string; beside?: string[]};
  /** Run the tests of a document as it was saved, or some by name; the push `tests` has the results. */
  startTests: {tab: number; names?: string[]};
  /** Run one cycle of one automaton, or of all with 0, while paused. */
  step: {component: string; automaton: number};
  /** Stop the process of a component that was started here. */
  stop: {tab: number};
  /** Stop a component that is followed, also one that was started elsewhere. */
  stopPresent: {component: string};
  /** Stop the tests of a document. */
  stopTests: {tab: number};
  /** Undo the last step; if it is another window's, what this one has typed at a place. */
  undo: {tab: number; place?: Place | null};
  /** Stop following it; it keeps running. */
  unfollow: {component: string};
}

/** What both sides had changed. */
export interface Resolved {
  conflicts: string[];
  revision: number;
}

/** The `variable` of a state's automaton that takes the output `name` of one of the automata below. */
export interface Result {
  name: string;
  child: number;
  variable: string;
}

/** Constants: the cameras' names, and the limits of the joints once they are known. */
export interface RobotFacts {
  cameras: string[];
  limits: JointLimits[];
}

/** The robot of the realm, and what the editor runs for it. */
export interface RobotPush {
  push: "robot";
  status?: "lost" | "none" | "present" | "starting" | "stopping";
  simulated?: boolean;
  name?: string;
  title?: string;
  speed?: number;
  since?: number;
  stopped?: string;
  started?: "" | "real" | "simulation";
  simulation?: Simulation;
  hasBalls?: boolean;
  postures?: string[];
  others?: OtherRobot[];
  serves?: string[];
  trouble?: string;
}

/** The state of the robot; fields that are unknown or too old are empty. */
export interface RobotState {
  joints: Record<string, number>;
  pan: number | null;
  tilt: number | null;
  health: HealthReport | null;
  torso: [number, number, number, number, number, number, number] | null;
  objects: Record<string, [number, number, number, number, number, number, number]>;
  trouble: string;
  sliding: string[];
  says: string;
  sound: string;
  failing: Fault[];
}

/** A topic, service or action of ROS 2 that the component uses. */
export interface RosInterface {
  name: string;
  kind: string;
  target: string;
  type: string;
  qos: string;
  stop: string;
}

/** The file of a document, and the tab of a copy. */
export interface SavedAs {
  path: string;
  remarks?: string[];
  tab?: number;
}

/** The file of a robot, and all that can be simulated then. */
export interface SavedRobot {
  bodies: KnownBody[];
  path: string;
}

/** What can be drawn as ready states: ours, then those of the project. */
export interface ShelfPush {
  push: "shelf";
  states: ReadyState[];
}

/** A recording, and the tab with its document; 0 without one. */
export interface ShownRecording {
  body: string;
  cameras: string[];
  component: string;
  document: string;
  facts?: RobotFacts;
  shortened: string;
  since?: number | null;
  snapshot: LiveSnapshot | null;
  structure: LiveStructure | null;
  tab: number;
  timeline: Timeline;
  world: import("../robot3d/world-drawing.js").WorldShape[];
}

/** A call that is being typed: its parameters, and the index of the one at the cursor, -1 for none. */
export interface Signature {
  name: string;
  parameters: string[];
  active: number;
  result: string;
  documentation: string;
}

/** A simulation as it is requested: options of `naoserver-sim`, and whether its balls move. */
export interface Simulation {
  world: string;
  speed: string;
  balls: boolean;
  body: string;
}

/** The state of a running component at this moment. */
export interface SnapshotPush {
  push: "snapshot";
  component: string;
  value: LiveSnapshot;
}

/** A component has been silent since a moment (s of wall time); `since` is 0 when it sends again. */
export interface StalePush {
  push: "stale";
  component: string;
  since: number;
}

/** The status of a component that was started here. */
export interface StartedPush {
  push: "started";
  tab: number;
  component: string;
  status: "ended" | "generating" | "started" | "starting" | "stopping";
  exitCode: number | null;
  message: string;
  elsewhere: string;
  place: Place | null;
  line: number;
}

/** The component that was started, and the file in which its run is recorded. */
export interface StartedRun {
  component: string;
  facts?: RobotFacts;
  recording?: string;
  since?: number | null;
  snapshot: LiveSnapshot | null;
  structure: LiveStructure | null;
  timeline: Timeline;
}

/** A state: its position on the canvas in pixels, its code, and the automata that it owns. */
export interface State {
  id: number;
  name: string;
  initial: boolean;
  final: boolean;
  x: number;
  y: number;
  children: number[];
  history: string;
  entry: string;
  code: string;
  exit: string;
  arguments: Argument[];
  results: Result[];
}

/** A state of an automaton. */
export interface StateStructure {
  id: number;
  name: string;
  initial: boolean;
  final: boolean;
  children: number[];
  restart: boolean;
}

/** A step of a run, as `CounterexampleStep` of the model checker; the rest are ids of the document. */
export interface Step {
  timeMs: number;
  automaton: number;
  kind: string;
  text: string;
  state: number;
  origin?: number | null;
  transition?: number | null;
}

/** The result of stopping the robot: the servants that have stopped, and why the others have not. */
export interface StopReport {
  stopped: string[];
  failed: Record<string, string>;
}

/** The automata of a running component. */
export interface StructurePush {
  push: "structure";
  component: string;
  value: LiveStructure;
}

/** A failure of a `part` of the robot that the behavior must survive, as `nao faults` names both. */
export interface Survives {
  part: string;
  kind: string;
  amount: string;
  after: string;
  must: string;
}

/** An open document. */
export interface TabState {
  tab: number;
  title: string;
  path: string;
  component: string;
  dirty: boolean;
  outside: string;
  changed: boolean;
  recording: string;
  views: string[];
}

/** A document with which one may begin. */
export interface Template {
  description: string;
  name: string;
}

/** A test as the page shows it; without an outcome it was not run yet. */
export interface TestView {
  name: string;
  file: string;
  outcome: "" | "failed" | "passed" | "skipped";
  seconds: number;
  reason: string;
  timeline: string;
}

/** The tests of a tab's document, how they went, and what they passed. */
export interface TestsPush {
  push: "tests";
  tab: number;
  status: "idle" | "running" | "stopping";
  tests: TestView[];
  passed: Passed[];
  code: PassedCode[];
  unmeasured: string;
  outdated: boolean;
  error: string;
}

/** Everything that is kept: its time span, and the changes of state. */
export interface Timeline {
  start: number;
  end: number;
  changes: [number, number, number, number, number][];
  spans: [number, number, boolean, number, number][];
  numbers: string[];
  failures: FailureSpan[];
}

/** What is left of a timed transition out of the current state. */
export interface TimerSnapshot {
  transition: number;
  remaining: number;
}

/** A transition between two states of one automaton. */
export interface Transition {
  id: number;
  name: string;
  x: number;
  y: number;
  origin: number;
  destination: number;
  type: string;
  trigger: string;
  guard: string;
  priority: string;
  code: string;
}

/** Why a transition out of the current state has not fired. */
export interface TransitionExplanation {
  transition: number;
  order: number;
  asked: boolean;
  value: boolean;
  askedAt: number;
  remaining: number;
  reason: string;
}

/** A transition of an automaton. */
export interface TransitionStructure {
  id: number;
  name: string;
  origin: number;
  destination: number;
  kind: number;
  seconds: number;
  event: string;
  condition: string;
  order: number;
}

/** A step that can be undone or redone, and the revision of the document to which that leads. */
export interface UndoStep {
  name: string;
  revision: number;
}

/** A step that was undone or redone, and where. */
export interface Undone {
  added: Added[];
  conflict?: boolean;
  name: string;
  others: boolean;
  own: boolean;
  place: Place | null;
  revision: number;
}

/** A vector in the frame that its holder names. */
export interface Vector3 {
  x: number;
  y: number;
  z: number;
}

/** How that goes which a view does for the document of a tab; `name` is that of the view. */
export interface ViewPush {
  push: "view";
  name: string;
  tab: number;
  outdated: boolean;
}

/** The open documents, those that can be recovered, and the components of the realm. */
export interface WorkspacePush {
  push: "workspace";
  tabs: TabState[];
  recoverable: Recoverable[];
  present: PresentComponent[];
}

/** A world of the simulation; `balls` says whether it has balls that can be moved. */
export interface WorldFacts {
  name: string;
  description: string;
  balls: boolean;
}

/** The path of a file that was written. */
export interface Written {
  path: string;
}
