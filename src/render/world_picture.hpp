// From a world, through its public interface, to what the renderer draws: shapes, colours and poses by slot.
#pragma once

#include <fathom/world.hpp>
#include <optional>
#include <vector>

#include "render/renderer.hpp"
#include "render/world_colours.hpp"

namespace fathom::render {

class WorldPicture {
 public:
  /// Passes the world's bodies, if they have changed, and their colours and poses to the renderer. The walls of a bin
  /// around everything that moves are left out, so that the inside is visible. Poses on the rendering GPU do not pass
  /// through the host. Then the data for which the host would have to read poses, that is the bounds and which bodies
  /// sleep, are updated only every 30th time, or if `exact` is true.
  void update(const World& world, Renderer& renderer, Colouring colouring = Colouring::start, bool exact = false);

  /// `moving_bounds` (m) at the last update that read poses.
  const Aabb& moving() const { return moving_; }

  /// Height (m) of the highest level floor.
  std::optional<float> ground_height() const { return ground_height_; }

 private:
  void list_bodies(const World& world, Renderer& renderer);

  std::vector<BodyId> bodies_;
  WorldColours colours_;
  std::optional<Colouring> coloured_;
  Aabb moving_{};
  int since_read_ = 0;  // updates
  std::optional<float> ground_height_;
};

/// A fixed box wide enough to be a floor, or a fixed surface.
bool is_ground(const World& world, BodyId id);

/// The fixed bodies that wall in everything that moves on all four sides and would hide it; empty if there are none.
std::vector<BodyId> bin_walls(const World& world);

/// Bounds (m) of the dynamic bodies without the most distant, so that a few strays do not count; of all bodies but
/// floors where none is dynamic.
Aabb moving_bounds(const World& world);

}  // namespace fathom::render
