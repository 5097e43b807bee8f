// Questions about where bodies are: what World's queries take and give.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <functional>
#include <vector>

namespace fathom {

/// Which bodies a query looks at: those that pass all of it.
struct QueryFilter {
  /// Bodies whose `Filter::category` has a bit in common with it.
  std::uint64_t mask = ~std::uint64_t{0};
  /// Bodies that are not there for the query: mostly the one that asks.
  std::vector<BodyId> ignored{};
  /// Asked last, of bodies that the query has met, in no order; false goes on as if the body were not there. It may
  /// read what the application has given the body (user data, shape, motion), and must not change the world.
  std::function<bool(BodyId)> accepts{};
  bool sensors = false;  ///< sensors are there, too
  /// Where it is not 0, bodies whose `Filter::mask` has a bit in common with it alone.
  std::uint64_t category = 0;
  /// As `Filter::group`: where it is not 0, bodies of the same group are there if it is positive and are not if it is
  /// negative, whatever the masks.
  std::int32_t group = 0;
};

/// From `origin` to `origin` + `translation` (m, world).
struct Ray {
  Vec3 origin;
  Vec3 translation;
};

/// The triangle of a body that is no mesh or height field.
inline constexpr std::uint32_t no_triangle = 0xffffffff;

/// Where a ray or a moving shape meets a body.
struct CastHit {
  BodyId body;
  float fraction = 0;          ///< of the translation
  Vec3 point;                  ///< m, world, on the body's surface; where the way begins inside, a point that both have
  Vec3 normal;                 ///< unit, outward from the body; zero where the way begins inside
  bool starts_inside = false;  ///< the ray's origin or the shape touches or overlaps the body at fraction 0
  std::uint32_t triangle = no_triangle;  ///< of a mesh or height field, see `Surface::triangle`
  std::uint32_t child = 0;               ///< of a compound, see `Compound::children`
};

/// Where two shapes are nearest to each other.
struct ClosestPoints {
  float distance = 0;  ///< m; 0 where they touch or overlap
  Vec3 on_a, on_b;     ///< m, world; where they touch or overlap, twice a point that both have
  Vec3 normal;         ///< unit, from a to b; zero where they touch or overlap
};

}  // namespace fathom
