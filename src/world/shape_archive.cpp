#include "world/shape_archive.hpp"

#include <algorithm>
#include <cstdint>

#include "geometry/compound_builder.hpp"
#include "math/vec3d.hpp"
#include "world/validate.hpp"

namespace fathom {
namespace {

// The limits of fathom::mesh and fathom::height_field.
constexpr float farthest = 1e6f;  // m
constexpr std::uint64_t max_elements = 1u << 30;

Aabb bounds_of(const Triangle& t) {
  return {min(t.corners[0], min(t.corners[1], t.corners[2])), max(t.corners[0], max(t.corners[1], t.corners[2]))};
}

/// Refuses a material that no body could have.
void read_material(ByteReader& in, Material& material) {
  archive_material(in, material);
  in.require_valid([&] { check_material(material, "material"); });
}

bool is_positive(float value) { return value > 0 && is_finite(value); }

}  // namespace

void HullArchive::write(ByteWriter& out, const Hull& hull) {
  out(hull.vertices_, hull.edges_, hull.planes_, hull.face_edges_, hull.radius_, hull.offset_, hull.volume_,
      hull.unit_inertia_, hull.outer_radius_, hull.inner_radius_);
}

std::shared_ptr<const Hull> HullArchive::read(ByteReader& in) {
  auto hull = std::make_shared<Hull>();
  in(hull->vertices_, hull->edges_, hull->planes_, hull->face_edges_, hull->radius_, hull->offset_, hull->volume_,
     hull->unit_inertia_, hull->outer_radius_, hull->inner_radius_);
  check_sizes(in, *hull);
  check_edges(in, *hull);
  hull->arrange();
  return hull;
}

void HullArchive::check_sizes(ByteReader& in, const Hull& hull) {
  in.require(hull.radius_ >= 0 && is_finite(hull.radius_) && is_finite(hull.offset_));
  for (const float size : {hull.volume_, hull.outer_radius_, hull.inner_radius_}) in.require(is_positive(size));
  for (const Vec3 v : hull.vertices_) in.require(is_finite(v));
  for (const Hull::Plane& plane : hull.planes_)
    in.require(abs(length_squared(plane.normal) - 1) < 1e-3f && is_finite(plane.offset));
}

/// Walks along edges must end: around a face and around a vertex they come back to where they began. They do if every
/// edge follows one other, of the same face, and starts where that one's twin does.
void HullArchive::check_edges(ByteReader& in, const Hull& hull) {
  const std::size_t vertices = hull.vertices_.size(), edges = hull.edges_.size(), faces = hull.planes_.size();
  in.require(vertices >= 4 && faces >= 4 && hull.face_edges_.size() == faces && edges % 2 == 0);
  std::vector<bool> follows(edges), has_edge(vertices);
  for (std::size_t e = 0; e < edges; ++e) {
    const Hull::HalfEdge& edge = hull.edges_[e];
    in.require(edge.next < edges && edge.origin < vertices && edge.face < faces && !follows[edge.next]);
    const Hull::HalfEdge& next = hull.edges_[edge.next];
    in.require(next.face == edge.face && next.origin == hull.edges_[e ^ 1].origin);
    follows[edge.next] = has_edge[edge.origin] = true;
  }
  for (std::size_t v = 0; v < vertices; ++v) in.require(has_edge[v]);
  for (std::size_t f = 0; f < faces; ++f)
    in.require(hull.face_edges_[f] < edges && hull.edges_[hull.face_edges_[f]].face == f);
}

void SurfaceArchive::write(ByteWriter& out, ShapeType type, const Surface& surface) {
  if (type == ShapeType::mesh) {
    const auto& mesh = static_cast<const TriangleMesh&>(surface);
    out(mesh.vertices_, mesh.indices_, mesh.nodes_);
  } else {
    const auto& field = static_cast<const HeightField&>(surface);
    out(field.columns_, field.rows_, field.cell_x_, field.cell_y_, field.heights_, field.holes_);
  }
  out(static_cast<std::uint32_t>(surface.materials_.size()), surface.material_numbers_);
  for (const Material& material : surface.materials_) archive_material(out, material);
}

void SurfaceArchive::read_materials(ByteReader& in, Surface& surface) {
  std::uint32_t count = 0;
  in(count, surface.material_numbers_);
  in.require(count <= 256);
  surface.materials_.resize(count);
  for (Material& material : surface.materials_) read_material(in, material);
  const std::size_t numbers = count == 0 ? 0 : surface.triangle_count() / surface.triangles_per_number_;
  in.require(surface.material_numbers_.size() == numbers);
  for (const std::uint8_t number : surface.material_numbers_) in.require(number < count);
}

std::shared_ptr<const Surface> SurfaceArchive::read(ByteReader& in, ShapeType type) {
  return type == ShapeType::mesh ? read_mesh(in) : read_height_field(in);
}

std::shared_ptr<const Surface> SurfaceArchive::read_mesh(ByteReader& in) {
  const auto mesh = std::make_shared<TriangleMesh>();
  in(mesh->vertices_, mesh->indices_, mesh->nodes_);
  check_triangles(in, *mesh);
  check_tree(in, *mesh);
  measure_tree(*mesh);
  read_materials(in, *mesh);
  return mesh;
}

void SurfaceArchive::check_triangles(ByteReader& in, const TriangleMesh& mesh) {
  for (const Vec3 v : mesh.vertices_) in.require(is_finite(v) && max_component(abs(v)) <= farthest);
  const std::size_t triangles = mesh.indices_.size() / 3;
  in.require(triangles > 0 && triangles <= max_elements && mesh.indices_.size() % 3 == 0);
  for (const std::uint32_t index : mesh.indices_) in.require(index < mesh.vertices_.size());
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const Triangle triangle = mesh.triangle(t);
    const Vec3d a = to_double(triangle.corners[0]);
    in.require(length(cross(to_double(triangle.corners[1]) - a, to_double(triangle.corners[2]) - a)) > 0);
  }
}

