#include "engine.hpp"

namespace fathom::peers {

const std::vector<EngineKind>& engines() {
  static const std::vector<EngineKind> list = {
      fathom_engine(),
#ifdef FATHOM_HAS_BULLET
      bullet_engine(),
#endif
#ifdef FATHOM_HAS_ODE
      ode_engine(),
#endif
#ifdef FATHOM_HAS_MUJOCO
      mujoco_engine(),
#endif
#ifdef FATHOM_HAS_BOX3D
      box3d_engine(),
#endif
#ifdef FATHOM_HAS_JOLT
      jolt_engine(),
#endif
  };
  return list;
}

const EngineKind& find_engine(std::string_view name) {
  std::string built;
  for (const EngineKind& engine : engines()) {
    if (engine.name == name) return engine;
    built += (built.empty() ? "" : ", ") + std::string(engine.name);
  }
  throw Error(ErrorCode::unavailable,
              "engine '" + std::string(name) + "' is not in this build, which has " + built +
                  "; others are built in where CMake finds them (bullet, ode, mujoco, box3d, jolt)");
}

Vec3 box_half_extents(const BodyDef& body) {
  if (body.shape.type != ShapeType::box) throw Error(ErrorCode::unavailable, "peers are measured with boxes only");
  return body.shape.half_extents;
}

float mass_of(const BodyDef& body) { return body.mass ? *body.mass : body.density * volume(body.shape); }

}  // namespace fathom::peers
