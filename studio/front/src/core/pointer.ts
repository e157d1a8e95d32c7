/** The pointer over the picture: it tells clicks from drags, and lets a tool drag before the camera. */

import type { Hit } from "./picking";

/**
 * Takes over the pointer: `down` returns false to leave it to the camera. `hover` hears what lies under a
 * pointer that is not pressed.
 */
export interface PointerTool {
  hover?(hit: Hit | null): void;
  down(event: PointerEvent): boolean;
  move(event: PointerEvent): void;
  up(): void;
}
export type Click = (hit: Hit, event: PointerEvent) => void;

const CLICK = 4; // pixels that a click may move
const LOOK = 60; // ms between two looks at what lies under the pointer: each draws one pixel

export class Pointer {
  /** Takes all clicks on the shape before any tool, or null. */
  first: Click | null = null;
  /** Whether one finger turns the view, whatever the tool; the person may let it use the tool. */
  fingerTurns = true;
  private tool: PointerTool | null = null;
  private click: Click | null = null;
  /** Hears what lies under the pointer of a mouse that is not pressed, or null. */
  onHover: (hit: Hit | null, x: number, y: number) => void = () => {};

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly pick: (x: number, y: number) => Hit | null,
  ) {
    let from: [number, number] | null = null;
    let holder: PointerTool | null = null; // the tool that has the pointer
    const take = (event: PointerEvent) => {
      if (event.button !== 0 || !event.isPrimary) return;
      from = [event.offsetX, event.offsetY];
      const turns = this.first || (event.pointerType === "touch" && this.fingerTurns);
      holder = !turns && this.tool?.down(event) ? this.tool : null;
      if (!holder) return;
      canvas.setPointerCapture(event.pointerId);
      event.stopImmediatePropagation();
    };
    const release = (event: PointerEvent) => {
      const [x, y] = [event.offsetX, event.offsetY];
      const still = from && Math.hypot(x - from[0], y - from[1]) < CLICK;
      if (holder) holder.up();
      else if (still && event.type === "pointerup") {
        const click = this.first ?? this.click;
        const hit = click && this.pick(x, y);
        if (hit) click!(hit, event);
      }
      from = holder = null;
    };
    canvas.addEventListener("pointerdown", take, { capture: true });
    let place: [number, number] | null = null; // of a pointer that hovers
    let timer = 0;
    const look = () => {
      timer = 0;
      const hit = place && this.pick(...place);
      this.tool?.hover?.(hit);
      this.onHover(hit, ...(place ?? ([0, 0] as const)));
    };
    canvas.addEventListener("pointermove", (event) => {
      holder?.move(event);
      if (event.buttons || event.pointerType === "touch") return;
      place = [event.offsetX, event.offsetY];
      timer ||= window.setTimeout(look, LOOK);
    });
    canvas.addEventListener("pointerleave", () => {
      place = null;
      timer ||= window.setTimeout(look, LOOK);
    });
    canvas.addEventListener("keydown", (event) => {
      if (event.key !== " ") return;
      event.preventDefault();
      this.clickMiddle(event.shiftKey);
    });
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
  }

  /** Do what a click in the middle of the picture does: so the keyboard paints and marks, too. */
  private clickMiddle(shiftKey: boolean): void {
    const { clientWidth, clientHeight } = this.canvas;
    const [offsetX, offsetY] = [clientWidth / 2, clientHeight / 2];
    const event = { offsetX, offsetY, shiftKey } as PointerEvent; // what tools and clicks read of one
    const click = this.first ?? this.click;
    if (!this.first && this.tool?.down(event)) return this.tool.up();
    const hit = click && this.pick(offsetX, offsetY);
    if (hit) click!(hit, event);
  }

  /** Give the pointer to a tool that drags, or to what a click does; else it turns the camera. */
  set(cursor: string, click: Click | null, tool: PointerTool | null): void {
    this.canvas.style.cursor = cursor;
    [this.click, this.tool] = [click, tool];
  }
}
