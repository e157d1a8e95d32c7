/** The shape: its counts and health, repairs, values, and files to open and to save. */

import type { App } from "../app";
import type { State } from "../core/backend";
import { formatNumber } from "../core/colors";
import { button, chooseFile, download, h } from "../core/dom";
import { acceptDrops, ColoringPanel } from "./controls";

export const MESH_FILES = ".ply,.obj,.off,.stl,.glb,.gltf,.vtk,.vtu,.mesh,.msh";
const FORMATS = ["ply", "obj", "glb"];

export class ShapePanel extends ColoringPanel {
  readonly id = "shape";
  readonly title = "Shape";
  private readonly facts = h("table", { class: "facts", "data-test": "facts" });
  private readonly health = h("ul", { class: "health", "data-test": "health" });
  private readonly values = h("select", { "data-test": "values", "aria-label": "Values", onchange: () => this.start() });
  private readonly valuesPart = h("div", {}, h("h3", {}, "Values"), this.values);

  build(app: App): HTMLElement {
    this.app = app;
    const can = app.state.capabilities;
    const choose = async () => this.open(await chooseFile(MESH_FILES));
    const open = button("Open a file …", "open", "Read a mesh; it becomes the shape (O)", choose);
    const save = [button("Picture", "save-png", "Save what is shown as PNG", () => this.savePicture().catch(() => {}))];
    if (can.includes("finish"))
      for (const format of FORMATS) {
        const name = format.toUpperCase();
        save.push(button(name, `save-${format}`, `Save the shape as ${name}`, () => this.save(format).catch(() => {})));
      }
    if (can.includes("open")) {
      app.shortcut("O", "Open a file", choose);
      acceptDrops(app.viewer.stage, (name, bytes) => this.open({ name, bytes }));
    }
    const opening = h("div", { class: "row" }, open, h("span", { class: "faint" }, "or drop one on the shape"));
    const size = [h("h3", {}, "Size"), this.facts, h("h3", {}, "Health"), this.health];
    const saving = [h("h3", {}, "Save"), h("div", { class: "row" }, ...save)];
    return h("div", {}, can.includes("open") && opening, this.valuesPart, ...size, ...saving);
  }

  protected versionOf(state: State): string {
    return `${state.shape}`;
  }

  override refresh(state: State): void {
    const { health, values } = state;
    const names = values.map(({ name }) => name).join();
    if (names !== this.values.dataset.names) {
      const options = values.map(({ name, title }) => h("option", { value: name }, title));
      this.values.replaceChildren(...options, h("option", { value: "" }, "none: the plain surface"));
      this.values.dataset.names = names;
    }
    this.valuesPart.hidden = !values.length;
    const known = health.status === "ready"; // a large mesh is examined for some seconds
    const rows = [["Vertices", state.n_vertices.toLocaleString("en")], ["Faces", state.n_faces.toLocaleString("en")]];
    const volume = health.volume === null ? "none: it is not closed" : `${formatNumber(health.volume)} length³`;
    if (known) rows.push(["Area", `${formatNumber(health.area)} length²`], ["Volume", volume]);
    this.facts.replaceChildren(...rows.map(([name, text]) => h("tr", {}, h("th", {}, name), h("td", {}, text))));
    this.health.replaceChildren(...(known ? this.describe(state) : [h("li", {}, "It is being examined …")]));
    super.refresh(state);
  }

  /** Return a line for each fact of health, and one with a button for each repair. */
  private describe({ health, capabilities }: State): HTMLElement[] {
    const { components, boundary_loops: loops, closed, manifold } = health;
    const rims = loops === 1 ? "1 boundary" : `${loops.toLocaleString("en")} boundaries`;
    const pieces = `It consists of ${components.toLocaleString("en")} separate pieces.`;
    const line = (good: boolean, text: string) => h("li", { class: good ? "good" : "fair" }, text);
    const lines = [
      line(components === 1, components === 1 ? "It is one piece." : pieces),
      line(closed, closed ? "It is closed: it has an inside and an outside." : `It is open, with ${rims}.`),
      line(manifold, manifold ? "It is a clean surface (manifold)." : "Some edges or vertices join more than one sheet."),
    ];
    for (const { name, why } of health.findings) {
      const words = name.replaceAll("_", " ");
      const label = `Repair: ${words}`;
      const repair = () => this.app.change({ kind: "repair", names: [name] }, label).catch(() => {});
      const act = capabilities.includes("repair") && button(label, `repair-${name}`, why, repair);
      lines.push(h("li", { class: "bad" }, `A trial of ${why.replace(name, words)}.`, act));
    }
    return health.findings.length ? lines : [...lines, line(true, "No repair is needed.")];
  }

  protected async show(): Promise<void> {
    const { viewer, state } = this.app;
    const chosen = state.values.find(({ name }) => name === this.values.value);
    if (!chosen) return viewer.setScalars(null);
    const values = await this.latest(this.get<Float32Array>(`values/${chosen.name}`));
    viewer.setScalars(values, { ...chosen, map: "viridis", range: [chosen.min, chosen.max] });
  }

  private open({ name, bytes }: { name: string; bytes: Uint8Array }): void {
    this.app.change({ kind: "open", name, file: bytes }, `Reading ${name}`).catch(() => {});
  }

  private fileName(ending: string): string {
    return `${this.app.state.name.replace(/\.\w{2,4}$/, "") || "shape"}.${ending}`;
  }

  private async savePicture(): Promise<void> {
    const picture = await this.app.run("Drawing the picture", this.app.viewer.screenshot());
    download(picture, this.fileName("png"), "image/png");
  }

  private async save(format: string): Promise<void> {
    const { data } = await this.app.run("Writing the file", this.app.backend.array(`file/${format}`));
    download(data as Uint8Array<ArrayBuffer>, this.fileName(format));
  }
}
