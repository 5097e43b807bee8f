// Bullet: btDiscreteDynamicsWorld with the sequential impulse solver, 10 iterations. Its parallel world needs a library
// built with threads; packaged ones are not.
#include <btBulletDynamicsCommon.h>

#include <cmath>

#include "engine.hpp"

namespace fathom::peers {
namespace {

btVector3 vector(Vec3 v) { return {v.x, v.y, v.z}; }
btQuaternion quaternion(Quat q) { return {q.x, q.y, q.z, q.w}; }

// btScalar may be double.
Vec3 vector(const btVector3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}
Quat quaternion(const btQuaternion& q) {
  return {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z())};
}

class BulletEngine final : public Engine {
 public:
  explicit BulletEngine(const Scene& scene) : dt_(scene.world.dt) {
    world_.setGravity(vector(scene.world.gravity));
    bodies_.reserve(scene.bodies.size());
    for (const BodyDef& body : scene.bodies) add(body);
    require_plain_joints("Bullet", scene);
    for (const SceneJoint& joint : scene.joints) add(joint);
  }

  ~BulletEngine() override {
    for (const auto& joint : joints_) world_.removeConstraint(joint.get());
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }

  // With no internal substeps a call is exactly one step.
  void step() override { world_.stepSimulation(dt_, 0); }

  void read(std::span<Pose> poses, std::span<Velocity> velocities) const override {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const btTransform& pose = bodies_[i]->getWorldTransform();
      poses[i] = {vector(pose.getOrigin()), 0, quaternion(pose.getRotation())};
      velocities[i] = {vector(bodies_[i]->getLinearVelocity()), 0, vector(bodies_[i]->getAngularVelocity()), 0};
    }
  }

  // Bullet infers a kinematic body's velocity from its transforms.
  void move(const Orbiter::Target& target) override {
    bodies_[target.body]->setWorldTransform(
        btTransform(quaternion(target.pose.rotation), vector(target.pose.position)));
  }

  void set_velocity(std::size_t body, const Velocity& v) override {
    bodies_[body]->setLinearVelocity(vector(v.linear));
    bodies_[body]->setAngularVelocity(vector(v.angular));
  }

 private:
  static std::unique_ptr<btCollisionShape> made_of(const Shape& shape) {
    switch (shape.type) {
      case ShapeType::sphere:
        return std::make_unique<btSphereShape>(shape.radius);
      case ShapeType::capsule:
        return std::make_unique<btCapsuleShapeZ>(shape.radius, 2 * shape.half_extents.z);
      case ShapeType::box:
        return std::make_unique<btBoxShape>(vector(shape.half_extents));
      case ShapeType::mesh:
      case ShapeType::height_field:
      case ShapeType::compound:
        refuse_shape("Bullet");
      case ShapeType::hull:
        break;
    }
    auto hull = std::make_unique<btConvexHullShape>();
    for (const Vec3 vertex : shape.hull->vertices()) hull->addPoint(vector(vertex), false);
    hull->recalcLocalAabb();
    return hull;
  }

  btCollisionShape* shape_of(const Shape& shape) {
    if (shapes_.empty() || !is_same(shape, last_shape_)) {
      shapes_.push_back(made_of(shape));
      last_shape_ = shape;
    }
    return shapes_.back().get();
  }

  void add(const BodyDef& def) {
    btCollisionShape* const shape = shape_of(def.shape);
    const btScalar mass = def.motion == MotionType::dynamic ? mass_of(def) : 0;
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
    // A contact's coefficient is the product of both bodies', so each body gets the square root.
    info.m_friction = std::sqrt(def.material.friction);
    info.m_restitution = std::sqrt(def.material.restitution);
    info.m_startWorldTransform = btTransform(quaternion(def.pose.rotation), vector(def.pose.position));
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    if (def.motion == MotionType::kinematic) bodies_.back()->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    // Its default filter keeps fixed bodies apart; override it only if the scene has another.
    if (def.filter.category == Filter{}.category && def.filter.mask == Filter{}.mask)
      world_.addRigidBody(bodies_.back().get());
    else
      world_.addRigidBody(bodies_.back().get(), static_cast<int>(def.filter.category),
                          static_cast<int>(def.filter.mask));
  }

  void add(const SceneJoint& joint) {
    joints_.push_back(std::make_unique<btPoint2PointConstraint>(
        *bodies_[joint.a], *bodies_[joint.b], vector(joint.def.frame_a.position), vector(joint.def.frame_b.position)));
    world_.addConstraint(joints_.back().get(), true);
  }

  btScalar dt_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broad_phase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broad_phase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  Shape last_shape_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btPoint2PointConstraint>> joints_;
};

}  // namespace

EngineKind bullet_engine() {
  const int version = btGetVersion();
  return {"bullet", std::to_string(version / 100) + "." + std::to_string(version % 100), false,
          [](const Scene& scene, int) -> std::unique_ptr<Engine> { return std::make_unique<BulletEngine>(scene); }};
}

}  // namespace fathom::peers
