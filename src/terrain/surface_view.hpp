// Read-only view of a mesh's or a height field's arrays, wherever they live: for devices.
#pragma once

#include <fathom/mesh.hpp>

#include "geometry/support.hpp"

namespace fathom {

struct SurfaceView {
  Aabb bounds;  ///< of all triangles (m)
  // A mesh.
  const Vec3* vertices = nullptr;
  const std::uint32_t* indices = nullptr;
  const BoxTreeNode* nodes = nullptr;
  // A height field.
  const float* heights = nullptr;
  const std::uint64_t* holes = nullptr;  ///< a bit per cell; null: none
  std::uint32_t columns = 0, rows = 0;   ///< samples
  float cell_x = 1, cell_y = 1;          ///< m

  /// Position of the vertex that has this name in triangles.
  FATHOM_HD Vec3 vertex(std::uint32_t name) const {
    return heights ? sample(name % columns, name / columns) : vertices[name];
  }

  FATHOM_HD Triangle triangle(std::uint32_t number) const {
    Triangle t;
    if (heights) {
      const std::uint32_t cell = number / 2, i = cell % (columns - 1), j = cell / (columns - 1);
      const bool second = number % 2 != 0;
      const std::uint32_t at_i[] = {i, i + 1, second ? i : i + 1}, at_j[] = {j, second ? j + 1 : j, j + 1};
      for (int k = 0; k < 3; ++k) t.vertices[k] = at_j[k] * columns + at_i[k];
    } else {
      for (std::uint32_t k = 0; k < 3; ++k) t.vertices[k] = indices[3 * std::size_t{number} + k];
    }
    for (int k = 0; k < 3; ++k) t.corners[k] = vertex(t.vertices[k]);
    return t;
  }

  /// Whether act(number) is true for any triangle whose bounds meet `box` (m, the surface's frame).
  template <class Act>
  FATHOM_HD bool any_in(const Aabb& box, const Act& act) const {
    return heights ? any_of_field(box, act) : any_of_mesh(box, act);
  }
  template <class Act>
  FATHOM_HD void for_each_in(const Aabb& box, const Act& act) const {
    any_in(box, [&](std::uint32_t number) {
      act(number);
      return false;
    });
  }

 private:
  FATHOM_HD Vec3 sample(std::uint32_t i, std::uint32_t j) const {
    return {static_cast<float>(i) * cell_x, static_cast<float>(j) * cell_y, heights[std::size_t{j} * columns + i]};
  }
  FATHOM_HD static Aabb box_of(const Triangle& t) {
    return {min(t.corners[0], min(t.corners[1], t.corners[2])), max(t.corners[0], max(t.corners[1], t.corners[2]))};
  }

  template <class Act>
  FATHOM_HD bool any_of_mesh(const Aabb& box, const Act& act) const {
    constexpr int deepest = 64;  // each node halves its triangles
    std::uint32_t waiting[deepest];
    int count = 0;
    std::uint32_t node = 0;
    for (;;) {
      const BoxTreeNode n = nodes[node];
      if (overlaps(Aabb{n.lower, n.upper}, box)) {
        if (n.count == 0) {
          waiting[count++] = n.next;
          ++node;
          continue;
        }
        for (std::uint32_t i = n.next; i < n.next + n.count; ++i)
          if (overlaps(box_of(triangle(i)), box) && act(i)) return true;
      }
      if (count == 0) return false;
      node = waiting[--count];
    }
  }

  // One more cell on each side, because the quotient is rounded.
  FATHOM_HD static std::uint32_t first_cell(float x, float size, std::uint32_t samples) {
    const std::uint32_t i = cell_at(x, size, samples);
    return i > 0 ? i - 1 : 0;
  }
  FATHOM_HD static std::uint32_t last_cell(float x, float size, std::uint32_t samples) {
    const std::uint32_t i = cell_at(x, size, samples) + 1;
    return i < samples - 2 ? i : samples - 2;
  }
  FATHOM_HD static std::uint32_t cell_at(float x, float size, std::uint32_t samples) {
    return static_cast<std::uint32_t>(clamp(x / size, 0.0f, static_cast<float>(samples - 2)));
  }
  template <class Act>
  FATHOM_HD bool any_of_field(const Aabb& box, const Act& act) const {
    if (!overlaps(box, bounds)) return false;
    const std::uint32_t first_i = first_cell(box.lower.x, cell_x, columns);
    const std::uint32_t last_i = last_cell(box.upper.x, cell_x, columns);
    const std::uint32_t last_j = last_cell(box.upper.y, cell_y, rows);
    for (std::uint32_t j = first_cell(box.lower.y, cell_y, rows); j <= last_j; ++j)
      for (std::uint32_t i = first_i; i <= last_i; ++i) {
        const std::uint32_t cell = j * (columns - 1) + i;
        if (holes && (holes[cell / 64] >> cell % 64 & 1) != 0) continue;
        for (std::uint32_t number = 2 * cell; number < 2 * cell + 2; ++number)
          if (overlaps(box_of(triangle(number)), box) && act(number)) return true;
      }
    return false;
  }
};

}  // namespace fathom
