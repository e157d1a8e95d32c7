in float dark;
out float v_dark;
void main() {
  v_dark = dark;
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(position, 1.0));
}
