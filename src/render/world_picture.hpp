// From a world, through its public interface, to what the renderer draws: shapes, colours and poses by slot.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <optional>
#include <vector>

#include "render/renderer.hpp"

namespace fathom::render {

/// What a body's colour tells.
enum class Colouring : std::uint8_t {
  start,   ///< how high it was at the start, where bodies started in layers; else it only tells bodies apart
  speed,   ///< dark blue: at rest, red: 5 m/s and more
  island,  ///< bodies that touch each other have one colour
};

class WorldPicture {
 public:
  /// Gives the renderer the world's bodies where they have changed since, their colours and poses. `time_step` false
  /// leaves out what only changes with steps.
  void update(const World& world, Renderer& renderer, Colouring colouring = Colouring::start);

  /// Bounds (m) of the dynamic bodies without the most distant, so that a few strays do not count; of all bodies but
  /// floors where none is dynamic.
  Aabb bounds(const World& world) const;
  /// Height (m) of the highest floor.
  std::optional<float> ground_height() const { return ground_height_; }

 private:
  void list_bodies(const World& world, Renderer& renderer);
  void colour_by_start(const World& world);
  Colour colour_of(const World& world, BodyId id, Colouring colouring) const;
  void find_islands(const World& world);

  std::vector<BodyId> bodies_;
  std::vector<Colour> start_colours_;  // by slot, as the next
  std::vector<Colour> colours_;
  std::vector<BodyId> coloured_;       // whose start colour is set
  std::vector<std::uint32_t> island_;  // the lowest slot of the body's island
  std::optional<float> ground_height_;
};

/// A fixed box so wide that it is a floor.
bool is_ground(const World& world, BodyId id);

}  // namespace fathom::render
