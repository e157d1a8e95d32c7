/** Heat on the shape: how much stays at each point, or how it spreads from a picked source. */

import type { App } from "../app";
import type { State } from "../core/backend";
import { findRange, formatNumber } from "../core/colors";
import { h } from "../core/dom";
import { findTimeRange, heatFromSource, heatKernelSignature } from "../core/heat";
import { buildChoice, ColoringPanel, ProgressBar, Slider } from "./controls";

const STEPS = 400; // of the slider, equal in the logarithm of time
const SOURCE = "#35c9e0"; // in no color of heat

export class HeatPanel extends ColoringPanel {
  readonly id = "heat";
  readonly title = "Heat";
  private readonly progress = new ProgressBar("heat-progress");
  private readonly time = new Slider("Time t", "time", () => this.paint());
  private readonly explained = h("p", { class: "note", "data-test": "heat-explained" });
  private readonly results: HTMLElement;
  private modes: Float32Array = new Float32Array();
  private eigenvalues: Float64Array = new Float64Array();
  private view = "signature";
  private source = -1;

  constructor() {
    super();
    const views = { signature: "Heat that stays", source: "From a source" };
    const choice = buildChoice("heat", views, (view) => {
      this.view = view;
      this.paint();
    });
    choice.press(this.view);
    this.time.setRange(0, STEPS);
    this.results = h("div", {}, choice.element, this.time.element, this.explained);
  }

  build(app: App): HTMLElement {
    this.app = app;
    this.time.show(app.settings.get("heat-time", STEPS / 2), "");
    app.viewer.onPick(({ vertex }) => {
      if (!this.active || this.view !== "source") return;
      this.source = vertex;
      this.paint();
    });
    return h("div", {}, this.progress.element, this.results);
  }

  protected versionOf(state: State): string {
    return `${state.shape} ${state.spectrum.k}`;
  }

  override refresh(state: State): void {
    this.progress.show(state.spectrum);
    this.results.hidden = !state.spectrum.k;
    super.refresh(state);
  }

  protected async show(): Promise<void> {
    this.modes = new Float32Array();
    if (!this.app.state.spectrum.k) return this.app.viewer.setScalars(null);
    const arrays = Promise.all([this.get<Float64Array>("eigenvalues"), this.get<Float32Array>("modes")]);
    [this.eigenvalues, this.modes] = await this.latest(this.app.run("Loading the eigenfunctions", arrays));
    if (this.source >= this.app.state.n_vertices) this.source = -1;
    this.paint();
  }

  /** Compute the heat, here in the browser, and color the shape by it. */
  private paint(): void {
    const times = findTimeRange(this.eigenvalues);
    if (!this.modes.length || !times) return;
    const { viewer } = this.app;
    const { modes, eigenvalues, source } = this;
    this.app.settings.set("heat-time", this.time.value);
    const share = this.time.value / STEPS;
    const time = times[0] ** (1 - share) * times[1] ** share;
    this.time.show(this.time.value, `${formatNumber(time)} length²`);
    const picking = this.view === "source";
    viewer.setMode(picking ? "source" : "orbit");
    viewer.setPoints(picking && source >= 0 ? [source] : [], SOURCE);
    const reach = `Heat spreads about 2√t = ${formatNumber(2 * Math.sqrt(time))} in this time.`;
    if (!picking) {
      const heat = heatKernelSignature(modes, eigenvalues, time);
      this.explained.textContent = `The heat kernel signature: how much of a unit of heat is still at the same point after time t. It is high at tips. ${reach}`;
      viewer.setScalars(heat, { map: "viridis", range: findRange(heat), title: "heat that stays", unit: "1/length²" });
    } else if (source >= 0) {
      const heat = heatFromSource(modes, eigenvalues, time, source);
      const [low, high] = findRange(heat);
      this.explained.textContent = `A unit of heat starts at vertex ${source}. ${reach} Click another source.`;
      viewer.setScalars(heat, { map: "inferno", range: [Math.min(low, 0), high], title: "heat", unit: "1/length²" });
    } else {
      this.explained.textContent = "Click a point of the shape, and a unit of heat starts there.";
      viewer.setScalars(null);
    }
  }
}
