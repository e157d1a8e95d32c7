in float ambient;
out float v_ambient;
#if COLORING == 1
in float value;
uniform float swing; // along the normal, for a value of 1: an eigenfunction as a vibration
uniform float phase; // of the colors of it; else 1
out float v_value;
#elif COLORING == 2
in vec3 paint;
in vec3 soft;
in vec3 beyond;
flat out vec3 v_paint; // of the last corner of the face
flat out vec3 v_beyond; // beyond the border that is near
out vec3 v_soft;
#elif COLORING == 3
in vec2 place_in_image;
in vec4 tint;
out vec2 v_place_in_image;
out vec4 v_tint;
#endif
#ifdef MARKED
in vec4 mark;
out vec4 v_mark;
#endif
#ifdef CLIPPED
out vec3 v_place;
#endif
#ifdef CREASED
in float crease;
out float v_crease; // above 0 in the faces at a crease
out vec3 v_seen;
#endif
out vec3 v_normal;
void main() {
  vec3 turn;
  vec3 place = moved(turn);
#if COLORING == 1
  if (!isnan(value)) place += swing * value * normal; // 0 times no value is no place
#endif
#ifdef CLIPPED
  v_place = place;
#endif
  v_normal = normalMatrix * moved_normal(turn);
  v_ambient = ambient;
#if COLORING == 1
  v_value = phase * value;
#elif COLORING == 2
  v_paint = paint;
  v_beyond = beyond;
  v_soft = soft;
#elif COLORING == 3
  v_place_in_image = place_in_image;
  v_tint = tint;
#endif
#ifdef MARKED
  v_mark = mark;
#endif
#ifdef CREASED
  v_crease = crease;
  v_seen = (modelViewMatrix * vec4(place, 1.0)).xyz;
#endif
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(place, 1.0));
}
