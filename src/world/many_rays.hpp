// Many rays at once, as World hands them to a simulator.
#pragma once

#include <cstdint>
#include <fathom/query.hpp>
#include <functional>
#include <span>

#include "geometry/query.hpp"
#include "world/filter.hpp"

namespace fathom {

struct ManyRays {
  std::span<const Ray> rays;
  QuerySight sight;
  std::span<const std::uint32_t> ignored;  ///< slots of bodies that they do not see, ascending
};

/// What a ray hits first.
struct RayHit {
  static constexpr std::uint32_t nothing = 0xffffffff;
  std::uint32_t slot = nothing;  ///< the body's
  SurfaceHit hit;
};

/// Receives the hits of some of the rays, beginning with ray `first`.
using TakeHits = std::function<void(std::size_t first, std::span<const RayHit> hits)>;

}  // namespace fathom
