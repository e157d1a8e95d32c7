/** Films: the view turns, a function swings, heat spreads; played, or saved as GIF. */

import { GIFEncoder, applyPalette, quantize } from "gifenc";
import type { Viewer } from "./viewer";

/** What happens in one round: `show` draws a share of it from 0 to 1, `end` puts all back. */
export interface Film {
  title: string;
  seconds: number;
  show(share: number): void;
  end(): unknown;
}

const RATE = 15; // pictures a second in a file
const WIDTH = 480; // pixels of a file
const N_COLORS = 256;

export function turntable(viewer: Viewer): Film {
  let before = 0;
  const show = (share: number) => {
    viewer.turn(2 * Math.PI * (share - before));
    before = share;
  };
  return { title: "Turntable", seconds: 6, show, end: () => show(0) };
}

/** Play round after round until it is stopped. */
export async function playFilm(film: Film, signal: AbortSignal): Promise<void> {
  const begin = performance.now();
  while (!signal.aborted) {
    film.show(((performance.now() - begin) / 1000 / film.seconds) % 1);
    await new Promise(requestAnimationFrame);
  }
  film.end();
}

/** Return a film as GIF; all its pictures share the colors of a few of them. */
export async function saveGif(
  viewer: Viewer,
  film: Film,
  ground: string,
  progress: (share: number) => void,
): Promise<Uint8Array<ArrayBuffer>> {
  const count = Math.round(film.seconds * RATE);
  const pictures: ImageData[] = [];
  for (let number = 0; number < count; number++) {
    film.show(number / count);
    pictures.push(viewer.frameOf(WIDTH, ground));
    progress((0.7 * number) / count);
    await new Promise((done) => setTimeout(done)); // the page stays alive
  }
  film.end();
  const some = pictures.filter((_, i) => i % Math.ceil(count / 6) === 0);
  const pixels = new Uint8Array(some.reduce((sum, { data }) => sum + data.length, 0));
  some.reduce((place, { data }) => (pixels.set(data, place), place + data.length), 0);
  const palette = quantize(pixels, N_COLORS);
  const file = GIFEncoder();
  for (const [number, { data, width, height }] of pictures.entries()) {
    const colors = applyPalette(data, palette);
    file.writeFrame(colors, width, height, { palette, delay: 1000 / RATE });
    progress(0.7 + (0.3 * number) / count);
    await new Promise((done) => setTimeout(done));
  }
  file.finish();
  return file.bytes();
}
