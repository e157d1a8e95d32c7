/** WebGL: how it starts, and what the page says where it is missing or lost. */

import * as three from "three";
import { h } from "./dom";

const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i; // names of renderers

/** Start WebGL in a canvas; null where there is none, and the stage says why. */
export function startRenderer(
  canvas: HTMLCanvasElement,
  stage: HTMLElement,
  onReturn: () => void,
): { renderer: three.WebGLRenderer; inSoftware: boolean } | null {
  const inSoftware = drawsInSoftware();
  // Without a graphics card, smoothing edges would double the time of a frame.
  const context = canvas.getContext("webgl2", { antialias: !inSoftware });
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
  return { renderer, inSoftware };
}

/**
 * Whether the browser draws without a graphics card. Asked to fail then, it does, unless somebody
 * told it to draw in software: then only the name of the renderer says so.
 */
function drawsInSoftware(): boolean {
  const canvas = document.createElement("canvas");
  const probe = canvas.getContext("webgl2", { failIfMajorPerformanceCaveat: true });
  if (!probe) return true;
  const named = probe.getExtension("WEBGL_debug_renderer_info");
  const name = String(probe.getParameter(named?.UNMASKED_RENDERER_WEBGL ?? probe.RENDERER));
  probe.getExtension("WEBGL_lose_context")?.loseContext(); // browsers allow only few at a time
  return SOFTWARE.test(name);
}

function showNotice(stage: HTMLElement, text: string): HTMLElement {
  const notice = h("div", { class: "notice", role: "alert", "data-test": "notice" }, text);
  stage.append(notice);
  return notice;
}
