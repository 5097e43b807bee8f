// Validates the application's arguments; each check throws an Error that names the value and the remedy.
#pragma once

#include <fathom/world.hpp>

namespace fathom {

void check_world(const WorldDef& def);
void check_body(const BodyDef& def);
void check_shape(const Shape& shape, const char* action);
/// Checks everything except that its bodies exist and one of them is dynamic.
void check_joint(const JointDef& def, const char* action = "add joint");
void check_joint_axis(const JointDef& def, JointAxisName name, const JointAxis& axis, const char* action);
/// Why the axis cannot have this restitution or armature in its mode; null if it can.
FATHOM_COMPONENT_API const char* restitution_fault(const JointAxis& axis);
FATHOM_COMPONENT_API const char* armature_fault(const JointAxis& axis);
void check_joint_break(float force, float torque, const char* action);
void check_joint_spring(float hertz, float damping_ratio, const char* action);
void check_joint_force(const JointDef& def, const char* action);
/// Why the joint cannot have a force limit; null if it can.
FATHOM_COMPONENT_API const char* joint_force_fault(const JointDef& def);
void check_pose(const Pose& pose, const char* action);
void check_finite(Vec3 value, const char* action, const char* name);
void check_material(const Material& material, const char* action);
/// The body must be dynamic.
void check_dynamic(MotionType motion, const char* action);
void check_damping(float linear, float angular, const char* action);
[[noreturn]] void refuse(const std::string& text);

}  // namespace fathom
