#include "terrain/turned_shape.hpp"

#include "collision/collide.hpp"
#include "collision/hull_axes.hpp"

namespace fathom {

void TurnedShape::turn(const Geometry& shape, Quat rotation) {
  rotation_ = rotation;
  round_ = {{}, 0};
  vertices_.clear(), planes_.clear(), edges_.clear();
  if (fathom::is_round(shape)) {
    round_ = transform({{}, 0, rotation}, round_shape(shape));
    inner_ = round_.radius;
    outer_ = max_component(abs(round_.core.from)) + round_.radius;
    return;
  }
  if (shape.type == ShapeType::box) box_ = BoxHull(shape.half_extents);
  hull_ = shape.type == ShapeType::box ? fathom::view(box_) : shape.hull;
  const HullSize size = size_of(hull_);
  inner_ = size.inner, outer_ = size.outer + hull_.radius;
  hull_.inner = inner_, hull_.outer = outer_;
  const Mat3 turn = to_matrix(rotation);
  vertices_.reserve(static_cast<std::size_t>(hull_.vertex_count));
  planes_.reserve(static_cast<std::size_t>(hull_.face_count));
  for (int i = 0; i < hull_.vertex_count; ++i) vertices_.push_back(turn * hull_.vertices[i]);
  for (int i = 0; i < hull_.face_count; ++i) planes_.push_back({turn * hull_.planes[i].normal, hull_.planes[i].offset});
  turned_ = hull_;
  turned_.vertices = vertices_.data(), turned_.planes = planes_.data();
  turned_.vertex_eights = turned_.plane_eights = nullptr;
}

const EdgeArc& TurnedShape::edge(int i) const {
  if (edges_.empty())
    for (int e = 0; e < edge_count(); ++e) edges_.push_back(edge_arc(turned_, e));
  return edges_[static_cast<std::size_t>(i)];
}

}  // namespace fathom
