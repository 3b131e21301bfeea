/**
 * The page: its layout, and when its parts are loaded.
 *
 * @import {HfsmCanvas} from "../canvas/canvas.js"
 * @import {Target} from "../kit/events.js"
 * @import {Automaton, Place} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @import {At} from "../data/page.js"
 * @import {Panel} from "./panels.js"
 */

import {html, nothing} from "lit";

import "./actions.js";
import "../canvas/canvas.js";
import "./menubar.js";
import "./robot-pill.js";
import "./tree.js";
import {PageElement} from "../data/element.js";
import {holdKeys} from "../kit/waiting-keys.js";
import {icon} from "../kit/icons.js";
import {listenForKeys} from "../kit/keys.js";
import {notify, notifyError, OFFLINE, clearErrors, showNoticesOf} from "../kit/notices.js";
import {showImports} from "../data/imported-content.js";
import {page} from "../data/page.js";
import {stopButton} from "../run/bar.js";
import {monitor} from "../run/monitor.js";
import {planned} from "../run/breakpoints.js";
import {listenForStop} from "../run/stop.js";
import {outputLog} from "../data/output-log.js";
import {perform} from "../kit/registry.js";
import {viewing} from "../kit/viewers.js";
import {actionButton} from "../kit/buttons.js";
import {resizer, restoreSizes} from "../kit/resizer.js";
import {Panels, bottomPanels, panelTabs, isOffered, sidePanels, views} from "./panels.js";
import {Runs} from "./runs.js";
import {banner, keepStopInView} from "./shell.js";
import {initTheme, switchTheme} from "../kit/theme.js";
import {browserStorage, windowStorage} from "../kit/location.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";

const UNHURRIED = 500; // ms after the first picture until more is loaded
const SHOWN = "visualhfsm.shown"; // the tab that a window shows
export class HfsmApp extends PageElement {
  static properties = {side: {state: true}, bottom: {state: true}, tree: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["change"], store: ["workspace", "document", "connection", "started", "robot", "outside"]};

  constructor() {
    super();
    /** Whether a document is about to be shown instead of the start page. */
    this.arrives = false;
    /** Tag of the element beside the canvas, "" for none. */
    this.side = "";
    /** Tag of the element below the canvas, "" for none. */
    this.bottom = "";
    /** The class that shows or hides the tree; empty where the width of the window decides. */
    this.tree = "";
    this.canvas = /** @type {HfsmCanvas} */ (document.createElement("hfsm-canvas"));
    this.panels = new Panels(() => this.requestUpdate());
    /** The timeline below the canvas. @type {(Panel & {compact?: boolean}) | undefined} */
    this.strip = undefined;
    /** The tabs before the last change. @type {Set<number> | undefined} */
    this.knownTabs = undefined;
    /** Resolves when the overlay of the canvas has loaded. @type {Promise<void> | undefined} */
    this.overlay = undefined;
    /** Resolves when what was shown before is asked for. @type {Promise<void> | undefined} */
    this.restored = undefined;
  }

  /** Tags of the elements that were last requested beside and below the canvas; they may still be loading. */
  #wanted = {side: "", bottom: ""};

  runs = new Runs(this);

  /** Whether something is below the canvas, or is loaded to be there. */
  get isBottomWanted() {
    return !!this.#wanted.bottom;
  }

  get context() {
    return {app: this, canvas: this.canvas};
  }

