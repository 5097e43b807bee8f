// Random bodies: the shapes, sizes and materials of heaps.
#pragma once

#include <fathom/body.hpp>

#include "scene/random.hpp"

namespace fathom {

/// Log-uniform over [low, high]. Computed from square roots, which are the same on every machine.
double log_uniform(Random& random, double low, double high);

/// A ball, capsule, box or hull, chosen by `number`, from 0.1 to 1 m.
Shape mixed_shape(Random& random, std::int64_t number);

/// What the bodies of a heap have in common.
struct HeapRecipe {
  unsigned shapes = 15;      ///< a bit per ShapeType
  double largest = 1;        ///< longest extent of the largest body (m)
  double size_ratio = 1;     ///< largest body's extent divided by the smallest's
  double slenderness = 1;    ///< maximum of longest extent divided by shortest
  double density_ratio = 1;  ///< around 1,000 kg/m³
  double friction_low = 0, friction_high = 1;
  double restitution_high = 0;
  double damping = 0;  ///< 1/s

  static HeapRecipe make(Random& random);
  bool has(ShapeType type) const { return (shapes >> static_cast<int>(type) & 1u) != 0; }
};

/// A dynamic body at the origin, randomly rotated.
BodyDef random_body(Random& random, const HeapRecipe& recipe);

/// Radius (m) of the ball about the body's centre that contains its shape.
double outer_radius(const Shape& shape);

}  // namespace fathom
