// Bodies sorted into draw calls.
#pragma once

#include <fathom/shape.hpp>
#include <span>
#include <vector>

#include "render/gl_objects.hpp"
#include "render/renderer.hpp"
#include "render/shape_mesh.hpp"

namespace fathom::render {

/// How a body's surface is drawn: which shader.
enum class Surface : std::uint8_t { box, round, capsule, hull, ground, terrain };
inline constexpr int surface_count = 6;

/// Triangles on the GPU. Stores several copies of a small mesh: an instance of a few triangles leaves a GPU's vertex
/// units half empty and costs a software renderer more than its vertices do.
class GpuMesh {
 public:
  explicit GpuMesh(const Mesh& mesh);
  /// Draws bodies `first` to `first + count` with the program in use, whose uniforms 0 to 2 are those of
  /// body.vert.glsl. Returns the number of draw calls.
  int draw(std::uint32_t first, std::uint32_t count) const;

 private:
  GlBuffer vertices_, indices_;
  GlVertexArray array_;
  std::uint32_t copies_, vertex_count_, index_count_;  // of one mesh
};

/// Bodies that one batch draws.
struct Batch {
  Surface surface;
  const GpuMesh* mesh;
  std::uint32_t first = 0, count = 0;  ///< instances
};

class BodyBatches {
 public:
  void set(std::span<const DrawnBody> bodies);
  /// In the order of `Surface`, except that meshes with many triangles come together, and floors last.
  std::span<const Batch> batches() const { return batches_; }
  GLuint instances() const { return instances_.get(); }

 private:
  const GpuMesh* basic_mesh(Surface surface, bool many);

  GrowingBuffer instances_;
  std::vector<Batch> batches_;
  std::unique_ptr<GpuMesh> box_, sphere_, coarse_sphere_, capsule_;
  /// Mesh of a hull, compound, mesh or height field. Keeps the shape alive: a new one at the same address would be
  /// mistaken for it.
  struct KeptMesh {
    Shape shape;
    std::unique_ptr<GpuMesh> mesh;
  };
  std::vector<KeptMesh> kept_;
};

}  // namespace fathom::render
