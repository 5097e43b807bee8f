// Compounds shared by tests.
#pragma once

#include <fathom/compound.hpp>
#include <vector>

#include "random.hpp"
#include "test_surfaces.hpp"

namespace fathom::test {

inline ChildShape child(const Shape& shape, Vec3 position, Quat rotation = {1, 0, 0, 0}) {
  ChildShape c;
  c.shape = shape;
  c.pose = {position, 0, rotation};
  return c;
}

/// A cube of 2 m as eight of 1 m.
inline Shape cube_of_cubes() {
  std::vector<ChildShape> children;
  for (int i = 0; i < 8; ++i)
    children.push_back(
        child(box({0.5f, 0.5f, 0.5f}), {i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f, i & 4 ? 0.5f : -0.5f}));
  return compound(children);
}

/// A top of 2 × 1 × 0.1 m on four legs of 0.9 m; its centre of mass is about 0.75 m above the floor.
inline Shape table() {
  std::vector<ChildShape> children{child(box({1, 0.5f, 0.05f}), {0, 0, 0.95f})};
  for (const float x : {-0.9f, 0.9f})
    for (const float y : {-0.4f, 0.4f}) children.push_back(child(box({0.05f, 0.05f, 0.45f}), {x, y, 0.45f}));
  return compound(children);
}

/// Two to six shapes of all kinds with roughly this half size, each near the previous one.
inline Shape random_compound(Generator& random, float size) {
  std::vector<ChildShape> children;
  const int count = 2 + static_cast<int>(random() % 5);
  Vec3 at;
  for (int i = 0; i < count; ++i) {
    const std::vector<Shape> shapes = shapes_of(size * uniform(random, 0.5f, 1));
    children.push_back(child(shapes[random() % shapes.size()], at, any_rotation(random)));
    at += size * uniform(random, 0.5f, 1.5f) * on_sphere(random);
  }
  return compound(children);
}

}  // namespace fathom::test
