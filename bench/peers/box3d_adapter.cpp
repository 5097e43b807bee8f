// Box3D: soft step, 4 substeps, its own threads.
#include <box3d/box3d.h>

#include <algorithm>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>

#include "engine.hpp"

namespace fathom::peers {
namespace {

constexpr int substeps = 4;  // as in its samples

b3Vec3 vector(Vec3 v) { return {v.x, v.y, v.z}; }
b3Quat quaternion(Quat q) { return {{q.x, q.y, q.z}, q.w}; }
Vec3 vector(b3Vec3 v) { return {v.x, v.y, v.z}; }
Quat quaternion(b3Quat q) { return {q.s, q.v.x, q.v.y, q.v.z}; }

class Box3dEngine final : public Engine {
 public:
  Box3dEngine(const Scene& scene, int threads) : dt_(scene.world.dt) {
    b3WorldDef def = b3DefaultWorldDef();
    def.gravity = vector(scene.world.gravity);
    def.enableSleep = false;
    def.workerCount = static_cast<std::uint32_t>(threads);
    world_ = b3CreateWorld(&def);
    bodies_.reserve(scene.bodies.size());
    for (const BodyDef& body : scene.bodies) add(body);
    for (const SceneJoint& joint : scene.joints) add(joint);
  }

  ~Box3dEngine() override {
    b3DestroyWorld(world_);
    for (b3MeshData* const mesh : meshes_) b3DestroyMesh(mesh);
    for (b3HeightFieldData* const field : fields_) b3DestroyHeightField(field);
  }

  void step() override { b3World_Step(world_, dt_, substeps); }

