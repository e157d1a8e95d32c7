/** The shape: its counts and health, repairs, values, and files to open and to save. */

import type { App, Panel } from "../app";
import type { State } from "../core/backend";
import { formatNumber } from "../core/colors";
import { button, chooseFile, download, h } from "../core/dom";
import { Store } from "../core/store";
import { acceptDrops } from "./controls";

export const MESH_FILES = ".ply,.obj,.off,.stl,.glb,.gltf,.vtk,.vtu,.mesh,.msh";
const FORMATS = ["ply", "obj", "glb"];

export class ShapePanel implements Panel {
  readonly id = "shape";
  readonly title = "Shape";
  readonly needs: string[] = [];
  private app!: App;
  private readonly store = new Store();
  private readonly facts = h("table", { class: "facts", "data-test": "facts" });
  private readonly health = h("ul", { class: "health", "data-test": "health" });
  private readonly values = h("select", { "data-test": "values", "aria-label": "Values" });
  private readonly valuesPart = h("div", {}, h("h3", {}, "Values"), this.values);
  private active = false;

  build(app: App): HTMLElement {
    this.app = app;
    this.values.addEventListener("change", () => this.paint());
    const can = (capability: string) => (app.state.capabilities as string[]).includes(capability);
    const open = button("Open a file …", "open", "Read a mesh; it becomes the shape (O)", () => this.choose());
    open.classList.add("primary");
    const picture = button("Picture", "save-png", "Save what is shown as PNG", () => this.savePicture());
    const files = FORMATS.map((format) =>
      button(format.toUpperCase(), `save-${format}`, `Save the shape as ${format.toUpperCase()}`, () => this.save(format)),
    );
    if (can("open")) {
      app.shortcut("O", "Open a file", () => this.choose());
      acceptDrops(app.viewer.stage, (name, file) => this.open(name, file));
    }
    return h(
      "div",
      {},
      can("open") && h("div", { class: "row" }, open, h("span", { class: "faint" }, "or drop one on the shape")),
      this.valuesPart,
      h("h3", {}, "Size"),
      this.facts,
      h("h3", {}, "Health"),
      this.health,
      h("h3", {}, "Save"),
      h("div", { class: "row" }, picture, ...(can("finish") ? files : [])),
    );
  }

  refresh(state: State): void {
    const { health, values } = state;
    const count = (number: number | null) => (number === null ? "…" : number.toLocaleString("en"));
    const rows: [string, string][] = [
      ["Vertices", count(state.n_vertices)],
      ["Faces", count(state.n_faces)],
      ["Area", `${formatNumber(health.area)} length²`],
      ["Volume", health.volume === null ? "none: it is not closed" : `${formatNumber(health.volume)} length³`],
    ];
    const known = health.components !== null; // large meshes are still examined
    if (!known) rows.splice(2);
    this.facts.replaceChildren(...rows.map(([name, text]) => h("tr", {}, h("th", {}, name), h("td", {}, text))));
    this.health.replaceChildren(...(known ? this.describe(state) : [h("li", {}, "The shape is being examined …")]));
    if (this.store.renew(`${state.shape}`)) {
      const options = values.map(({ name, title }) => h("option", { value: name }, title));
      this.values.replaceChildren(...options, h("option", { value: "" }, "none: the plain surface"));
      this.valuesPart.hidden = !values.length;
      if (this.active) this.paint();
    }
  }

  shown(): void {
    this.active = true;
    this.paint();
  }

  hidden(): void {
    this.active = false;
    this.app.viewer.setScalars(null);
  }

  /** Return a line for each fact of health, and one with a button for each repair. */
  private describe({ health, capabilities }: State): HTMLElement[] {
    const { components, boundary_loops: loops } = health;
    const holes = loops === 1 ? "1 boundary" : `${loops.toLocaleString("en")} boundaries`;
    const facts: [boolean, string][] = [
      [components === 1, components === 1 ? "It is one piece." : `It consists of ${components.toLocaleString("en")} separate pieces.`],
      [health.closed, health.closed ? "It is closed: it has an inside and an outside." : `It is open, with ${holes}.`],
      [health.manifold, health.manifold ? "It is a clean surface (manifold)." : "Some edges or vertices join more than one sheet (not manifold)."],
    ];
    const lines = facts.map(([good, text]) => h("li", { class: good ? "good" : "fair" }, text));
    for (const { name, why } of health.findings) {
      const label = name.replaceAll("_", " ");
      const repair = () =>
        this.app.change({ kind: "repair", names: [name] }, `Repairing: ${label}`).catch(() => {});
      const act = capabilities.includes("repair") && button(`Repair: ${label}`, `repair-${name}`, why, repair);
      lines.push(h("li", { class: "bad" }, why, act));
    }
    if (!health.findings.length) lines.push(h("li", { class: "good" }, "No repair is needed."));
    return lines;
  }

  private async paint(): Promise<void> {
    const chosen = this.app.state.values.find(({ name }) => name === this.values.value);
    if (!chosen) return this.app.viewer.setScalars(null);
    const { name, title, unit, min, max } = chosen;
    const values = await this.app.run(`Loading ${title}`, this.store.get<Float32Array>(this.app.backend, `values/${name}`));
    if (!this.active || this.values.value !== name) return;
    const text = unit ? `${title}, ${unit}` : title;
    this.app.viewer.setScalars(values, { map: "viridis", range: [min, max], title: text });
  }

  private async choose(): Promise<void> {
    const { name, bytes } = await chooseFile(MESH_FILES);
    this.open(name, bytes);
  }

  private open(name: string, file: Uint8Array): void {
    this.app.change({ kind: "open", name, file }, `Reading ${name}`).catch(() => {});
  }

  private fileName(ending: string): string {
    return `${this.app.state.name.replace(/\.\w{2,4}$/, "") || "shape"}.${ending}`;
  }

  private async savePicture(): Promise<void> {
    download(await this.app.run("Drawing the picture", this.app.viewer.screenshot()), this.fileName("png"), "image/png");
  }

  private async save(format: string): Promise<void> {
    const { data } = await this.app.run("Writing the file", this.app.backend.array(`file/${format}`));
    download(data as Uint8Array<ArrayBuffer>, this.fileName(format));
  }
}
