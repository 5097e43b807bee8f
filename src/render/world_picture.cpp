#include "render/world_picture.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace fathom::render {
namespace {

constexpr float floor_half_width = 5.0f;  // m
constexpr float fastest = 5.0f;           // m/s, the end of the speed scale
constexpr Colour fixed_colour{150, 152, 156};
constexpr Colour kinematic_colour{214, 214, 220};
constexpr std::uint8_t asleep = 128;

/// A little lighter or darker, so that neighbours of one colour differ.
Colour varied(Colour colour, std::uint32_t slot) {
  const float factor = 1.0f + 0.16f * (static_cast<float>((slot * 2654435761u) >> 24) / 255.0f - 0.5f);
  const auto vary = [factor](std::uint8_t v) {
    return static_cast<std::uint8_t>(std::lround(min(255.0f, factor * static_cast<float>(v))));
  };
  return {vary(colour.r), vary(colour.g), vary(colour.b)};
}

int height_step(float z) { return static_cast<int>(std::lround(10.0f * clamp(z, -1e6f, 1e6f))); }

}  // namespace

bool is_ground(const World& world, BodyId id) {
  if (world.motion(id) != MotionType::fixed) return false;
  const Shape& shape = world.shape(id);
  return shape.type == ShapeType::box && shape.half_extents.x >= floor_half_width &&
         shape.half_extents.y >= floor_half_width;
}

void WorldPicture::list_bodies(const World& world, Renderer& renderer) {
  bodies_.assign(world.bodies().begin(), world.bodies().end());
  std::vector<DrawnBody> drawn;
  drawn.reserve(bodies_.size());
  ground_height_.reset();
  for (const BodyId id : bodies_) {
    const bool ground = is_ground(world, id);
    drawn.push_back({id.index, world.shape(id), ground});
    if (ground) ground_height_ = max(ground_height_.value_or(-1e30f), world.bounds(id).upper.z);
  }
  renderer.set_bodies(drawn);
  colour_by_start(world);
}

void WorldPicture::colour_by_start(const World& world) {
  const std::size_t slots = world.poses().size();
  const bool first_time = coloured_.empty();
  start_colours_.resize(slots);
  coloured_.resize(slots);
  std::map<int, std::size_t> heights;
  if (first_time) {
    for (const BodyId id : bodies_)
      if (world.motion(id) == MotionType::dynamic) heights[height_step(world.poses()[id.index].position.z)] = 0;
  }
  const bool in_layers = heights.size() > 1 && 2 * heights.size() <= bodies_.size();
  std::size_t rank = 0;
  for (auto& height : heights) height.second = rank++;
  for (const BodyId id : bodies_) {
    if (coloured_[id.index] == id) continue;
    coloured_[id.index] = id;
    Colour& colour = start_colours_[id.index];
    if (world.motion(id) != MotionType::dynamic) {
      colour = world.motion(id) == MotionType::fixed ? fixed_colour : kinematic_colour;
    } else if (in_layers) {
      const std::size_t layer = heights.at(height_step(world.poses()[id.index].position.z));
      colour = varied(sunset(static_cast<float>(layer) / static_cast<float>(heights.size() - 1)), id.index);
    } else {
      colour = varied(scattered(id.index), id.index);
    }
  }
}

// Bodies that touch, fixed ones apart: the lowest slot of each island, by union-find with path halving.
void WorldPicture::find_islands(const World& world) {
  island_.resize(world.poses().size());
  for (std::uint32_t slot = 0; slot < island_.size(); ++slot) island_[slot] = slot;
  const auto root = [this](std::uint32_t slot) {
    while (island_[slot] != slot) slot = island_[slot] = island_[island_[slot]];
    return slot;
  };
  world.for_each_contact([&](const ContactInfo& contact) {
    if (world.motion(contact.a) != MotionType::dynamic || world.motion(contact.b) != MotionType::dynamic) return;
    const std::uint32_t a = root(contact.a.index), b = root(contact.b.index);
    island_[std::max(a, b)] = std::min(a, b);
  });
  for (std::uint32_t slot = 0; slot < island_.size(); ++slot) island_[slot] = root(slot);
}

Colour WorldPicture::colour_of(const World& world, BodyId id, Colouring colouring) const {
  const Colour own = start_colours_[id.index];
  if (world.motion(id) != MotionType::dynamic) return own;
  switch (colouring) {
    case Colouring::start:
      return own;
    case Colouring::speed:
      return turbo(length(world.velocities()[id.index].linear) / fastest);
    case Colouring::island:
      return varied(scattered(island_[id.index]), island_[id.index]);
  }
  return own;
}

void WorldPicture::update(const World& world, Renderer& renderer, Colouring colouring) {
  if (!std::ranges::equal(world.bodies(), bodies_)) list_bodies(world, renderer);
  if (colouring == Colouring::island) find_islands(world);
  colours_.resize(world.poses().size());
  for (const BodyId id : bodies_) {
    Colour colour = colour_of(world, id, colouring);
    if (world.motion(id) == MotionType::dynamic && !world.is_awake(id)) colour.a = asleep;
    colours_[id.index] = colour;
  }
  renderer.set_colours(colours_);
  renderer.poses().write(world.poses());
}

Aabb WorldPicture::bounds(const World& world) const {
  std::vector<BodyId> shown;
  for (const BodyId id : bodies_)
    if (world.motion(id) == MotionType::dynamic) shown.push_back(id);
  if (shown.empty()) {
    for (const BodyId id : bodies_)
      if (!is_ground(world, id)) shown.push_back(id);
  }
  if (shown.empty()) return {{-5, -5, -1}, {5, 5, 4}};
  // Bounds of all but the outermost hundredth on each side of each axis.
  Aabb box{{1e30f, 1e30f, 1e30f}, {-1e30f, -1e30f, -1e30f}};
  float low[3], high[3];
  std::vector<float> values(shown.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::transform(shown, values.begin(), [&](BodyId id) { return world.poses()[id.index].position[axis]; });
    const std::size_t strays = values.size() / 100;
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(strays);
    std::nth_element(values.begin(), first, values.end());
    low[axis] = *first;
    const auto last = values.end() - 1 - static_cast<std::ptrdiff_t>(strays);
    std::nth_element(values.begin(), last, values.end());
    high[axis] = *last;
  }
  const Aabb middles = grown({{low[0], low[1], low[2]}, {high[0], high[1], high[2]}}, 1e-3f);
  for (const BodyId id : shown) {
    const Vec3 p = world.poses()[id.index].position;
    if (contains(middles, {p, p})) box = merged(box, world.bounds(id));
  }
  return box.lower.x <= box.upper.x ? box : middles;
}

}  // namespace fathom::render
