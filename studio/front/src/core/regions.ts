/** The regions of an edit: each vertex is free, fixed, or in one of at most four regions. */

export const MAX_REGIONS = 4; // as in moved.glsl: one component each of the attribute `shares`
export const FIXED = MAX_REGIONS; // number of the fixed vertices, after those of the regions
const FREE = FIXED + 1;

export class Regions {
  private owner: Uint8Array;

  constructor(nVertices: number) {
    this.owner = new Uint8Array(nVertices).fill(FREE);
  }

  /** Return the number of the region of a vertex, or null. */
  of(vertex: number): number | null {
    const owner = this.owner[vertex]!;
    return owner === FREE ? null : owner;
  }

  /** Return the vertices of a region, ascending. */
  vertices(region: number): Uint32Array {
    const found: number[] = [];
    this.owner.forEach((owner, vertex) => owner === region && found.push(vertex));
    return Uint32Array.from(found);
  }

  /** Add vertices to a region; they leave the region that had them. */
  add(region: number, vertices: Iterable<number>): void {
    for (const vertex of vertices) this.owner[vertex] = region;
  }

  remove(region: number, vertices: Iterable<number>): void {
    for (const vertex of vertices) if (this.owner[vertex] === region) this.owner[vertex] = FREE;
  }

  clear(region: number): void {
    this.remove(region, this.owner.keys());
  }

  /** Return the regions as text for the storage of the tab: one digit a vertex. */
  write(): string {
    return this.owner.join("");
  }

  /** Take what `write` returned; text of another mesh is ignored. */
  read(text: string): void {
    if (text.length === this.owner.length) this.owner = Uint8Array.from(text, Number);
  }
}
