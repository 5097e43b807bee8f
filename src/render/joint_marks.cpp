#include "render/joint_marks.hpp"

#include <cmath>
#include <utility>

namespace fathom::render {
namespace {

constexpr Colour arm_colour{120, 200, 255, 200}, gap_colour{255, 60, 220, 255};
constexpr Colour anchor_a_colour{60, 140, 255, 255}, anchor_b_colour{255, 170, 40, 255};
constexpr Colour reaction_colour{110, 230, 90, 255};
constexpr Colour axis_colour{255, 230, 90, 255}, limit_colour{255, 120, 60, 255};
constexpr float weight_length = 0.5f;  // m
constexpr int cone_rays = 8;

struct Anchors {
  Vec3 a, b;
};

Anchors anchors_of(const World& world, const JointDef& joint) {
  const auto at = [&](BodyId body, const Pose& frame) { return transform(world.poses()[body.index], frame.position); };
  return {at(joint.a, joint.frame_a), at(joint.b, joint.frame_b)};
}

/// The axes of one generic joint.
class AxisMarks {
 public:
  AxisMarks(const World& world, const JointDef& joint, const Anchors& anchors, std::vector<Mark>& marks)
      : joint_(joint), anchors_(anchors), marks_(marks) {
    const auto turned = [&](BodyId body, const Pose& frame) {
      return to_matrix(world.poses()[body.index].rotation * frame.rotation);
    };
    of_a_ = turned(joint.a, joint.frame_a), of_b_ = turned(joint.b, joint.frame_b);
    // If B cannot be pushed, the axes are B's, and A moves along them, backwards.
    if (world.motion(joint.b) != MotionType::dynamic) {
      std::swap(of_a_, of_b_), std::swap(anchors_.a, anchors_.b);
      sign_ = -1;
    }
    for (const BodyId body : {joint.a, joint.b})
      if (world.motion(body) == MotionType::dynamic)
        size_ = min(size_, 0.7f * length(half_extents(world.bounds(body))));
  }

  void add() {
    const Vec3 axes[] = {of_a_.x, of_a_.y, of_a_.z};
    for (std::size_t i = 0; i < 3; ++i)
      if (joint_.axes[i].mode != AxisMode::locked) add_slider(joint_.axes[i], axes[i]);
    if (joint_.axis(JointAxisName::twist).mode != AxisMode::locked) add_hinge(of_b_.x, JointAxisName::twist);
    if (joint_.cone_angle > 0) return add_cone();
    if (joint_.axis(JointAxisName::swing_y).mode != AxisMode::locked) add_hinge(of_a_.y, JointAxisName::swing_y);
    if (joint_.axis(JointAxisName::swing_z).mode != AxisMode::locked) add_hinge(of_a_.z, JointAxisName::swing_z);
  }

 private:
  void add_line(Vec3 from, Vec3 to, Colour colour) { marks_.push_back({from, 3, to, colour}); }

  void add_slider(const JointAxis& axis, Vec3 along) {
    const bool is_limited = axis.mode == AxisMode::limited;
    const Vec3 from = anchors_.a + (is_limited ? sign_ * axis.lower : -size_) * along;
    const Vec3 to = anchors_.a + (is_limited ? sign_ * axis.upper : size_) * along;
    add_line(from, to, axis_colour);
    if (!is_limited) return;
    for (const Vec3 end : {from, to}) marks_.push_back({end, 6, end, limit_colour});
  }
  /// If limited, B's next axis stays between two rays.
  void add_hinge(Vec3 axis, JointAxisName name) {
    add_line(anchors_.b - size_ * axis, anchors_.b + size_ * axis, axis_colour);
    const JointAxis& limits = joint_.axis(name);
    if (limits.mode != AxisMode::limited) return;
    const Vec3 start = name == JointAxisName::twist ? normalize(of_a_.y - dot(of_a_.y, axis) * axis) : of_a_.x;
    const Vec3 now = name == JointAxisName::twist ? of_b_.y : of_b_.x;
    for (const float angle : {sign_ * limits.lower, sign_ * limits.upper})
      add_line(anchors_.b, anchors_.b + size_ * (std::cos(angle) * start + std::sin(angle) * cross(axis, start)),
               limit_colour);
    add_line(anchors_.b, anchors_.b + size_ * now, axis_colour);
  }
  void add_cone() {
    const float along = size_ * std::cos(joint_.cone_angle), across = size_ * std::sin(joint_.cone_angle);
    for (int ray = 0; ray < cone_rays; ++ray) {
      const float angle = 2 * pi * static_cast<float>(ray) / cone_rays;
      const Vec3 out = std::cos(angle) * of_a_.y + std::sin(angle) * of_a_.z;
      add_line(anchors_.b, anchors_.b + along * of_a_.x + across * out, limit_colour);
    }
    add_line(anchors_.b, anchors_.b + size_ * of_b_.x, axis_colour);
  }

