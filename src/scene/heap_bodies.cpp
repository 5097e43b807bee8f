#include "scene/heap_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <vector>

#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

// Smallest extent (m): gravity alone moves a body farther in a substep of 1/60 s.
constexpr double thinnest = 0.001;

template <std::size_t n>
double one_of(Random& random, const double (&values)[n]) {
  return values[random.bits() % n];
}

bool chance(Random& random, double probability) { return random.unit() < probability; }

/// Half extents of a body `size` long: a rod, a plate or something in between.
Vec3 half_extents(Random& random, double size, double slenderness) {
  const double most = std::max(1.0, std::min(slenderness, size / thinnest));
  const double thin = size / log_uniform(random, 1, most);
  double middle = thin;  // a rod
  const double kind = random.unit();
  if (kind < 0.35)
    middle = size;  // a plate
  else if (kind < 0.65)
    middle = log_uniform(random, thin, size);
  return {static_cast<float>(0.5 * size), static_cast<float>(0.5 * middle), static_cast<float>(0.5 * thin)};
}

/// The hull of points on an ellipsoid; a box if it is too thin.
Shape random_hull(Random& random, Vec3 half) {
  const int count = 6 + static_cast<int>(random.bits() % 19);
  std::vector<Vec3> points;
  while (static_cast<int>(points.size()) < count) {
    const double x = random.symmetric(1), y = random.symmetric(1), z = random.symmetric(1);
    const double square = x * x + y * y + z * z;
    if (square > 1 || square < 0.01) continue;
    const double scale = 1 / std::sqrt(square);
    points.push_back({half.x * static_cast<float>(scale * x), half.y * static_cast<float>(scale * y),
                      half.z * static_cast<float>(scale * z)});
  }
  const Shape shape = hull(points);
  // Six points may span a sliver, thinner than the recipe's slenderness.
  return shape.hull->inner_radius() < 0.2f * half.z ? box(half) : shape;
}

Shape random_shape(Random& random, const HeapRecipe& recipe) {
  ShapeType type;
  do type = static_cast<ShapeType>(random.bits() % 4);
  while (!recipe.has(type));
  const double size = log_uniform(random, recipe.largest / recipe.size_ratio, recipe.largest);
  const Vec3 half = half_extents(random, size, recipe.slenderness);
  switch (type) {
    case ShapeType::sphere:
      return sphere(half.x);
    case ShapeType::capsule:
      return capsule(half.z, half.x - half.z);
    case ShapeType::box:
      return box(half);
    case ShapeType::hull:
    case ShapeType::compound:
    case ShapeType::mesh:
    case ShapeType::height_field:
      break;
  }
  return random_hull(random, half);
}

}  // namespace

double log_uniform(Random& random, double low, double high) {
  // low · (high / low)^u, drawing the binary digits of u one by one.
  double value = low, root = high / low;
  for (std::uint64_t digits = random.bits() >> 40, i = 0; i < 24; ++i, digits >>= 1) {
    root = std::sqrt(root);
    if (digits & 1) value *= root;
  }
  return value;
}

HeapRecipe HeapRecipe::make(Random& random) {
  HeapRecipe recipe;
  do recipe.shapes = random.bits() % 16;
  while (recipe.shapes == 0);
  recipe.size_ratio = one_of(random, {1, 3, 10, 30});
  recipe.largest = log_uniform(random, 0.005 * recipe.size_ratio, 50);
  recipe.slenderness = one_of(random, {1.5, 4, 10, 50, 100});
  recipe.density_ratio = one_of(random, {1, 1, 10, 100});
  if (const double kind = random.unit(); kind < 0.1)
    recipe.friction_high = 0;
  else if (kind < 0.5)
    recipe.friction_low = recipe.friction_high = random.unit();
  recipe.restitution_high = chance(random, 0.5) ? 0 : 0.9 * random.unit();
  // Bodies that roll or slide freely come to rest only by air drag.
  const bool has_round = recipe.has(ShapeType::sphere) || recipe.has(ShapeType::capsule);
  if (has_round || recipe.friction_high < 0.2) recipe.damping = 1;
  return recipe;
}

BodyDef random_body(Random& random, const HeapRecipe& recipe) {
  BodyDef body;
  body.shape = random_shape(random, recipe);
  body.pose.rotation = random_rotation(random);
  const double spread = std::sqrt(recipe.density_ratio);
  body.density = static_cast<float>(log_uniform(random, 1000 / spread, 1000 * spread));
  const double friction = recipe.friction_low + (recipe.friction_high - recipe.friction_low) * random.unit();
  body.material = {static_cast<float>(friction), static_cast<float>(recipe.restitution_high * random.unit())};
  body.linear_damping = body.angular_damping = static_cast<float>(recipe.damping);
  return body;
}

double outer_radius(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::sphere:
      return static_cast<double>(shape.radius);
    case ShapeType::capsule:
      return static_cast<double>(shape.half_extents.z + shape.radius);
    case ShapeType::box:
      return static_cast<double>(length(shape.half_extents));
    case ShapeType::mesh:
    case ShapeType::height_field: {
      const Aabb& box = shape.surface->bounds();
      return static_cast<double>(length(max(abs(box.lower), abs(box.upper))));
    }
    case ShapeType::compound:
      return static_cast<double>(shape.compound->outer_radius());
    case ShapeType::hull:
      break;
  }
  return static_cast<double>(shape.hull->outer_radius());
}

}  // namespace fathom
