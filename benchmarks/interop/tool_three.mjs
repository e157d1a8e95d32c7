// three.js writes and reads, in node: what its exporters and loaders need of a browser is given here.

import { readFileSync, writeFileSync } from "node:fs";
import * as THREE from "three";
import { GLTFExporter } from "three/examples/jsm/exporters/GLTFExporter.js";
import { OBJExporter } from "three/examples/jsm/exporters/OBJExporter.js";
import { PLYExporter } from "three/examples/jsm/exporters/PLYExporter.js";
import { STLExporter } from "three/examples/jsm/exporters/STLExporter.js";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import { VTKLoader } from "three/examples/jsm/loaders/VTKLoader.js";
import { Gathered, linearColor, rows, screenColor, serve } from "./exchange.mjs";

globalThis.self = globalThis;
globalThis.ProgressEvent = class {};
globalThis.requestAnimationFrame = (work) => setTimeout(work, 0);
globalThis.FileReader = class {
  readAsArrayBuffer(blob) {
    blob.arrayBuffer().then((data) => { this.result = data; this.onloadend?.(); });
  }
  readAsDataURL(blob) {
    blob.arrayBuffer().then((data) => {
      this.result = `data:${blob.type};base64,${Buffer.from(data).toString("base64")}`;
      this.onloadend?.();
    });
  }
};

/** Return a geometry; what goes to glTF has v downward, as the loader of glTF leaves it. */
function geometryOf(shape, down) {
  const geometry = new THREE.BufferGeometry();
  geometry.setIndex(shape.triangles.flat());
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(shape.points.flat(), 3));
  if (shape.texture) geometry.setAttribute("uv", new THREE.Float32BufferAttribute(shape.texture.flatMap(([u, v]) => [u, down ? 1 - v : v]), 2));
  if (shape.colors) geometry.setAttribute("color", new THREE.Float32BufferAttribute(shape.colors.flatMap(linearColor), 3));
  return geometry;
}

/** Return the object that shows a shape. */
function objectOf(shape, down = false) {
  const geometry = geometryOf(shape, down);
  const material = new THREE.MeshStandardMaterial({ vertexColors: Boolean(shape.colors) });
  const place = (object, { translation, rotation, scale }) => {
    object.position.set(...translation);
    if (rotation) object.quaternion.set(...rotation);
    if (scale) object.scale.set(...scale);
    return object;
  };
  if (shape.copies) {
    const group = new THREE.Group();
    for (const copy of shape.copies) group.add(place(new THREE.Mesh(geometry, material), copy));
    return group;
  }
  if (shape.targets) {
    geometry.morphAttributes.position = shape.targets.map((target) => new THREE.Float32BufferAttribute(target.flat(), 3));
    geometry.morphTargetsRelative = true;
    const mesh = new THREE.Mesh(geometry, material);
    mesh.morphTargetInfluences = [...shape.weights];
    return mesh;
  }
  if (shape.joint_nodes) {
    const pad = (pair) => [...pair, 0, 0];
    geometry.setAttribute("skinIndex", new THREE.Uint16BufferAttribute(shape.weights.flatMap(([a, b]) => [0, b > 0 ? 1 : 0, 0, 0]), 4));
    geometry.setAttribute("skinWeight", new THREE.Float32BufferAttribute(shape.weights.flatMap(pad), 4));
    const armature = place(new THREE.Group(), shape.armature);
    const [low, high] = shape.joint_nodes.map((node) => place(new THREE.Bone(), node));
    const mesh = new THREE.SkinnedMesh(geometry, material);
    armature.add(mesh, low);
    low.add(high);
    const inverses = shape.inverse_binds.map((matrix) => new THREE.Matrix4().fromArray(matrix.flat()).transpose());
    armature.updateMatrixWorld(true);
    mesh.bind(new THREE.Skeleton([low, high], inverses), new THREE.Matrix4());
    return armature;
  }
  return new THREE.Mesh(geometry, material);
}

/** Return the copies as instances of one mesh. */
function instancesOf(shape) {
  const material = new THREE.MeshStandardMaterial();
  const mesh = new THREE.InstancedMesh(geometryOf(shape), material, shape.copies.length);
  shape.copies.forEach(({ translation, rotation, scale }, number) => {
    const place = new THREE.Matrix4().compose(
      new THREE.Vector3(...translation), new THREE.Quaternion(...rotation), new THREE.Vector3(...scale),
    );
    mesh.setMatrixAt(number, place);
  });
  return mesh;
}

const scene = (object) => {
  const found = new THREE.Scene();
  found.add(object);
  found.updateMatrixWorld(true);
  return found;
};

const writeGltf = (make, binary) => async (shape, path) => {
  const made = await new GLTFExporter().parseAsync(scene(make(shape, true)), { binary });
  writeFileSync(path, binary ? Buffer.from(made) : JSON.stringify(made));
};
const writeText = (exporter, options) => (shape, path) => {
  const made = exporter.parse(scene(objectOf(shape)), ...options);
  writeFileSync(path, typeof made === "string" ? made : Buffer.from(made.buffer ?? made));
};
const writePly = (binary) => (shape, path) => new Promise((resolve) => {
  new PLYExporter().parse(scene(objectOf(shape)), (made) => {
    writeFileSync(path, typeof made === "string" ? made : Buffer.from(made));
    resolve();
  }, { binary });
});

