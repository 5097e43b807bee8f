// Random bodies: the shapes, sizes and materials that heaps are made of.
#pragma once

#include <fathom/body.hpp>

#include "scene/random.hpp"

namespace fathom {

/// Uniform in its logarithm over [low, high]. Made of square roots, which are the same on every machine.
double log_uniform(Random& random, double low, double high);

/// A ball, a capsule, a box or a hull, in turn, from 0.1 to 1 m.
Shape mixed_shape(Random& random, std::int64_t number);

/// What the bodies of one heap have in common.
struct HeapRecipe {
  unsigned shapes = 15;      ///< a bit a ShapeType
  double largest = 1;        ///< m, the longest extent of the largest body
  double size_ratio = 1;     ///< largest body's extent over the smallest's
  double slenderness = 1;    ///< longest extent over the shortest, at most
  double density_ratio = 1;  ///< about 1,000 kg/m³
  double friction_low = 0, friction_high = 1;
  double restitution_high = 0;
  double damping = 0;  ///< 1/s

  static HeapRecipe make(Random& random);
  bool has(ShapeType type) const { return (shapes >> static_cast<int>(type) & 1u) != 0; }
};

/// A dynamic body at the origin, turned at random.
BodyDef random_body(Random& random, const HeapRecipe& recipe);

/// Radius (m) of the ball about the body's centre that holds its shape.
double outer_radius(const Shape& shape);

}  // namespace fathom
