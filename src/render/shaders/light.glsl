// Light, air and water, for the renderer and for the web page. Colours are linear here.
// `Look` is filled by the program: see look.hpp.

vec3 to_linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c)); }

vec3 to_srgb(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(vec3(0.0031308), c));
}

// A shoulder for what is brighter than white (Narkowicz 2016, fitted to the ACES curve).
vec3 tone(vec3 c) { return (c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14); }

vec3 background(vec3 direction) {
  float up = direction.z;
  vec3 sky = mix(look_horizon.rgb, look_zenith.rgb, pow(clamp(up, 0.0, 1.0), 0.55));
  vec3 below = mix(look_horizon.rgb, look_nadir.rgb, pow(clamp(-up, 0.0, 1.0), 0.5));
  return up > 0.0 ? sky : below;
}

// The share of light that air or water lets through over a distance, by channel.
vec3 transmission(float way) { return exp(-way * look_extinction.rgb); }

// Light from the sky and from the ground, by the height of the normal.
vec3 ambient(vec3 normal) {
  return mix(look_ambient_down.rgb, look_ambient_up.rgb, 0.5 + 0.5 * normal.z);
}

// Light that the surface waves gather on what lies under water: two wave patterns multiplied.
float caustics(vec3 p, float time) {
  vec2 q = p.xy * 0.9;
  float a = sin(q.x + 0.7 * sin(q.y * 1.3 + time)) + sin(q.y * 1.1 + 0.8 * sin(q.x * 0.9 - 0.8 * time));
  float b = sin(0.8 * (q.x + q.y) + 0.9 * sin(q.x - 1.2 * q.y + 0.6 * time));
  float c = 1.0 - abs(0.4 * a + 0.35 * b);
  return pow(clamp(c, 0.0, 1.0), 4.0);
}

// Colour of a lit surface as seen from the eye, as sRGB.
vec3 lit(vec3 albedo, vec3 position, vec3 normal, float gloss, float sunlit) {
  vec3 to_eye = eye.xyz - position;
  float range = length(to_eye);
  vec3 view = to_eye / range;
  vec3 sun = look_sun_direction.xyz;
  vec3 sun_colour = look_sun_colour.rgb;
  if (look_water.x > 0.5) {
    // The sun's light has come through the water above.
    sun_colour *= transmission(max(look_water.y - position.z, 0.0)) * (0.7 + 1.6 * caustics(position, look_water.z));
  }
  float facing = max(dot(normal, sun), 0.0);
  vec3 halfway = normalize(sun + view);
  float highlight = gloss * pow(max(dot(normal, halfway), 0.0), 48.0) * facing;
  float rim = gloss * 0.5 * pow(1.0 - max(dot(normal, view), 0.0), 4.0);
  vec3 colour = albedo * (sun_colour * (facing * sunlit) + ambient(normal));
  colour += sun_colour * (highlight * sunlit) + look_horizon.rgb * rim;
  vec3 through = transmission(range);
  vec3 air = background(-view);
  return to_srgb(tone(colour * through + air * (1.0 - through)));
}

// Lines of a grid, averaged over the pixel's footprint (Quilez, "Filterable procedurals", 2018). `share` of the
// spacing is line.
float grid_lines(vec2 p, float spacing, float share) {
  vec2 q = p / spacing + 0.5 * share;
  vec2 w = max(abs(dFdx(q)), abs(dFdy(q))) + 1e-4;
  vec2 a = q + 0.5 * w, b = q - 0.5 * w;
  vec2 covered = (floor(a) + min(fract(a) / share, 1.0) - floor(b) - min(fract(b) / share, 1.0)) * share / w;
  return 1.0 - (1.0 - covered.x) * (1.0 - covered.y);
}

vec3 ground_albedo(vec3 position, vec3 normal) {
  vec3 base = look_ground.rgb;
  float fine = grid_lines(position.xy, 1.0, 0.03), coarse = grid_lines(position.xy, 10.0, 0.008);
  float far = 1.0 - smoothstep(30.0, 90.0, length(eye.xyz - position));
  float lines = max(0.55 * fine * far, 0.85 * coarse);
  return mix(base, look_ground_line.rgb, lines * step(0.7, normal.z));
}
