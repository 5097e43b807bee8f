#include <fathom/saved_shape.hpp>

#include "world/sealed_bytes.hpp"
#include "world/shape_archive.hpp"
#include "world/validate.hpp"

namespace fathom {
namespace {

constexpr SealKind saved_shape_kind{0x50534d4f48544146, 3, "shape", "saved shape"};  // "FATHOMSP"

}  // namespace

void save_shape(const Shape& shape, std::vector<std::byte>& out) {
  check_shape(shape, "save_shape");
  begin_sealed(saved_shape_kind, out);
  ByteWriter write(out);
  ShapeWriter(write).write(shape);
  seal(out);
}

Shape load_shape(std::span<const std::byte> bytes) {
  ByteReader in = unsealed(bytes, saved_shape_kind);
  const Shape shape = ShapeReader(in).read();
  in.require(in.left() == 0);
  return shape;
}

}  // namespace fathom
