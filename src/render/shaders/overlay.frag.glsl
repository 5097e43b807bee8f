flat in vec4 mark_colour;
in vec2 across;
flat in vec2 size;
layout(location = 0) out vec4 pixel;

void main() {
  // Distance from the segment, which has round ends.
  float d = length(vec2(max(abs(across.x) - size.x, 0.0), across.y));
  float cover = clamp(size.y + 0.5 - d, 0.0, 1.0);
  pixel = vec4(mark_colour.rgb, mark_colour.a * cover);
}
