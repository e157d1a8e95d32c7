/** Collection: the mean shape, sliders for the modes in which specimens vary, and the specimens. */

import type { App, Panel } from "../contract";
import type { Collection, State } from "../core/backend";
import { Form, h } from "../core/dom";
import { alongNormals, bendByModes } from "../core/modes";
import markup from "./collection.html?raw";

const MOST = 3; // standard deviations
const COLORED = 2; // deviations of the first mode at the end of the color map

const write = (value: number) => `${value.toFixed(1)} sd`.replace("-", "−");

export class CollectionPanel implements Panel {
  readonly id = "collection";
  readonly title = "Collection";
  readonly needs = ["collection"];
  private app!: App;
  private readonly form = new Form(markup);
  private sliders: HTMLInputElement[] = [];
  private modes: Float32Array | null = null; // of the mean, one after the other
  private mean = new Float32Array(0); // vertices, and their normals
  private normals = new Float32Array();
  private most = 0; // displacement at the end of the color map
  private listed = ""; // what tells the collection that is shown from others
  private pose = "";
  private active = false;

  build(app: App): HTMLElement {
    const { form } = this;
    this.app = app;
    form.on({
      mean: () => this.set([]),
      "to-mean": () => app.change({ kind: "mean" }, "Loading the mean"),
    });
    return form.root;
  }

  /** Show another collection: its sliders, its specimens, and what failed. */
  private list(collection: Collection): void {
    const { form } = this;
    form.get("sliders").replaceChildren();
    this.sliders = collection.shares.map((share, mode) => this.addSlider(share, mode));
    const rows = collection.specimens.map((each) => this.buildRow(each));
    form.get("specimens").replaceChildren(...rows);
    const failed = collection.failures.map(([name, why]) =>
      h("li", { class: "bad" }, `${name}: ${why}`),
    );
    form.get("failures").replaceChildren(...failed);
    form.get("failures-part").hidden = !failed.length;
    const count = collection.specimens.length;
    form.text("about-collection", `${count} specimens of ${collection.title}, in correspondence.`);
    this.modes = null;
  }

  private addSlider(share: number, mode: number): HTMLInputElement {
    const name = `mode-${mode}`;
    const range = { type: "range", min: -MOST, max: MOST, step: 0.05, value: 0 };
    const slider = h("input", { ...range, "data-test": name, input: () => this.bend() });
    const title = `Mode ${mode + 1}, ${(100 * share).toFixed(0)} % of the variance`;
    const output = h("output", { "data-test": `${name}-value` });
    this.form.get("sliders").append(h("label", { class: "slider" }, h("span", {}, title), output, slider));
    return slider;
  }

  private buildRow({ name, notes, scores }: Collection["specimens"][0]): HTMLElement {
    const button = (text: string, title: string, click: () => void, test: string) =>
      h("button", { type: "button", title, "data-test": test, click }, text);
    const open = () => this.app.change({ kind: "beside", specimen: name }, `Loading ${name}`);
    return h(
      "li",
      {},
      button(name, `Show ${name} beside the mean`, open, `specimen-${name}`),
      button("≈", `Move the sliders to ${name}`, () => this.set(scores), `like-${name}`),
      notes.length > 0 && h("span", { class: "faint" }, notes.join("; ")),
    );
  }

  refresh(state: State): void {
    const { title, is_mean, specimens } = state.collection!;
    const listed = [title, ...specimens.map(({ name }) => name)].join();
    if (listed !== this.listed) this.list(state.collection!);
    this.listed = listed;
    this.form.get("modes-part").hidden = !is_mean;
    this.form.get("to-mean-part").hidden = is_mean;
    const pose = `${state.shape} ${state.pose}`;
    if (pose === this.pose) return;
    this.pose = pose;
    this.mean = new Float32Array(0); // of another shape, or in another pose
    this.reset();
  }

  shown(): void {
    this.active = true;
  }

  /** Other panels show the shape as it is. */
  hidden(): void {
    this.active = false;
    if (this.sliders.some((slider) => slider.valueAsNumber)) this.set([]);
    this.app.viewer.setScalars(null);
  }

  private reset(): void {
    for (const { dataset } of this.sliders) this.form.slide(dataset.test!, 0, write(0));
  }

  private set(scores: number[]): void {
    this.sliders.forEach((slider, mode) => {
      slider.valueAsNumber = Math.min(Math.max(scores[mode] ?? 0, -MOST), MOST);
    });
    this.bend();
  }

  /** Show the shape that the sliders ask for, colored by how far the surface has moved. */
  private async bend(): Promise<void> {
    const { app, sliders } = this;
    const amounts = sliders.map((slider) => slider.valueAsNumber);
    amounts.forEach((amount, mode) =>
      this.form.slide(sliders[mode]!.dataset.test!, amount, write(amount)),
    );
    if (!this.modes) this.modes = await app.load<Float32Array>("collection/modes", "Loading the modes");
    const { modes } = this;
    if (!modes || !app.state.collection!.is_mean) return;
    const size = 3 * app.state.n_vertices;
    if (!this.mean.length) {
      this.mean = Float32Array.from(app.viewer.vertices);
      this.normals = Float32Array.from(app.viewer.geometry.getAttribute("normal").array);
      const first = alongNormals(modes.subarray(0, size), this.normals);
      this.most = COLORED * first.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    }
    const change = bendByModes(modes, amounts, size);
    app.viewer.setVertices(Float32Array.from(this.mean, (value, i) => value + change[i]!));
    if (!this.active || !amounts.some(Boolean)) return app.viewer.setScalars(null);
    const moved = alongNormals(change, this.normals);
    const range: [number, number] = [-this.most, this.most];
    app.viewer.setScalars(moved, { map: "RdBu_r", range, title: "Outward from the mean" });
  }
}
