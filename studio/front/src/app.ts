/** The window: viewer on the left, panels on the right, one line of status below. */

import type { Backend, Change, Finished, State } from "./core/backend";
import { button, h } from "./core/dom";
import { Viewer, type View } from "./core/viewer";
import style from "./style.css?inline";

/** What survives a reload of the page, in the storage of the tab. */
export class Settings {
  private readonly values: Record<string, unknown>;

  constructor(
    private readonly storage: Storage | null,
    private readonly key = "eigenshape",
  ) {
    this.values = JSON.parse(storage?.getItem(key) ?? "{}");
  }

  get<T>(name: string, otherwise: T): T {
    return (this.values[name] as T | undefined) ?? otherwise;
  }

  set(name: string, value: unknown): void {
    this.values[name] = value;
    this.storage?.setItem(this.key, JSON.stringify(this.values));
  }
}

export interface App {
  readonly backend: Backend;
  readonly viewer: Viewer;
  readonly settings: Settings;
  readonly state: State;
  /** Ask for the state, load what changed, and refresh all panels; again while something runs. */
  refresh(): Promise<void>;
  /** Make a change on the server, and show its result and its warnings. */
  change(change: Change, text: string): Promise<Finished>;
  /** Show `text` as the status while `work` runs, and its error if it fails. */
  run<T>(text: string, work: Promise<T>): Promise<T>;
  fail(error: unknown): void;
  say(text: string): void;
  /** Bind a key such as "g", "Shift+D" or "Ctrl+Z"; the overview lists it with its text. */
  shortcut(key: string, text: string, action: () => void): void;
  /** Show a panel. */
  open(id: string): void;
}

export interface Panel {
  id: string;
  title: string;
  needs: string[]; // capabilities without which the panel is hidden
  build(app: App): HTMLElement;
  refresh(state: State): void;
  shown?(): void;
  hidden?(): void;
}

const POLL = 300; // ms between two questions while the server computes

export class Studio implements App {
  readonly viewer: Viewer;
  state!: State;
  private readonly main: HTMLElement;
  private readonly tabs = h("div", { class: "tabs", role: "tablist", "aria-label": "Panels" });
  private readonly body = h("div", { class: "panels" });
  private readonly status = h("span", { class: "message", role: "status", "data-test": "status" });
  private readonly counts = h("span", { class: "counts", "data-test": "counts" });
  private readonly title = h("h1", { "data-test": "name" });
  private readonly help = h("dialog", { class: "help", "data-test": "help", "aria-label": "Keys" });
  private readonly shortcuts = new Map<string, { text: string; action: () => void }>();
  private readonly pages = new Map<string, { panel: Panel; tab: HTMLElement; page: HTMLElement }>();
  private active: Panel | null = null;
  private busy = 0;
  private timer = 0;
  private shown = { shape: -1, pose: -1 }; // what the viewer shows

  constructor(
    readonly backend: Backend,
    host: HTMLElement,
    private readonly panels: Panel[],
    readonly settings: Settings,
    keys: EventTarget = host,
  ) {
    // A shadow root keeps the styles of a notebook out, and ours in.
    const root = host.attachShadow({ mode: "open" });
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(style);
    root.adoptedStyleSheets = [sheet];
    const stage = h("div", { class: "stage", "data-test": "stage" });
    const bar = h(
      "header",
      {},
      this.title,
      button("◐", "theme", "Dark or light (T)", () => this.switchTheme()),
      button("?", "help-button", "Keys (?)", () => this.showHelp()),
    );
    const side = h("aside", {}, bar, this.tabs, this.body);
    const footer = h("footer", {}, this.status, this.counts);
    this.main = h("div", { class: "studio" }, stage, side, footer, this.help);
    root.append(this.main);
    this.setTheme(settings.get("theme", matchMedia("(prefers-color-scheme: dark)").matches));
    this.viewer = new Viewer(stage);
    this.viewer.onView = (view) => settings.set("view", view);
    keys.addEventListener("keydown", (event) => this.press(event as KeyboardEvent));
    this.tabs.addEventListener("keydown", (event) => this.walkTabs(event));
    this.shortcut("?", "Show this overview", () => this.showHelp());
    this.shortcut("Home", "Show the whole shape", () => this.viewer.fit());
    this.shortcut("T", "Dark or light", () => this.switchTheme());
    this.shortcut("Ctrl+Z", "Undo the last edit", () => this.step("undo"));
    this.shortcut("Ctrl+Shift+Z", "Redo", () => this.step("redo"));
  }

