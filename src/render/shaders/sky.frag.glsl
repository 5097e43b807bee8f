in vec3 direction;
layout(location = 0) out vec4 pixel;

void main() {
  // Noise of half a quantization step hides the bands of a smooth gradient.
  float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  pixel = vec4(to_srgb(tone(background(normalize(direction)))) + (noise - 0.5) / 255.0, 1.0);
}
