#include "world/shape_archive.hpp"

#include <algorithm>
#include <cstdint>

namespace fathom {

void HullArchive::write(ByteWriter& out, const Hull& hull) {
  out(hull.vertices_, hull.edges_, hull.planes_, hull.face_edges_, hull.offset_, hull.volume_, hull.unit_inertia_,
      hull.outer_radius_, hull.inner_radius_);
}

std::shared_ptr<const Hull> HullArchive::read(ByteReader& in) {
  auto hull = std::make_shared<Hull>();
  in(hull->vertices_, hull->edges_, hull->planes_, hull->face_edges_, hull->offset_, hull->volume_, hull->unit_inertia_,
     hull->outer_radius_, hull->inner_radius_);
  const std::size_t vertices = hull->vertices_.size(), edges = hull->edges_.size(), faces = hull->planes_.size();
  in.require(vertices >= 4 && faces >= 4 && hull->face_edges_.size() == faces && edges % 2 == 0);
  for (const Hull::HalfEdge& edge : hull->edges_)
    in.require(edge.next < edges && edge.origin < vertices && edge.face < faces);
  for (const std::uint16_t edge : hull->face_edges_) in.require(edge < edges);
  hull->arrange();
  return hull;
}

void ShapeWriter::write(const Shape& shape) {
  out_(shape.type, shape.radius, shape.half_extents);
  if (shape.type != ShapeType::hull) return;
  const auto known = std::find(hulls_.begin(), hulls_.end(), shape.hull.get());
  out_(static_cast<std::uint32_t>(known - hulls_.begin()));
  if (known != hulls_.end()) return;
  hulls_.push_back(shape.hull.get());
  HullArchive::write(out_, *shape.hull);
}

Shape ShapeReader::read() {
  Shape shape;
  in_(shape.type, shape.radius, shape.half_extents);
  in_.require(shape.type <= ShapeType::hull);
  if (shape.type != ShapeType::hull) return shape;
  const auto index = in_.read<std::uint32_t>();
  in_.require(index <= hulls_.size());
  if (index == hulls_.size()) hulls_.push_back(HullArchive::read(in_));
  shape.hull = hulls_[index];
  return shape;
}

namespace {

template <class T>
void write_optional(ByteWriter& out, const std::optional<T>& value) {
  out(static_cast<std::uint8_t>(value.has_value()), value.value_or(T{}));
}

template <class T>
std::optional<T> read_optional(ByteReader& in) {
  const bool there = in.read<std::uint8_t>() != 0;
  const T value = in.read<T>();
  return there ? std::optional<T>(value) : std::nullopt;
}

}  // namespace

void write_body(ByteWriter& out, ShapeWriter& shapes, const BodyDef& def) {
  out(def.motion, def.pose, def.velocity);
  shapes.write(def.shape);
  archive_material(out, def.material);
  out(def.filter);
  write_optional(out, def.mass);
  out(def.density);
  write_optional(out, def.inertia);
  out(def.gravity_scale, def.linear_damping, def.angular_damping, static_cast<std::uint8_t>(def.can_sleep),
      def.user_data);
}

BodyDef read_body(ByteReader& in, ShapeReader& shapes) {
  BodyDef def;
  in(def.motion, def.pose, def.velocity);
  in.require(def.motion <= MotionType::dynamic);
  def.shape = shapes.read();
  archive_material(in, def.material);
  in(def.filter);
  def.mass = read_optional<float>(in);
  in(def.density);
  def.inertia = read_optional<SymMat3>(in);
  in(def.gravity_scale, def.linear_damping, def.angular_damping);
  def.can_sleep = in.read<std::uint8_t>() != 0;
  in(def.user_data);
  return def;
}

}  // namespace fathom
