#include <fathom/compound.hpp>

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
  return a.type == b.type && a.radius == b.radius && a.half_extents == b.half_extents && a.hull == b.hull &&
         a.surface == b.surface;
}

void refuse_scene(std::string_view engine, std::string_view what) {
  throw Error(ErrorCode::unavailable, std::string(engine) + " is not measured with " + std::string(what) +
                                          "; leave it out by --engines or choose another scene");
}

void refuse_shape(std::string_view engine) { refuse_scene(engine, "triangle meshes, height fields and compounds"); }

void refuse_rounded(std::string_view engine, const Scene& scene) {
  const auto is_rounded = [](const Shape& shape) { return shape.hull && shape.hull->radius() > 0; };
  for (const BodyDef& body : scene.bodies) {
    bool is_any = is_rounded(body.shape);
    if (body.shape.compound)
      for (const ChildShape& child : body.shape.compound->children()) is_any |= is_rounded(child.shape);
    if (is_any) refuse_scene(engine, "rounded boxes and hulls");
  }
}

void refuse_joints(std::string_view engine, const Scene& scene) {
  if (!scene.joints.empty()) refuse_scene(engine, "joints");
}

void require_plain_joints(std::string_view engine, const Scene& scene) {
  for (const SceneJoint& joint : scene.joints)
    if (joint.def.type != JointType::ball || joint.def.hertz > 0 || joint.def.collide_connected)
      refuse_scene(engine, "joints but rigid ball joints whose bodies do not collide");
}

PeerJoint peer_joint(std::string_view engine, const JointDef& joint) {
  const auto axis = [&](JointAxisName name) -> const JointAxis& { return joint.axis(name); };
  const auto is = [&](JointAxisName name, AxisMode mode) {
    return axis(name).mode == mode && !axis(name).drive.is_on();
  };
  const bool is_plain = joint.hertz == 0 && !joint.collide_connected && !joint.can_break();
  if (is_plain && joint.type == JointType::ball) return PeerJoint::ball;
  const bool holds = is_plain && joint.type == JointType::generic && is(JointAxisName::x, AxisMode::locked) &&
                     is(JointAxisName::y, AxisMode::locked) && is(JointAxisName::z, AxisMode::locked);
  const JointAxis& twist = axis(JointAxisName::twist);
  const bool has_only_friction = twist.drive.stiffness == 0 && twist.drive.velocity == 0 && twist.armature == 0 &&
                                 (!twist.drive.is_on() || twist.drive.damping == rigid_damping);
  if (holds && joint.cone_angle > 0 && is(JointAxisName::twist, AxisMode::limited)) return PeerJoint::limb;
  if (holds && is(JointAxisName::swing_y, AxisMode::locked) && is(JointAxisName::swing_z, AxisMode::locked) &&
      twist.mode != AxisMode::locked && has_only_friction)
    return PeerJoint::hinge;
  refuse_scene(engine, "joints but rigid ball joints, with or without cones, and hinges whose bodies do not collide");
}

float mass_of(const BodyDef& body) { return body.mass ? *body.mass : body.density * volume(body.shape); }

}  // namespace fathom::peers
