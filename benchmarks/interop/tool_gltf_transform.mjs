// glTF Transform writes and reads; its functions for smaller files move points into other numbers and nodes.

import { Document, NodeIO, VERSION } from "@gltf-transform/core";
import { ALL_EXTENSIONS, EXTMeshGPUInstancing } from "@gltf-transform/extensions";
import { dedup, flatten, instance, join as joinMeshes, quantize, reorder, sparse, weld } from "@gltf-transform/functions";
import { MeshoptDecoder, MeshoptEncoder } from "meshoptimizer";
import { Gathered, linearColor, rows, screenColor, serve } from "./exchange.mjs";

await MeshoptDecoder.ready;
await MeshoptEncoder.ready;
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
  "meshopt.decoder": MeshoptDecoder,
  "meshopt.encoder": MeshoptEncoder,
});

function documentOf(shape) {
  const document = new Document();
  const buffer = document.createBuffer();
  const add = (numbers, type) => document.createAccessor().setType(type).setArray(numbers).setBuffer(buffer);
  const primitive = document.createPrimitive().setMaterial(document.createMaterial("plain"));
  primitive.setIndices(add(new Uint16Array(shape.triangles.flat()), "SCALAR"));
  primitive.setAttribute("POSITION", add(new Float32Array(shape.points.flat()), "VEC3"));
  if (shape.texture) primitive.setAttribute("TEXCOORD_0", add(new Float32Array(shape.texture.flatMap(([u, v]) => [u, 1 - v])), "VEC2"));
  if (shape.colors) primitive.setAttribute("COLOR_0", add(new Float32Array(shape.colors.flatMap(linearColor)), "VEC3"));
  const mesh = document.createMesh("shape").addPrimitive(primitive);
  const scene = document.createScene();
  const place = (node, { translation, rotation, scale }) => {
    node.setTranslation(translation);
    if (rotation) node.setRotation(rotation);
    if (scale) node.setScale(scale);
    return node;
  };
  if (shape.copies) {
    shape.copies.forEach((copy, number) => scene.addChild(place(document.createNode(`copy${number}`), copy).setMesh(mesh)));
    return document;
  }
  const node = document.createNode("shape").setMesh(mesh);
  if (shape.joint_nodes) {
    primitive.setAttribute("JOINTS_0", add(new Uint8Array(shape.weights.flatMap(([, b]) => [0, b > 0 ? 1 : 0, 0, 0])), "VEC4"));
    primitive.setAttribute("WEIGHTS_0", add(new Float32Array(shape.weights.flatMap((pair) => [...pair, 0, 0])), "VEC4"));
    const armature = place(document.createNode("Armature"), shape.armature);
    const [low, high] = shape.joint_nodes.map((entry, i) => place(document.createNode(`joint${i}`), entry));
    low.addChild(high);
    armature.addChild(node).addChild(low);
    const columns = shape.inverse_binds.flatMap((matrix) => [0, 1, 2, 3].flatMap((j) => matrix.map((row) => row[j])));
    node.setSkin(document.createSkin().addJoint(low).addJoint(high).setInverseBindMatrices(add(new Float32Array(columns), "MAT4")));
    scene.addChild(armature);
    return document;
  }
  for (const target of shape.targets ?? []) {
    primitive.addTarget(document.createPrimitiveTarget().setAttribute("POSITION", add(new Float32Array(target.flat()), "VEC3")));
  }
  if (shape.targets) mesh.setWeights(shape.weights);
  scene.addChild(node);
  return document;
}

const write = (...steps) => async (shape, path) => {
  const document = documentOf(shape);
  if (steps.length) await document.transform(...steps);
  await io.write(path, document);
};
const writeNodeWeights = async (shape, path) => {
  const document = documentOf(shape);
  const [node] = document.getRoot().listNodes();
  node.setWeights(shape.weights);
  node.getMesh().setWeights(shape.weights.map(() => 1));
  await io.write(path, document);
};
const writeMeshopt = async (shape, path) => {
  const document = documentOf(shape);
  document.createExtension(ALL_EXTENSIONS.find((each) => each.EXTENSION_NAME === "EXT_meshopt_compression")).setRequired(true);
  await document.transform(reorder({ encoder: MeshoptEncoder }), quantize());
  await io.write(path, document);
};

/** Return a product of matrices stored by columns. */
const times = (a, b) => Array.from({ length: 16 }, (_, i) =>
  [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + (i % 4)] * b[4 * Math.floor(i / 4) + k], 0));
