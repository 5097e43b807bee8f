#include "render/body_batches.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <unordered_map>

namespace fathom::render {
namespace {

/// As in body.vert.glsl.
struct Instance {
  Vec3 scale;
  std::uint32_t slot;
};
static_assert(sizeof(Instance) == 16);

constexpr std::uint32_t batch_vertices = 4096;  // per instance, for meshes with fewer
constexpr std::size_t many_spheres = 2000;      // from this number on, a coarser mesh is used

Surface surface_of(const DrawnBody& body) {
  if (body.ground && body.shape.type == ShapeType::box) return Surface::ground;
  if (body.ground && body.shape.is_surface()) return Surface::terrain;
  switch (body.shape.type) {
    case ShapeType::box:
      return Surface::box;
    case ShapeType::sphere:
      return Surface::round;
    case ShapeType::capsule:
      return Surface::capsule;
    case ShapeType::hull:
    case ShapeType::compound:
    case ShapeType::mesh:
    case ShapeType::height_field:
      return Surface::hull;
  }
  return Surface::box;
}

Vec3 scale_of(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::box:
      return shape.half_extents;
    case ShapeType::sphere:
      return {shape.radius, shape.radius, shape.radius};
    case ShapeType::capsule:
      return {shape.radius, shape.radius, shape.half_extents.z};
    case ShapeType::hull:
    case ShapeType::compound:
    case ShapeType::mesh:
    case ShapeType::height_field:
      return {1, 1, 1};
  }
  return {1, 1, 1};
}

/// The hull, compound or surface that the shape shares with others; null if it has none.
const void* shared_part(const Shape& shape) {
  if (shape.hull) return shape.hull.get();
  if (shape.compound) return shape.compound.get();
  return shape.surface.get();
}

Mesh mesh_of(const Shape& shape) {
  if (shape.compound) return compound_mesh(*shape.compound);
  return shape.is_surface() ? surface_mesh(*shape.surface) : hull_mesh(*shape.hull);
}

}  // namespace

GpuMesh::GpuMesh(const Mesh& mesh)
    : array_(make_vertex_array()),
      copies_(std::clamp<std::uint32_t>(batch_vertices / static_cast<std::uint32_t>(mesh.vertices.size()), 1, 256)),
      vertex_count_(static_cast<std::uint32_t>(mesh.vertices.size())),
      index_count_(static_cast<std::uint32_t>(mesh.indices.size())) {
  Mesh copies;
  for (std::uint32_t copy = 0; copy < copies_; ++copy) {
    copies.vertices.insert(copies.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const std::uint32_t index : mesh.indices) copies.indices.push_back(copy * vertex_count_ + index);
  }
  vertices_ = make_buffer_of(copies.vertices);
  indices_ = make_buffer_of(copies.indices);
  const GLuint a = array_.get();
  glVertexArrayVertexBuffer(a, 0, vertices_.get(), 0, sizeof(MeshVertex));
  glVertexArrayElementBuffer(a, indices_.get());
  const struct {
    int components;
    std::size_t offset;
  } attributes[] = {
      {3, offsetof(MeshVertex, position)}, {3, offsetof(MeshVertex, normal)}, {1, offsetof(MeshVertex, extra)}};
  for (GLuint i = 0; i < 3; ++i) {
    glEnableVertexArrayAttrib(a, i);
    glVertexArrayAttribFormat(a, i, attributes[i].components, GL_FLOAT, GL_FALSE,
                              static_cast<GLuint>(attributes[i].offset));
    glVertexArrayAttribBinding(a, i, 0);
  }
}

int GpuMesh::draw(std::uint32_t first, std::uint32_t count) const {
  glBindVertexArray(array_.get());
  glUniform1ui(1, copies_);
  glUniform1ui(2, vertex_count_);
  const auto draw = [this](std::uint32_t from, std::uint32_t copies, std::uint32_t instances) {
    if (copies == 0 || instances == 0) return 0;
    glUniform1ui(0, from);
    glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(copies * index_count_), GL_UNSIGNED_INT, nullptr,
                            static_cast<GLsizei>(instances));
    return 1;
  };
  const std::uint32_t full = count / copies_;
  return draw(first, copies_, full) + draw(first + full * copies_, count % copies_, 1);
}

const GpuMesh* BodyBatches::basic_mesh(Surface surface, bool many) {
  const auto made = [](std::unique_ptr<GpuMesh>& mesh, auto make) {
    if (!mesh) mesh = std::make_unique<GpuMesh>(make());
    return mesh.get();
  };
  switch (surface) {
    case Surface::round:
      return many ? made(coarse_sphere_, [] { return unit_sphere(2); }) : made(sphere_, [] { return unit_sphere(4); });
    case Surface::capsule:
      return made(capsule_, [] { return unit_capsule(32); });
    default:
      return made(box_, unit_box);
  }
}

void BodyBatches::set(std::span<const DrawnBody> bodies) {
  // Hulls, compounds and surfaces that are still in use keep their meshes.
  std::vector<KeptMesh> kept;
  std::unordered_map<const void*, std::size_t> index;
  std::vector<std::vector<Instance>> basic(surface_count);
  struct Sharing {
    std::vector<Instance> moving, terrain;
  };
  std::vector<Sharing> sharing;  // by index in `kept`
  for (const DrawnBody& body : bodies) {
    const Instance instance{scale_of(body.shape), body.slot};
    const Surface surface = surface_of(body);
    if (surface != Surface::hull && surface != Surface::terrain) {
      basic[static_cast<std::size_t>(surface)].push_back(instance);
      continue;
    }
    const void* part = shared_part(body.shape);
    const auto [entry, is_new] = index.try_emplace(part, kept.size());
    if (is_new) {
      const auto known =
          std::find_if(kept_.begin(), kept_.end(), [&](const KeptMesh& k) { return shared_part(k.shape) == part; });
      kept.push_back(
          {body.shape, known != kept_.end() ? std::move(known->mesh) : std::make_unique<GpuMesh>(mesh_of(body.shape))});
      sharing.emplace_back();
    }
    Sharing& bodies_of = sharing[entry->second];
    (surface == Surface::terrain ? bodies_of.terrain : bodies_of.moving).push_back(instance);
  }
  kept_ = std::move(kept);

  batches_.clear();
  std::vector<Instance> all;
  all.reserve(bodies.size());
  const auto add = [&](Surface surface, const GpuMesh* mesh, const std::vector<Instance>& list) {
    if (list.empty()) return;
    batches_.push_back(
        {surface, mesh, static_cast<std::uint32_t>(all.size()), static_cast<std::uint32_t>(list.size())});
    all.insert(all.end(), list.begin(), list.end());
  };
  for (const Surface surface : {Surface::box, Surface::round, Surface::capsule}) {
    const auto& list = basic[static_cast<std::size_t>(surface)];
    add(surface, list.empty() ? nullptr : basic_mesh(surface, list.size() > many_spheres), list);
  }
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    add(Surface::hull, kept_[i].mesh.get(), sharing[i].moving);
    add(Surface::terrain, kept_[i].mesh.get(), sharing[i].terrain);
  }
  // Last: by then bodies hide most of the ground.
  const auto& floors = basic[static_cast<std::size_t>(Surface::ground)];
  add(Surface::ground, floors.empty() ? nullptr : basic_mesh(Surface::box, false), floors);
  instances_.write(all.data(), all.size() * sizeof(Instance));
}

}  // namespace fathom::render
