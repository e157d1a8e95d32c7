/** What several panels are built of: sliders, choices, progress, plots, a place to drop files. */

import uPlot from "uplot";
import type { State } from "../core/backend";
import { h } from "../core/dom";

/** A slider with its name, and its value in words. */
export class Slider {
  readonly input: HTMLInputElement;
  private readonly output = h("output");
  readonly element: HTMLElement;

  constructor(label: string, name: string, onInput: (value: number) => void) {
    this.input = h("input", { type: "range", "data-test": name });
    this.input.addEventListener("input", () => onInput(this.value));
    this.output.dataset.test = `${name}-value`;
    this.element = h("label", { class: "slider" }, h("span", {}, label), this.output, this.input);
  }

  get value(): number {
    return this.input.valueAsNumber;
  }

  setRange(min: number, max: number, step: number): void {
    Object.assign(this.input, { min, max, step });
  }

  show(value: number, text: string): void {
    this.input.valueAsNumber = value;
    this.input.setAttribute("aria-valuetext", text);
    this.output.textContent = text;
  }
}

/** Return a row of buttons of which one is pressed, and a function that presses one. */
export function buildChoice(name: string, options: Record<string, string>, onChoose: (id: string) => void) {
  const element = h("div", { class: "row choice", role: "group" });
  const press = (id: string) => {
    for (const each of element.querySelectorAll("button"))
      each.setAttribute("aria-pressed", String(each.dataset.test === `${name}-${id}`));
  };
  for (const [id, label] of Object.entries(options)) {
    const choose = () => (press(id), onChoose(id));
    element.append(h("button", { type: "button", "data-test": `${name}-${id}`, onclick: choose }, label));
  }
  return { element, press };
}

/** The progress of work on the server; hidden unless it runs or has failed. */
export class ProgressBar {
  private readonly bar = h("progress", { max: 1 });
  private readonly text = h("span");
  readonly element: HTMLElement;

  constructor(name: string) {
    this.element = h("div", { class: "progress", "data-test": name }, this.bar, this.text);
  }

  show({ status, progress, message }: Pick<State["spectrum"], "status" | "progress" | "message">): void {
    this.element.hidden = status !== "running" && status !== "failed";
    this.bar.hidden = status === "failed";
    this.bar.value = progress;
    const share = `${Math.round(100 * progress)} %`;
    this.text.textContent = status === "failed" ? message : `${share} ${message}`;
  }
}

/** Let files be dropped on an element. */
export function acceptDrops(element: HTMLElement, onFile: (name: string, file: Uint8Array) => void): void {
  const mark = (on: boolean) => (event: DragEvent) => {
    event.preventDefault(); // otherwise the browser leaves the page for the file
    element.classList.toggle("dropping", on);
  };
  element.addEventListener("dragover", mark(true));
  element.addEventListener("dragleave", mark(false));
  element.addEventListener("drop", async (event) => {
    mark(false)(event);
    const file = event.dataTransfer?.files[0];
    if (file) onFile(file.name, new Uint8Array(await file.arrayBuffer()));
  });
}

export interface PlotOptions {
  labels: [string, string];
  series: uPlot.Series[];
  draw(plot: uPlot, pixel: (x: number, y: number) => [number, number]): void;
  choose(plot: uPlot, left: number, top: number): void; // a click
}

/** Return a plot in the colors of the page, dark or light, that answers to clicks. */
export function buildPlot(host: HTMLElement, data: uPlot.AlignedData, options: PlotOptions): uPlot {
  const color = (name: string) => () => readColor(host, name);
  const [x, y] = options.labels.map((label) => ({
    label,
    stroke: color("--text"),
    grid: { stroke: color("--line"), width: 1 },
    ticks: { stroke: color("--line"), size: 4 },
    font: "11px system-ui, sans-serif",
    labelFont: "12px system-ui, sans-serif",
    labelSize: 18,
    gap: 3,
  }));
  const pixel = (plot: uPlot) => (one: number, two: number): [number, number] => [
    plot.valToPos(one, "x", true), plot.valToPos(two, "y", true),
  ];
  const plot = new uPlot(
    {
      width: host.clientWidth,
      height: 210,
      legend: { show: false },
      scales: { x: { time: false } },
      cursor: { drag: { x: false, y: false }, points: { show: false } },
      axes: [{ ...x!, size: 26 }, { ...y!, size: 44 }],
      series: [{}, ...options.series],
      hooks: { draw: [(drawn) => options.draw(drawn, pixel(drawn))] },
    },
    data,
    host,
  );
  plot.over.addEventListener("click", () => options.choose(plot, plot.cursor.left!, plot.cursor.top!));
  const page = host.closest("[data-theme]");
  if (page) new MutationObserver(() => plot.redraw(false)).observe(page, { attributeFilter: ["data-theme"] });
  return plot;
}

export function readColor(element: Element, name: string): string {
  return getComputedStyle(element).getPropertyValue(name).trim();
}

/** Draw a ring around a point of a plot. */
export function drawRing(plot: uPlot, [x, y]: [number, number], color: string): void {
  plot.ctx.beginPath();
  plot.ctx.arc(x, y, 5 * devicePixelRatio, 0, 2 * Math.PI);
  plot.ctx.strokeStyle = color;
  plot.ctx.lineWidth = 2 * devicePixelRatio;
  plot.ctx.stroke();
}
