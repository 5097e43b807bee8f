#include "physx_world.hpp"

namespace fathom::peers {
namespace {

using namespace physx;

/// Keeps the first error, ignoring performance remarks.
struct Errors final : PxErrorCallback {
  std::string first;

  void reportError(PxErrorCode::Enum code, const char* message, const char*, int) override {
    if (code == PxErrorCode::eDEBUG_INFO || code == PxErrorCode::ePERF_WARNING) return;
    if (first.empty()) first = message;
  }
};

struct Library {
  PxDefaultAllocator allocator;
  Errors errors;
  PxFoundation* foundation = PxCreateFoundation(PX_PHYSICS_VERSION, allocator, errors);
  PxPhysics* physics = PxCreatePhysics(PX_PHYSICS_VERSION, *foundation, PxTolerancesScale());

  Library() { PxInitExtensions(*physics, nullptr); }
  ~Library() {
    PxCloseExtensions();
    physics->release();
    foundation->release();
  }
};

Library& library() {
  static Library one;
  return one;
}

}  // namespace

PxFoundation& physx_foundation() { return *library().foundation; }
PxPhysics& physx_physics() { return *library().physics; }
std::string physx_version() {
  return std::to_string(PX_PHYSICS_VERSION_MAJOR) + "." + std::to_string(PX_PHYSICS_VERSION_MINOR) + "." +
         std::to_string(PX_PHYSICS_VERSION_BUGFIX);
}

PxSceneDesc PhysxWorld::description(const Scene& scene) {
  PxSceneDesc desc(physx_physics().getTolerancesScale());
  desc.gravity = to_physx(scene.world.gravity);
  desc.filterShader = PxDefaultSimulationFilterShader;
  return desc;
}

PhysxWorld::PhysxWorld(const Scene& scene, int threads, PxSceneDesc desc)
    : dt_(scene.world.dt), dispatcher_(PxDefaultCpuDispatcherCreate(threads > 1 ? static_cast<PxU32>(threads) : 0)) {
  library().errors.first.clear();
  desc.cpuDispatcher = dispatcher_;
  scene_ = physx_physics().createScene(desc);
  if (scene_ == nullptr) {
    dispatcher_->release();
    throw Error(ErrorCode::unavailable, "PhysX cannot make a scene: " + trouble());
  }
  refuse_joints("PhysX", scene);
  for (const BodyDef& body : scene.bodies) create(body);
}

PhysxWorld::~PhysxWorld() {
  for (PxRigidActor* actor : actors_) actor->release();
  if (shape_ != nullptr) shape_->release();
  scene_->release();
  dispatcher_->release();
}

void PhysxWorld::step() {
  scene_->simulate(dt_);
  scene_->fetchResults(true);
}

void PhysxWorld::read(std::span<Pose> poses, std::span<Velocity> velocities) const {
  for (std::size_t i = 0; i < actors_.size(); ++i) {
    poses[i] = from_physx(actors_[i]->getGlobalPose());
    const auto* moving = actors_[i]->is<PxRigidDynamic>();
    velocities[i] = {};
    if (moving != nullptr)
      velocities[i] = {from_physx(moving->getLinearVelocity()), 0, from_physx(moving->getAngularVelocity()), 0};
  }
}

void PhysxWorld::set_velocity(std::size_t body, const Velocity& v) {
  auto* moving = actors_[body]->is<PxRigidDynamic>();
  moving->setLinearVelocity(to_physx(v.linear));
  moving->setAngularVelocity(to_physx(v.angular));
}

void PhysxWorld::move(const Orbiter::Target& target) {
  const Quat q = target.pose.rotation;
  actors_[target.body]->is<PxRigidDynamic>()->setKinematicTarget(
      {to_physx(target.pose.position), PxQuat(q.x, q.y, q.z, q.w).getNormalized()});
}

std::string PhysxWorld::trouble() const { return library().errors.first; }

void PhysxWorld::create(const BodyDef& def) {
  const Quat q = def.pose.rotation;
  const PxTransform pose(to_physx(def.pose.position), PxQuat(q.x, q.y, q.z, q.w).getNormalized());
  if (def.motion == MotionType::kinematic) {
    PxRigidDynamic* body = physx_physics().createRigidDynamic(pose);
    body->setRigidBodyFlag(PxRigidBodyFlag::eKINEMATIC, true);
    body->attachShape(shape_of(def));
    actors_.push_back(body);
  } else if (def.motion == MotionType::dynamic) {
    PxRigidDynamic* body = physx_physics().createRigidDynamic(pose);
    body->attachShape(shape_of(def));
    PxRigidBodyExt::setMassAndUpdateInertia(*body, mass_of(def));
    body->setLinearDamping(0);
    body->setAngularDamping(0);  // the default of 0.05 would be another scene
    body->setSleepThreshold(0);
    actors_.push_back(body);
  } else {
    actors_.push_back(physx_physics().createRigidStatic(pose));
    actors_.back()->attachShape(shape_of(def));
  }
  scene_->addActor(*actors_.back());
}

namespace {

/// Keeps a hull's mesh until its shape owns it.
struct MadeGeometry {
  PxGeometryHolder geometry;
  PxTransform in_body{PxIdentity};
  PxConvexMesh* mesh = nullptr;

  explicit MadeGeometry(const Shape& shape) {
    const Vec3 half = shape.half_extents;
    switch (shape.type) {
      case ShapeType::sphere:
        geometry.storeAny(PxSphereGeometry(shape.radius));
        return;
      case ShapeType::capsule:  // along x in PhysX
        geometry.storeAny(PxCapsuleGeometry(shape.radius, half.z));
        in_body.q = PxQuat(PxHalfPi, PxVec3(0, 1, 0));
        return;
      case ShapeType::box:
        geometry.storeAny(PxBoxGeometry(to_physx(half)));
        return;
      case ShapeType::mesh:
      case ShapeType::height_field:
      case ShapeType::compound:
        refuse_shape("PhysX");
      case ShapeType::hull:
        break;
    }
    const std::span<const Vec3> vertices = shape.hull->vertices();
    PxConvexMeshDesc desc;
    desc.points.data = vertices.data();
    desc.points.stride = sizeof(Vec3);
    desc.points.count = static_cast<PxU32>(vertices.size());
    desc.flags = PxConvexFlag::eCOMPUTE_CONVEX;
    PxCookingParams params(physx_physics().getTolerancesScale());
    params.buildGPUData = true;
    mesh = PxCreateConvexMesh(params, desc);
    if (mesh == nullptr) throw Error(ErrorCode::unavailable, "PhysX cannot make a hull of these points");
    geometry.storeAny(PxConvexMeshGeometry(mesh));
  }
  ~MadeGeometry() {
    if (mesh != nullptr) mesh->release();
  }
  MadeGeometry(const MadeGeometry&) = delete;
  MadeGeometry& operator=(const MadeGeometry&) = delete;
};

}  // namespace

PxShape& PhysxWorld::shape_of(const BodyDef& def) {
  const float friction = def.material.friction, restitution = def.material.restitution;
  if (shape_ == nullptr || !is_same(def.shape, last_shape_) || friction != last_friction_ ||
      restitution != last_restitution_) {
    if (shape_ != nullptr) shape_->release();
    PxMaterial* material = physx_physics().createMaterial(friction, friction, restitution);
    const MadeGeometry made(def.shape);
    shape_ = physx_physics().createShape(made.geometry.any(), *material);
    shape_->setLocalPose(made.in_body);
    material->release();
    last_shape_ = def.shape, last_friction_ = friction, last_restitution_ = restitution;
  }
  return *shape_;
}

}  // namespace fathom::peers
