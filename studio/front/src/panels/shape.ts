/** The shape: its counts and health, repairs, values, and files to open and to save. */

import type { App } from "../contract";
import type { State, Vec3 } from "../core/backend";
import { Vector3 } from "three";
import { nearestAxis } from "../core/axes";
import { download, Form, h } from "../core/dom";
import { ColoringPanel } from "./coloring";
import markup from "./shape.html?raw";

const NEAR = 0.95; // cosine of the angle to an axis below which a direction is not taken for it

/** Return the axis of the coordinates that is near to a direction, or the direction. */
function snap(direction: Vector3): Vector3 {
  const axis = nearestAxis(direction);
  return axis.dot(direction) > NEAR ? axis : direction;
}

export class ShapePanel extends ColoringPanel {
  readonly id = "shape";
  readonly title = "Shape";
  private readonly form = new Form(markup);

  build(app: App): HTMLElement {
    const { form } = this;
    const can = app.state.capabilities;
    this.app = app;
    const choose = async () => (await app.choose()).forEach((file) => app.openFile(file));
    form.on({
      open: choose,
      "open-folder": () => app.folders.show(),
      values: () => this.start(),
      "save-png": () => this.savePicture(),
      "roll-left": () => this.roll(1),
      "roll-right": () => this.roll(-1),
      front: () => this.faceFront(),
    });
    app.addExports(form, "save");
    form.get("opening").hidden = !can.includes("open");
    form.get("open-folder").hidden = !can.includes("folders");
    form.get("facing").hidden = !can.includes("finish");
    if (can.includes("open")) {
      app.shortcut("O", "Open a file", choose);
      app.acceptDrops(app.main, (file) => app.openFile(file));
    }
    return form.root;
  }

  protected versionOf(state: State): string {
    return `${state.shape}`;
  }

  override refresh(state: State): void {
    const { health, values } = state;
    this.listShapes(state);
    const select = this.form.get<HTMLSelectElement>("values");
    const names = values.map(({ name }) => name).join();
    if (names !== select.dataset.names) {
      const options = values.map(({ name, title }) => h("option", { value: name }, title));
      select.replaceChildren(...options, h("option", { value: "" }, "none: the plain surface"));
      select.dataset.names = names;
    }
    this.form.get("values-part").hidden = !values.length;
    const rows = health.facts.map(([name, text]) =>
      h("tr", {}, h("th", {}, name), h("td", {}, text)),
    );
    this.form.get("facts").replaceChildren(...rows);
    const lines = health.lines.map(([kind, text]) => h("li", { class: kind }, text));
    this.form.get("health").replaceChildren(...lines, ...this.buildRepairs(state));
    super.refresh(state);
  }

  /** List the shapes that were opened, if there are several, to choose from. */
  private listShapes({ shapes, shape }: State): void {
    const buttons = shapes.map(([number, name]) => {
      const click = () => this.app.change({ kind: "choose", shape: number }, `Showing ${name}`);
      const attributes = { type: "button", "data-test": `shape-${number}`, title: name, click };
      return h("button", { ...attributes, "aria-pressed": String(number === shape) }, name);
    });
    const list = this.form.get("shapes");
    list.hidden = shapes.length < 2;
    list.replaceChildren(...buttons);
  }

  /** Return a line with a button for each repair that would help. */
  private buildRepairs({ health, capabilities }: State): HTMLElement[] {
    return health.findings.map(({ name, why, text }) => {
      const label = `Repair: ${name.replaceAll("_", " ")}`;
      const click = () => this.app.change({ kind: "repair", names: [name] }, label);
      const attributes = { type: "button", "data-test": `repair-${name}`, title: why, click };
      const act = capabilities.includes("repair") && h("button", attributes, label);
      return h("li", { class: "bad" }, text, act);
    });
  }

  protected async show(): Promise<void> {
    const { viewer, state } = this.app;
    const name = this.form.get("values").value;
    const chosen = state.values.find((each) => each.name === name);
    if (!chosen) return viewer.setScalars(null);
    const values = await this.latest(this.get<Float32Array>(`values/${name}`));
    const partial = values.some(Number.isNaN);
    const range: [number, number] = [chosen.min, chosen.max];
    viewer.setScalars(values, { ...chosen, map: "viridis", range, partial });
  }

  /** Turn the shape by a quarter in the picture: what is at its side becomes its top. */
  private roll(side: 1 | -1): Promise<boolean> {
    const { right, towards } = this.app.viewer.axes;
    return this.face(snap(right.multiplyScalar(side)), towards);
  }

  private faceFront(): Promise<boolean> {
    return this.face(new Vector3(...this.app.state.up), this.app.viewer.axes.towards);
  }

  private face(up: Vector3, towards: Vector3): Promise<boolean> {
    const side = { up: up.toArray() as Vec3, towards: towards.toArray() as Vec3 };
    return this.app.change({ kind: "face", ...side }, "Turning the shape");
  }

  private async savePicture(): Promise<void> {
    const picture = await this.app.run("Drawing the picture", this.app.viewer.screenshot());
    if (picture) download(picture, this.app.fileName("png"), "image/png");
  }
}
