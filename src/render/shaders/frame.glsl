// Data of a whole frame, in the order of FrameBlock in renderer.cpp.
layout(std140, binding = 0) uniform Frame {
  mat4 view_projection;
  mat4 shadow_matrix;  // world to the shadow map's texture coordinates and depth
  vec4 eye;            // m
  vec4 camera_right;   // scaled to the picture's edge, like the next
  vec4 camera_up;
  vec4 camera_ahead;
  vec4 viewport;       // width, height (pixels), a shadow texel (m)
  vec4 look_sun_direction;
  vec4 look_sun_colour;
  vec4 look_ambient_up;
  vec4 look_ambient_down;
  vec4 look_zenith;
  vec4 look_horizon;
  vec4 look_nadir;
  vec4 look_extinction;  // 1/m by channel
  vec4 look_ground;
  vec4 look_ground_line;
  vec4 look_water;  // height of the surface (m), time (s)
};

layout(binding = 0) uniform sampler2DShadow shadow_map;
