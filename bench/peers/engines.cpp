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

Vec3 box_half_extents(const BodyDef& body) {
  if (body.shape.type != ShapeType::box) throw Error(ErrorCode::unavailable, "peers are measured with boxes only");
  return body.shape.half_extents;
}

float mass_of(const BodyDef& body) { return body.mass ? *body.mass : body.density * volume(body.shape); }

}  // namespace fathom::peers
