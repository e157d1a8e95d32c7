// Points on vertices: feature points, a heat source.
in vec3 tint;
uniform float size; // pixels of the picture
uniform vec2 picture; // its width and height
out vec3 v_tint;
void main() {
  vec3 turn;
  v_tint = tint;
  vec4 seen = modelViewMatrix * vec4(moved(turn), 1.0);
  gl_Position = projectionMatrix * seen;
  // A disc faces the eye and the surface under it may not: behind is what lies two discs deeper.
  seen.z += 4.0 * size * gl_Position.w / (projectionMatrix[1][1] * picture.y);
  vec4 nearer = projectionMatrix * seen;
  gl_Position.z = nearer.z / nearer.w * gl_Position.w;
  gl_PointSize = size;
}