const apply = (m, [x, y, z]) => [0, 1, 2].map((i) => m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i]);
const determinant = (m) =>
  m[0] * (m[5] * m[10] - m[6] * m[9]) - m[4] * (m[1] * m[10] - m[2] * m[9]) + m[8] * (m[1] * m[6] - m[2] * m[5]);
const elements = (accessor) => [...Array(accessor.getCount()).keys()].map((i) => accessor.getElement(i, []));

/** Return the matrix of a translation, a turn and a scale. */
function composed([x, y, z], [a, b, c, w], [sx, sy, sz]) {
  return [
    (1 - 2 * (b * b + c * c)) * sx, 2 * (a * b + c * w) * sx, 2 * (a * c - b * w) * sx, 0,
    2 * (a * b - c * w) * sy, (1 - 2 * (a * a + c * c)) * sy, 2 * (b * c + a * w) * sy, 0,
    2 * (a * c + b * w) * sz, 2 * (b * c - a * w) * sz, (1 - 2 * (a * a + b * b)) * sz, 0,
    x, y, z, 1,
  ];
}

/** Return the matrices that place the mesh of a node. */
function placesOf(node) {
  const world = node.getWorldMatrix();
  const copies = node.getExtension(EXTMeshGPUInstancing.EXTENSION_NAME);
  if (!copies) return [world];
  const columns = ["TRANSLATION", "ROTATION", "SCALE"].map((name) => copies.getAttribute(name));
  const plain = [[0, 0, 0], [0, 0, 0, 1], [1, 1, 1]];
  const count = columns.find(Boolean).getCount();
  return [...Array(count).keys()].map((i) =>
    times(world, composed(...columns.map((column, k) => (column ? column.getElement(i, []) : plain[k])))));
}

async function read(path) {
  const document = await io.read(path);
  const gathered = new Gathered();
  const root = document.getRoot();
  (root.getDefaultScene() ?? root.listScenes()[0]).traverse((node) => {
    const mesh = node.getMesh();
    if (!mesh) return;
    const weights = node.getWeights().length ? node.getWeights() : mesh.getWeights();
    for (const primitive of mesh.listPrimitives()) {
      const points = elements(primitive.getAttribute("POSITION"));
      primitive.listTargets().forEach((target, k) => {
        const moves = target.getAttribute("POSITION");
        if (moves && weights[k]) elements(moves).forEach((move, i) => { points[i] = points[i].map((x, j) => x + weights[k] * move[j]); });
      });
      const corners = primitive.getIndices() ? Array.from(primitive.getIndices().getArray()) : [...points.keys()];
      const texture = primitive.getAttribute("TEXCOORD_0");
      const colors = primitive.getAttribute("COLOR_0");
      const values = {
        texture: texture && elements(texture).map(([u, v]) => [u, 1 - v]),
        colors: colors && elements(colors).map((color) => screenColor(color.slice(0, 3))),
      };
      const skin = node.getSkin();
      if (skin) {
        const binds = skin.getInverseBindMatrices();
        const joints = skin.listJoints().map((joint, i) => times(joint.getWorldMatrix(), binds.getElement(i, [])));
        const numbers = elements(primitive.getAttribute("JOINTS_0"));
        const shares = elements(primitive.getAttribute("WEIGHTS_0"));
        const posed = points.map((point, i) => numbers[i].reduce((sum, joint, k) => {
          const place = apply(joints[joint], point);
          return sum.map((x, j) => x + shares[i][k] * place[j]);
        }, [0, 0, 0]));
        gathered.add(posed, rows(corners, 3), values);
        continue;
      }
      for (const place of placesOf(node)) {
        const order = determinant(place) < 0 ? [2, 1, 0] : [0, 1, 2];
        gathered.add(points.map((point) => apply(place, point)), rows(corners, 3).map((t) => order.map((i) => t[i])), values);
      }
    }
  });
  return gathered.found;
}

const surfaces = ["prism", "seam", "colors", "far", "copies", "morph", "skin"];
await serve(
  VERSION,
  {
    "GLB": [".glb", write(), ...surfaces],
    "glTF": [".gltf", write(), ...surfaces],
    "GLB, quantized": [".glb", write(quantize()), ...surfaces],
    "GLB, sparse": [".glb", write(sparse()), ...surfaces],
    "GLB, instances": [".glb", write(dedup(), instance({ min: 2 })), "copies"],
    "GLB, joined": [".glb", write(dedup(), flatten(), joinMeshes(), weld()), ...surfaces],
    "GLB, weights of a node": [".glb", writeNodeWeights, "morph"],
    "GLB, meshopt": [".glb", writeMeshopt, ...surfaces],
  },
  { ".glb": read, ".gltf": read },
);