/** Add what a scene shows: joints, targets and instances applied. */
function gather(root, { flipped }) {
  const gathered = new Gathered();
  root.updateMatrixWorld(true);
  root.traverse((object) => {
    if (!object.isMesh) return;
    object.skeleton?.update();
    const { index, attributes } = object.geometry;
    const count = attributes.position.count;
    const corners = index ? Array.from(index.array) : [...Array(count).keys()];
    const vector = new THREE.Vector3();
    const places = object.isInstancedMesh
      ? [...Array(object.count).keys()].map((number) => {
          const place = new THREE.Matrix4();
          object.getMatrixAt(number, place);
          return place.premultiply(object.matrixWorld);
        })
      : [object.matrixWorld];
    for (const place of places) {
      const points = [...Array(count).keys()].map((number) =>
        object.getVertexPosition(number, vector).clone().applyMatrix4(place).toArray());
      const order = place.determinant() < 0 ? [2, 1, 0] : [0, 1, 2];
      const triangles = rows(corners, 3).map((triangle) => order.map((i) => triangle[i]));
      const read = (attribute) => [...Array(count).keys()].map((number) =>
        [...Array(attribute.itemSize).keys()].map((i) => attribute.getComponent(number, i)));
      gathered.add(points, triangles, {
        texture: attributes.uv && read(attributes.uv).map(([u, v]) => [u, flipped ? 1 - v : v]),
        colors: attributes.color && read(attributes.color).map((color) => screenColor(color.slice(0, 3))),
      });
    }
  });
  return gathered.found;
}

const bytes = (path) => {
  const data = readFileSync(path);
  return data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
};
const readGltf = async (path) => {
  let data = bytes(path);
  if (path.endsWith(".gltf")) {
    const tree = JSON.parse(Buffer.from(data).toString());
    for (const buffer of tree.buffers ?? []) {
      if (buffer.uri?.startsWith("data:")) continue;
      const beside = readFileSync(path.replace(/[^/]*$/, decodeURIComponent(buffer.uri)));
      buffer.uri = `data:application/octet-stream;base64,${beside.toString("base64")}`;
    }
    // Images need a browser; what they show is not compared.
    for (const material of tree.materials ?? []) delete material.pbrMetallicRoughness;
    data = JSON.stringify(tree);
  } else {
    data = withoutImages(data);
  }
  const loaded = await new GLTFLoader().parseAsync(data, "");
  return gather(loaded.scene, { flipped: true });
};

/** Return a GLB file whose materials name no image, since images need a browser. */
function withoutImages(data) {
  const view = Buffer.from(data);
  const length = view.readUInt32LE(12);
  const tree = JSON.parse(view.subarray(20, 20 + length).toString());
  for (const material of tree.materials ?? []) delete material.pbrMetallicRoughness;
  const text = Buffer.from(JSON.stringify(tree));
  const padded = Buffer.concat([text, Buffer.alloc((4 - (text.length % 4)) % 4, " ")]);
  const head = Buffer.from(view.subarray(0, 20));
  head.writeUInt32LE(padded.length, 12);
  const made = Buffer.concat([head, padded, view.subarray(20 + length)]);
  made.writeUInt32LE(made.length, 8);
  return made.buffer.slice(made.byteOffset, made.byteOffset + made.byteLength);
}

const readGeometry = (loader) => (path) => gather(new THREE.Mesh(loader.parse(bytes(path))), {});
const surfaces = ["prism", "seam", "colors", "far", "copies"];

await serve(
  `r${THREE.REVISION}`,
  {
    "GLB": [".glb", writeGltf(objectOf, true), ...surfaces, "morph", "skin"],
    "glTF": [".gltf", writeGltf(objectOf, false), ...surfaces, "morph", "skin"],
    "GLB, instances": [".glb", writeGltf(instancesOf, true), "copies"],
    "OBJ": [".obj", writeText(new OBJExporter(), []), ...surfaces],
    "PLY": [".ply", writePly(true), ...surfaces],
    "PLY, text": [".ply", writePly(false), ...surfaces],
    "STL": [".stl", writeText(new STLExporter(), [{ binary: true }]), "prism", "far", "copies"],
    "STL, text": [".stl", writeText(new STLExporter(), [{}]), "prism", "far", "copies"],
  },
  {
    ".glb": readGltf,
    ".gltf": readGltf,
    ".obj": (path) => gather(new OBJLoader().parse(readFileSync(path, "utf-8")), {}),
    ".ply": readGeometry(new PLYLoader()),
    ".stl": readGeometry(new STLLoader()),
    ".vtk": readGeometry(new VTKLoader()),
  },
);
