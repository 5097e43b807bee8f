// Jolt: one collision step, 10 velocity and 2 position iterations, its own thread pool.
#include <Jolt/Jolt.h>
// Jolt requires its first header to precede all others.
#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemThreadPool.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/Shape/BoxShape.h>
#include <Jolt/Physics/Collision/Shape/CapsuleShape.h>
#include <Jolt/Physics/Collision/Shape/ConvexHullShape.h>
#include <Jolt/Physics/Collision/Shape/RotatedTranslatedShape.h>
#include <Jolt/Physics/Collision/Shape/SphereShape.h>
#include <Jolt/Physics/PhysicsSettings.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/RegisterTypes.h>

#include "engine.hpp"

namespace fathom::peers {
namespace {

constexpr JPH::ObjectLayer fixed_layer = 0, moving_layer = 1;

JPH::Vec3 vector(Vec3 v) { return {v.x, v.y, v.z}; }
Vec3 vector(JPH::Vec3 v) { return {v.GetX(), v.GetY(), v.GetZ()}; }
Quat quaternion(JPH::Quat q) { return {q.GetW(), q.GetX(), q.GetY(), q.GetZ()}; }

/// Bodies that move and bodies that do not: the two layers of its samples.
struct Layers final : JPH::BroadPhaseLayerInterface {
  JPH::uint GetNumBroadPhaseLayers() const override { return 2; }
  JPH::BroadPhaseLayer GetBroadPhaseLayer(JPH::ObjectLayer layer) const override {
    return JPH::BroadPhaseLayer(static_cast<JPH::BroadPhaseLayer::Type>(layer));
  }
#if defined(JPH_EXTERNAL_PROFILE) || defined(JPH_PROFILE_ENABLED)
  const char* GetBroadPhaseLayerName(JPH::BroadPhaseLayer) const override { return "layer"; }
#endif
};
struct LayerFilter final : JPH::ObjectVsBroadPhaseLayerFilter {
  bool ShouldCollide(JPH::ObjectLayer a, JPH::BroadPhaseLayer b) const override {
    return a == moving_layer || b == JPH::BroadPhaseLayer(moving_layer);
  }
};
struct PairFilter final : JPH::ObjectLayerPairFilter {
  bool ShouldCollide(JPH::ObjectLayer a, JPH::ObjectLayer b) const override {
    return a == moving_layer || b == moving_layer;
  }
};

/// Registers Jolt's types once, before its first object.
struct Library {
  Library() {
    JPH::RegisterDefaultAllocator();
    JPH::Factory::sInstance = new JPH::Factory();
    JPH::RegisterTypes();
  }
  ~Library() {
    JPH::UnregisterTypes();
    delete JPH::Factory::sInstance;
    JPH::Factory::sInstance = nullptr;
  }
};
struct UsesLibrary {
  UsesLibrary() { static const Library library; }
};

class JoltEngine final : UsesLibrary, public Engine {
 public:
  JoltEngine(const Scene& scene, int threads)
      : dt_(scene.world.dt), jobs_(JPH::cMaxPhysicsJobs, JPH::cMaxPhysicsBarriers, threads - 1) {
    refuse_joints("Jolt", scene);
    const auto count = static_cast<JPH::uint>(scene.bodies.size());
    // Enough room that no contact is ever dropped.
    system_.Init(count + 64, 0, count * 32 + 4096, count * 16 + 4096, layers_, layer_filter_, pair_filter_);
    JPH::PhysicsSettings settings;
    settings.mAllowSleeping = false;
    system_.SetPhysicsSettings(settings);
    system_.SetGravity(vector(scene.world.gravity));
    for (const BodyDef& body : scene.bodies) create(body);
    add_all();
  }

  ~JoltEngine() override {
    JPH::BodyInterface& bodies = system_.GetBodyInterface();
    bodies.RemoveBodies(ids_.data(), static_cast<int>(ids_.size()));
    bodies.DestroyBodies(ids_.data(), static_cast<int>(ids_.size()));
  }

  void step() override { errors_ = errors_ | system_.Update(dt_, 1, &memory_, &jobs_); }

  void read(std::span<Pose> poses, std::span<Velocity> velocities) const override {
    const JPH::BodyInterface& bodies = system_.GetBodyInterfaceNoLock();
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      JPH::RVec3 position;
      JPH::Quat rotation;
      JPH::Vec3 linear, angular;
      bodies.GetPositionAndRotation(ids_[i], position, rotation);
      bodies.GetLinearAndAngularVelocity(ids_[i], linear, angular);
      poses[i] = {vector(JPH::Vec3(position)), 0, quaternion(rotation)};
      velocities[i] = {vector(linear), 0, vector(angular), 0};
    }
  }

