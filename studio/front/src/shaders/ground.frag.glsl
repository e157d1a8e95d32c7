precision highp float;
// The shadow of the shape: dark where the ground sees little of the sky; it ends before the rim.
in vec2 v_place;
uniform sampler2D sky;
out vec4 color;
void main() {
  float share = texture(sky, 0.5 + 0.5 * v_place).r;
  float dark = 0.9 * clamp(1.0 - share, 0.0, 1.0) * (1.0 - smoothstep(0.5, 1.0, length(v_place)));
  color = vec4(vec3(0.0), dark);
}
