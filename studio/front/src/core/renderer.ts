/** WebGL: how it starts, and what the page says where it is missing or lost. */

import * as three from "three";
import { h } from "./dom";

/** Start WebGL in a canvas; null where there is none, and the stage says why. */
export function startRenderer(
  canvas: HTMLCanvasElement,
  stage: HTMLElement,
  onReturn: () => void,
): { renderer: three.WebGLRenderer; inSoftware: boolean } | null {
  const start = (options: WebGLContextAttributes) => canvas.getContext("webgl2", options);
  const onCard = start({ antialias: true, failIfMajorPerformanceCaveat: true });
  // Without a graphics card, smoothing edges would double the time of a frame.
  const context = onCard ?? start({ antialias: false });
  if (!context?.getExtension("EXT_color_buffer_float")) {
    showNotice(
      stage,
      "This browser has no WebGL2 with float buffers, which the picture needs. Enable hardware " +
        "acceleration, or use a recent Chrome, Edge, Firefox or Safari.",
    );
    return null;
  }
  const renderer = new three.WebGLRenderer({ canvas, context });
  renderer.setClearColor(0, 0);
  let notice: HTMLElement | null = null;
  canvas.addEventListener("webglcontextlost", () => {
    notice = showNotice(stage, "The graphics card was reset. The picture returns in a moment.");
  });
  canvas.addEventListener("webglcontextrestored", () => {
    notice?.remove();
    onReturn();
  });
  return { renderer, inSoftware: !onCard };
}

function showNotice(stage: HTMLElement, text: string): HTMLElement {
  const notice = h("div", { class: "notice", role: "alert", "data-test": "notice" }, text);
  stage.append(notice);
  return notice;
}
