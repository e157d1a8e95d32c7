/** Vertices at creases: there the mean of the normals of faces suits none of them. */

const LEAST_COSINE = Math.cos((40 * Math.PI) / 180); // as LEAST_TURN of the library
// A quarter of the edges of a machine part turns by less than 2 degrees; on shapes that are nowhere
// flat there are more, and they stay smooth: many edges of coarse faces turn by 40 degrees.
const FLAT_COSINE = Math.cos((2 * Math.PI) / 180);
const FLAT_SHARE = 0.25;
const MOST_FACES = 500_000; // of more, the shading of each is small, and the edges take seconds

/** Return 1 for each vertex at an edge where a shape of flat faces turns by 40 degrees or more. */
export function markCreases(points: Float32Array, faces: Uint32Array): Uint8Array {
  const count = points.length / 3;
  const marks = new Uint8Array(count);
  if (faces.length > 3 * MOST_FACES) return marks;
  const normals = faceNormals(points, faces);
  const first = new Map<number, number>(); // the face on one side of each edge
  const sharp: number[] = [];
  let [flat, all] = [0, 0];
  faces.forEach((start, place) => {
    const end = faces[place % 3 === 2 ? place - 2 : place + 1]!;
    const edge = Math.min(start, end) * count + Math.max(start, end);
    const face = 3 * Math.floor(place / 3);
    const other = first.get(edge);
    if (other === undefined) {
      first.set(edge, face);
      return;
    }
    const cosine = [0, 1, 2].reduce((sum, k) => sum + normals[face + k]! * normals[other + k]!, 0);
    all += 1;
    if (cosine > FLAT_COSINE) flat += 1;
    if (cosine < LEAST_COSINE) sharp.push(start, end);
  });
  if (flat >= FLAT_SHARE * all) for (const vertex of sharp) marks[vertex] = 1;
  return marks;
}

/** Return the unit normal of each face; that of a face without area is 0. */
function faceNormals(points: Float32Array, faces: Uint32Array): Float32Array {
  const normals = new Float32Array(faces.length);
  for (let place = 0; place < faces.length; place += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => 3 * faces[place + k]!) as [number, number, number];
    const [ux, uy, uz] = [0, 1, 2].map((k) => points[b + k]! - points[a + k]!) as [number, number, number];
    const [vx, vy, vz] = [0, 1, 2].map((k) => points[c + k]! - points[a + k]!) as [number, number, number];
    const normal = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.hypot(...normal) || 1;
    normals.set(normal.map((each) => each / length), place);
  }
  return normals;
}
