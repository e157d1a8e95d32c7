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
