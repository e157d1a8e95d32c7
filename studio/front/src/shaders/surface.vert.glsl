in vec3 exact_normal;
in float ambient;
out float v_ambient;
#if COLORING == 1
in float value;
out float v_value;
#elif COLORING == 2
in vec3 paint;
flat out vec3 v_paint; // a face has the color of its last corner, so borders of parts are sharp
#endif
#ifdef MARKED
in vec4 mark;
out vec4 v_mark;
#endif
out vec3 v_normal;
out vec3 v_view;
void main() {
  vec3 turn;
  vec4 seen = modelViewMatrix * vec4(moved(turn), 1.0);
  v_normal = normalMatrix * mix(turned(normal, turn), exact_normal, blend);
  v_view = -seen.xyz;
  v_ambient = ambient;
#if COLORING == 1
  v_value = value;
#elif COLORING == 2
  v_paint = paint;
#endif
#ifdef MARKED
  v_mark = mark;
#endif
  gl_Position = projectionMatrix * seen;
}
