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
      const CellCorners at = cell_corners(number);
      for (int k = 0; k < 3; ++k) t.vertices[k] = at.j[k] * columns + at.i[k], t.corners[k] = sample(at.i[k], at.j[k]);
    } else {
      for (std::uint32_t k = 0; k < 3; ++k) t.vertices[k] = indices[3 * std::size_t{number} + k];
      for (int k = 0; k < 3; ++k) t.corners[k] = vertices[t.vertices[k]];
    }
    return t;
  }
  /// The names of a triangle's vertices.
  FATHOM_HD void name_vertices(std::uint32_t number, std::uint32_t (&names)[3]) const {
    if (heights) {
      const CellCorners at = cell_corners(number);
      for (int k = 0; k < 3; ++k) names[k] = at.j[k] * columns + at.i[k];
    } else {
      for (std::uint32_t k = 0; k < 3; ++k) names[k] = indices[3 * std::size_t{number} + k];
    }
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
  /// Whether act(number) is true for any triangle that has the vertex with this name, or for some others around it.
  template <class Act>
  FATHOM_HD bool any_around(std::uint32_t name, const Act& act) const;

 private:
  /// Samples of a triangle of a height field.
  struct CellCorners {
    std::uint32_t i[3], j[3];
  };
  FATHOM_HD CellCorners cell_corners(std::uint32_t number) const {
    const std::uint32_t cell = number / 2, j = cell / (columns - 1), i = cell - j * (columns - 1);
    const bool second = number % 2 != 0;
    return {{i, i + 1, second ? i : i + 1}, {j, second ? j + 1 : j, j + 1}};
  }
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
    j_ = first_cell(box.lower.y, surface.cell_y, surface.rows);
    last_j_ = last_cell(box.upper.y, surface.cell_y, surface.rows);
  }
  /// Finds all triangles that have the vertex, and others around it.
  FATHOM_HD TriangleSearch(const SurfaceView& surface, std::uint32_t vertex) : surface_(surface) {
    const Vec3 at = surface.vertex(vertex);
    box_ = {at, at};
    if (!surface.heights) return;
    has_all_ = true;
    const std::uint32_t j = vertex / surface.columns, i = vertex - j * surface.columns;
    first_i_ = i > 0 ? i - 1 : 0, last_i_ = i < surface.columns - 1 ? i : i - 1;
    j_ = j > 0 ? j - 1 : 0, last_j_ = j < surface.rows - 1 ? j : j - 1;
  }

  /// Sets the number of the next triangle; false: there is none.
  FATHOM_HD bool next(std::uint32_t& number) {
    while (has_more()) {
      number = triangle_++;
      if (meets(number)) return true;
    }
    return false;
  }
  /// For a whole team, whose work-items look at one triangle each: sets the number of this work-item's, and a bit for
  /// each that was found, in order. False: there are no more triangles.
  FATHOM_HD bool next_of_team(std::uint32_t& number, unsigned& found) {
    if (!has_more()) return false;
    number = triangle_ + team::item();
    triangle_ += team::items;
    found = team::ballot(number < end_ && meets(number));
    return true;
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
  FATHOM_HD bool next_row() {
    if (node_ == none || j_ > last_j_) return false;
    const std::uint32_t first = j_++ * (surface_.columns - 1);
    triangle_ = 2 * (first + first_i_), end_ = 2 * (first + last_i_ + 1);
    return true;
  }
  FATHOM_HD bool has_more() {
    while (triangle_ >= end_)
      if (!(surface_.heights ? next_row() : next_leaf())) return false;
    return true;
  }
  FATHOM_HD bool meets(std::uint32_t number) const {
    if (surface_.heights && surface_.is_hole(number / 2)) return false;
    if (has_all_) return true;
    const Triangle t = surface_.triangle(number);
    const Aabb bounds{min(t.corners[0], min(t.corners[1], t.corners[2])),
                      max(t.corners[0], max(t.corners[1], t.corners[2]))};
    return overlaps(bounds, box_);
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
  bool has_all_ = false;                  // of a field: all triangles of the cells
  std::uint32_t triangle_ = 0, end_ = 0;  // those left of a leaf or a row of cells
  std::uint32_t node_ = 0;                // `none`: the search is over
  std::uint32_t waiting_[deepest];        // second children on a mesh
  int count_ = 0;
  std::uint32_t first_i_ = 0, last_i_ = 0, j_ = 0, last_j_ = 0;  // cells of a field
};

/// Calls act(number) for the triangles whose bounds meet the box, each by one work-item of a team, and done(count)
/// after each round of `count` of them, by all: work-item k has had the k-th of the round.
template <class Act, class Done>
FATHOM_HD void for_each_by_team(const SurfaceView& surface, const Aabb& box, const Act& act, const Done& done) {
  TriangleSearch search(surface, box);
  std::uint32_t mine = 0, waiting = 0;  // work-item k has the k-th of those that wait to be visited
  for (bool any_left = true; any_left;) {
    std::uint32_t number = 0;
    unsigned found = 0;
    any_left = search.next_of_team(number, found);
    const std::uint32_t item = team::item(), all = waiting + team::count_of(found),
                        count = all < team::items ? all : team::items;
    const bool is_free = item >= waiting;
    const std::uint32_t next = team::from_item(number, team::nth(found, is_free ? item - waiting : 0));
    if (is_free) mine = next;
    if ((count == team::items || !any_left) && count > 0) {
      if (item < count) act(mine);
      team::sync();
      done(count);
      team::sync();
      mine = team::from_item(number, team::nth(found, item + count - waiting));
      waiting = all - count;
    } else {
      waiting = all;
    }
  }
}

template <class Act>
FATHOM_HD bool SurfaceView::any_in(const Aabb& box, const Act& act) const {
  TriangleSearch search(*this, box);
  for (std::uint32_t number; search.next(number);)
    if (act(number)) return true;
  return false;
}
template <class Act>
FATHOM_HD bool SurfaceView::any_around(std::uint32_t name, const Act& act) const {
  TriangleSearch search(*this, name);
  for (std::uint32_t number; search.next(number);)
    if (act(number)) return true;
  return false;
}

}  // namespace fathom
