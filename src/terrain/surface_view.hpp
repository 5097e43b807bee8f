// Read-only view of a mesh's or a height field's arrays, wherever they live: for devices.
#pragma once

#include <fathom/mesh.hpp>

#include "geometry/support.hpp"
#include "math/team.hpp"

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
  const Material* materials = nullptr;   ///< null: all triangles have the body's
  const std::uint8_t* material_numbers = nullptr;
  std::uint32_t material_count = 0;

  /// Which of `materials` a triangle has; 0 if there are none.
  FATHOM_HD std::uint8_t material_of(std::uint32_t number) const {
    return materials ? material_numbers[heights ? number / 2 : number] : std::uint8_t{0};
  }

  /// Whether a cell of a height field has no ground.
  FATHOM_HD bool is_hole(std::uint32_t cell) const { return holes && (holes[cell / 64] >> cell % 64 & 1) != 0; }

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
  FATHOM_HD bool any_in(const Aabb& box, const Act& act) const;
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
};

/// Finds the triangles whose bounds meet a box, one after the other: in a loop, what is done with them is compiled once
/// for both kinds of surfaces.
class TriangleSearch {
 public:
  FATHOM_HD TriangleSearch(const SurfaceView& surface, const Aabb& box) : surface_(surface), box_(box) {
    if (!surface.heights) return;
    node_ = overlaps(box, surface.bounds) ? 0 : none;
    first_i_ = first_cell(box.lower.x, surface.cell_x, surface.columns);
    last_i_ = last_cell(box.upper.x, surface.cell_x, surface.columns);
    last_j_ = last_cell(box.upper.y, surface.cell_y, surface.rows);
    i_ = first_i_, j_ = first_cell(box.lower.y, surface.cell_y, surface.rows);
  }

  /// Sets the number of the next triangle; false: there is none.
  FATHOM_HD bool next(std::uint32_t& number) {
    for (;;) {
      while (triangle_ < end_) {
        number = triangle_++;
        const Triangle t = surface_.triangle(number);
        const Aabb bounds{min(t.corners[0], min(t.corners[1], t.corners[2])),
                          max(t.corners[0], max(t.corners[1], t.corners[2]))};
        if (overlaps(bounds, box_)) return true;
      }
      if (!(surface_.heights ? next_cell() : next_leaf())) return false;
    }
  }

 private:
  static constexpr std::uint32_t none = 0xffffffff;
  static constexpr int deepest = 64;  // each node halves its triangles

  FATHOM_HD bool next_leaf() {
    while (node_ != none) {
      const BoxTreeNode n = surface_.nodes[node_];
      const bool meets = overlaps(Aabb{n.lower, n.upper}, box_);
      if (meets && n.count == 0) {
        waiting_[count_++] = n.next;
        ++node_;
        continue;
      }
      node_ = count_ > 0 ? waiting_[--count_] : none;
      if (!meets) continue;
      triangle_ = n.next, end_ = n.next + n.count;
      return true;
    }
    return false;
  }
  FATHOM_HD bool next_cell() {
    while (node_ != none && j_ <= last_j_) {
      const std::uint32_t cell = j_ * (surface_.columns - 1) + i_;
      if (i_++ == last_i_) i_ = first_i_, ++j_;
      if (surface_.is_hole(cell)) continue;
      triangle_ = 2 * cell, end_ = triangle_ + 2;
      return true;
    }
    return false;
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

  const SurfaceView& surface_;
  Aabb box_;
  std::uint32_t triangle_ = 0, end_ = 0;  // those left of a leaf or a cell
  std::uint32_t node_ = 0;                // `none`: the search is over
  std::uint32_t waiting_[deepest];        // second children on a mesh
  int count_ = 0;
  std::uint32_t i_ = 0, j_ = 0, first_i_ = 0, last_i_ = 0, last_j_ = 0;  // cells of a field
};

/// Calls act(number) for the triangles whose bounds meet the box, each by one work-item of a team, and done(count)
/// after each round of `count` of them, by all: work-item k has had the k-th of the round.
template <class Act, class Done>
FATHOM_HD void for_each_by_team(const SurfaceView& surface, const Aabb& box, const Act& act, const Done& done) {
  TriangleSearch search(surface, box);
  for (bool any_left = true; any_left;) {
    std::uint32_t count = 0, mine = 0;
    for (std::uint32_t number; count < team::items && (any_left = search.next(number)); ++count)
      if (count == team::item()) mine = number;
    if (team::item() < count) act(mine);
    team::sync();
    done(count);
    team::sync();
  }
}

template <class Act>
FATHOM_HD bool SurfaceView::any_in(const Aabb& box, const Act& act) const {
  TriangleSearch search(*this, box);
  for (std::uint32_t number; search.next(number);)
    if (act(number)) return true;
  return false;
}

}  // namespace fathom