  void set_velocity(std::size_t body, const Velocity& v) override {
    system_.GetBodyInterfaceNoLock().SetLinearAndAngularVelocity(ids_[body], vector(v.linear), vector(v.angular));
  }

  std::string trouble() const override {
    return errors_ == JPH::EPhysicsUpdateError::None ? std::string() : "a buffer was full: contacts were dropped";
  }

 private:
  void create(const BodyDef& def) {
    const bool moves = def.motion != MotionType::fixed, is_dynamic = def.motion == MotionType::dynamic;
    const JPH::RVec3 position(def.pose.position.x, def.pose.position.y, def.pose.position.z);
    const Quat q = def.pose.rotation;
    JPH::BodyCreationSettings body(shape_of(def.shape), position, JPH::Quat(q.x, q.y, q.z, q.w).Normalized(),
                                   is_dynamic ? JPH::EMotionType::Dynamic
                                   : moves    ? JPH::EMotionType::Kinematic
                                              : JPH::EMotionType::Static,
                                   moves ? moving_layer : fixed_layer);
    body.mFriction = def.material.friction;
    body.mRestitution = def.material.restitution;
    body.mLinearDamping = body.mAngularDamping = 0;  // the default of 0.05 would be another scene
    body.mAllowSleeping = false;
    if (is_dynamic) {
      body.mOverrideMassProperties = JPH::EOverrideMassProperties::CalculateInertia;
      body.mMassPropertiesOverride.mMass = mass_of(def);
    }
    ids_.push_back(system_.GetBodyInterface().CreateBody(body)->GetID());
  }

  static JPH::Ref<JPH::Shape> made_of(const Shape& shape) {
    const Vec3 half = shape.half_extents;
    switch (shape.type) {
      case ShapeType::sphere:
        return new JPH::SphereShape(shape.radius);
      case ShapeType::capsule:  // along y in Jolt
        return new JPH::RotatedTranslatedShape(JPH::Vec3::sZero(),
                                               JPH::Quat::sRotation(JPH::Vec3::sAxisX(), 0.5f * JPH::JPH_PI),
                                               new JPH::CapsuleShape(half.z, shape.radius));
      case ShapeType::box:
        return new JPH::BoxShape(vector(half));
      case ShapeType::mesh:
      case ShapeType::height_field:
      case ShapeType::compound:
        refuse_shape("Jolt");
      case ShapeType::hull:
        break;
    }
    JPH::Array<JPH::Vec3> points;
    for (const Vec3 vertex : shape.hull->vertices()) points.push_back(vector(vertex));
    const JPH::ShapeSettings::ShapeResult made = JPH::ConvexHullShapeSettings(points).Create();
    if (made.HasError())
      throw Error(ErrorCode::unavailable, "Jolt cannot make a hull: " + std::string(made.GetError()));
    return made.Get();
  }

  const JPH::Shape* shape_of(const Shape& shape) {
    if (shape_ == nullptr || !is_same(shape, last_shape_)) {
      shape_ = made_of(shape);
      last_shape_ = shape;
    }
    return shape_;
  }

  // All at once: this gives Jolt a good tree.
  void add_all() {
    JPH::BodyInterface& bodies = system_.GetBodyInterface();
    std::vector<JPH::BodyID> ids = ids_;  // will be sorted
    const auto count = static_cast<int>(ids.size());
    const JPH::BodyInterface::AddState state = bodies.AddBodiesPrepare(ids.data(), count);
    bodies.AddBodiesFinalize(ids.data(), count, state, JPH::EActivation::Activate);
    system_.OptimizeBroadPhase();
  }

  float dt_;
  JPH::TempAllocatorImplWithMallocFallback memory_{256 * 1024 * 1024};
  JPH::JobSystemThreadPool jobs_;
  Layers layers_;
  LayerFilter layer_filter_;
  PairFilter pair_filter_;
  JPH::PhysicsSystem system_;
  JPH::RefConst<JPH::Shape> shape_;  // shared by bodies
  Shape last_shape_;
  std::vector<JPH::BodyID> ids_;
  JPH::EPhysicsUpdateError errors_ = JPH::EPhysicsUpdateError::None;
};

}  // namespace

EngineKind jolt_engine() {
  return {"jolt",
          std::to_string(JPH_VERSION_MAJOR) + "." + std::to_string(JPH_VERSION_MINOR) + "." +
              std::to_string(JPH_VERSION_PATCH),
          true, [](const Scene& scene, int threads) -> std::unique_ptr<Engine> {
            return std::make_unique<JoltEngine>(scene, threads);
          }};
}

}  // namespace fathom::peers
