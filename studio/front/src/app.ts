/** The window: viewer on the left, panels on the right, one line of status below. */

import type { Backend, Change, State } from "./core/backend";
import markup from "./app.html?raw";
import type { App, Panel } from "./contract";
import type { Beside } from "./core/beside";
import { Cloud } from "./core/cloud";
import { acceptDrops, chooseFiles, download, Form, h, readFiles, type NamedFile } from "./core/dom";
import type { Film } from "./core/film";
import type { Settings } from "./core/settings";
import { Skin, stackImages } from "./core/skin";
import { Viewer, type View } from "./core/viewer";
import type { Arrays, TypedArray } from "./core/wire";
import { FolderDialog } from "./folders";
import { LargeNote } from "./large";
import { DeformPanel } from "./panels/deform/deform";
import { Strip } from "./strip";
import style from "./style.css?inline";
import { runTour } from "./tour";
import { welcome } from "./welcome";

const FORMATS = {
  ply: "Save the shape as PLY",
  obj: "Save positions and faces as OBJ; GLB keeps textures, too",
  glb: "Save the shape as GLB",
};
const SEEN = "eigenshape-tour=1"; // cookie: the ports of one machine share it, unlike storage
const POLL = 300; // ms between two questions while the server computes

/** The window; what its contents use of it is described at `App`. */
export class Studio implements App {
  readonly viewer: Viewer;
  state!: State;
  private readonly page = new Form(markup);
  readonly main = this.page.root;
  private readonly status = this.page.get("status");
  private readonly large = new LargeNote(this);
  readonly folders = new FolderDialog(this);
  private readonly help = this.page.get<HTMLDialogElement>("help");
  private readonly shortcuts = new Map<string, { text: string; action: () => void }>();
  private readonly pages = new Map<string, { panel: Panel; tab: HTMLElement; page: HTMLElement }>();
  private active: Panel | null = null;
  private cloud: Cloud | null = null; // the points that the surface was made of
  second: Beside | null = null;
  readonly secondShown: ((second: Beside) => void)[] = [];
  private strip: Strip | null = null;
  private showing: Promise<void> = Promise.resolve(); // the newest state
  private busy = 0;
  private timer = 0;
  private shown = { shape: -1, pose: -1, side: "" }; // what the viewer shows
  private mesh: Promise<[Float32Array, Uint32Array]>; // requested, of a shape not shown yet
  private readonly first: Promise<State>;
  private changing: Promise<unknown> = Promise.resolve(); // the last change
  private stepping: Promise<void> = Promise.resolve(); // undone and redone one after the other

  constructor(
    readonly backend: Backend,
    host: HTMLElement,
    private readonly panels: Panel[],
    readonly settings: Settings,
    keys: EventTarget = host,
  ) {
    // WebGL takes a second to start without a graphics card; meanwhile the shape is on its way.
    backend.trouble = (why) => this.showTrouble(why);
    this.first = backend.meta();
    this.mesh = this.requestMesh();
    // A shadow root keeps the styles of a notebook out, and ours in.
    const root = host.attachShadow({ mode: "open" });
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(style);
    root.adoptedStyleSheets = [sheet];
    root.append(this.main);
    this.setTheme(settings.get("theme", matchMedia("(prefers-color-scheme: dark)").matches));
    this.viewer = new Viewer(this.page.get("stage"));
    this.viewer.onView = (view) => settings.set("view", view);
    new ResizeObserver(() => this.cover()).observe(this.page.get("panels"));
    this.page.on({
      theme: () => this.switchTheme(),
      sheet: () => this.showSheet(!this.main.classList.contains("sheet")),
      "help-button": () => this.showHelp(),
      "help-close": () => this.help.close(),
      tour: () => {
        this.help.close();
        this.startTour();
      },
    });
    keys.addEventListener("keydown", (event) => this.press(event as KeyboardEvent));
    this.page.get("tabs").addEventListener("keydown", (event) => this.walkTabs(event));
    this.shortcut("?", "Show this overview", () => this.showHelp());
    this.shortcut("Home", "Show the whole shape", () => this.viewer.fit());
    this.shortcut("T", "Dark or light", () => this.switchTheme());
    this.shortcut("Ctrl+Z", "Undo the last edit", () => this.step("undo"));
    this.shortcut("Ctrl+Shift+Z", "Redo", () => this.step("redo"));
    this.shortcut("Ctrl+Y", "Redo", () => this.step("redo"));
  }

