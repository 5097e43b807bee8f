// What World's queries accept and return.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <functional>
#include <vector>

namespace fathom {

/// Which bodies a query sees: those that pass every criterion.
struct QueryFilter {
  /// Only bodies whose `Filter::category` shares a bit with it.
  std::uint64_t mask = ~std::uint64_t{0};
  /// Bodies that the query ignores, usually the caller's own.
  std::vector<BodyId> ignored{};
  /// Called last, in no particular order, for bodies that the query has found; false skips the body. It may read what
  /// the application set on the body (user data, shape, motion), but must not change the world.
  std::function<bool(BodyId)> accepts{};
  bool sensors = false;  ///< whether it sees sensors
  /// If not 0: only bodies whose `Filter::mask` shares a bit with it.
  std::uint64_t category = 0;
  /// As `Filter::group`, if not 0: bodies of the same group are seen if it is positive and not seen if it is negative,
  /// whatever the masks.
  std::int32_t group = 0;
};

/// From `origin` to `origin` + `translation` (m, world).
struct Ray {
  Vec3 origin;       ///< m, world
  Vec3 translation;  ///< m; its length is that of the ray
};

/// A convex shape somewhere, and where it goes; one shape may serve many.
struct ShapeCast {
  const Shape* shape = nullptr;  ///< not null
  Pose pose;                     ///< m, world; where it is, or begins
  Vec3 translation;              ///< m; ignored by `World::overlap_shapes`
};

/// `CastHit::triangle` if the body is neither a mesh nor a height field.
inline constexpr std::uint32_t no_triangle = 0xffffffff;

/// Where a ray or a moving shape meets a body.
struct CastHit {
  BodyId body;                 ///< which one
  float fraction = 0;          ///< of the translation
  Vec3 point;                  ///< m, world, on the body's surface; if the cast starts inside, a common point of both
  Vec3 normal;                 ///< unit, outward from the body; zero if the cast starts inside
  bool starts_inside = false;  ///< the ray's origin or the shape touches or overlaps the body at fraction 0
  std::uint32_t triangle = no_triangle;  ///< of a mesh or height field, see `Surface::triangle`
  std::uint32_t child = 0;               ///< of a compound, see `Compound::children`
};

/// Where two shapes are closest to each other.
struct ClosestPoints {
  float distance = 0;  ///< m; 0 where they touch or overlap
  Vec3 on_a;           ///< m, world; a common point of both if they touch or overlap
  Vec3 on_b;           ///< m, world
  Vec3 normal;         ///< unit, from a to b; zero if they touch or overlap
};

}  // namespace fathom
