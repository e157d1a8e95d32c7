/** The five calls behind every host, and the values that they take and give. */

import { decode, encode, type Arrays, type TypedArray } from "./wire";

export type Vec3 = [number, number, number];
export type Handle =
  | { type: "rotation"; pivot: Vec3; axis: Vec3; angle: number }
  | { type: "translation"; vector: Vec3 }
  | { type: "scaling"; pivot: Vec3; factors: Vec3 }
  | null;

/** Work of the server that the page waits for. */
export interface Progress {
  status: "none" | "running" | "ready" | "failed";
  progress: number; // 0 to 1
  message: string;
}

export interface State {
  name: string;
  n_vertices: number;
  n_faces: number;
  up: Vec3;
  towards: Vec3; // the viewer
  capabilities: string[]; // rig, finish, query, open, repair, solve
  suffixes: string; // of the files that can be opened, as a file dialog takes them
  most_bytes: number; // of a file
  notes: string[]; // what could not be opened, and what was repaired
  losses: string[]; // what was there before the server began, and is gone
  large: string; // what to say of a large shape of which nothing is computed unasked; or ""
  health: {
    status: Progress["status"]; // all else is null or empty until it is ready
    area: number;
    closed: boolean | null;
    facts: [string, string][]; // names and values, as text
    lines: ["good" | "fair", string][];
    findings: { name: string; why: string; text: string }[]; // repairs that would help
  };
  values: { name: string; title: string; unit: string; min: number; max: number }[];
  spectrum: Progress & { k: number; certificate: string; complete: boolean };
  parts: Progress & { n_regions: number; levels: (number | null)[] }; // null: without end
  deformation: Progress & { n_edits: number };
  index: { path: string; n_shapes: number } | null;
  shapes: [number, string][]; // numbers and names of those that can be chosen
  history: string[]; // what the hand did, oldest first
  place: number; // how much of it stands; the rest was undone
  digest: string; // tells the mesh at rest from all others
  selected: number; // tells the present regions from others; 0: none
  pose: number; // tells the pose from others of the shape, and the shape from others
  n_images: number; // on the shape; -1 if its file does not say how it looks
  n_points: number; // that the surface was made of; 0 if it is that of the file
  beside: Second | null;
  landmarks: Landmark[];
  collection: Collection | null;
  samples: string[]; // offered where no file was opened
  shape: number;
}

/** A second shape, and the map between the shape and it. */
export interface Second {
  name: string;
  number: number; // tells it from others
  n_vertices: number;
  n_faces: number;
  up: Vec3;
  towards: Vec3;
  map: Progress;
  similarity: number[] | null; // lays the shape on this one, by the map: three rows of four
  can_correct: boolean; // whether the map was found, and not known before
  can_pose: boolean; // whether all of the shape was mapped to this one
  lines: string[]; // what is known of the map
  pairs: [number, number][]; // vertices of both that correspond, by hand
}

export interface Landmark {
  name: string;
  point: Vec3;
  vertex: number; // near it
}

export interface Collection {
  title: string;
  is_mean: boolean; // whether the shape is the mean of the collection
  specimens: { name: string; notes: string[]; scores: number[] }[];
  failures: [string, string][]; // names and reasons
  shares: number[]; // of the variance, of each mode
}

/** What `finish` shall change; `kind` says which of the other entries there are. */
export interface Change {
  kind: string;
  handles?: Handle[];
  n_modes?: number | null;
  mode?: string;
  edits?: unknown;
  source?: string;
  names?: string[];
  k?: number;
  name?: string;
  text?: string; // what the hand did
  place?: number;
  shape?: number;
  sample?: string;
  match?: number;
  specimen?: string;
  folder?: string;
  close?: boolean;
  up?: Vec3;
  towards?: Vec3;
}
export interface Finished {
  state: State;
  warnings: string[];
  vertices?: Float32Array<ArrayBuffer>; // of the new pose, if the shape is the same
}
export interface RigRequest {
  n_modes: number | null;
  regions: Uint32Array[];
  fixed: Uint32Array | null;
}
export interface RigAnswer {
  n_modes: number[];
  pivots: Vec3[]; // the middle of the rim of each region
  warnings: string[];
  shares: Float32Array; // four numbers a vertex: how far it follows each region
}
export interface Match {
  name: string;
  label: string | null;
  score: number;
  mirrored: boolean | null;
  up?: Vec3; // how to look at it
  towards?: Vec3;
}
export interface Matches {
  matches: Match[];
  itself: string; // name in the index of what was searched with, if it is there
  arrays: Arrays; // thumbnail0.., pairs0.., colors0..
}

export interface Backend {
  trouble(text: string | null): void; // says why calls wait; null: they are answered again
  meta(): Promise<State>;
  array<T extends TypedArray>(name: string, start?: number, stop?: number): Promise<T>;
  rig(request: RigRequest): Promise<RigAnswer>;
  finish(change: Change, files?: Arrays): Promise<Finished>;
  query(nMatches: number, region: Uint32Array | null): Promise<Matches>;
}

type Bytes = ArrayBuffer | ArrayBufferView;
type Call = Exclude<keyof Backend, "trouble">;
export type Send = (call: Call, message: Uint8Array<ArrayBuffer>) => Promise<Bytes>;

/** Return the five calls over any way to send a message and receive its answer. */
export function backendOver(send: Send): Backend {
  async function ask(call: Call, meta: unknown = {}, arrays: Arrays = {}) {
    const answer = decode(await send(call, encode(meta, arrays)));
    if (answer.meta.error) throw new Error(answer.meta.error.message); // of the library
    return answer;
  }
  // The library answers side by side, in any order. What changes its state is asked one after the
  // other: of two regions that are bound in a hurry, the last must be the one that moves.
  let last: Promise<unknown> = Promise.resolve();
  function askInTurn(call: Call, meta: unknown, arrays?: Arrays) {
    const answer = last.then(() => ask(call, meta, arrays));
    last = answer.catch(() => {}); // whoever asked hears of it
    return answer;
  }
  const page = Math.random().toString(36).slice(2);
  let number = 0;
  return {
    trouble: () => {},
    meta: async () => (await ask("meta")).meta,
    array: async (name, start, stop) =>
      (await ask("array", { name, start, stop })).arrays[name] as any,
    async rig({ n_modes, regions, fixed }) {
      const named = regions.map((region, number) => [`region${number}`, region] as const);
      const request = { n_modes, n_regions: regions.length, fixed: fixed !== null };
      const arrays = { ...Object.fromEntries(named), ...(fixed && { fixed }) };
      const answer = await askInTurn("rig", request, arrays);
      return { ...answer.meta, ...answer.arrays };
    },
    async finish(change, files) {
      // By its name the server knows a change that it has made already, if its answer was lost.
      const id = `${page}-${number++}`;
      const answer = await askInTurn("finish", { ...change, id }, files);
      return { ...answer.meta, ...answer.arrays };
    },
    async query(n_matches, region) {
      const answer = await ask("query", { n_matches }, region ? { region } : {});
      return { ...answer.meta, arrays: answer.arrays };
    },
  };
}
