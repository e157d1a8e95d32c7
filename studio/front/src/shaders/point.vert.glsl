// Points on vertices: feature points, a heat source. They lie a little before the surface.
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
