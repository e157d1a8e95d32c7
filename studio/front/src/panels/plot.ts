/** Plots in the colors of the page, with lines and rings of our own, that answer to clicks. */

import uPlot from "uplot";

const MARGIN = 0.04; // of the range along x, so that points at its ends are seen whole
const TICKS = 14; // pixels of them, and of the gap before the numbers
const FONT = "12px system-ui, sans-serif";
type Place = [number, number];

/** Draws over a plot, in the coordinates of its axes. */
export class Pen {
  constructor(readonly plot: uPlot) {}

  line(from: Place, to: Place, color: string, width = 1): void {
    this.plot.ctx.beginPath();
    this.plot.ctx.moveTo(...this.pixel(from));
    this.plot.ctx.lineTo(...this.pixel(to));
    this.stroke(color, width);
  }

  ring(place: Place, color: string): void {
    this.plot.ctx.beginPath();
    this.plot.ctx.arc(...this.pixel(place), 5 * devicePixelRatio, 0, 2 * Math.PI);
    this.stroke(color, 2);
  }

  private pixel([x, y]: Place): Place {
    return [this.plot.valToPos(x, "x", true), this.plot.valToPos(y, "y", true)];
  }

  private stroke(color: string, width: number): void {
    this.plot.ctx.strokeStyle = color;
    this.plot.ctx.lineWidth = width * devicePixelRatio;
    this.plot.ctx.stroke();
  }
}

export interface PlotOptions {
  labels: [string, string];
  series: uPlot.Series[];
  draw(pen: Pen): void;
  choose(plot: uPlot, left: number, top: number): void; // a click
}

export function buildPlot(host: HTMLElement, data: uPlot.AlignedData, options: PlotOptions): uPlot {
  const stroke = () => pageColor(host, "--text");
  const grid = { stroke: () => pageColor(host, "--line"), width: 1 };
  const style = { labelFont: FONT, labelSize: 18, font: FONT, gap: 3, stroke, grid, ticks: grid };
  const widen = (_: uPlot, low: number, high: number): uPlot.Range.MinMax => [
    low - MARGIN * (high - low),
    high + MARGIN * (high - low),
  ];
  const settings: uPlot.Options = {
    width: host.clientWidth,
    height: 200,
    padding: [8, 10, 0, 0],
    legend: { show: false },
    scales: { x: { time: false, range: widen } },
    cursor: { drag: { x: false, y: false }, points: { show: false } },
    axes: [
      { ...style, label: options.labels[0], size: 28 },
      { ...style, label: options.labels[1], size: widthOf },
    ],
    series: [{}, ...options.series],
    hooks: { draw: [(plot) => options.draw(new Pen(plot))] },
  };
  const plot = new uPlot(settings, data, host);
  plot.over.addEventListener("click", () =>
    options.choose(plot, plot.cursor.left!, plot.cursor.top!),
  );
  const page = host.closest("[data-theme]")!;
  const repaint = new MutationObserver(() => plot.redraw(false));
  repaint.observe(page, { attributeFilter: ["data-theme"] });
  return plot;
}

/** Return the width of an axis on which the longest of its numbers is seen whole. */
function widthOf(plot: uPlot, numbers: string[] | null): number {
  plot.ctx.font = FONT;
  const widths = (numbers ?? []).map((text) => plot.ctx.measureText(text).width);
  return TICKS + Math.ceil(Math.max(0, ...widths));
}

/** A series of dots in the color of the page. */
export function dots(host: HTMLElement, size: number): uPlot.Series {
  const fill = () => pageColor(host, "--accent");
  return { paths: () => null, points: { show: true, size, width: 0, fill } };
}

export function pageColor(element: Element, name: string): string {
  return getComputedStyle(element).getPropertyValue(name).trim();
}