  async start(): Promise<void> {
    const loading = this.first.then((state) => this.show(state)).then(() => true);
    if (!(await this.run("Loading the shape", loading))) return;
    const view = this.settings.get<View | null>("view", null);
    if (view && view.shape === this.state.shape) this.viewer.setView(view);
    this.addPanels();
    this.strip = new Strip(this);
    const usable = [...this.pages.keys()];
    // Whoever brings values wants to see them.
    const last = this.settings.get("panel", this.state.values.length ? "shape" : "");
    this.refreshPanels();
    const first = this.state.n_points ? "shape" : usable[0]!;
    this.open(usable.includes(last) ? last : first);
    this.findParts();
    if (this.state.samples.length && !this.settings.get("welcomed", false)) welcome(this);
  }

  /** Ask for the state, load what changed, and refresh all panels; again while something runs. */
  async refresh(): Promise<void> {
    await this.show(await this.backend.meta());
    this.refreshPanels();
    this.findParts();
  }

  /** Let the parts be found once the shape can be bent: they serve as limbs. */
  private findParts(): void {
    const { capabilities, deformation, parts } = this.state;
    if (!capabilities.includes("finish") || deformation.status !== "ready") return;
    if (parts.status !== "none") return;
    const started = this.backend.finish({ kind: "parts" }).then(() => this.refresh());
    started.catch((error) => this.fail(error));
  }

  firstTour(): void {
    if (document.cookie.includes(SEEN)) return;
    document.cookie = `${SEEN}; max-age=${10 * 365 * 86400}; samesite=strict`;
    this.startTour();
  }

  private startTour(): void {
    const bend = this.pages.get("deform")?.panel;
    if (!(bend instanceof DeformPanel)) return;
    this.open("deform");
    runTour(this, bend.limbs).catch((error) => this.fail(error));
  }

  async change(change: Change, text: string, files?: Arrays): Promise<boolean> {
    const making = this.run(text, this.backend.finish(change, files));
    this.changing = making;
    const done = await making;
    if (!done) return false;
    await this.show(done.state, done.vertices);
    this.refreshPanels();
    if (done.warnings.length) this.say(done.warnings.join(" "));
    return true;
  }

  /** Say why calls wait for the server; once it is there again, show what it has. */
  private showTrouble(why: string | null): void {
    if (why) return this.fail(why);
    const { shape, digest, beside, losses, history } = this.state;
    this.refresh()
      .then(() => {
        const now = this.state;
        // Another server shows another shape to a tab of which no work is kept.
        if (now.shape === shape && now.digest !== digest) return location.reload();
        const gone = now.losses.filter((loss) => !losses.includes(loss));
        const fewer = history.length - now.history.length;
        if (fewer > 0 && !gone.length) gone.push(`${fewer} steps are gone.`);
        const mapped = ["running", "ready"].includes(beside?.map.status ?? "");
        if (mapped && now.beside?.map.status === "none")
          gone.push(`The map to ${now.beside.name} is gone: find it again in Compare.`);
        if (gone.length) this.fail(`The studio answers again. ${gone.join(" ")}`);
        else this.say("The studio answers again; nothing was lost.");
      })
      .catch((error) => this.fail(error));
  }

  choose(suffixes = this.state.suffixes, multiple = false): Promise<NamedFile[]> {
    return this.orFail(chooseFiles(suffixes, this.state.most_bytes, multiple));
  }

  acceptDrops(element: HTMLElement, onFile: (file: NamedFile) => void): void {
    acceptDrops(element, async (file) =>
      (await this.orFail(readFiles([file], this.state.most_bytes))).forEach(onFile),
    );
  }

  private orFail(files: Promise<NamedFile[]>): Promise<NamedFile[]> {
    return files.catch((error) => {
      this.fail(error);
      return [];
    });
  }

  openFile({ name, bytes }: NamedFile): Promise<boolean> {
    return this.change({ kind: "open", name }, `Reading ${name}`, { file: bytes });
  }