  const JointDef& joint_;
  Anchors anchors_;
  std::vector<Mark>& marks_;
  Mat3 of_a_, of_b_;  // the joint's frames in the world
  float size_ = 1;    // m, of lines without ends of their own
  float sign_ = 1;
};

/// A rope, or the axis that a body turns about or slides along.
void add_coupling_marks(const CouplingEnd& end, Vec3 anchor, std::vector<Mark>& marks) {
  const Vec3 along = 0.5f * weight_length * rotate(end.from.rotation, Vec3{1, 0, 0});
  if (end.motion == CoupledMotion::rope)
    marks.push_back({end.from.position, 3, anchor, axis_colour});
  else
    marks.push_back({anchor - along, 3, anchor + along, axis_colour});
}

/// Whether the anchors should coincide: a slider's need not.
bool anchors_meet(const JointDef& joint) {
  if (joint.type != JointType::generic) return joint.type == JointType::ball;
  return joint.axes[0].mode == AxisMode::locked && joint.axes[1].mode == AxisMode::locked &&
         joint.axes[2].mode == AxisMode::locked;
}

}  // namespace

void add_joint_marks(const World& world, std::vector<Mark>& marks) {
  for (const JointId id : world.joints()) {
    const JointDef& joint = world.joint(id);
    const Anchors anchors = anchors_of(world, joint);
    const auto add_arm = [&](BodyId body, Vec3 anchor) {
      if (world.motion(body) == MotionType::dynamic)
        marks.push_back({world.poses()[body.index].position, 1.5f, anchor, arm_colour});
    };
    add_arm(joint.a, anchors.a);
    add_arm(joint.b, anchors.b);
    if (joint.type == JointType::generic) AxisMarks(world, joint, anchors, marks).add();
    if (joint.type == JointType::distance) marks.push_back({anchors.a, 3, anchors.b, axis_colour});
    if (joint.type == JointType::coupling) {
      add_coupling_marks(joint.coupled_a, anchors.a, marks);
      add_coupling_marks(joint.coupled_b, anchors.b, marks);
    }
    if (anchors_meet(joint)) marks.push_back({anchors.a, 3, anchors.b, gap_colour});
    // The larger one first: both stay visible where they coincide.
    marks.push_back({anchors.a, 8, anchors.a, anchor_a_colour});
    marks.push_back({anchors.b, 4, anchors.b, anchor_b_colour});
  }
}

void add_reaction_marks(const World& world, std::vector<Mark>& marks) {
  // One scale for all, to compare them: under a heavy load a light link carries many times its own weight.
  float heaviest = 1e-6f;
  for (const JointId id : world.joints())
    heaviest = max(heaviest, max(world.mass(world.joint(id).a), world.mass(world.joint(id).b)));
  const float scale = weight_length / (max(length(world.gravity()), 1.0f) * heaviest);
  for (const JointId id : world.joints()) {
    const Vec3 anchor = anchors_of(world, world.joint(id)).b;
    marks.push_back({anchor, 3, anchor + scale * world.reaction(id).force, reaction_colour});
  }
}

}  // namespace fathom::render
