// Serialises shapes and body definitions. Hulls, surfaces and compounds are written once each: bodies share them.
#pragma once

#include <fathom/body.hpp>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "world/archive.hpp"

namespace fathom {

/// Reads and writes `Hull`'s private data: rebuilding a hull from its vertices would shift it by rounding.
struct HullArchive {
  static void write(ByteWriter& out, const Hull& hull);
  static std::shared_ptr<const Hull> read(ByteReader& in);

 private:
  static void check_sizes(ByteReader& in, const Hull& hull);
  static void check_edges(ByteReader& in, const Hull& hull);
};

/// Meshes and height fields: rebuilding a mesh from its triangles would reorder them. Reading checks everything that
/// searches and contacts rely on, and recomputes boxes.
struct SurfaceArchive {
  static void write(ByteWriter& out, ShapeType type, const Surface& surface);
  static std::shared_ptr<const Surface> read(ByteReader& in, ShapeType type);

 private:
  static std::shared_ptr<const Surface> read_mesh(ByteReader& in);
  static std::shared_ptr<const Surface> read_height_field(ByteReader& in);
  static void read_materials(ByteReader& in, Surface& surface);
  static void check_triangles(ByteReader& in, const TriangleMesh& mesh);
  static void check_tree(ByteReader& in, const TriangleMesh& mesh);
  static void measure_tree(TriangleMesh& mesh);
};

class ShapeReader;
class ShapeWriter;

/// Rebuilding a compound from its children would shift it by rounding. The tree of boxes is rebuilt.
struct CompoundArchive {
  static void write(ByteWriter& out, ShapeWriter& shapes, const Compound& compound);
  static std::shared_ptr<const Compound> read(ByteReader& in, ShapeReader& shapes);

 private:
  static ChildShape read_child(ByteReader& in, ShapeReader& shapes);
};

class ShapeWriter {
 public:
  explicit ShapeWriter(ByteWriter& out) : out_(out) {}
  void write(const Shape& shape);

 private:
  ByteWriter& out_;
  std::vector<const Hull*> hulls_;
  std::vector<const Surface*> surfaces_;
  std::vector<const Compound*> compounds_;
};

class ShapeReader {
 public:
  explicit ShapeReader(ByteReader& in) : in_(in) {}
  Shape read();

 private:
  ByteReader& in_;
  std::vector<std::shared_ptr<const Hull>> hulls_;
  std::vector<std::pair<ShapeType, std::shared_ptr<const Surface>>> surfaces_;
  std::vector<std::shared_ptr<const Compound>> compounds_;
};

FATHOM_COMPONENT_API void write_body(ByteWriter& out, ShapeWriter& shapes, const BodyDef& def);
FATHOM_COMPONENT_API BodyDef read_body(ByteReader& in, ShapeReader& shapes);

/// Field by field: the struct has padding.
template <class Archive, class M>
void archive_material(Archive& a, M& material) {
  a(material.friction, material.restitution, material.friction_rule, material.restitution_rule,
    material.rolling_resistance, material.surface_velocity, material.friction_axis, material.friction_along);
}

}  // namespace fathom
