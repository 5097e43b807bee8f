// Colours for the bodies of a world.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <span>
#include <vector>

#include "render/colour.hpp"

namespace fathom::render {

/// What a body's colour shows.
enum class Colouring : std::uint8_t {
  start,   ///< its initial height if bodies started in layers; otherwise only distinguishes bodies
  speed,   ///< dark blue: at rest, red: 5 m/s and more
  island,  ///< bodies that touch each other share a colour
};

class WorldColours {
 public:
  /// Colours by slot, alpha below 255 for sleeping bodies. Valid until the next call.
  std::span<const Colour> update(const World& world, Colouring colouring = Colouring::start);

 private:
  void colour_new_bodies(const World& world);
  void find_islands(const World& world);
  Colour colour_of(const World& world, BodyId id, Colouring colouring) const;

  std::vector<BodyId> known_;  // by slot, like the others
  std::vector<Colour> start_;
  std::vector<Colour> colours_;
  std::vector<std::uint32_t> island_;  // the lowest slot of the body's island
};

}  // namespace fathom::render
