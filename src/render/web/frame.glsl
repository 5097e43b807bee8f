precision highp float;
precision highp int;
precision highp sampler2DShadow;
// As shaders/frame.glsl.
uniform mat4 view_projection;
uniform mat4 shadow_matrix;
uniform vec4 eye, camera_right, camera_up, camera_ahead, viewport;
uniform vec4 look_sun_direction, look_sun_colour, look_ambient_up, look_ambient_down, look_zenith, look_horizon;
uniform vec4 look_nadir, look_extinction, look_ground, look_ground_line, look_water;
uniform sampler2DShadow shadow_map;