  void read(std::span<Pose> poses, std::span<Velocity> velocities) const override {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const b3Pos p = b3Body_GetPosition(bodies_[i]);
      // Positions are double in its large-world build.
      poses[i] = {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)},
                  0,
                  quaternion(b3Body_GetRotation(bodies_[i]))};
      velocities[i] = {vector(b3Body_GetLinearVelocity(bodies_[i])), 0, vector(b3Body_GetAngularVelocity(bodies_[i])),
                       0};
    }
  }

  void set_velocity(std::size_t body, const Velocity& v) override {
    b3Body_SetLinearVelocity(bodies_[body], vector(v.linear));
    b3Body_SetAngularVelocity(bodies_[body], vector(v.angular));
  }

 private:
  void add(const BodyDef& def) {
    b3BodyDef body = b3DefaultBodyDef();
    body.type = def.motion == MotionType::dynamic     ? b3_dynamicBody
                : def.motion == MotionType::kinematic ? b3_kinematicBody
                                                      : b3_staticBody;
    body.position = {def.pose.position.x, def.pose.position.y, def.pose.position.z};
    body.rotation = quaternion(def.pose.rotation);
    body.enableSleep = false;
    bodies_.push_back(b3CreateBody(world_, &body));
    b3ShapeDef shape = b3DefaultShapeDef();
    shape.density = def.motion == MotionType::dynamic ? mass_of(def) / volume(def.shape) : 1;
    shape.baseMaterial.friction = def.material.friction;
    shape.baseMaterial.restitution = def.material.restitution;
    if (def.filter.category != Filter{}.category || def.filter.mask != Filter{}.mask) {
      shape.filter.categoryBits = def.filter.category;
      shape.filter.maskBits = def.filter.mask;
    }
    add_shape(shape, def.shape, def.pose);
  }

  void add(const SceneJoint& joint) {
    const PeerJoint kind = peer_joint("Box3D", joint.def);
    const JointAxis& twist = joint.def.axis(JointAxisName::twist);
    if (kind == PeerJoint::hinge) {
      b3RevoluteJointDef def = b3DefaultRevoluteJointDef();
      attach(def.base, joint);
      def.enableLimit = twist.mode == AxisMode::limited;
      def.lowerAngle = twist.lower, def.upperAngle = twist.upper;
      def.enableMotor = twist.drive.is_on();  // at rest: friction
      def.maxMotorTorque = twist.drive.max_force;
      b3CreateRevoluteJoint(world_, &def);
      return;
    }
    b3SphericalJointDef def = b3DefaultSphericalJointDef();
    attach(def.base, joint);
    if (kind == PeerJoint::limb) {
      def.enableConeLimit = def.enableTwistLimit = true;
      def.coneAngle = joint.def.cone_angle;
      def.lowerTwistAngle = twist.lower, def.upperTwistAngle = twist.upper;
    }
    b3CreateSphericalJoint(world_, &def);
  }

  void attach(b3JointDef& def, const SceneJoint& joint) const {
    def.bodyIdA = bodies_[joint.a];
    def.bodyIdB = bodies_[joint.b];
    // Box3D's hinges and cones are about z.
    const Quat z_to_x{0.5f, 0.5f, 0.5f, 0.5f};
    def.localFrameA = {vector(joint.def.frame_a.position), quaternion(normalize(joint.def.frame_a.rotation * z_to_x))};
    def.localFrameB = {vector(joint.def.frame_b.position), quaternion(normalize(joint.def.frame_b.rotation * z_to_x))};
  }

  void add_shape(const b3ShapeDef& def, const Shape& shape, const Pose& pose) {
    const Vec3 half = shape.half_extents;
    switch (shape.type) {
      case ShapeType::sphere: {
        const b3Sphere sphere{{0, 0, 0}, shape.radius};
        b3CreateSphereShape(bodies_.back(), &def, &sphere);
        return;
      }
      case ShapeType::capsule: {
        const b3Capsule capsule{{0, 0, -half.z}, {0, 0, half.z}, shape.radius};
        b3CreateCapsuleShape(bodies_.back(), &def, &capsule);
        return;
      }
      case ShapeType::box: {
        const b3BoxHull hull = b3MakeBoxHull(half.x, half.y, half.z);
        b3CreateHullShape(bodies_.back(), &def, &hull.base);
        return;
      }
      case ShapeType::mesh:
        return add_mesh(def, static_cast<const TriangleMesh&>(*shape.surface));
      case ShapeType::height_field:
        return add_field(def, static_cast<const HeightField&>(*shape.surface), pose);
      case ShapeType::compound:
        for (const ChildShape& child : shape.compound->children()) {
          if (child.shape.type != ShapeType::hull) refuse_scene("Box3D", "compounds of other shapes than hulls");
          add_hull(def, *child.shape.hull, child.pose);
        }
        return;
      case ShapeType::hull:
        return add_hull(def, *shape.hull, {});
    }
  }

  void add_hull(const b3ShapeDef& def, const Hull& of, const Pose& pose) {
    std::vector<b3Vec3> points;
    for (const Vec3 vertex : of.vertices()) points.push_back(vector(transform(pose, vertex)));
    const auto count = static_cast<int>(points.size());
    b3HullData* const hull = b3CreateHull(points.data(), count, count);
    if (hull == nullptr) throw Error(ErrorCode::unavailable, "Box3D cannot make a hull of these points");
    b3CreateHullShape(bodies_.back(), &def, hull);  // copies it; equal hulls share the copy
    b3DestroyHull(hull);
  }

  void add_mesh(const b3ShapeDef& def, const TriangleMesh& of) {
    std::vector<b3Vec3> vertices;
    for (const Vec3 vertex : of.vertices()) vertices.push_back(vector(vertex));
    std::vector<std::int32_t> indices(of.indices().begin(), of.indices().end());
    b3MeshDef mesh{};
    mesh.vertices = vertices.data(), mesh.vertexCount = static_cast<int>(vertices.size());
    mesh.indices = indices.data(), mesh.triangleCount = static_cast<int>(of.triangle_count());
    mesh.identifyEdges = true;
    meshes_.push_back(b3CreateMesh(&mesh, nullptr, 0));
    if (meshes_.back() == nullptr) throw Error(ErrorCode::unavailable, "Box3D cannot make a mesh of these triangles");
    b3CreateMeshShape(bodies_.back(), &def, meshes_.back(), b3Vec3_one);
  }

  /// Box3D's fields are over x and z, with heights along y: the body lies on its side, and our rows are reversed.
  void add_field(const b3ShapeDef& def, const HeightField& of, const Pose& pose) {
    const std::uint32_t columns = of.columns(), rows = of.rows();
    std::vector<float> heights;
    for (std::uint32_t row = rows; row-- > 0;)
      for (std::uint32_t i = 0; i < columns; ++i) heights.push_back(of.heights()[row * columns + i]);
    std::vector<std::uint8_t> materials(std::size_t{columns - 1} * (rows - 1), 0);
    b3HeightFieldDef field{};
    field.heights = heights.data(), field.materialIndices = materials.data();
    field.scale = {of.cell_x(), 1, of.cell_y()};
    field.countX = static_cast<int>(columns), field.countZ = static_cast<int>(rows);
    field.globalMinimumHeight = *std::ranges::min_element(heights);
    field.globalMaximumHeight = *std::ranges::max_element(heights);
    fields_.push_back(b3CreateHeightField(&field));
    const Quat on_its_side{0.70710678f, 0.70710678f, 0, 0};
    const Vec3 last_row = transform(pose, {0, of.cell_y() * static_cast<float>(rows - 1), 0});
    b3Body_SetTransform(bodies_.back(), {last_row.x, last_row.y, last_row.z}, quaternion(pose.rotation * on_its_side));
    b3CreateHeightFieldShape(bodies_.back(), &def, fields_.back());
  }

  float dt_;
  b3WorldId world_;
  std::vector<b3BodyId> bodies_;
  std::vector<b3MeshData*> meshes_;
  std::vector<b3HeightFieldData*> fields_;
};

}  // namespace

EngineKind box3d_engine() {
  const b3Version v = b3GetVersion();
  return {"box3d", std::to_string(v.major) + "." + std::to_string(v.minor) + "." + std::to_string(v.revision), true,
          [](const Scene& scene, int threads) -> std::unique_ptr<Engine> {
            return std::make_unique<Box3dEngine>(scene, threads);
          }};
}

}  // namespace fathom::peers
