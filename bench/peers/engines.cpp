#include "engine.hpp"

namespace fathom::peers {

namespace {

std::vector<EngineKind> all_engines() {
  std::vector<EngineKind> list = {fathom_engine()};
  if (fathom_gpu_is_there()) list.push_back(fathom_gpu_engine());
#ifdef FATHOM_HAS_BULLET
  list.push_back(bullet_engine());
#endif
#ifdef FATHOM_HAS_ODE
  list.push_back(ode_engine());
#endif
#ifdef FATHOM_HAS_MUJOCO
  list.push_back(mujoco_engine());
#endif
#ifdef FATHOM_HAS_BOX3D
  list.push_back(box3d_engine());
#endif
#ifdef FATHOM_HAS_JOLT
  list.push_back(jolt_engine());
#endif
#ifdef FATHOM_HAS_PHYSX
  list.push_back(physx_engine());
  list.push_back(physx_tgs_engine());
#endif
#ifdef FATHOM_HAS_PHYSX_GPU
  if (physx_gpu_is_there()) list.push_back(physx_gpu_engine());
#endif
  return list;
}

}  // namespace

const std::vector<EngineKind>& engines() {
  static const std::vector<EngineKind> list = all_engines();
  return list;
}

const EngineKind& find_engine(std::string_view name) {
  std::string built;
  for (const EngineKind& engine : engines()) {
    if (engine.name == name) return engine;
    built += (built.empty() ? "" : ", ") + std::string(engine.name);
  }
  throw Error(ErrorCode::unavailable,
              "engine '" + std::string(name) + "' is not in this build or cannot run here; there are " + built +
                  ". Others are built in where CMake finds them (bullet, ode, mujoco, box3d, jolt, physx); "
                  "fathom-gpu and physx-gpu need a GPU, the latter also libPhysXGpu_64.so in LD_LIBRARY_PATH");
}

bool is_same(const Shape& a, const Shape& b) {
  return a.type == b.type && a.radius == b.radius && a.half_extents == b.half_extents && a.hull == b.hull;
}

void refuse_scene(std::string_view engine, std::string_view what) {
  throw Error(ErrorCode::unavailable, std::string(engine) + " is not measured with " + std::string(what) +
                                          "; leave it out by --engines or choose another scene");
}

void refuse_joints(std::string_view engine, const Scene& scene) {
  if (!scene.joints.empty()) refuse_scene(engine, "joints");
}

void require_plain_joints(std::string_view engine, const Scene& scene) {
  for (const SceneJoint& joint : scene.joints)
    if (joint.def.type != JointType::ball || joint.def.hertz > 0 || joint.def.collide_connected)
      refuse_scene(engine, "joints but rigid ball joints whose bodies do not collide");
}

float mass_of(const BodyDef& body) { return body.mass ? *body.mass : body.density * volume(body.shape); }

}  // namespace fathom::peers