  async start(): Promise<void> {
    await this.run("Loading the shape", this.load());
    const view = this.settings.get<View | null>("view", null);
    if (view && view.shape === this.state.shape) this.viewer.setView(view);
    for (const panel of this.panels) this.addPanel(panel);
    const usable = [...this.pages.keys()];
    const last = this.settings.get("panel", usable[0]);
    if (usable.length) this.open(last && usable.includes(last) ? last : usable[0]!);
    this.refreshPanels();
  }

  async refresh(): Promise<void> {
    await this.load();
    this.refreshPanels();
  }

  async change(change: Change, text: string): Promise<Finished> {
    const done = await this.run(text, this.backend.finish(change));
    const vertices = done.arrays.vertices?.data as Float32Array | undefined;
    if (vertices && done.state.shape === this.shown.shape) {
      this.viewer.setVertices(vertices);
      this.shown.pose = done.state.pose;
    }
    await this.show(done.state);
    this.refreshPanels();
    if (done.warnings.length) this.say(done.warnings.join(" "));
    return done;
  }

  async run<T>(text: string, work: Promise<T>): Promise<T> {
    this.busy += 1;
    this.say(`${text} …`);
    this.main.classList.add("busy");
    try {
      const result = await work;
      if (this.status.textContent === `${text} …`) this.say("");
      return result;
    } catch (error) {
      this.fail(error);
      throw error;
    } finally {
      this.busy -= 1;
      this.main.classList.toggle("busy", this.busy > 0);
    }
  }

  fail(error: unknown): void {
    this.say(error instanceof Error ? error.message : String(error));
    this.status.classList.add("failed");
  }

  say(text: string): void {
    this.status.classList.remove("failed");
    this.status.textContent = text;
    this.status.title = text;
  }

  shortcut(key: string, text: string, action: () => void): void {
    this.shortcuts.set(key, { text, action });
  }

  open(id: string): void {
    const next = this.pages.get(id);
    if (!next || next.panel === this.active) return;
    this.active?.hidden?.();
    for (const { panel, tab, page } of this.pages.values()) {
      const chosen = panel.id === id;
      tab.setAttribute("aria-selected", String(chosen));
      tab.tabIndex = chosen ? 0 : -1;
      page.hidden = !chosen;
    }
    this.active = next.panel;
    this.settings.set("panel", id);
    this.active.shown?.();
  }

  private addPanel(panel: Panel): void {
    const capabilities = this.state.capabilities as string[];
    if (!panel.needs.every((need) => capabilities.includes(need))) return;
    const number = this.pages.size + 1;
    const tab = h(
      "button",
      {
        type: "button",
        role: "tab",
        id: `tab-${panel.id}`,
        "aria-controls": `panel-${panel.id}`,
        "data-test": `tab-${panel.id}`,
        title: `${panel.title} (${number})`,
        onclick: () => this.open(panel.id),
      },
      panel.title,
    );
    const page = h("section", {
      role: "tabpanel",
      id: `panel-${panel.id}`,
      "aria-labelledby": tab.id,
      "data-test": `panel-${panel.id}`,
      hidden: true,
    });
    page.append(panel.build(this));
    this.tabs.append(tab);
    this.body.append(page);
    this.pages.set(panel.id, { panel, tab, page });
    this.shortcut(String(number), `Panel: ${panel.title}`, () => this.open(panel.id));
  }

