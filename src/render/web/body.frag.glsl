in vec3 world_position;
in vec3 local_position;
in vec3 local_normal;
in float extra;
flat in vec3 body_scale;
flat in vec4 body_rotation;
flat in vec4 body_colour;

layout(location = 0) out vec4 pixel;

void main() {
  pixel = vec4(surface(body_colour, world_position, local_position, local_normal, extra, body_scale, body_rotation), 1.0);
}
