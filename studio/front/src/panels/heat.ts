/** Heat on the shape: how much stays at each point, or how it spreads from a picked source. */

import type { App } from "../contract";
import type { State } from "../core/backend";
import { findRange, formatNumber } from "../core/colors";
import type { Film } from "../core/film";
import { Form } from "../core/dom";
import { findTimeRange, heatFromSource, heatKernelSignature } from "../core/heat";
import { ColoringPanel } from "./coloring";
import markup from "./heat.html?raw";

const STEPS = 400; // of the slider in heat.html, equal in the logarithm of time
const SOURCE = "#35c9e0"; // in no color of heat

export class HeatPanel extends ColoringPanel {
  readonly id = "heat";
  readonly title = "Heat";
  private readonly form = new Form(markup);
  private modes = new Float32Array();
  private eigenvalues = new Float64Array();
  private view = "signature";
  private source = -1;

  build(app: App): HTMLElement {
    const { form } = this;
    this.app = app;
    form.onChoice("heat", (view) => {
      this.view = view;
      this.paint();
    });
    form.on({ time: () => this.paint() });
    form.slide("time", app.settings.get("heat-time", STEPS / 2), "");
    return form.root;
  }

  protected versionOf(state: State): string {
    return `${state.shape} ${state.spectrum.k}`;
  }

  override refresh(state: State): void {
    this.form.progress("heat-progress", state.spectrum);
    this.form.get("heat-results").hidden = !state.spectrum.k;
    super.refresh(state);
  }

  films(): Film[] {
    if (!this.modes.length || (this.view === "source" && this.source < 0)) return [];
    let before: number | null = null; // what the slider showed
    const at = (step: number) => {
      this.form.get("time").valueAsNumber = step;
      this.paint();
    };
    const show = (share: number) => {
      before ??= this.form.number("time");
      at(STEPS * share);
    };
    return [{ title: "Heat", seconds: 6, show, end: () => before !== null && at(before) }];
  }

  protected async show(): Promise<void> {
    this.modes = new Float32Array();
    if (!this.app.state.spectrum.k) return this.app.viewer.setScalars(null);
    const loading = Promise.all([
      this.get<Float64Array<ArrayBuffer>>("eigenvalues"),
      this.get<Float32Array<ArrayBuffer>>("modes"),
    ]);
    const loaded = await this.latest(this.app.run("Loading the eigenfunctions", loading));
    if (!loaded) return;
    [this.eigenvalues, this.modes] = loaded;
    if (this.source >= this.app.state.n_vertices) this.source = -1;
    this.paint();
  }

  /** Compute the heat, here in the browser, and color the shape by it. */
  private paint(): void {
    const times = findTimeRange(this.eigenvalues);
    if (!this.modes.length || !times) return;
    const { form, modes, eigenvalues, source } = this;
    const { settings, viewer } = this.app;
    const step = form.number("time");
    const time = times[0] ** (1 - step / STEPS) * times[1] ** (step / STEPS);
    settings.set("heat-time", step);
    form.slide("time", step, `${formatNumber(time)} length²`);
    const reach = `Heat spreads about 2√t = ${formatNumber(2 * Math.sqrt(time))} in this time.`;
    const unit = "1/length²";
    if (this.view === "signature") {
      form.text(
        "heat-explained",
        "The heat kernel signature: how much of a unit of heat is still at the same point after " +
          `time t. It is high at tips. ${reach}`,
      );
      const heat = heatKernelSignature(modes, eigenvalues, time);
      const range = findRange(heat);
      viewer.setPointer();
      viewer.setPoints([], SOURCE);
      viewer.setScalars(heat, { map: "viridis", range, title: "heat that stays", unit });
      return;
    }
    viewer.setPointer("crosshair", ({ vertex }) => {
      this.source = vertex;
      this.paint();
    });
    viewer.setPoints(source < 0 ? [] : [source], SOURCE);
    if (source < 0) {
      form.text("heat-explained", "Click a point of the shape, and a unit of heat starts there.");
      return viewer.setScalars(null);
    }
    const started = `A unit of heat starts at vertex ${source}.`;
    form.text("heat-explained", `${started} ${reach} Click another source.`);
    const heat = heatFromSource(modes, eigenvalues, time, source);
    const [low, high] = findRange(heat);
    const range: [number, number] = [Math.min(low, 0), high];
    viewer.setScalars(heat, { map: "inferno", range, title: "heat", unit });
  }
}
