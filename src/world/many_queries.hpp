// Many queries at once, as World hands them to a simulator.
#pragma once

#include <cstdint>
#include <fathom/query.hpp>
#include <functional>
#include <span>

#include "geometry/query.hpp"
#include "world/filter.hpp"

namespace fathom {

/// Rays, or shapes to move or to place.
template <class Asked>
struct ManyQueries {
  std::span<const Asked> asked;
  QuerySight sight;
  std::span<const std::uint32_t> ignored;  ///< slots of bodies that they do not see, ascending
};
using ManyRays = ManyQueries<Ray>;
using ManyShapes = ManyQueries<ShapeCast>;

/// What a query hits first.
struct BodyHit {
  static constexpr std::uint32_t nothing = 0xffffffff;
  std::uint32_t slot = nothing;  ///< the body's
  SurfaceHit hit;
};

/// Receives the hits of some of the queries, beginning with number `first`.
using TakeHits = std::function<void(std::size_t first, std::span<const BodyHit> hits)>;
/// Receives the slots of bodies that shape `number` touches, ascending.
using TakeTouched = std::function<void(std::size_t number, std::span<const std::uint32_t> slots)>;

}  // namespace fathom
