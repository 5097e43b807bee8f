#include "scene/gltf_file.hpp"

#include <tiny_gltf.h>

#include <array>
#include <cstring>
#include <fathom/error.hpp>
#include <filesystem>
#include <span>
#include <vector>

namespace fathom {
namespace {

/// Column by column, as in the file.
using Matrix = std::array<double, 16>;

constexpr Matrix identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (std::size_t column = 0; column < 4; ++column)
    for (std::size_t row = 0; row < 4; ++row)
      for (std::size_t k = 0; k < 4; ++k) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return product;
}

Matrix matrix_of(const tinygltf::Node& node) {
  Matrix m = identity;
  if (node.matrix.size() == 16) {
    std::copy(node.matrix.begin(), node.matrix.end(), m.begin());
    return m;
  }
  if (node.rotation.size() == 4) {
    const double x = node.rotation[0], y = node.rotation[1], z = node.rotation[2], w = node.rotation[3];
    m = {1 - 2 * (y * y + z * z),
         2 * (x * y + w * z),
         2 * (x * z - w * y),
         0,
         2 * (x * y - w * z),
         1 - 2 * (x * x + z * z),
         2 * (y * z + w * x),
         0,
         2 * (x * z + w * y),
         2 * (y * z - w * x),
         1 - 2 * (x * x + y * y),
         0,
         0,
         0,
         0,
         1};
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (node.scale.size() == 3)
      for (std::size_t row = 0; row < 3; ++row) m[4 * axis + row] *= node.scale[axis];
    if (node.translation.size() == 3) m[12 + axis] = node.translation[axis];
  }
  return m;
}

bool is_mirrored(const Matrix& m) {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) + m[4] * (m[9] * m[2] - m[10] * m[1]) +
             m[8] * (m[1] * m[6] - m[2] * m[5]) <
         0;
}

class GltfReader {
 public:
  GltfReader(const std::string& content, const std::string& path) : path_(path) { load(content); }

  FileTriangles read() {
    const auto visit_all = [&](const std::vector<int>& nodes) {
      for (const int node : nodes) visit(node, identity, 0);
    };
    if (model_.defaultScene >= 0 && static_cast<std::size_t>(model_.defaultScene) < model_.scenes.size())
      visit_all(model_.scenes[static_cast<std::size_t>(model_.defaultScene)].nodes);
    else
      for (const tinygltf::Scene& scene : model_.scenes) visit_all(scene.nodes);
    if (read_.indices.empty()) fail("has no triangle in its scene; export the mesh with its faces");
    return std::move(read_);
  }

 private:
  [[noreturn]] void fail(const std::string& text) const { throw Error(ErrorCode::file, path_ + ": " + text); }

