#include "world/validate.hpp"

#include <cstdio>
#include <string>

#include "math/eigen.hpp"

namespace fathom {

namespace {

std::string text(float value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%g", static_cast<double>(value));
  return buffer;
}

std::string text(Vec3 v) { return "(" + text(v.x) + ", " + text(v.y) + ", " + text(v.z) + ")"; }

void require_positive(float value, const char* action, const char* name) {
  if (is_finite(value) && value > 0) return;
  refuse(std::string(action) + ": " + name + " is " + text(value) + "; it must be finite and greater than 0");
}

void require_not_negative(float value, const char* action, const char* name) {
  if (is_finite(value) && value >= 0) return;
  refuse(std::string(action) + ": " + name + " is " + text(value) + "; it must be finite and at least 0");
}

// Sylvester's criterion: all leading minors positive.
bool is_positive_definite(const SymMat3& m) {
  const float minor = m.xx * m.yy - m.xy * m.xy;
  return m.xx > 0 && minor > 0 && determinant(to_matrix(m)) > 0;
}

void check_inertia(const SymMat3& m) {
  const bool finite = is_finite(Vec3{m.xx, m.yy, m.zz}) && is_finite(Vec3{m.xy, m.xz, m.yz});
  if (!finite || !is_positive_definite(m))
    refuse("add body: the inertia with diagonal " + text(Vec3{m.xx, m.yy, m.zz}) +
           " is not positive definite; leave it out to take the shape's");
  // ∫(y² + z²) + ∫(z² + x²) ≥ ∫(x² + y²): no mass distribution has a moment above the sum of the other two. With one,
  // spin about that axis would not conserve energy. Flat bodies reach the sum, up to rounding.
  const Vec3 moments = principal_frame(m).moments;
  const float largest = max_component(moments), others = moments.x + moments.y + moments.z - largest;
  if (largest > others * (1 + 1e-4f))
    refuse("add body: the inertia's principal moments are " + text(moments) +
           " kg·m²; none may be larger than the sum of the other two");
}

void check_rule(CombineRule rule, const char* action, const char* name) {
  if (rule <= CombineRule::maximum) return;
  refuse(std::string(action) + ": the " + name + " is " + std::to_string(static_cast<int>(rule)) +
         ", which is no CombineRule");
}

template <class Choice>
void check_choice(Choice choice, Choice last, const char* name) {
  if (choice <= last) return;
  refuse("create world: " + std::string(name) + " is " + std::to_string(static_cast<int>(choice)) +
         ", which is none of its values");
}

}  // namespace

void refuse(const std::string& message) { throw Error(ErrorCode::invalid_argument, message); }

void check_finite(Vec3 value, const char* action, const char* name) {
  if (!is_finite(value)) refuse(std::string(action) + ": " + name + " is " + text(value) + "; it must be finite");
}

void check_pose(const Pose& pose, const char* action) {
  check_finite(pose.position, action, "the position");
  const float norm = dot(pose.rotation, pose.rotation);
  if (!is_finite(norm) || norm < 1e-12f)
    refuse(std::string(action) + ": the rotation (w, x, y, z) has length " + text(fathom::sqrt(norm)) +
           "; it must be a finite quaternion that is not zero");
}

void check_material(const Material& m, const char* action) {
  require_not_negative(m.friction, action, "the friction");
  require_not_negative(m.restitution, action, "the restitution");
  if (m.restitution > 1)
    refuse(std::string(action) + ": the restitution is " + text(m.restitution) + "; it must be at most 1");
  require_not_negative(m.rolling_resistance, action, "the rolling resistance");
  check_finite(m.surface_velocity, action, "the surface velocity");
  // Its square times a mass must be finite.
  if (max_component(abs(m.surface_velocity)) > 1e6f)
    refuse(std::string(action) + ": the surface velocity is " + text(m.surface_velocity) +
           "; its components must be at most 1e6 m/s");
  check_finite(m.friction_axis, action, "the friction axis");
  if (const float norm = length(m.friction_axis); norm != 0 && !(abs(norm - 1) <= 1e-3f))
    refuse(std::string(action) + ": the friction axis " + text(m.friction_axis) + " has length " + text(norm) +
           "; it must be a unit vector, or zero for friction that acts alike in all directions");
  require_not_negative(m.friction_along, action, "the friction along its axis");
  check_rule(m.friction_rule, action, "friction rule");
  check_rule(m.restitution_rule, action, "restitution rule");
}

void check_dynamic(MotionType motion, const char* action) {
  if (motion == MotionType::dynamic) return;
  refuse(std::string(action) + ": the body is " + (motion == MotionType::fixed ? "fixed" : "kinematic") +
         "; forces and impulses move dynamic bodies alone");
}

void check_damping(float linear, float angular, const char* action) {
  require_not_negative(linear, action, "the linear damping");
  require_not_negative(angular, action, "the angular damping");
}

void check_shape(const Shape& shape, const char* action) {
  switch (shape.type) {
    case ShapeType::sphere:
      return require_positive(shape.radius, action, "the sphere's radius");
    case ShapeType::capsule:
      require_positive(shape.radius, action, "the capsule's radius");
      return require_not_negative(shape.half_extents.z, action, "the capsule's half length");
    case ShapeType::box:
      check_finite(shape.half_extents, action, "the box's half extents");
      return require_positive(min_component(shape.half_extents), action, "the box's smallest half extent");
    case ShapeType::hull:
      if (!shape.hull)
        refuse(std::string(action) + ": the shape's type is hull but it has none; make it with fathom::hull(points)");
      if (!(shape.radius == shape.hull->radius()))
        refuse(std::string(action) + ": the shape's radius is not its hull's; round it with fathom::rounded");
      return;
    case ShapeType::mesh:
    case ShapeType::height_field:
      if (!shape.surface)
        refuse(std::string(action) +
               ": the shape is a surface but has none; make it with fathom::mesh or fathom::height_field");
      return;
    case ShapeType::compound:
      if (!shape.compound)
        refuse(std::string(action) +
               ": the shape's type is compound but it has none; make it with fathom::compound(children)");
      return;
  }
  refuse(std::string(action) + ": the shape's type is " + std::to_string(static_cast<int>(shape.type)) +
         ", which is unknown");
}

void check_body(const BodyDef& def) {
  const char* action = "add body";
  if (def.motion > MotionType::dynamic)
    refuse("add body: the motion is " + std::to_string(static_cast<int>(def.motion)) + ", which is no MotionType");
  check_shape(def.shape, action);
  if (def.shape.is_surface() && def.motion == MotionType::dynamic)
    refuse(
        "add body: a mesh or height field cannot be dynamic; make the body fixed or kinematic, or its shape of hulls");
  check_pose(def.pose, action);
  check_finite(def.velocity.linear, action, "the linear velocity");
  check_finite(def.velocity.angular, action, "the angular velocity");
  if (def.motion == MotionType::fixed && (def.velocity.linear != Vec3{} || def.velocity.angular != Vec3{}))
    refuse("add body: the body is fixed, but has a velocity; leave it out, or make the body kinematic");
  check_material(def.material, action);
  check_damping(def.linear_damping, def.angular_damping, action);
  check_finite({def.gravity_scale, 0, 0}, action, "the gravity scale");
  if (def.motion != MotionType::dynamic) return;
  if (def.mass)
    require_positive(*def.mass, action, "the mass");
  else
    require_positive(def.density, action, "the density");
  if (!def.mass) require_positive(def.density * volume(def.shape), action, "the mass (density × volume)");
  if (def.inertia) check_inertia(*def.inertia);
}

static std::string axis_text(std::size_t axis) {
  static constexpr const char* names[] = {"x", "y", "z", "twist", "swing_y", "swing_z"};
  return names[axis];
}

static void check_coupling(const JointDef& def, const char* action) {
  const std::string where = std::string(action) + ": ";
  for (const CouplingEnd& end : {def.coupled_a, def.coupled_b}) {
    if (end.motion > CoupledMotion::rope)
      refuse(where + "the coupled motion is " + std::to_string(static_cast<int>(end.motion)) +
             ", which is no CoupledMotion");
    check_pose(end.from, action);
  }
  if (!is_finite(def.ratio) || def.ratio == 0)
    refuse(where + "the coupling's ratio is " + text(def.ratio) + "; it must be finite and not 0");
  const JointAxis& sum = def.axis(JointAxisName::x);
  if (sum.mode != AxisMode::limited)
    refuse(where + "the coupling's axis x has no bounds; limit it to what the sum of its motions may be");
  if (sum.drive.is_on() || sum.restitution > 0 || sum.armature > 0)
    refuse(where + "a coupling has no drive, restitution or armature; give these to the joints that bear its bodies");
}

void check_joint_break(float force, float torque, const char* action) {
  const auto check = [&](float most, const char* name) {
    if (!(most >= 0)) refuse(std::string(action) + ": " + name + " is " + text(most) + "; it must be at least 0");
  };
  check(force, "the force at which it breaks");
  check(torque, "the torque at which it breaks");
}

void check_joint(const JointDef& def, const char* action) {
  const std::string where = std::string(action) + ": ";
  if (def.type > JointType::coupling)
    refuse(where + "the type is " + std::to_string(static_cast<int>(def.type)) + ", which is no JointType");
  if (def.a == def.b) refuse(where + "both bodies are the same one; a joint holds two different bodies together");
  check_pose(def.frame_a, action);
  check_pose(def.frame_b, action);
  check_joint_spring(def.hertz, def.damping_ratio, action);
  check_joint_force(def, action);
  check_joint_break(def.break_force, def.break_torque, action);
  if (def.type == JointType::ball) return;
  if (def.type == JointType::coupling) check_coupling(def, action);
  require_not_negative(def.cone_angle, action, "the cone's angle");
  if (def.cone_angle >= pi) refuse(where + "the cone's angle is " + text(def.cone_angle) + "; it must be below pi");
  const char* const one_axis = def.type == JointType::distance   ? "a distance joint"
                               : def.type == JointType::coupling ? "a coupling"
                                                                 : nullptr;
  if (def.cone_angle > 0 && one_axis) refuse(where + one_axis + " has no cone; leave the cone's angle 0");
  for (std::size_t i = 0; i < joint_axis_count; ++i) {
    const JointAxis& axis = def.axes[i];
    check_joint_axis(def, static_cast<JointAxisName>(i), axis, action);
    const bool is_set = axis.mode != AxisMode::free || axis.drive.is_on();
    if (one_axis && i > 0 && is_set)
      refuse(where + one_axis + " has one axis, x; leave axis " + axis_text(i) + " free");
    if (def.cone_angle > 0 && i > static_cast<std::size_t>(JointAxisName::twist) && is_set)
      refuse(where + "with a cone both swings are free; leave axis " + axis_text(i) + " free");
  }
}

const char* restitution_fault(const JointAxis& axis) {
  if (axis.restitution > 1) return "the restitution must be at most 1";
  if (axis.restitution > 0 && axis.mode != AxisMode::limited)
    return "an axis without limits has no restitution; limit it by a lower and an upper bound";
  return nullptr;
}

const char* armature_fault(const JointAxis& axis) {
  return axis.armature > 0 && axis.is_locked() ? "an axis that is locked has no armature; leave it 0" : nullptr;
}

void check_joint_axis(const JointDef& def, JointAxisName name, const JointAxis& axis, const char* action) {
  if (name > JointAxisName::swing_z)
    refuse(std::string(action) + ": " + std::to_string(static_cast<int>(name)) + " is no JointAxisName");
  const std::string what = "axis " + axis_text(static_cast<std::size_t>(name));
  if (axis.mode > AxisMode::locked)
    refuse(std::string(action) + ": the mode of " + what + " is " + std::to_string(static_cast<int>(axis.mode)) +
           ", which is no AxisMode");
  const auto finite = [&](float value, const char* of) { check_finite({value, 0, 0}, action, (what + of).c_str()); };
  finite(axis.lower, "'s lower bound"), finite(axis.upper, "'s upper bound");
  finite(axis.drive.position, "'s target"), finite(axis.drive.velocity, "'s target velocity");
  require_not_negative(axis.drive.stiffness, action, (what + "'s stiffness").c_str());
  require_not_negative(axis.drive.damping, action, (what + "'s damping").c_str());
  require_not_negative(axis.drive.max_force, action, (what + "'s largest force").c_str());
  require_not_negative(axis.restitution, action, (what + "'s restitution").c_str());
  require_not_negative(axis.armature, action, (what + "'s armature").c_str());
  for (const char* const fault : {restitution_fault(axis), armature_fault(axis)})
    if (fault) refuse(std::string(action) + ": " + what + ": " + fault);
  if (axis.drive.by_frequency && axis.drive.is_on() && axis.drive.stiffness == 0)
    refuse(std::string(action) + ": the drive of " + what +
           " has a damping ratio but no frequency; set its stiffness (Hz)");
  if (axis.mode != AxisMode::limited) return;
  if (axis.lower > axis.upper)
    refuse(std::string(action) + ": " + what + "'s lower bound " + text(axis.lower) + " is above its upper bound " +
           text(axis.upper));
  if (def.type == JointType::distance && axis.lower < 0)
    refuse(std::string(action) + ": a distance cannot be below 0, as the lower bound " + text(axis.lower));
  const float most = name < JointAxisName::twist ? 3e38f : name == JointAxisName::twist ? pi : 0.5f * pi;
  if (axis.lower < -most || axis.upper > most)
    refuse(std::string(action) + ": the bounds of " + what + " must lie within " + text(most) + " rad of 0");
}

void check_joint_spring(float hertz, float damping_ratio, const char* action) {
  require_not_negative(hertz, action, "the spring's frequency (hertz)");
  require_not_negative(damping_ratio, action, "the spring's damping ratio");
}

const char* joint_force_fault(const JointDef& def) {
  if (def.max_force >= JointDef{}.max_force) return nullptr;
  if (def.type != JointType::ball) return "a largest force is for ball joints; give an axis a drive with one";
  return def.hertz > 0 ? nullptr : "a rigid joint has no largest force; give it a frequency (hertz)";
}

void check_joint_force(const JointDef& def, const char* action) {
  if (!(def.max_force >= 0))
    refuse(std::string(action) + ": the largest force is " + text(def.max_force) + "; it must be at least 0");
  if (const char* const fault = joint_force_fault(def)) refuse(std::string(action) + ": " + fault);
}

void check_world(const WorldDef& def) {
  const char* action = "create world";
  check_choice(def.simulator, SimulatorKind::hybrid, "simulator");
  check_choice(def.broad_phase, BroadPhase::sweep, "broad_phase");
  check_choice(def.partition, Partition::cells, "partition");
  check_choice(def.solver.method, Solver::impulse, "solver.method");
  check_finite(def.gravity, action, "the gravity");
  require_positive(def.dt, action, "dt");
  if (def.dt > 1 || def.dt < 1e-6f)
    refuse("create world: dt is " + text(def.dt) + " s; it must be between 1e-6 and 1 s, typically 1/60");
  if (def.threads < 0 || def.threads > WorldDef::max_threads)
    refuse("create world: threads is " + std::to_string(def.threads) + "; it must be 0 (all of the machine's) to " +
           std::to_string(WorldDef::max_threads));
  if (def.ahead < 0 || def.ahead > 16)
    refuse("create world: ahead is " + std::to_string(def.ahead) + "; it must be 0 to 16 steps, typically 0 or 2");
  const SolverSettings& s = def.solver;
  if (s.substeps < 1 || s.substeps > SolverSettings::max_substeps)
    refuse("create world: solver.substeps is " + std::to_string(s.substeps) + "; it must be 1 to " +
           std::to_string(SolverSettings::max_substeps));
  if (s.iterations < 1 || s.iterations > 1000)
    refuse("create world: solver.iterations is " + std::to_string(s.iterations) + "; it must be 1 to 1000");
  if (s.marking_rounds < 1 || s.marking_rounds > 255)
    refuse("create world: solver.marking_rounds is " + std::to_string(s.marking_rounds) + "; it must be 1 to 255");
  require_positive(s.contact_hertz, action, "solver.contact_hertz");
  require_not_negative(s.contact_damping_ratio, action, "solver.contact_damping_ratio");
  require_not_negative(s.push_out_velocity, action, "solver.push_out_velocity");
  require_not_negative(s.restitution_threshold, action, "solver.restitution_threshold");
  require_positive(s.max_linear_speed, action, "solver.max_linear_speed");
  require_not_negative(def.sleep.linear_speed, action, "sleep.linear_speed");
  require_not_negative(def.sleep.time, action, "sleep.time");
  const Vec3 a = def.sweep_axis;
  if (!is_finite(a) || min_component(a) < 0 || !(length(a) > 1e-6f))
    refuse("create world: sweep_axis is " + text(a) + "; its components must be at least 0 and not all 0");
  if (def.max_bodies == 0 || def.max_bodies > (1u << 30))
    refuse("create world: max_bodies is " + std::to_string(def.max_bodies) + "; it must be 1 to 2^30");
}

}  // namespace fathom
