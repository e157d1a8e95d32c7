// What the programs in JavaScript do alike; see exchange.py.

import { appendFileSync, readFileSync } from "node:fs";
import { extname } from "node:path";

/** Answer all jobs of the file that the command line names; each answer is one line. */
export async function serve(version, writers, readers) {
  const [jobs, answers] = process.argv.slice(2);
  const answer = (content) => appendFileSync(answers, JSON.stringify(content) + "\n");
  const writes = Object.fromEntries(
    Object.entries(writers).map(([name, [suffix, , ...shapes]]) => [name, [suffix, ...shapes]]),
  );
  answer({ version, writes, reads: Object.keys(readers) });
  for (const line of readFileSync(jobs, "utf-8").split("\n").filter(Boolean)) {
    const job = JSON.parse(line);
    try {
      if (job.act === "write") {
        await writers[job.format][1](job.shape, job.path);
        answer({ key: job.key });
      } else {
        answer({ key: job.key, found: await readers[extname(job.path)](job.path) });
      }
    } catch (error) {
      answer({ key: job.key, error: String(error).slice(0, 300) });
    }
  }
}

/** Return numbers in rows of a width. */
export function rows(numbers, width) {
  const found = [];
  for (let i = 0; i + width <= numbers.length; i += width) {
    found.push(Array.from(numbers.slice(i, i + width)));
  }
  return found;
}

/** Return linear light from 0 to 1 as a screen shows it, from 0 to 255. */
export function screenColor(light) {
  return light.map((x) => 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
}

/** Return a color of a screen, from 0 to 255, as linear light. */
export function linearColor(color) {
  return color.map((x) => (x / 255 <= 0.04045 ? x / 255 / 12.92 : ((x / 255 + 0.055) / 1.055) ** 2.4));
}

/** Gather meshes into one answer. */
export class Gathered {
  constructor() {
    this.found = { points: [], polygons: [] };
  }

  /** Add a mesh: points in the world, triangles, and what belongs to points. */
  add(points, triangles, { texture, colors }) {
    const start = this.found.points.length;
    this.found.points.push(...points);
    this.found.polygons.push(...triangles.map((corners) => corners.map((corner) => corner + start)));
    if (texture) (this.found.texture ??= []).push(...texture);
    if (colors) (this.found.colors ??= []).push(...colors);
  }
}