  void load(const std::string& content) {
    tinygltf::TinyGLTF loader;
    // Pictures are not needed.
    loader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*, int,
                             void*) { return true; },
                          nullptr);
    std::string error, warning;
    const std::string folder = std::filesystem::path(path_).parent_path().string();
    const bool is_binary = content.starts_with("glTF");
    const auto size = static_cast<unsigned>(content.size());
    const bool is_read =
        is_binary ? loader.LoadBinaryFromMemory(&model_, &error, &warning,
                                                reinterpret_cast<const unsigned char*>(content.data()), size, folder)
                  : loader.LoadASCIIFromString(&model_, &error, &warning, content.data(), size, folder);
    if (is_read) return;
    const std::string first_line = error.substr(0, error.find('\n'));
    fail("is no glTF 2.0 file that can be read: " + first_line + "; export it again");
  }

  template <class T>
  const T& at(const std::vector<T>& list, int index, const char* what) const {
    if (index < 0 || static_cast<std::size_t>(index) >= list.size())
      fail("refers to " + std::string(what) + " " + std::to_string(index) + ", but has " + std::to_string(list.size()) +
           "; export it again");
    return list[static_cast<std::size_t>(index)];
  }

  void visit(int number, const Matrix& parent, std::size_t depth) {
    const tinygltf::Node& node = at(model_.nodes, number, "node");
    if (depth > model_.nodes.size()) fail("has a node that is its own ancestor; export it again");
    const Matrix placed = parent * matrix_of(node);
    if (node.mesh >= 0)
      for (const tinygltf::Primitive& primitive : at(model_.meshes, node.mesh, "mesh").primitives)
        add(primitive, placed);
    for (const int child : node.children) visit(child, placed, depth + 1);
  }

  void add(const tinygltf::Primitive& primitive, const Matrix& placed) {
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) return;  // points and lines
    const auto positions = primitive.attributes.find("POSITION");
    if (positions == primitive.attributes.end()) return;
    const auto first = static_cast<std::uint32_t>(read_.vertices.size());
    const std::size_t count = add_vertices(positions->second, placed);
    std::vector<std::uint32_t> corners;
    if (primitive.indices >= 0)
      corners = indices_of(primitive.indices, count);
    else
      for (std::uint32_t i = 0; i < count; ++i) corners.push_back(i);
    const std::string name =
        primitive.material >= 0 ? at(model_.materials, primitive.material, "material").name : std::string();
    const std::uint32_t used = read_.material_number(name);
    const bool turns = is_mirrored(placed);
    const auto triangle = [&](std::size_t a, std::size_t b, std::size_t c) {
      if (turns) std::swap(b, c);
      for (const std::size_t corner : {a, b, c}) read_.indices.push_back(first + corners[corner]);
      read_.material_of.push_back(used);
    };
    if (primitive.mode == TINYGLTF_MODE_TRIANGLES)
      for (std::size_t i = 0; i + 2 < corners.size(); i += 3) triangle(i, i + 1, i + 2);
    if (primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP)
      for (std::size_t i = 0; i + 2 < corners.size(); ++i) triangle(i, i + 1 + i % 2, i + 2 - i % 2);
    if (primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN)
      for (std::size_t i = 1; i + 1 < corners.size(); ++i) triangle(0, i, i + 1);
  }

  /// An accessor's elements, each of `size` bytes, `stride` apart.
  struct Elements {
    const unsigned char* data;
    std::size_t count, stride;
  };
  Elements elements_of(const tinygltf::Accessor& accessor, std::size_t size) const {
    if (accessor.sparse.isSparse || accessor.bufferView < 0)
      fail("has sparse or compressed vertices; export it without compression");
    const tinygltf::BufferView& view = at(model_.bufferViews, accessor.bufferView, "buffer view");
    const std::vector<unsigned char>& bytes = at(model_.buffers, view.buffer, "buffer").data;
    const std::size_t stride = view.byteStride > 0 ? view.byteStride : size;
    const std::size_t begin = view.byteOffset + accessor.byteOffset;
    const bool fits = stride < 256 && accessor.count < bytes.size() && begin <= bytes.size() &&
                      (accessor.count == 0 || (accessor.count - 1) * stride + size <= bytes.size() - begin);
    if (!fits) fail("has an accessor that reaches beyond its buffer; export it again");
    return {bytes.data() + begin, accessor.count, stride};
  }

  /// Returns how many there are.
  std::size_t add_vertices(int number, const Matrix& m) {
    const tinygltf::Accessor& accessor = at(model_.accessors, number, "accessor");
    if (accessor.type != TINYGLTF_TYPE_VEC3 || accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
      fail("has positions that are not three floats each; export it without quantisation");
    const Elements elements = elements_of(accessor, sizeof(float[3]));
    for (std::size_t i = 0; i < elements.count; ++i) {
      float p[3];
      std::memcpy(p, elements.data + i * elements.stride, sizeof p);
      double placed[3];
      for (std::size_t row = 0; row < 3; ++row) {
        placed[row] = m[12 + row];
        for (std::size_t k = 0; k < 3; ++k) placed[row] += m[4 * k + row] * static_cast<double>(p[k]);
      }
      read_.vertices.push_back(
          {static_cast<float>(placed[0]), static_cast<float>(-placed[2]), static_cast<float>(placed[1])});
    }
    return elements.count;
  }

  std::vector<std::uint32_t> indices_of(int number, std::size_t vertices) const {
    const tinygltf::Accessor& accessor = at(model_.accessors, number, "accessor");
    const std::size_t size = accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? 1
                             : accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? 2
                             : accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT   ? 4
                                                                                                : 0;
    if (accessor.type != TINYGLTF_TYPE_SCALAR || size == 0) fail("has indices of an unknown type; export it again");
    const Elements elements = elements_of(accessor, size);
    std::vector<std::uint32_t> indices;
    for (std::size_t i = 0; i < elements.count; ++i) {
      std::uint32_t index = 0;
      std::memcpy(&index, elements.data + i * elements.stride, size);  // both are little-endian
      if (index >= vertices)
        fail("has an index " + std::to_string(index) + " for " + std::to_string(vertices) +
             " vertices; export it again");
      indices.push_back(index);
    }
    return indices;
  }

  const std::string& path_;
  tinygltf::Model model_;
  FileTriangles read_;
};

}  // namespace

FileTriangles parse_gltf(const std::string& content, const std::string& path) {
  return GltfReader(content, path).read();
}

}  // namespace fathom
