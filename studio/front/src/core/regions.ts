/** The regions of an edit: each vertex is free, fixed, or in one of at most four regions. */

export const MAX_REGIONS = 4; // as in moved.glsl: one component each of the attribute `shares`
export const FIXED = MAX_REGIONS; // number of the fixed vertices, after those of the regions
const FREE = FIXED + 1;

export class Regions {
  private owner: Uint8Array<ArrayBuffer>;

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

  /** The region of each vertex, as the server keeps it. */
  get owners(): Uint8Array<ArrayBuffer> {
    return this.owner.slice();
  }

  /** Take the region of each vertex; no numbers at all stand for no region. */
  read(owners: Uint8Array): void {
    if (owners.length) this.owner.set(owners);
    else this.owner.fill(FREE);
  }
}
