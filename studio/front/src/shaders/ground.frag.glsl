precision mediump float;
// The shadow of the shape: dark where the ground sees little of the sky.
in float v_dark;
out vec4 color;
void main() {
  color = vec4(0.0, 0.0, 0.0, v_dark);
}
