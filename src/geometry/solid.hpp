// Volume, centre of mass and inertia of a solid polyhedron.
#pragma once

#include <array>

#include "math/vec3d.hpp"

namespace fathom {

/// Integrals of 1, x and x·xᵀ over a solid bounded by triangles, summed over the tetrahedra that the triangles form
/// with the origin (Blow, Binstock: How to find the inertia tensor of a 3D solid body, 2004). Exact for any closed
/// surface, and numerically precise if the origin is near it.
class SolidIntegrals {
 public:
  /// Adds a triangle, counter-clockwise seen from outside.
  void add(Vec3d a, Vec3d b, Vec3d c) {
    const double six_volumes = dot(a, cross(b, c));
    const Vec3d sum = a + b + c;
    volume_ += six_volumes / 6;
    first_ += (six_volumes / 24) * sum;
    // ∫ x·xᵀ = 6V/120 · (s·sᵀ + a·aᵀ + b·bᵀ + c·cᵀ), s the sum of the corners (the fourth is the origin).
    const auto moment = [&](double Vec3d::*u, double Vec3d::*v) {
      return six_volumes / 120 * (sum.*u * sum.*v + a.*u * a.*v + b.*u * b.*v + c.*u * c.*v);
    };
    constexpr auto x = &Vec3d::x, y = &Vec3d::y, z = &Vec3d::z;
    const std::array added{moment(x, x), moment(y, y), moment(z, z), moment(x, y), moment(x, z), moment(y, z)};
    for (std::size_t i = 0; i < 6; ++i) second_[i] += added[i];
  }

  double volume() const { return volume_; }
  Vec3d centre() const { return (1 / volume_) * first_; }

  /// Inertia about the centre of mass for unit mass.
  SymMat3 unit_inertia() const {
    const Vec3d c = centre();
    const auto central = [&](std::size_t i, double shift) { return second_[i] / volume_ - shift; };
    const double xx = central(0, c.x * c.x), yy = central(1, c.y * c.y), zz = central(2, c.z * c.z);
    const double xy = central(3, c.x * c.y), xz = central(4, c.x * c.z), yz = central(5, c.y * c.z);
    const auto f = [](double a) { return static_cast<float>(a); };
    return {f(yy + zz), f(xx + zz), f(xx + yy), f(-xy), f(-xz), f(-yz)};
  }

 private:
  double volume_ = 0;
  Vec3d first_;
  std::array<double, 6> second_{};  // xx, yy, zz, xy, xz, yz
};

}  // namespace fathom
