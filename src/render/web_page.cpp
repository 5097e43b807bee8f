#include "render/web_page.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fathom/compound.hpp>
#include <fathom/error.hpp>
#include <fathom/mesh.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "render/shape_mesh.hpp"
#include "web_files.hpp"

namespace fathom::render {
namespace {

using Json = nlohmann::ordered_json;

constexpr float rotation_steps = 2000;
constexpr float size_steps = 500;

std::string base64(const void* data, std::size_t size) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  std::string text;
  text.reserve((size + 2) / 3 * 4);
  for (std::size_t i = 0; i < size; i += 3) {
    const std::size_t here = std::min<std::size_t>(3, size - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < here ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= here ? digits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

template <class T>
std::string base64(const std::vector<T>& values) {
  return base64(values.data(), values.size() * sizeof(T));
}

std::vector<std::uint8_t> packed(const std::vector<std::uint8_t>& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::vector<std::uint8_t> out(size);
  if (compress2(out.data(), &size, bytes.data(), static_cast<uLong>(bytes.size()), 9) != Z_OK) {
    throw Error(ErrorCode::capacity, "the page's recording is too large to pack; ask for fewer seconds or bodies");
  }
  out.resize(size);
  return out;
}

float smallest_extent(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::sphere:
    case ShapeType::capsule:
      return shape.radius;
    case ShapeType::box:
      return min_component(shape.half_extents);
    case ShapeType::hull:
      return shape.hull->inner_radius();
    case ShapeType::compound:
      return shape.compound->inner_radius();
    case ShapeType::mesh:
    case ShapeType::height_field:
      break;
  }
  return 1e30f;  // surfaces have none
}

float outer_radius(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::sphere:
      return shape.radius;
    case ShapeType::capsule:
      return shape.radius + shape.half_extents.z;
    case ShapeType::box:
      return length(shape.half_extents);
    case ShapeType::hull:
      return shape.hull->outer_radius();
    case ShapeType::compound:
      return shape.compound->outer_radius();
    case ShapeType::mesh:
    case ShapeType::height_field:
      return length(max(abs(shape.surface->bounds().lower), abs(shape.surface->bounds().upper)));
  }
  return 1;
}

Json list(Vec3 v) { return {v.x, v.y, v.z}; }
Json list4(Vec3 v) { return {v.x, v.y, v.z, 0}; }

Json json_of(const Look& look) {
  return {{"sun_direction", list4(look.sun_direction)},
          {"sun_colour", list4(look.sun_colour)},
          {"ambient_up", list4(look.ambient_up)},
          {"ambient_down", list4(look.ambient_down)},
          {"zenith", list4(look.zenith)},
          {"horizon", list4(look.horizon)},
          {"nadir", list4(look.nadir)},
          {"extinction", list4(look.extinction)},
          {"ground", list4(look.ground)},
          {"ground_line", list4(look.ground_line)},
          {"water", look.water},
          {"water_surface", look.water_surface}};
}

/// The page's meshes: basic shapes once each, and one for each hull, compound and surface.
class Meshes {
 public:
  /// Index of the mesh for a shape; creates it if it is new.
  std::size_t number(const Shape& shape, bool ground) {
    const void* part = shape.surface.get();
    if (shape.hull) part = shape.hull.get();
    if (shape.compound) part = shape.compound.get();
    const auto [entry, is_new] = numbers_.try_emplace({shape.type, ground, part}, list_.size());
    if (is_new) list_.push_back(make(shape, ground));
    return entry->second;
  }
  const Json& list() const { return list_; }

 private:
  static Json make(const Shape& shape, bool ground) {
    switch (shape.type) {
      case ShapeType::sphere:
        return json_of("ROUND", unit_sphere(2));
      case ShapeType::capsule:
        return json_of("CAPSULE", unit_capsule(20));
      case ShapeType::hull:
        return json_of("HULL", hull_mesh(*shape.hull));
      case ShapeType::compound:
        return json_of("HULL", compound_mesh(*shape.compound));
      case ShapeType::mesh:
      case ShapeType::height_field:
        return json_of(ground ? "TERRAIN" : "HULL", surface_mesh(*shape.surface));
      case ShapeType::box:
        break;
    }
    return json_of(ground ? "GROUND" : "BOX", unit_box());
  }
  static Json json_of(const char* surface, const Mesh& mesh) {
    return {{"surface", surface}, {"vertices", base64(mesh.vertices)}, {"indices", base64(mesh.indices)}};
  }

  std::map<std::tuple<ShapeType, bool, const void*>, std::size_t> numbers_;
  Json list_ = Json::array();
};

Vec3 scale_of(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::sphere:
      return {shape.radius, shape.radius, shape.radius};
    case ShapeType::capsule:
      return {shape.radius, shape.radius, shape.half_extents.z};
    case ShapeType::box:
      return shape.half_extents;
    case ShapeType::hull:
    case ShapeType::compound:
    case ShapeType::mesh:
    case ShapeType::height_field:
      break;
  }
  return {1, 1, 1};
}

std::string replaced(std::string text, const std::string& mark, const std::string& value) {
  const std::size_t at = text.find(mark);
  return text.replace(at, mark.size(), value);
}

/// Escapes JSON so that it cannot end the script element that contains it.
std::string embedded(const Json& json) {
  std::string text = json.dump();
  for (std::size_t at = 0; (at = text.find("</", at)) != std::string::npos; at += 3) text.replace(at, 2, "<\\/");
  return text;
}

}  // namespace

