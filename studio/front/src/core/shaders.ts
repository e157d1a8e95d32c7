/** The shaders. `moved()` is the one place that says where a vertex is while a region is dragged. */

export const MAX_REGIONS = 4;

/**
 * As `move_by_shares` of the library: each vertex moves by its share of each motion, a rotation
 * by exp(share * log r) (Rodrigues' formula), so a twist does not pinch. `blend` fades to `exact`,
 * the result of the server.
 */
export const MOVED = /* glsl */ `
#define REGIONS ${MAX_REGIONS}
in vec4 shares;
in vec3 exact;
uniform int n_moving;            // regions beyond are at rest; 0 saves a third of the time of a frame
uniform int kind[REGIONS];       // 0: at rest, 1: rotation, 2: translation
uniform vec3 pivot[REGIONS];
uniform vec3 direction[REGIONS]; // unit axis, or the vector of the translation
uniform float angle[REGIONS];
uniform float blend;

const float PI = 3.14159265;

// Errors of the sine of a graphics card are 2e-5 and more; those of this series are below 1e-6.
float sine(float x) {
  float turns = round(x / PI);
  float y = x - turns * PI;
  float q = y * y;
  y *= 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0))));
  return mod(turns, 2.0) == 0.0 ? y : -y;
}

vec3 across(vec3 axis, float angle, vec3 arm) {
  vec3 side = cross(axis, arm);
  float half_sine = sine(0.5 * angle);
  return sine(angle) * side + 2.0 * half_sine * half_sine * cross(axis, side);
}

// The position of this vertex; its normal turns by the sum of its shares of the rotations.
vec3 moved(out vec3 turn) {
  vec3 place = position;
  turn = vec3(0.0);
  for (int r = 0; r < n_moving; r++) {
    if (kind[r] == 1) {
      place += across(direction[r], shares[r] * angle[r], position - pivot[r]);
      turn += shares[r] * angle[r] * direction[r];
    } else if (kind[r] == 2) {
      place += shares[r] * direction[r];
    }
  }
  return mix(place, exact, blend);
}

vec3 turned(vec3 vector, vec3 turn) {
  if (n_moving == 0) return vector;
  float size = max(length(turn), 1e-20);
  return vector + across(turn / size, size, vector);
}
`;

export const SURFACE_VERTEX = /* glsl */ `
${MOVED}
in vec3 exact_normal;
in float value;
in vec3 paint;
in vec4 mark;
out vec3 v_normal;
out vec3 v_view;
out float v_value;
out vec3 v_paint;
out vec4 v_mark;
void main() {
  vec3 turn;
  vec4 seen = modelViewMatrix * vec4(moved(turn), 1.0);
  v_normal = normalMatrix * mix(turned(normal, turn), exact_normal, blend);
  v_view = -seen.xyz;
  v_value = value;
  v_paint = paint;
  v_mark = mark;
  gl_Position = projectionMatrix * seen;
}
`;

export const SURFACE_FRAGMENT = /* glsl */ `
precision highp float;
in vec3 v_normal;
in vec3 v_view;
in float v_value;
in vec3 v_paint;
in vec4 v_mark;
uniform sampler2D table; // 256 colors
uniform vec2 range;
uniform bool nodal;
uniform vec3 plain;
uniform float opacity;
out vec4 color;
void main() {
  // COLORING is 0: plain, 1: values through the table, 2: paint. Without a graphics card a branch
  // that is not taken costs a sixth of a frame, so the shader is compiled for each of them.
#if COLORING == 1
  float share = (v_value - range.x) / max(range.y - range.x, 1e-30);
  vec3 base = texelFetch(table, ivec2(clamp(int(256.0 * share), 0, 255), 0), 0).rgb;
  // A line of constant width on the screen where the function changes its sign.
  // Where it is zero all over, as on a component of its own, there is none: slope is rounding.
  float slope = fwidth(v_value);
  float distance_to_zero = abs(v_value) / max(slope, 1e-30);
  if (nodal && slope > 1e-9 * range.y) base = mix(vec3(0.12), base, smoothstep(0.7, 1.5, distance_to_zero));
#elif COLORING == 2
  vec3 base = v_paint;
#else
  vec3 base = plain;
#endif
  base = mix(base, v_mark.rgb, v_mark.a);
  vec3 eye = normalize(v_view);
  vec3 n = normalize(v_normal);
  if (dot(n, eye) < 0.0) n = -n; // both sides of an open surface are lit
  // A large soft lamp at the upper left of the camera, a faint one at the lower right, and air.
  float key = 0.5 + 0.5 * dot(n, vec3(-0.448, 0.647, 0.617));
  float fill = max(dot(n, vec3(0.781, -0.279, 0.558)), 0.0);
  float rim = 1.0 - max(dot(n, eye), 0.0);
  float light = 0.36 + 0.68 * key * key + 0.1 * fill - 0.12 * rim * rim * rim;
  color = vec4(min(base * light, 1.0), opacity);
}
`;

/** Points on vertices: feature points, a heat source. They lie a little before the surface. */
export const POINT_VERTEX = /* glsl */ `
${MOVED}
in vec3 tint;
uniform float size;
out vec3 v_tint;
void main() {
  vec3 turn;
  v_tint = tint;
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(moved(turn), 1.0));
  gl_Position.z -= 0.002 * gl_Position.w;
  gl_PointSize = size;
}
`;

export const POINT_FRAGMENT = /* glsl */ `
precision highp float;
in vec3 v_tint;
out vec4 color;
void main() {
  float radius = 2.0 * length(gl_PointCoord - 0.5);
  float edge = fwidth(radius);
  float disc = 1.0 - smoothstep(1.0 - edge, 1.0, radius);
  if (disc <= 0.0) discard;
  color = vec4(mix(v_tint, vec3(0.08), smoothstep(0.68, 0.74, radius)), disc);
}
`;

/** What lies under a pixel: the last vertex of the face, the place at rest, and the place shown. */
export const PICK_VERTEX = /* glsl */ `
${MOVED}
out vec3 v_rest;
out vec3 v_place;
flat out float v_last;
void main() {
  vec3 turn;
  v_rest = position;
  v_place = moved(turn);
  v_last = float(gl_VertexID); // WebGL takes flat values from the last corner of a triangle
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(v_place, 1.0));
}
`;

export const PICK_FRAGMENT = /* glsl */ `
precision highp float;
in vec3 v_rest;
in vec3 v_place;
flat in float v_last;
layout(location = 0) out vec4 rest;
layout(location = 1) out vec4 place;
void main() {
  rest = vec4(v_rest, v_last + 1.0); // 0 where there is no face
  place = vec4(v_place, 1.0);
}
`;

/** One pixel a vertex, with its position: what the shader computes, for tests and for picking. */
export const POSITION_VERTEX = /* glsl */ `
${MOVED}
uniform ivec2 grid;
out vec3 v_place;
void main() {
  vec3 turn;
  v_place = moved(turn);
  vec2 cell = vec2(gl_VertexID % grid.x, gl_VertexID / grid.x) + 0.5;
  gl_Position = vec4(2.0 * cell / vec2(grid) - 1.0, 0.0, 1.0);
  gl_PointSize = 1.0;
}
`;

export const POSITION_FRAGMENT = /* glsl */ `
precision highp float;
in vec3 v_place;
out vec4 place;
void main() {
  place = vec4(v_place, 1.0);
}
`;
