// Compiled by tests/headers: names of both namespaces side by side, as in a program that opens both.
#include <algorithm>
#include <cmath>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <fathom/version.hpp>
#include <fathom/world.hpp>
#include <functional>
#include <memory>
#include <numeric>
#include <variant>
#include <vector>

using namespace std;
using namespace fathom;

float numbers(float a) {
  return abs(a) + sqrt(a) + fma(a, a, 1.0f) + min(a, 1.0f) + max(a, 0.0f) + clamp(a, 0.0f, 1.0f) +
         static_cast<float>(abs(-2) + min(1, 2) + max(1, 2)) + pi;
}

float vectors(Vec3 v) {
  const Vec3 w = min(abs(v), max(v, -v)) + cross(v, v);
  return dot(v, w) + length(v) + distance(v, w) + length(normalize(v)) + (is_finite(v) && isfinite(v.x) ? 1.0f : 0.0f);
}

World things(const Filter& filter) {
  vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  WorldDef def;
  apply(Preset::dissertation, def);
  World world(def);
  BodyDef body{.shape = hull(points)};
  body.filter = filter;
  const BodyId id = world.add(body);
  const vector<Shape> shapes{box({1, 1, 1}), sphere(1), capsule(1, 1), compound(vector<ChildShape>(2))};
  for_each(shapes.begin(), shapes.end(), [&](const Shape& shape) { world.set_shape(id, shape); });
  function<bool(BodyId)> accepts = [](BodyId) { return true; };
  QueryFilter query;
  query.accepts = std::move(accepts);
  return world;
}