/// Nodes are in depth-first order, and leaves contain the triangles in order. So a traversal visits each once and never
/// has more pending second children than a search can store.
void SurfaceArchive::check_tree(ByteReader& in, const TriangleMesh& mesh) {
  constexpr std::size_t deepest = 64;  // as in TriangleMesh::find
  const std::size_t nodes = mesh.nodes_.size();
  std::vector<std::size_t> to_come;  // pending second children
  std::uint32_t triangle = 0;
  in.require(nodes > 0 && nodes < 2 * std::size_t{mesh.triangle_count()});
  for (std::size_t i = 0; i < nodes; ++i) {
    const TriangleMesh::Node& node = mesh.nodes_[i];
    if (node.count == 0) {
      in.require(node.next > i + 1 && node.next < nodes && to_come.size() < deepest);
      to_come.push_back(node.next);
      continue;
    }
    in.require(node.next == triangle && node.count <= mesh.triangle_count() - triangle);
    triangle += node.count;
    in.require((to_come.empty() ? nodes : to_come.back()) == i + 1);
    if (!to_come.empty()) to_come.pop_back();
  }
  in.require(to_come.empty() && triangle == mesh.triangle_count());
}

void SurfaceArchive::measure_tree(TriangleMesh& mesh) {
  for (std::size_t i = mesh.nodes_.size(); i-- > 0;) {
    TriangleMesh::Node& node = mesh.nodes_[i];
    Aabb box;
    if (node.count == 0) {
      const TriangleMesh::Node &first = mesh.nodes_[i + 1], &second = mesh.nodes_[node.next];
      box = merged({first.lower, first.upper}, {second.lower, second.upper});
    } else {
      box = bounds_of(mesh.triangle(node.next));
      for (std::uint32_t t = 1; t < node.count; ++t) box = merged(box, bounds_of(mesh.triangle(node.next + t)));
    }
    node.lower = box.lower, node.upper = box.upper;
  }
  mesh.bounds_ = {mesh.nodes_[0].lower, mesh.nodes_[0].upper};
}

std::shared_ptr<const Surface> SurfaceArchive::read_height_field(ByteReader& in) {
  const auto field = std::make_shared<HeightField>();
  in(field->columns_, field->rows_, field->cell_x_, field->cell_y_, field->heights_, field->holes_);
  const std::uint64_t columns = field->columns_, rows = field->rows_;
  in.require(columns >= 2 && rows >= 2 && columns * rows <= max_elements && field->heights_.size() == columns * rows);
  const auto is_length = [](float cell, std::uint64_t cells) {
    return cell > 0 && cell * static_cast<float>(cells) <= farthest;
  };
  in.require(is_length(field->cell_x_, columns - 1) && is_length(field->cell_y_, rows - 1));
  for (const float height : field->heights_) in.require(abs(height) <= farthest);
  in.require(field->holes_.empty() || field->holes_.size() == ((columns - 1) * (rows - 1) + 63) / 64);
  field->measure();
  read_materials(in, *field);
  return field;
}