  private async load(): Promise<void> {
    await this.show(await this.backend.meta());
  }

  /** Take a state, and load the mesh or the vertices if they are others than the viewer has. */
  private async show(state: State): Promise<void> {
    this.state = state;
    if (state.shape !== this.shown.shape) {
      const names = ["vertices", "faces"];
      const [vertices, faces] = await Promise.all(names.map((name) => this.backend.array(name)));
      const [points, corners] = [vertices!.data as Float32Array, faces!.data as Uint32Array];
      this.viewer.setMesh(points, corners, state.up, state.front);
      this.viewer.shape = state.shape;
    } else if (state.pose !== this.shown.pose) {
      this.viewer.setVertices((await this.backend.array("vertices")).data as Float32Array);
    }
    this.shown = { shape: state.shape, pose: state.pose };
    this.title.textContent = this.title.title = state.name;
    const [vertices, faces] = [state.n_vertices, state.n_faces].map((n) => n.toLocaleString("en"));
    this.counts.textContent = `${vertices} vertices · ${faces} faces`;
    clearTimeout(this.timer);
    const { health, spectrum, parts, deformation } = state;
    if ([health, spectrum, parts, deformation].some((part) => part.status === "running"))
      this.timer = window.setTimeout(() => this.refresh().catch((error) => this.fail(error)), POLL);
  }

  private refreshPanels(): void {
    for (const { panel } of this.pages.values()) panel.refresh(this.state);
  }

  private step(kind: "undo" | "redo"): void {
    const { n_edits, n_redoable } = this.state.deformation;
    if (kind === "undo" ? n_edits : n_redoable)
      this.change({ kind }, kind === "undo" ? "Undoing" : "Redoing").catch(() => {});
  }

  private setTheme(dark: boolean): void {
    this.main.dataset.theme = dark ? "dark" : "light";
  }

  private switchTheme(): void {
    const dark = this.main.dataset.theme !== "dark";
    this.settings.set("theme", dark);
    this.setTheme(dark);
  }

  private showHelp(): void {
    const rows = [...this.shortcuts].map(([key, { text }]) =>
      h("div", {}, h("kbd", {}, key.replaceAll("+", " + ")), text),
    );
    const mouse =
      "Drag turns the shape, the right button moves it, the wheel zooms; so do the arrow keys, " +
      "+ and - while the picture has the focus.";
    const close = button("Close", "help-close", "Close (Esc)", () => this.help.close());
    this.help.replaceChildren(h("h2", {}, "Keys"), h("div", { class: "keys" }, ...rows), mouse, close);
    this.help.showModal();
  }

  private press(event: KeyboardEvent): void {
    const target = event.composedPath()[0];
    const typing = target instanceof HTMLInputElement && !["range", "checkbox", "radio"].includes(target.type);
    if (typing || target instanceof HTMLSelectElement || this.help.open) return;
    if (target instanceof HTMLButtonElement && event.key === "Enter") return; // it presses the button
    const letter = event.key.length === 1 ? event.key.toUpperCase() : event.key;
    const control = event.ctrlKey || event.metaKey;
    // Shift is part of "?" itself, but tells "Ctrl+Shift+Z" from "Ctrl+Z".
    const shift = event.shiftKey && /^[A-Z]/.test(letter);
    const key = `${control ? "Ctrl+" : ""}${shift ? "Shift+" : ""}${letter}`;
    const found = this.shortcuts.get(key);
    if (!found) return;
    event.preventDefault();
    found.action();
  }

  /** Arrow keys walk along the tabs, as everywhere. */
  private walkTabs(event: KeyboardEvent): void {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step || !this.active) return;
    const ids = [...this.pages.keys()];
    const next = ids[(ids.indexOf(this.active.id) + step + ids.length) % ids.length]!;
    this.open(next);
    this.pages.get(next)!.tab.focus();
  }
}
