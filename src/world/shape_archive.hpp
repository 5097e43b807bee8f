// Shapes and body definitions as bytes. Hulls are written once each: bodies share them.
#pragma once

#include <fathom/body.hpp>
#include <memory>
#include <vector>

#include "world/archive.hpp"

namespace fathom {

/// Reads and writes what `Hull` keeps to itself: a hull built anew from its vertices would be moved by a rounding.
struct HullArchive {
  static void write(ByteWriter& out, const Hull& hull);
  static std::shared_ptr<const Hull> read(ByteReader& in);
};

class ShapeWriter {
 public:
  explicit ShapeWriter(ByteWriter& out) : out_(out) {}
  void write(const Shape& shape);

 private:
  ByteWriter& out_;
  std::vector<const Hull*> hulls_;
};

class ShapeReader {
 public:
  explicit ShapeReader(ByteReader& in) : in_(in) {}
  Shape read();

 private:
  ByteReader& in_;
  std::vector<std::shared_ptr<const Hull>> hulls_;
};

void write_body(ByteWriter& out, ShapeWriter& shapes, const BodyDef& def);
BodyDef read_body(ByteReader& in, ShapeReader& shapes);

/// The fields one by one: the struct has padding.
template <class Archive, class M>
void archive_material(Archive& a, M& material) {
  a(material.friction, material.restitution, material.friction_rule, material.restitution_rule,
    material.rolling_resistance);
}

}  // namespace fathom