  connectedCallback() {
    super.connectedCallback();
    listenForKeys(this.context);
    this.listen(page, "edit", (event) => this.#edit(event.detail));
    this.listen(page, "data", (event) => this.#showData(event.detail));
    this.listen(page, "tab", () => this.#titleWindow());
    this.listen(page, "tab", () => showNoticesOf(page.tab));
    this.listen(page, "tab", () => windowStorage.setItem(SHOWN, String(page.tab)));
    this.listen(page, "tab", () => (this.arrives = !!this.panels.get("hfsm-start")?.isConnected));
    this.listen(store, "connection", () => store.online && clearErrors(OFFLINE));
    this.listen(page, "tab", () => this.#offerViews());
    this.listen(page, "save", () => perform("save", this.context));
    this.listen(page, "highlight", () => this.canvas.showLive(highlighted()));
    this.listen(page, "automaton", () => page.highlight && this.canvas.showLive(highlighted()));
    this.listen(page, "focus-canvas", () => this.canvas.focusSelected());
    this.listen(store, "workspace", () => this.#follow());
    this.listen(store, "document", ({detail}) => {
      // What it was before had them.
      if (detail.changed) clearErrors(`start ${detail.tab}`, `judge ${detail.tab}`, "steer reload");
      if (detail.tab === page.tab) page.prune();
    });
    this.listen(store, "outside", ({detail}) => {
      if (detail.state === "reloaded" && detail.message) notify(detail.message, "info", undefined, detail);
    });
    store.addEventListener("document", () => setTimeout(() => this.#loadLater(), UNHURRIED), {once: true});
    this.listen(store, "closed", ({detail}) => page.forget(detail.tab));
    this.listen(outputLog, "lines", ({detail}) => this.runs.showOutput(detail));
    this.listen(store, "failure", ({detail}) => notifyError(detail.error));
    this.listen(
      /** @type {Target<{"hfsm-menu": Parameters<typeof import("./menu.js").showMenu>[0], tool: null}>} */ (
        this.canvas
      ),
      "hfsm-menu",
      async ({detail}) => (await import("./menu.js")).showMenu(detail, this.context),
    );
    this.listen(this.canvas, "tool", () => this.requestUpdate());
    import("./dropped-files.js").then(({takeDrops}) => takeDrops(this));
    this.listen(
      window,
      "beforeunload",
      (event) =>
        store.workspace.tabs.some((each) => each.dirty) && !store.online && !store.restarted && event.preventDefault(),
    );
    this.listen(monitor, "present", () => monitor.present.length && this.#showMonitor("hfsm-monitor-toolbar"));
    this.listen(monitor, "mode", () => this.#monitored());
    for (const kind of /** @type {const} */ (["mode", "structure"]))
      this.listen(monitor, kind, () => this.#showRobot());
    this.listen(store, "robot", () => this.#showRobot());
    this.listen(monitor, "structure", () => this.#showBreakpoints());
    this.listen(page, "tab", () => this.#showBreakpoints());
    this.listen(store, "connection", () => this.#showBreakpoints());
    this.listen(store, "connection", () => this.#welcome());
    listenForStop();
    if (windowStorage.getItem("visualhfsm.left") ?? browserStorage.getItem("visualhfsm.layout")) this.#restore();
    showImports();
    store.connect();
  }

  /** Show an element beside the canvas; an empty tag closes it. @param {string} tag */
  async showSide(tag) {
    this.#wanted.side = tag;
    const element = tag ? await this.panels.load(tag) : undefined;
    if ((tag && !element) || this.#wanted.side !== tag) return undefined;
    this.side = tag;
    await this.updateComplete;
    return element;
  }

  /** Show an element below the canvas; an empty tag closes it. @param {string} tag */
  async showBottom(tag, {focuses = true} = {}) {
    this.#wanted.bottom = tag;
    const show = async () => {
      const element = tag ? await this.panels.load(tag) : undefined;
      if ((tag && !element) || this.#wanted.bottom !== tag) return undefined;
      this.bottom = tag;
      await this.updateComplete;
      if (focuses) element?.focusFirst?.();
      return element;
    };
    return tag && focuses ? holdKeys(show) : show();
  }

  /** Show the robot beside the drawing, or fold it. @param {boolean} [folded] by default the other way */
  async foldRobot(folded) {
    const wasThere = !!this.panels.get("hfsm-robot-dock");
    const dock = /** @type {import("../robot3d/dock.js").RobotDock | undefined} */ (await this.#showRobot());
    await dock?.fold(folded ?? (wasThere && !dock.folded));
  }

  /** Whether the robot is beside the drawing. */
  get showsRobot() {
    return !!this.querySelector(".dock");
  }

  /** When there is a robot to see, load what shows it. */
  async #showRobot() {
    const known = this.panels.get("hfsm-robot-dock");
    return known ?? (monitor.hasRobot ? this.#showMonitor("hfsm-robot-dock") : undefined);
  }

  /** Show what is live beside the automaton, such as the robot in 3D. @param {string} tab */
  async showLive(tab) {
    const panel = /** @type {import("../run/panel.js").MonitorPanel | undefined} */ (
      await this.showSide("hfsm-monitor-panel")
    );
    await panel?.choose(tab);
  }

  /** Whether the tree is visible. */
  get showsTree() {
    return Boolean(/** @type {HTMLElement | null} */ (this.querySelector(".left"))?.offsetWidth);
  }

  /** Show the shelf, and let its search be typed. */
  showShelf() {
    if (!this.showsTree) this.tree = "with-tree";
    return holdKeys(async () => {
      const shelf = /** @type {import("../shelf/shelf.js").Shelf | undefined} */ (await this.panels.load("hfsm-shelf"));
      this.requestUpdate();
      await this.updateComplete;
      await shelf?.search();
      return shelf;
    });
  }

  toggleTree() {
    this.tree = this.showsTree ? "without-tree" : "with-tree";
  }

  /** Show the panel of a view, or fold it. @param {string} tag */
  async toggleView(tag) {
    const panel = await this.showSide(this.side === tag ? "" : tag);
    if (panel) panel.focusFirst?.();
    else this.canvas.focusSelected();
  }

  /** Show what plug-ins have to show of a document when this browser first shows it. */
  #offerViews() {
    for (const view of views.values()) {
      const shown = `visualhfsm.${view.name} ${store.greeting.root}/${page.tabState?.path}`;
      if (view.before || !isOffered(view) || browserStorage.getItem(shown)) continue;
      browserStorage.setItem(shown, "shown");
      this.showSide(view.tag);
    }
  }

  /** Show the menu of the robot. */
  showRobotMenu() {
    /** @type {HTMLElement | null} */ (this.querySelector("#robot-menu"))?.togglePopover(true);
  }

  /** Show which components run. */
  async showRunning() {
    const toolbar = /** @type {import("../run/toolbar.js").MonitorToolbar | undefined} */ (
      await this.#showMonitor("hfsm-monitor-toolbar")
    );
    await toolbar?.updateComplete;
    await toolbar?.open();
  }

  /** Follow a component that runs, and show its document. @param {string} component */
  async follow(component) {
    if (await monitor.follow(component)) await this.openFollowed();
  }

  /** Open the document of the component that is followed. */
  async openFollowed() {
    await (await import("../run/documents.js")).openFollowed();
  }

  toggleTheme() {
    switchTheme();
  }

  /** Show the document beside the shown one. @param {number} step */
  showNeighbor(step) {
    const {tabs} = store.workspace;
    if (!tabs.length) return;
    const index = tabs.findIndex((each) => each.tab === page.tab);
    page.show(tabs[(index + step + tabs.length) % tabs.length].tab);
  }

  render() {
    const starting = !page.document;
    const isBeside = !!(this.side || this.showsRobot);
    return html` <header>
        <button type="button" class="skip" ?hidden=${starting} @click=${() => this.canvas.focusSelected()}>
          ${t("Skip to the drawing")}
        </button>
        ${
          starting
            ? html`<span class="brand">${icon("layout")}VisualHFSM</span>`
            : html`<h1 class="brand">${icon("layout")}VisualHFSM</h1>`
        }
        <hfsm-menubar></hfsm-menubar>
        <hfsm-tabs></hfsm-tabs>
        <hfsm-robot></hfsm-robot>
        <div class="monitor-area">${this.panels.get("hfsm-monitor-toolbar") ?? nothing}</div>
        ${stopButton(this.context)}
      </header>
      <div class="second-row" role="region" aria-label=${t("Run and draw")}>
        <hfsm-monitor-bar></hfsm-monitor-bar>
        <div class="crumbs" ?hidden=${starting}>
          ${actionButton("up", this.context, {label: false})}<hfsm-breadcrumbs></hfsm-breadcrumbs>
        </div>
        <hfsm-tools ?hidden=${starting}></hfsm-tools>
        ${monitor.hasRobot && !starting ? actionButton("robotDock", this.context, {label: false}) : nothing}
      </div>
      <div class="work ${isBeside ? "beside" : ""} ${this.side ? "with-side" : ""} ${this.tree}">
        <aside class="left" aria-label=${t("Automata and shelf")} ?hidden=${starting}>
          <div class="stacked">
            <nav aria-label=${t("Tree of automata")}><hfsm-tree></hfsm-tree></nav>
            ${(starting ? undefined : this.panels.get("hfsm-shelf")) ?? nothing}
          </div>
          ${resizer({name: t("Width of the tree"), variable: "--left", along: "x", sign: 1, smallest: 120, largest: 480})}
        </aside>
        <main aria-label=${t("Canvas")}>
          ${starting ? banner(this.context) : nothing}
          <div class="center" ?hidden=${starting}>
            <div class="drawing">
              ${starting ? nothing : banner(this.context)} ${this.canvas}
              <div class="toolbar" role="toolbar" aria-label=${t("View")}>
                ${["undo", "redo", "zoomOut", "zoomIn", "fit"].map((id) => actionButton(id, this.context, {label: false}))}
              </div>
            </div>
            <div class="column" ?hidden=${!isBeside}>
              ${resizer({
                name: t("Width of the panel"),
                variable: "--side",
                along: "x",
                sign: -1,
                smallest: 260,
                largest: 1200,
              })}
              <div class="stacked ${this.side ? "with-panel" : ""}">
                ${this.panels.get("hfsm-robot-dock") ?? nothing}${
                  this.side
                    ? html`<section class="side" aria-label=${t("Panel beside the canvas")}>
                        ${panelTabs(
                          sidePanels(),
                          this.side,
                          (tag) => this.showSide(tag),
                          () => this.canvas.focusSelected(),
                        )}
                        <div class="content">${this.panels.get(this.side)}</div>
                      </section>`
                    : nothing
                }
              </div>
            </div>
          </div>
          ${
            monitor.isShownBeside(page.tab) && !starting && this.bottom !== "hfsm-monitor-timeline"
              ? (this.strip ?? nothing)
              : nothing
          }
          ${
            this.bottom && !starting
              ? html`${resizer({
                    name: t("Height of the panel"),
                    variable: "--bottom",
                    along: "y",
                    sign: -1,
                    smallest: 90,
                    largest: 700,
                  })}
                  <section class="bottom" aria-label=${t("Panel below the canvas")}>
                    ${panelTabs(
                      bottomPanels(),
                      this.bottom,
                      (tag) => this.showBottom(tag),
                      () => this.canvas.focusSelected(),
                    )}
                    <div class="content">${this.panels.get(this.bottom)}</div>
                  </section>`
              : nothing
          }
          ${starting && store.online ? this.panels.lazily("hfsm-start") : nothing}
        </main>
      </div>
      <footer><hfsm-status></hfsm-status></footer>`;
  }

  /** Show what was shown before the page was loaded again. */
  #restore() {
    this.restored ??= import("./layouts.js").then((module) => module.restore(this));
  }

  /** Load what the first picture does not need. */
  async #loadLater() {
    this.#restore();
    if (viewing.on) return; // who may not draw needs no shelf
    import("../canvas/first-sentence.js").then(({invite}) => invite(this.canvas));
    await this.panels.load("hfsm-shelf");
    this.requestUpdate();
  }

  /** @param {Place & At} place */
  async #edit(place) {
    await this.#reveal("hfsm-code-panel", {place});
  }

  /** @param {{section: string, place?: Place & At}} data */
  async #showData({section, place}) {
    await this.#reveal("hfsm-data-panel", {section, place});
  }

  /**
   * Show something in a panel, which takes the keys that are pressed until it is there, if it takes the focus.
   *
   * @param {string} tag
   * @param {{place?: Place & At, section?: string}} wanted
   */
  #reveal(tag, wanted) {
    const show = async () => {
      const panel = await this.showSide(tag);
      return panel && Object.assign(panel, wanted).revealed;
    };
    return wanted.place?.focus === false ? show() : holdKeys(show);
  }

  /** Show a document at first, and another one when the shown one was closed. */
  #follow() {
    const {tabs} = store.workspace;
    const known = this.knownTabs;
    this.knownTabs = new Set(tabs.map((each) => each.tab));
    if (!known && page.tab === 0) page.show(firstTab());
    else if (known?.has(page.tab) && !this.knownTabs.has(page.tab)) page.show(tabs.at(-1)?.tab ?? 0);
    this.#titleWindow();
  }

  /** Show a newcomer a robot that dances, or a recording, when the server asks for it. */
  async #welcome() {
    const {demo, recording} = store.online ? store.greeting : {};
    if (demo) (await import("./robot-run.js")).watchDance(this);
    if (recording) (await import("../run/documents.js")).play(recording);
  }

  /** Focus the canvas after a choice on the start page, which is gone. */
  updated() {
    if (!this.arrives || !page.document) return;
    this.arrives = false;
    if (document.activeElement === document.body) this.canvas.surface.focus({preventScroll: true});
  }

  #titleWindow() {
    const {title = "", dirty = false} = page.tabState ?? {};
    document.title = title ? `${dirty ? "• " : ""}${title} – VisualHFSM` : "VisualHFSM";
  }

  /** Load an element of the monitor, and draw the page with it. @param {string} tag */
  async #showMonitor(tag) {
    const element = await this.panels.load(tag);
    this.requestUpdate();
    return element;
  }

  /** Draw the state of a component and its breakpoints; loaded when there is something to draw. */
  #showOverlay() {
    this.overlay ??= import("../run/overlay.js").then(({showOn}) => showOn(this.canvas));
    return this.overlay;
  }

  #showBreakpoints() {
    if (planned.has(page.tab)) this.#showOverlay();
  }

  /** When the first component is followed, load the elements that show it. */
  async #monitored() {
    this.requestUpdate();
    if (monitor.newest) this.runs.starting = -1;
    if (!monitor.component || this.strip) return;
    this.strip = Object.assign(/** @type {Panel} */ (document.createElement("hfsm-monitor-timeline")), {compact: true});
    const [whyNot] = await Promise.all([
      import("../run/why-not.js"),
      import("../run/spoken.js"),
      this.#showOverlay(),
      this.panels.load("hfsm-monitor-timeline"),
    ]);
    whyNot.explainUnderPointer(this.canvas);
    this.requestUpdate();
  }
}

/** The marks in the shown automaton that do not come from a run. */
const highlighted = () => page.highlight?.get(page.automaton?.id ?? 0);

initTheme();
keepStopInView();
restoreSizes();
/** The first view of a window: the one before it was loaded again, or for a viewer, the run. */
function firstTab() {
  const {tabs, present} = store.workspace;
  const former = Number(windowStorage.getItem(SHOWN));
  const live = tabs.find(({component}) => present.some((each) => each.component === component));
  return (tabs.find(({tab}) => tab === former) ?? (viewing.on ? live : undefined) ?? tabs[0])?.tab ?? 0;
}

customElements.define("hfsm-app", HfsmApp);