void CompoundArchive::write(ByteWriter& out, ShapeWriter& shapes, const Compound& compound) {
  out(compound.offset_, compound.unit_inertia_, compound.volume_,
      static_cast<std::uint32_t>(compound.children_.size()));
  for (const ChildShape& child : compound.children_) {
    shapes.write(child.shape);
    out(child.pose.position, child.pose.rotation, child.density, child.user_data, child.material.has_value(),
        child.filter.has_value());
    if (child.material) archive_material(out, *child.material);
    if (child.filter) out(*child.filter);
  }
}

std::shared_ptr<const Compound> CompoundArchive::read(ByteReader& in, ShapeReader& shapes) {
  const auto compound = std::make_shared<Compound>();
  in(compound->offset_, compound->unit_inertia_, compound->volume_);
  const auto count = in.read<std::uint32_t>();
  in.require(count > 0 && count <= 65536);
  for (std::uint32_t i = 0; i < count; ++i) compound->children_.push_back(read_child(in, shapes));
  CompoundBuilder::arrange(*compound);
  in.require(compound->volume_ > 0 && is_finite(compound->volume_) && is_finite(compound->outer_radius_) &&
             compound->inner_radius_ > 0);
  return compound;
}

ChildShape CompoundArchive::read_child(ByteReader& in, ShapeReader& shapes) {
  ChildShape child;
  child.shape = shapes.read();
  in.require(child.shape.is_convex());
  bool has_material = false, has_filter = false;
  in(child.pose.position, child.pose.rotation, child.density, child.user_data, has_material, has_filter);
  in.require(is_finite(child.pose) && abs(dot(child.pose.rotation, child.pose.rotation) - 1) < 1e-3f);
  if (has_material) read_material(in, child.material.emplace());
  if (has_filter) in(child.filter.emplace());
  return child;
}

namespace {

/// Writes the number of a shared object among those written so far; true if it is new.
template <class T>
bool write_number(ByteWriter& out, std::vector<const T*>& known, const T* thing) {
  const auto found = std::find(known.begin(), known.end(), thing);
  out(static_cast<std::uint32_t>(found - known.begin()));
  const bool is_new = found == known.end();
  if (is_new) known.push_back(thing);
  return is_new;
}

}  // namespace

void ShapeWriter::write(const Shape& shape) {
  out_(shape.type, shape.radius, shape.half_extents);
  if (shape.type == ShapeType::hull) {
    if (write_number(out_, hulls_, shape.hull.get())) HullArchive::write(out_, *shape.hull);
  } else if (shape.is_surface()) {
    if (write_number(out_, surfaces_, shape.surface.get())) SurfaceArchive::write(out_, shape.type, *shape.surface);
  } else if (shape.type == ShapeType::compound) {
    if (write_number(out_, compounds_, shape.compound.get())) CompoundArchive::write(out_, *this, *shape.compound);
  }
}

Shape ShapeReader::read() {
  Shape shape;
  in_(shape.type, shape.radius, shape.half_extents);
  in_.require(shape.type <= ShapeType::compound);
  // The others are not there yet.
  if (shape.type <= ShapeType::box) in_.require_valid([&] { check_shape(shape, "shape"); });
  if (shape.type == ShapeType::hull) {
    const auto index = in_.read<std::uint32_t>();
    in_.require(index <= hulls_.size());
    if (index == hulls_.size()) hulls_.push_back(HullArchive::read(in_));
    shape.hull = hulls_[index];
    in_.require(shape.radius == shape.hull->radius());
  } else if (shape.is_surface()) {
    const auto index = in_.read<std::uint32_t>();
    in_.require(index <= surfaces_.size());
    if (index == surfaces_.size()) surfaces_.emplace_back(shape.type, SurfaceArchive::read(in_, shape.type));
    in_.require(surfaces_[index].first == shape.type);
    shape.surface = surfaces_[index].second;
  } else if (shape.type == ShapeType::compound) {
    const auto index = in_.read<std::uint32_t>();
    in_.require(index <= compounds_.size());
    if (index == compounds_.size()) compounds_.push_back(CompoundArchive::read(in_, *this));
    shape.compound = compounds_[index];
  }
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
      static_cast<std::uint8_t>(def.sensor), static_cast<std::uint8_t>(def.bullet),
      static_cast<std::uint8_t>(def.pre_solve), static_cast<std::uint8_t>(def.custom_filter), def.user_data);
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
  def.sensor = in.read<std::uint8_t>() != 0;
  def.bullet = in.read<std::uint8_t>() != 0;
  def.pre_solve = in.read<std::uint8_t>() != 0;
  def.custom_filter = in.read<std::uint8_t>() != 0;
  in(def.user_data);
  return def;
}

}  // namespace fathom