void WebPage::append_number(std::int32_t value) {
  auto bits = static_cast<std::uint32_t>(value) << 1 ^ static_cast<std::uint32_t>(value >> 31);
  for (; bits > 127; bits >>= 7) stream_.push_back(static_cast<std::uint8_t>(bits | 128));
  stream_.push_back(static_cast<std::uint8_t>(bits));
}

void WebPage::enter_new_bodies(const World& world) {
  const std::span<const Colour> colours = colours_.update(world);
  entry_of_slot_.resize(world.poses().size(), ~std::size_t{0});
  for (const BodyId id : world.bodies()) {
    if (world.is_sensor(id)) continue;
    std::size_t& entry = entry_of_slot_[id.index];
    if (entry >= entries_.size() || !(entries_[entry].id == id)) {
      entry = entries_.size();
      Colour colour = colours[id.index];
      colour.a = 255;
      entries_.push_back({id,
                          known_.size(),
                          0,
                          world.shape(id),
                          colour,
                          is_ground(world, id),
                          world.motion(id) == MotionType::dynamic,
                          {},
                          {}});
    }
    entries_[entry].last = known_.size();
  }
  if (quantum_ > 0) return;
  float smallest = 1e30f;
  for (const Entry& entry : entries_) smallest = min(smallest, smallest_extent(entry.shape));
  quantum_ = clamp(smallest / size_steps, 1e-5f, 1.0f);
}

void WebPage::add(const World& world) {
  enter_new_bodies(world);
  const std::size_t frame = known_.size();
  std::vector<std::array<std::int32_t, channels>> now(entries_.size());
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    if (entry.last != frame) {  // it was removed; keeps its last pose
      std::copy_n(entry.before, channels, now[i].begin());
      continue;
    }
    const Pose& pose = world.poses()[entry.id.index];
    const float p[3] = {pose.position.x, pose.position.y, pose.position.z};
    for (int c = 0; c < 3; ++c) now[i][c] = static_cast<std::int32_t>(std::lround(clamp(p[c] / quantum_, -1e9f, 1e9f)));
    const float q[4] = {pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z};
    // A quaternion and its negative are the same rotation: use the one nearer to the last.
    float along = 0;
    for (int c = 0; c < 4; ++c) along += q[c] * static_cast<float>(entry.before[3 + c]);
    const float steps = along < 0 ? -rotation_steps : rotation_steps;
    for (int c = 0; c < 4; ++c) now[i][3 + c] = static_cast<std::int32_t>(std::lround(steps * q[c]));
  }
  for (int c = 0; c < channels; ++c) {
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const Entry& entry = entries_[i];
      const std::size_t age = frame - entry.first;
      const std::int32_t expected = age > 1   ? 2 * entry.before[c] - entry.before_that[c]
                                    : age > 0 ? entry.before[c]
                                              : 0;
      append_number(now[i][c] - expected);
    }
  }
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    std::copy_n(entries_[i].before, channels, entries_[i].before_that);
    std::copy_n(now[i].begin(), channels, entries_[i].before);
  }
  known_.push_back(entries_.size());
  const Aabb moving = moving_bounds(world);
  view_ = frame == 0 ? moving : merged(view_, moving);
}

std::string WebPage::html(bool under_water, float azimuth, float elevation) const {
  Meshes meshes;
  Json bodies = Json::array();
  std::size_t moving = 0;
  float ground = -1e30f;
  for (const Entry& entry : entries_) {
    moving += entry.dynamic;
    if (entry.ground && !entry.shape.is_surface())
      ground = max(ground, quantum_ * static_cast<float>(entry.before[2]) + entry.shape.half_extents.z);
    bodies.push_back({{"mesh", meshes.number(entry.shape, entry.ground)},
                      {"scale", list(scale_of(entry.shape))},
                      {"colour", {entry.colour.r, entry.colour.g, entry.colour.b}},
                      {"first", entry.first},
                      {"last", entry.last},
                      {"radius", outer_radius(entry.shape)},
                      {"ground", entry.ground}});
  }
  Aabb view = view_;
  if (ground > -1e30f && ground < view.upper.z) view.lower.z = ground;
  // The page's controls hide the lower edge.
  view.lower.z -= 0.1f * (view.upper.z - view.lower.z);
  const Camera camera = camera_on(view, azimuth, elevation, 16.0f / 9.0f);
  const float size = length(view.upper - view.lower);
  const Look look = under_water ? fathom::render::under_water(size, view.upper.z + 0.5f * size) : daylight(size);
  const Json scene{{"name", name_},
                   {"rate", rate_},
                   {"moving", moving},
                   {"quantum", quantum_},
                   {"camera",
                    {{"azimuth", azimuth},
                     {"elevation", elevation},
                     {"half_extents", list(half_extents(view))},
                     {"target", list(camera.target)}}},
                   {"look", json_of(look)},
                   {"meshes", meshes.list()},
                   {"frames", known_},
                   {"bodies", bodies}};
  const std::string light = std::string(web::frame) + web::light;
  const Json shaders{{"body_vert", std::string(web::frame) + web::body_vert},
                     {"body_frag", light + web::surface + web::body_frag},
                     {"depth_frag", std::string(web::frame) + web::depth_frag},
                     {"sky_vert", std::string(web::frame) + web::sky_vert},
                     {"sky_frag", light + web::sky_frag}};
  std::string page = replaced(web::player_html, "{{script}}", web::player_js);
  page = replaced(page, "{{shaders}}", embedded(shaders));
  page = replaced(page, "{{scene}}", embedded(scene));
  return replaced(page, "{{motion}}", base64(packed(stream_)));
}

}  // namespace fathom::render
