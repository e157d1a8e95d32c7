// What lies under a pixel: the last vertex of the face, the place at rest, and the place shown. With
// a grid, each vertex has a pixel of its own: so tests read where the shader moves all of them.
uniform ivec2 grid; // 0 without a grid
out vec3 v_rest;
out vec3 v_place;
flat out float v_last;
void main() {
  vec3 turn;
  v_rest = position;
  v_place = moved(turn);
  v_last = float(gl_VertexID); // WebGL takes flat values from the last corner of a triangle
  vec2 cell = vec2(gl_VertexID % max(grid.x, 1), gl_VertexID / max(grid.x, 1)) + 0.5;
  gl_Position = grid.x > 0
    ? vec4(2.0 * cell / vec2(grid) - 1.0, 0.0, 1.0)
    : projectionMatrix * (modelViewMatrix * vec4(v_place, 1.0));
  gl_PointSize = 1.0;
}
