// Builds height fields: checks the input and copies it.
#pragma once

#include <fathom/mesh.hpp>
#include <memory>

namespace fathom {

class HeightFieldBuilder {
 public:
  /// The materials are valid.
  static std::shared_ptr<const HeightField> build(const HeightFieldDef& def);
};

}  // namespace fathom