  async run<T>(text: string, work: Promise<T>): Promise<T | null> {
    this.busy += 1;
    if (text) this.say(`${text} …`);
    this.main.classList.add("busy");
    try {
      const result = await work;
      if (this.status.textContent === `${text} …`) this.say("");
      return result;
    } catch (error) {
      this.fail(error);
      return null;
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
    this.status.textContent = this.status.title = text;
  }

  load<T extends TypedArray>(name: string, text: string): Promise<T | null> {
    return this.run(text, this.backend.array<T>(name));
  }

  async save(kind: string, ending: string): Promise<void> {
    const file = await this.load<Uint8Array<ArrayBuffer>>(`file/${kind}`, "Writing the file");
    if (file) download(file, this.fileName(ending));
  }

  addExports(form: Form, row: string): void {
    if (!this.state.capabilities.includes("finish")) return;
    for (const [format, title] of Object.entries(FORMATS)) {
      const click = () => this.save(format, format);
      const button = { type: "button", "data-test": `${row}-${format}`, title, click };
      form.get(row).append(h("button", button, format.toUpperCase()));
    }
  }

  fileName(ending: string): string {
    return `${this.state.name.replace(/\.\w{2,4}$/, "") || "shape"}.${ending}`;
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
    this.showCloud();
    this.active.shown?.();
    this.strip?.panelShown();
  }

  films(): Film[] {
    return this.active?.films?.() ?? [];
  }

  /** The panel Shape shows the points of a scan; the others color and bend the surface. */
  private showCloud(): void {
    this.cloud?.show(this.active?.id === "shape");
  }

  /** Add the panels that can be used now: an index or a collection may have been opened. */
  private addPanels(): void {
    const { capabilities } = this.state;
    for (const panel of this.panels)
      if (!this.pages.has(panel.id) && panel.needs.every((need) => capabilities.includes(need)))
        this.addPanel(panel);
  }

  private addPanel(panel: Panel): void {
    const number = this.pages.size + 1;
    const [tabId, pageId] = [`tab-${panel.id}`, `panel-${panel.id}`];
    const click = () => {
      this.open(panel.id);
      this.showSheet(true);
    };
    const key = `Shift+${number}`;
    const title = `${panel.title} (${key})`;
    const control = { id: tabId, "data-test": tabId, role: "tab", "aria-controls": pageId };
    const tab = h("button", { ...control, type: "button", title, click }, panel.title);
    const region = { id: pageId, "data-test": pageId, role: "tabpanel", "aria-labelledby": tabId };
    const page = h("section", { ...region, hidden: true }, panel.build(this));
    this.page.get("tabs").append(tab);
    this.page.get("panels").append(page);
    this.pages.set(panel.id, { panel, tab, page });
    this.shortcut(key, `Panel: ${panel.title}`, click);
  }

  private requestMesh(): Promise<[Float32Array, Uint32Array]> {
    return Promise.all([
      this.backend.array<Float32Array>("vertices"),
      this.backend.array<Uint32Array>("faces"),
    ]);
  }

  /** Take a state, and load the mesh or the vertices if they are others than the viewer has. */
  private show(state: State, vertices?: Float32Array<ArrayBuffer>): Promise<void> {
    this.state = state;
    return (this.showing = this.showNow(state, vertices));
  }

  private async showNow(state: State, vertices?: Float32Array<ArrayBuffer>): Promise<void> {
    const { shape, pose } = state;
    if (shape !== this.shown.shape) {
      if (this.shown.shape >= 0) this.mesh = this.requestMesh();
      const [points, faces] = await this.mesh;
      if (state !== this.state) return this.showing; // a newer one has come meanwhile
      this.viewer.setMesh(points, faces, state.up, state.towards);
      this.viewer.shape = shape;
      if (state.n_images >= 0) this.loadSkin(state).catch((error) => this.fail(error));
      this.cloud?.remove();
      const cloud = state.n_points && (await this.backend.array<Float32Array>("points"));
      if (state !== this.state) return this.showing;
      this.cloud = cloud ? new Cloud(this.viewer, cloud) : null;
      this.showCloud();
    } else if (pose !== this.shown.pose) {
      const points = vertices ?? (await this.backend.array<Float32Array<ArrayBuffer>>("vertices"));
      if (state !== this.state) return this.showing;
      this.viewer.setVertices(points);
    }
    const side = `${shape} ${state.up} ${state.towards}`;
    if (shape === this.shown.shape && side !== this.shown.side)
      this.viewer.face(state.up, state.towards);
    this.shown = { shape, pose, side };
    this.page.text("name", state.name);
    this.page.get("name").title = state.name;
    const [nVertices, nFaces] = [state.n_vertices, state.n_faces].map((n) =>
      n.toLocaleString("en"),
    );
    this.page.text("counts", `${nVertices} vertices · ${nFaces} faces`);
    clearTimeout(this.timer);
    const { health, spectrum, parts, deformation, beside } = state;
    // The repair that turns faces helps unless all of them face outward.
    const outward = health.findings.every(({ name }) => name !== "orient");
    this.viewer.setSolid(health.closed === true && outward);
    const works = [health, spectrum, parts, deformation, beside?.map];
    if (works.some((work) => work?.status === "running"))
      this.timer = window.setTimeout(() => this.refresh().catch((error) => this.fail(error)), POLL);
  }

  /** Let the shape look as its file says, after the first picture of it. */
  private async loadSkin({ shape, n_images }: State): Promise<void> {
    const numbers = Array.from({ length: n_images }, (_, number) => number);
    const [rows, corners, ...files] = await Promise.all([
      this.backend.array<Float32Array>("skin/rows"),
      this.backend.array<Uint32Array>("skin/corners"),
      ...numbers.map((number) => this.backend.array<Uint8Array<ArrayBuffer>>(`skin/${number}`)),
    ]);
    const images = await stackImages(files);
    if (this.viewer.shape !== shape) return images.dispose();
    this.viewer.setSkin(new Skin(this.viewer.surface, rows, corners, images));
  }

  refreshPanels(): void {
    this.strip?.refresh();
    if (this.active) this.addPanels();
    this.large.refresh(this.state);
    for (const { panel } of this.pages.values()) panel.refresh(this.state);
  }

  can(kind: "undo" | "redo"): boolean {
    const { history, place } = this.state;
    return kind === "undo" ? place > 0 : place < history.length;
  }

  step(kind: "undo" | "redo"): Promise<void> {
    this.stepping = this.stepping.then(async () => {
      await this.changing;
      if (this.can(kind)) await this.change({ kind }, kind === "undo" ? "Undoing" : "Redoing");
    });
    return this.stepping;
  }

  /** Slide the panel over the shape, or away, where the window is narrow. */
  showSheet(seen: boolean): void {
    this.main.classList.toggle("sheet", seen);
    this.page.get("sheet").ariaExpanded = String(seen);
    this.cover();
  }

  /** Let the shapes be seen above the panel, where that lies over them. */
  private cover(): void {
    const panels = this.page.get("panels");
    const lies = this.main.classList.contains("sheet") && getComputedStyle(panels).position === "absolute";
    const pixels = lies ? panels.offsetHeight : 0;
    this.second?.viewer.cover(pixels, true);
    this.viewer.cover(pixels);
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
      h("div", {}, h("kbd", {}, key.replaceAll("+", " + ").replace("Arrow", "")), text),
    );
    this.page.get("keys").replaceChildren(...rows);
    this.help.showModal();
  }

  private press(event: KeyboardEvent): void {
    const target = event.composedPath()[0] as HTMLElement;
    const typing = target.matches?.("select, input:not([type=range], [type=checkbox])");
    if (typing || this.main.querySelector("dialog[open]")) return;
    if (["BUTTON", "SUMMARY"].includes(target.tagName) && event.key === "Enter") return; // it presses the button
    // The digits are the keys, whatever Shift makes of them on this keyboard.
    const digit = /^Digit(\d)$/.exec(event.code)?.[1];
    const letter = digit ?? (event.key.length === 1 ? event.key.toUpperCase() : event.key);
    const control = event.ctrlKey || event.metaKey;
    // Shift is part of "?" itself, but tells "Ctrl+Shift+Z" from "Ctrl+Z".
    const shift = event.shiftKey && /^[A-Z]|^\d$/.test(letter);
    const key = `${control ? "Ctrl+" : ""}${shift ? "Shift+" : ""}${letter}`;
    const found = this.shortcuts.get(key);
    const slides = target.matches?.("input[type=range]") && letter.startsWith("Arrow");
    if (!found || slides) return;
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
