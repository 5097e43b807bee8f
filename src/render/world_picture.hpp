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
  /// Gives the renderer the world's bodies where they have changed, their colours and their poses. The walls of a bin
  /// around all that moves are left out, so that it is seen.
  /// Poses on the GPU that draws do not pass through the host. What the host would have to read poses for, the
  /// bounds and which bodies sleep, is then brought up to date every 30th time, or where `exact` asks for it.
  void update(const World& world, Renderer& renderer, Colouring colouring = Colouring::start, bool exact = false);

  /// `moving_bounds` (m) as of the last update that read poses.
  const Aabb& moving() const { return moving_; }

  /// Height (m) of the highest floor that is level.
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

/// A fixed box so wide that it is a floor, or a fixed surface.
bool is_ground(const World& world, BodyId id);

/// The fixed bodies that wall in all that moves on its four sides, so that nobody could see it; else none.
std::vector<BodyId> bin_walls(const World& world);

/// Bounds (m) of the dynamic bodies without the most distant, so that a few strays do not count; of all bodies but
/// floors where none is dynamic.
Aabb moving_bounds(const World& world);

}  // namespace fathom::render
