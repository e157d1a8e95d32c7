/** A report: one page without a server, which has all arrays in itself. */

import type { Backend } from "../core/backend";
import { decode } from "../core/wire";

const refuse = async () => {
  throw new Error("A report shows a shape and cannot change it. Open the shape in the studio instead.");
};

/** Return the backend of a page that has a message, base64 of gzip, as the text of a script. */
export async function inlineBackend(script: HTMLElement): Promise<Backend> {
  const packed = Uint8Array.from(atob(script.textContent!.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const { meta, arrays } = decode(await new Response(stream).arrayBuffer());
  return {
    meta: async () => meta,
    async array(name, start = 0, stop) {
      const whole = arrays[name];
      if (!whole) throw new Error(`The report has no array ${name}.`);
      const [rows, ...rest] = whole.shape as [number, ...number[]];
      const width = rest.reduce((product, side) => product * side, 1);
      const end = Math.min(stop ?? rows, rows);
      return { data: whole.data.subarray(start * width, end * width), shape: [end - start, ...rest] };
    },
    rig: refuse,
    finish: refuse,
    query: refuse,
  };
}
