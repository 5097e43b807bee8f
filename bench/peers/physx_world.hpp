// PhysX scene and bodies created from ours: shared by its CPU and GPU adapters.
#pragma once

#include <PxPhysicsAPI.h>

#include <string>
#include <vector>

#include "engine.hpp"

namespace fathom::peers {

inline physx::PxVec3 to_physx(Vec3 v) { return {v.x, v.y, v.z}; }
inline Vec3 from_physx(const physx::PxVec3& v) { return {v.x, v.y, v.z}; }
inline Pose from_physx(const physx::PxTransform& t) { return {from_physx(t.p), 0, {t.q.w, t.q.x, t.q.y, t.q.z}}; }

/// PhysX objects that exist once per process.
physx::PxFoundation& physx_foundation();
physx::PxPhysics& physx_physics();
std::string physx_version();

class PhysxWorld {
 public:
  /// Start of both adapters' descriptions: PhysX's defaults, and the scene's gravity.
  static physx::PxSceneDesc description(const Scene& scene);
  /// The dispatcher gets `threads` threads; with one, tasks run on the caller's.
  PhysxWorld(const Scene& scene, int threads, physx::PxSceneDesc desc);
  ~PhysxWorld();
  PhysxWorld(const PhysxWorld&) = delete;
  PhysxWorld& operator=(const PhysxWorld&) = delete;

  void step();
  physx::PxScene& scene() { return *scene_; }
  /// In the order of Scene::bodies.
  const std::vector<physx::PxRigidActor*>& actors() const { return actors_; }
  /// Poses and velocities as the actors report them.
  void read(std::span<Pose> poses, std::span<Velocity> velocities) const;
  void set_velocity(std::size_t body, const Velocity& velocity);
  void move(const Orbiter::Target& target);
  /// The first error that PhysX has reported since this world was created.
  std::string trouble() const;

 private:
  void create(const BodyDef& def);
  physx::PxShape& shape_of(const BodyDef& def);

  float dt_;
  physx::PxDefaultCpuDispatcher* dispatcher_;
  physx::PxScene* scene_;
  std::vector<physx::PxRigidActor*> actors_;
  physx::PxShape* shape_ = nullptr;  // shared by bodies with the same shape and material
  Shape last_shape_;
  float last_friction_ = 0, last_restitution_ = 0;
};

}  // namespace fathom::peers
