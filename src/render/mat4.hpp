// Column-major 4×4 matrices, as OpenGL expects. Depth is reversed: 1 at the near plane, 0 at infinity, which puts
// float's precision where it is needed (Reed, "Depth precision visualized", 2015).
#pragma once

#include <fathom/math.hpp>

namespace fathom::render {

struct Vec4 {
  float x = 0, y = 0, z = 0, w = 0;
};

struct Mat4 {
  Vec4 columns[4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
};

inline Vec4 operator*(const Mat4& m, Vec4 v) {
  const auto& c = m.columns;
  return {c[0].x * v.x + c[1].x * v.y + c[2].x * v.z + c[3].x * v.w,
          c[0].y * v.x + c[1].y * v.y + c[2].y * v.z + c[3].y * v.w,
          c[0].z * v.x + c[1].z * v.y + c[2].z * v.z + c[3].z * v.w,
          c[0].w * v.x + c[1].w * v.y + c[2].w * v.z + c[3].w * v.w};
}

inline Mat4 operator*(const Mat4& a, const Mat4& b) {
  return {{a * b.columns[0], a * b.columns[1], a * b.columns[2], a * b.columns[3]}};
}

/// World to view: x right, y up, −z ahead. `right` and `up` are unit vectors perpendicular to `back`.
inline Mat4 view_matrix(Vec3 eye, Vec3 right, Vec3 up, Vec3 back) {
  return {{{right.x, up.x, back.x, 0},
           {right.y, up.y, back.y, 0},
           {right.z, up.z, back.z, 0},
           {-dot(right, eye), -dot(up, eye), -dot(back, eye), 1}}};
}

/// View to clip space with clip depth in [0, 1], reversed, no far plane. `scale` is 1 / tan(field of view / 2).
inline Mat4 perspective_matrix(float scale, float aspect, float near) {
  return {{{scale / aspect, 0, 0, 0}, {0, scale, 0, 0}, {0, 0, 0, -1}, {0, 0, near, 0}}};
}

/// A box in view space to clip space, depth reversed: 1 at its upper z (nearest), 0 at its lower.
inline Mat4 orthographic_matrix(const Aabb& box) {
  const Vec3 size = box.upper - box.lower, sum = box.upper + box.lower;
  return {{{2 / size.x, 0, 0, 0},
           {0, 2 / size.y, 0, 0},
           {0, 0, 1 / size.z, 0},
           {-sum.x / size.x, -sum.y / size.y, -box.lower.z / size.z, 1}}};
}

}  // namespace fathom::render
