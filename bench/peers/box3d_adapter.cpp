// Box3D: soft step, 4 substeps, its own threads.
#include <box3d/box3d.h>

#include "engine.hpp"

namespace fathom::peers {
namespace {

constexpr int substeps = 4;  // what its samples use

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

  ~Box3dEngine() override { b3DestroyWorld(world_); }

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
    shape.density = mass_of(def) / volume(def.shape);
    shape.baseMaterial.friction = def.material.friction;
    shape.baseMaterial.restitution = def.material.restitution;
    if (def.filter.category != Filter{}.category || def.filter.mask != Filter{}.mask) {
      shape.filter.categoryBits = def.filter.category;
      shape.filter.maskBits = def.filter.mask;
    }
    add_shape(shape, def.shape);
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
    // Hinges and cones are about z there.
    const Quat z_to_x{0.5f, 0.5f, 0.5f, 0.5f};
    def.localFrameA = {vector(joint.def.frame_a.position), quaternion(normalize(joint.def.frame_a.rotation * z_to_x))};
    def.localFrameB = {vector(joint.def.frame_b.position), quaternion(normalize(joint.def.frame_b.rotation * z_to_x))};
  }

  void add_shape(const b3ShapeDef& def, const Shape& shape) {
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
      case ShapeType::height_field:
      case ShapeType::compound:
        refuse_shape("Box3D");
      case ShapeType::hull:
        break;
    }
    std::vector<b3Vec3> points;
    for (const Vec3 vertex : shape.hull->vertices()) points.push_back(vector(vertex));
    const auto count = static_cast<int>(points.size());
    b3HullData* const hull = b3CreateHull(points.data(), count, count);
    if (hull == nullptr) throw Error(ErrorCode::unavailable, "Box3D makes no hull of these points");
    b3CreateHullShape(bodies_.back(), &def, hull);  // a copy, which equal ones share
    b3DestroyHull(hull);
  }

  float dt_;
  b3WorldId world_;
  std::vector<b3BodyId> bodies_;
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
