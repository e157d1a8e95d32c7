// Edges of the faces lie a little before the surface.
#ifdef CLIPPED
out vec3 v_place;
#endif
void main() {
  vec3 turn;
  vec3 place = moved(turn);
#ifdef CLIPPED
  v_place = place;
#endif
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(place, 1.0));
  gl_Position.z -= 0.0004 * gl_Position.w;
}
