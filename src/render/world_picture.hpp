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
  /// Passes the world's bodies, if they have changed, and their colours and poses to the renderer. Leaves out the walls
  /// of a bin around everything that moves, so the inside is visible. Poses on the rendering GPU do not pass through
  /// the host. Then the bounds and the set of sleeping bodies, for which the host must read poses, are updated only
  /// every 30th time, or if `exact` is true.
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

/// The fixed bodies that wall in everything that moves on all four sides and so hide it; empty if there are none.
std::vector<BodyId> bin_walls(const World& world);

/// Bounds (m) of the dynamic bodies without the outermost, so a few strays do not count; if none is dynamic, of all
/// bodies except floors.
Aabb moving_bounds(const World& world);

}  // namespace fathom::render
