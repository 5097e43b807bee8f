// Volume, centre of mass and inertia of a solid.
#pragma once

#include <utility>

#include "math/vec3d.hpp"

namespace fathom {

/// Sum of products a·bᵀ, of which only the symmetric part counts.
struct Tensor3 {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

  void add(double s, Vec3d a, Vec3d b) {
    xx += s * a.x * b.x, yy += s * a.y * b.y, zz += s * a.z * b.z;
    xy += s / 2 * (a.x * b.y + a.y * b.x), xz += s / 2 * (a.x * b.z + a.z * b.x), yz += s / 2 * (a.y * b.z + a.z * b.y);
  }
  void add(double s, const Tensor3& t) {
    xx += s * t.xx, yy += s * t.yy, zz += s * t.zz, xy += s * t.xy, xz += s * t.xz, yz += s * t.yz;
  }
};

/// Integrals of 1, x and x·xᵀ over a solid.
struct Moments {
  double volume = 0;
  Vec3d first;
  Tensor3 second;
};

/// Such integrals over a solid, summed over its parts.
class SolidIntegrals {
 public:
  /// Adds a triangle of a closed surface, counter-clockwise seen from outside: the tetrahedron that it forms with the
  /// origin (Blow, Binstock: How to find the inertia tensor of a 3D solid body, 2004). Exact wherever the origin is,
  /// and numerically precise if the surface is near it.
  void add(Vec3d a, Vec3d b, Vec3d c) {
    const double six_volumes = dot(a, cross(b, c));
    const Vec3d sum = a + b + c;
    // ∫ x·xᵀ = 6V/120 · (s·sᵀ + a·aᵀ + b·bᵀ + c·cᵀ), s the sum of the corners (the fourth is the origin).
    Moments m{six_volumes / 6, (six_volumes / 24) * sum, {}};
    for (const Vec3d v : {sum, a, b, c}) m.second.add(six_volumes / 120, v, v);
    add(m);
  }

  /// Adds the prism between a triangle, counter-clockwise seen from `up`, and the triangle shifted by that.
  void add_prism(Vec3d a, Vec3d b, Vec3d c, Vec3d up) {
    add(a + up, b + up, c + up);
    add(a, c, b);
    for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) {
      add(from, to, to + up);
      add(from, to + up, from + up);
    }
  }

  /// Adds a part.
  void add(const Moments& part) {
    sum_.volume += part.volume;
    sum_.first += part.first;
    sum_.second.add(1, part.second);
  }

  double volume() const { return sum_.volume; }
  Vec3d centre() const { return (1 / sum_.volume) * sum_.first; }

  /// Inertia about the centre of mass for unit mass.
  SymMat3 unit_inertia() const {
    const Vec3d c = centre();
    Tensor3 t;
    t.add(1 / sum_.volume, sum_.second);
    t.add(-1, c, c);
    const auto f = [](double a) { return static_cast<float>(a); };
    return {f(t.yy + t.zz), f(t.xx + t.zz), f(t.xx + t.yy), f(-t.xy), f(-t.xz), f(-t.yz)};
  }

 private:
  Moments sum_;
};

}  // namespace fathom
