// What World's queries accept and return.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <functional>
#include <vector>

namespace fathom {

/// Which bodies a query sees: those that pass all of these.
struct QueryFilter {
  /// Bodies whose `Filter::category` has a bit in common with it.
  std::uint64_t mask = ~std::uint64_t{0};
  /// Bodies that the query does not see, usually the one that asks.
  std::vector<BodyId> ignored{};
  /// Called last, for bodies that the query has met, in no order; false continues as if the body were absent. It may
  /// read what the application has given the body (user data, shape, motion), and must not change the world.
  std::function<bool(BodyId)> accepts{};
  bool sensors = false;  ///< whether it sees sensors
  /// If not 0: only bodies whose `Filter::mask` has a bit in common with it.
  std::uint64_t category = 0;
  /// As `Filter::group`, if not 0: bodies of the same group are seen if it is positive and are not if it is negative,
  /// whatever the masks say.
  std::int32_t group = 0;
};

/// From `origin` to `origin` + `translation` (m, world).
struct Ray {
  Vec3 origin;       ///< m, world
  Vec3 translation;  ///< m; its length is the ray's
};

/// `CastHit::triangle` of a body that is not a mesh or height field.
inline constexpr std::uint32_t no_triangle = 0xffffffff;

/// Where a ray or a moving shape meets a body.
struct CastHit {
  BodyId body;                 ///< which one
  float fraction = 0;          ///< of the translation
  Vec3 point;                  ///< m, world, on the body's surface; where the cast starts inside, a point of both
  Vec3 normal;                 ///< unit, outward from the body; zero where the cast starts inside
  bool starts_inside = false;  ///< the ray's origin or the shape touches or overlaps the body at fraction 0
  std::uint32_t triangle = no_triangle;  ///< of a mesh or height field, see `Surface::triangle`
  std::uint32_t child = 0;               ///< of a compound, see `Compound::children`
};

/// Where two shapes are nearest to each other.
struct ClosestPoints {
  float distance = 0;  ///< m; 0 where they touch or overlap
  Vec3 on_a;           ///< m, world; where they touch or overlap, a point of both
  Vec3 on_b;           ///< m, world
  Vec3 normal;         ///< unit, from a to b; zero where they touch or overlap
};

}  // namespace fathom
